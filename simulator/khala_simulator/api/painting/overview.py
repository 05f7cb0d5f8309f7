"""The minimap: ground, fog, units as dots, where the camera looks, where a unit is attacked.

Above: `render.py`. Below: `ground.py`, `marks.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_simulator.api.effects import blips
from khala_simulator.api.painting import marks, palette
from khala_simulator.api.painting.ground import PaintedGround
from khala_simulator.api.projection import Rect
from khala_simulator.api.sight import Alliance, Display

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.layers import Frame
    from khala_simulator.api.projection import Minimap, ScreenView
    from khala_simulator.api.types import Types

    Image = NDArray[np.uint8]

LEAST = 1.4
"""Radius in pixels of the smallest dot."""


class OverviewPainter:
    """Paints the minimap of one client."""

    def __init__(self, minimap: Minimap, screen: ScreenView, types: Types) -> None:
        self._minimap, self._screen, self._types = minimap, screen, types
        area, scale = minimap.area, minimap.scale
        self._shown = Rect(area.x0, area.y1 - minimap.rows * scale, area.x0 + minimap.columns * scale, area.y1)
        self._ground = PaintedGround(minimap.columns, minimap.rows, 1 / scale)
        x, y = minimap.to_pixels(area.x1, area.y0)
        self._rest = (round(x), round(y))  # where the map ends, in an image of another shape

    def paint(self, frame: Frame) -> Image:
        """Return the image of this frame."""
        image = self._ground.paint(frame.world, frame.player, self._shown, fog=frame.fogged)
        self._dots(image, frame)
        for x, y in blips(frame.world, self._types, frame.player).tolist():
            marks.dot(image, self._minimap.to_pixels(x, y), LEAST, palette.BLIP)
        image[self._rest[1] :] = 0
        image[:, self._rest[0] :] = 0
        self._camera(image, frame)
        for x, y in frame.attacked.tolist():
            marks.ring(image, self._minimap.to_pixels(x, y), max(4.0, min(image.shape[:2]) / 24), palette.ALERT, 1)
        return image

    def _dots(self, image: Image, frame: Frame) -> None:
        """Draw the dots, neutral units first, own units last; structures are squares."""
        sight, scale = frame.sight, self._minimap.scale
        known = np.flatnonzero(sight.display != Display.HIDDEN.value)
        structure = self._types.structure[sight.row]
        first = np.where(sight.alliance == Alliance.NEUTRAL.value, 0, np.where(structure, 1, 2))
        last = sight.alliance == Alliance.SELF.value
        order = known[np.lexsort((last[known], first[known]))]
        x, y = self._minimap.to_pixels(sight.pos[order, 0], sight.pos[order, 1])
        radius = np.maximum(sight.radius[order] / scale * 0.9, LEAST)
        sides = palette.sides(sight.owner, sight.alliance, frame.player)
        columns = (sight.row[order], sides[order], x, y, radius, structure[order])
        for row, side, column, line, size, square in zip(*(part.tolist() for part in columns), strict=True):
            unit = self._types.catalog.units[row]
            colour = palette.livery_of(unit, side).body if unit.resource else palette.LIVERIES[side].dot
            if square:
                x0, y0 = max(0, round(column - size)), max(0, round(line - size))
                image[y0 : max(0, round(line + size)), x0 : max(0, round(column + size))] = colour
            else:
                marks.dot(image, (column, line), size, colour)

    def _camera(self, image: Image, frame: Frame) -> None:
        view = self._screen.view(frame.camera)
        x0, y0 = self._minimap.to_pixels(view.x0, view.y1)
        x1, y1 = self._minimap.to_pixels(view.x1, view.y0)
        corners = (round(x0), round(y0)), (round(x1) - 1, round(y1) - 1)
        cv2.rectangle(image, *corners, palette.CAMERA, 1)
