"""The game's own pixels: rendered images and feature layers, if the observation has them and its camera is near.

What the game draws is drawn where its one camera is. A picture of a team takes it as long as that camera is at most
`NEAR` away, moved so that positions stay true; what is beyond its edge is black.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from bridge.frames import CAMERA_WIDTH

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from s2clientprotocol import common_pb2

    from bridge.frames import Camera
    from bridge.observe.image.lettering import Image
    from bridge.snapshot import Snapshot

NEAR = 3.0
"""World units: an eighth of the screen would be black."""
_DEPTHS = {1: "u1", 8: "u1", 16: "<u2", 32: "<i4"}


def screen(snapshot: Snapshot, camera: Camera, size_px: int) -> Image | None:
    """What the game renders of a camera's view, (size_px, size_px, 3); None if it does not."""
    pixels = _colours(snapshot.response.observation.render_data.map)
    width = snapshot.info.options.render.width or CAMERA_WIDTH
    if pixels is None or not is_near(snapshot, camera):
        return None
    return np.asarray(_moved(pixels, snapshot, camera, width, size_px, cv2.INTER_LINEAR), np.uint8)


def minimap(snapshot: Snapshot, size_px: int) -> Image | None:
    """What the game renders of the whole map; None if it does not."""
    pixels = _colours(snapshot.response.observation.render_data.minimap)
    return None if pixels is None else np.asarray(cv2.resize(pixels, (size_px, size_px)), np.uint8)


def layer(snapshot: Snapshot, name: str, camera: Camera, size_px: int) -> NDArray[np.int32] | None:
    """A feature layer of the screen under a camera, values as they are; None if the game's camera is elsewhere."""
    values = _values(getattr(snapshot.response.observation.feature_layer_data.renders, name, None))
    if values is None or not is_near(snapshot, camera):
        return None
    width = snapshot.info.options.feature_layer.width or CAMERA_WIDTH
    moved = _moved(values.astype(np.float32), snapshot, camera, width, size_px, cv2.INTER_NEAREST)
    return np.asarray(moved, np.int32)


def minimap_layer(snapshot: Snapshot, name: str, size_px: int) -> NDArray[np.int32] | None:
    """A feature layer of the minimap, values as they are; None if it was not sent."""
    values = _values(getattr(snapshot.response.observation.feature_layer_data.minimap_renders, name, None))
    if values is None:
        return None
    large = cv2.resize(values.astype(np.float32), (size_px, size_px), interpolation=cv2.INTER_NEAREST)
    return np.asarray(large, np.int32)


def is_near(snapshot: Snapshot, camera: Camera) -> bool:
    """Whether the game's camera shows about what this one does."""
    real = snapshot.response.observation.raw_data.player.camera
    return abs(real.x - camera.x) <= NEAR and abs(real.y - camera.y) <= NEAR


def _colours(image: common_pb2.ImageData) -> Image | None:
    """A rendered image, blue, green, red."""
    if not image.data:
        return None
    pixels = np.frombuffer(image.data, np.uint8).reshape(image.size.y, image.size.x, -1)[..., :3]
    return np.ascontiguousarray(pixels[..., ::-1])


def _values(image: common_pb2.ImageData | None) -> NDArray[np.int32] | None:
    """A feature layer, (height, width), row 0 at the top."""
    if image is None or not image.data:
        return None
    flat: NDArray[Any] = np.frombuffer(image.data, np.dtype(_DEPTHS[image.bits_per_pixel]))
    if image.bits_per_pixel == 1:
        flat = np.unpackbits(flat)
    return np.asarray(flat[: image.size.x * image.size.y].reshape(image.size.y, image.size.x), np.int32)


def _moved(
    pixels: NDArray[np.uint8] | NDArray[np.float32],
    snapshot: Snapshot,
    camera: Camera,
    width: float,
    size_px: int,
    interpolation: int,
) -> NDArray[np.uint8] | NDArray[np.float32]:
    """An image of the game's camera, `width` world units wide, as another camera would have it."""
    real = snapshot.response.observation.raw_data.player.camera
    per_unit = pixels.shape[1] / width
    scale = CAMERA_WIDTH * per_unit / size_px
    half = pixels.shape[1] / 2 - CAMERA_WIDTH / 2 * per_unit
    x = (camera.x - real.x) * per_unit + half + 0.5 * scale - 0.5
    y = (real.y - camera.y) * per_unit + half + 0.5 * scale - 0.5
    matrix = np.array([[scale, 0, x], [0, scale, y]])
    flags = interpolation | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(pixels, matrix, (size_px, size_px), flags=flags)  # type: ignore[return-value]  # same kind
