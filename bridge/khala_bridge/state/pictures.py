"""The game's own pictures of one moment: feature layers and rendered images.

They are large and rarely used, so they are decoded on demand. Row 0 is at the top. The snapshot (`camera`) has the
place of the game's camera, `EpisodeInfo.pictures` the extent of its screen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from s2clientprotocol import common_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

_DEPTHS = {1: "u1", 8: "u1", 16: "<u2", 32: "<i4"}


class GamePictures:
    """The game's drawings; every method returns None if the game did not draw it."""

    __slots__ = ("_observation",)

    def __init__(self, observation: sc_pb.Observation) -> None:
        """Take the observation with the pictures, from `khala_bridge.state.read`."""
        self._observation = observation

    def screen(self) -> NDArray[np.uint8] | None:
        """Return the rendered screen, (height, width, 3): blue, green, red."""
        return _colours(self._observation.render_data.map)

    def minimap(self) -> NDArray[np.uint8] | None:
        """Return the rendered minimap, (height, width, 3): blue, green, red."""
        return _colours(self._observation.render_data.minimap)

    def layer(self, name: str) -> NDArray[np.int32] | None:
        """Return a feature layer of the screen by the API's name, (height, width), values unchanged."""
        return _known(self._observation.feature_layer_data.renders, name)

    def minimap_layer(self, name: str) -> NDArray[np.int32] | None:
        """Return a feature layer of the minimap by the API's name, (height, width), values unchanged."""
        return _known(self._observation.feature_layer_data.minimap_renders, name)

    def layer_pixel(self, name: str, column: int, row: int) -> int | None:
        """Return one value of a feature layer of the screen, without decoding the others; whole bytes only."""
        image = getattr(self._observation.feature_layer_data.renders, name)
        width = image.bits_per_pixel // 8
        if not width or not image.data:
            return None
        start = (row * image.size.x + column) * width
        return int.from_bytes(image.data[start : start + width], "little")


def _known(layers: Any, name: str) -> NDArray[np.int32] | None:
    """Return a feature layer; creep only where the player has ever been, since the game sends that of the whole map."""
    values = _values(getattr(layers, name, None))
    sight = _values(layers.visibility_map) if name == "creep" and values is not None else None
    return values if values is None or sight is None else values * (sight > 0)


def _colours(image: common_pb2.ImageData) -> NDArray[np.uint8] | None:
    if not image.data:
        return None
    pixels = np.frombuffer(image.data, np.uint8).reshape(image.size.y, image.size.x, -1)[..., :3]
    return np.ascontiguousarray(pixels[..., ::-1])


def _values(image: common_pb2.ImageData | None) -> NDArray[np.int32] | None:
    if image is None or not image.data:
        return None
    flat: NDArray[Any] = np.frombuffer(image.data, np.dtype(_DEPTHS[image.bits_per_pixel]))
    if image.bits_per_pixel == 1:
        flat = np.unpackbits(flat)
    return np.asarray(flat[: image.size.x * image.size.y].reshape(image.size.y, image.size.x), np.int32)
