"""Rendered features: nine feature layers of a team's screen in one picture, three rows of three."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_bridge.observe.image import palette
from khala_bridge.observe.image.layers import LAYERS, colour
from khala_bridge.observe.image.lettering import written

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.observe.image.layers import Cells
    from khala_bridge.observe.image.lettering import Image

SHOWN = (
    "height_map", "visibility_map", "creep",
    "power", "pathable", "buildable",
    "player_relative", "unit_type", "unit_hit_points_ratio",
)  # fmt: skip
"""Row by row, from the top left."""
_COLUMNS = 3
_GAP = 2


def tile_px(size_px: int) -> int:
    """Return the size in pixels of one of the nine tiles in a picture of this size."""
    return (size_px - _GAP * (_COLUMNS - 1)) // _COLUMNS


def draw(values: Mapping[str, Cells], size_px: int) -> Image:
    """Return the picture of these values by layer, each `tile_px` large."""
    tile = tile_px(size_px)
    image = np.full((size_px, size_px, 3), palette.VOID, np.uint8)
    for number, name in enumerate(SHOWN):
        top, left = (k * (tile + _GAP) for k in divmod(number, _COLUMNS))
        image[top : top + tile, left : left + tile] = colour(LAYERS[name], values[name])
        written(name, 7, palette.LABEL, palette.INK).press(image, left + 3, top + 3)
    return image
