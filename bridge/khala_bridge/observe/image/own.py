"""The game's own pixels: rendered images and feature layers, if the observation has them and its camera is near.

The game draws only what its one camera shows. A picture of a team uses it if that camera is at most `NEAR` away,
moved so that positions stay true; everything beyond its edge is black.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_bridge.frames import CAMERA_WIDTH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.frames import Camera
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.state import Snapshot

NEAR = 3.0
"""World units; at this distance an eighth of the screen is black."""


def screen(snapshot: Snapshot, camera: Camera, size_px: int) -> Image | None:
    """Return the game's rendering of a camera's view, (size_px, size_px, 3); None if it has none."""
    pixels = snapshot.pictures.screen()
    width = snapshot.info.pictures.render_width or CAMERA_WIDTH
    if pixels is None or not is_near(snapshot, camera):
        return None
    return np.asarray(_shift(pixels, snapshot, camera, width, size_px, cv2.INTER_LINEAR), np.uint8)


def minimap(snapshot: Snapshot, size_px: int) -> Image | None:
    """Return the game's rendering of the whole map; None if it has none."""
    pixels = snapshot.pictures.minimap()
    return None if pixels is None else np.asarray(cv2.resize(pixels, (size_px, size_px)), np.uint8)


def layer(snapshot: Snapshot, name: str, camera: Camera, size_px: int) -> NDArray[np.int32] | None:
    """Return a feature layer of a camera's screen, values unchanged; None if the game's camera is elsewhere."""
    values = snapshot.pictures.layer(name)
    if values is None or not is_near(snapshot, camera):
        return None
    width = snapshot.info.pictures.layer_width or CAMERA_WIDTH
    moved = _shift(values.astype(np.float32), snapshot, camera, width, size_px, cv2.INTER_NEAREST)
    return np.asarray(moved, np.int32)


def minimap_layer(snapshot: Snapshot, name: str, size_px: int) -> NDArray[np.int32] | None:
    """Return a feature layer of the minimap, values unchanged; None if the game did not send it."""
    values = snapshot.pictures.minimap_layer(name)
    if values is None:
        return None
    large = cv2.resize(values.astype(np.float32), (size_px, size_px), interpolation=cv2.INTER_NEAREST)
    return np.asarray(large, np.int32)


def is_near(snapshot: Snapshot, camera: Camera) -> bool:
    """Return True if the game's camera shows about the same as this one."""
    real = snapshot.camera
    return abs(real.x - camera.x) <= NEAR and abs(real.y - camera.y) <= NEAR


def _shift(
    pixels: NDArray[np.uint8] | NDArray[np.float32],
    snapshot: Snapshot,
    camera: Camera,
    width: float,
    size_px: int,
    interpolation: int,
) -> NDArray[np.uint8] | NDArray[np.float32]:
    """Return an image of the game's camera, `width` world units wide, as seen by another camera."""
    real = snapshot.camera
    per_unit = pixels.shape[1] / width
    scale = CAMERA_WIDTH * per_unit / size_px
    half = pixels.shape[1] / 2 - CAMERA_WIDTH / 2 * per_unit
    x = (camera.x - real.x) * per_unit + half + 0.5 * scale - 0.5
    y = (real.y - camera.y) * per_unit + half + 0.5 * scale - 0.5
    matrix = np.array([[scale, 0, x], [0, scale, y]])
    flags = interpolation | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(pixels, matrix, (size_px, size_px), flags=flags)  # type: ignore[return-value]  # same kind
