"""The rendered images of one client: its screen and its minimap in colour.

This module decides what is shown, from what the player perceives; `painting` decides how it looks. Importing this
module loads OpenCV, so a seat does it only when a client asks for rendered images. Above: `observation.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
from s2clientprotocol import spatial_pb2

from khala_simulator.api.painting.overview import OverviewPainter
from khala_simulator.api.painting.scene import ScenePainter
from khala_simulator.api.raster import RasterLayer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.layers import Frame
    from khala_simulator.api.projection import ImagePair
    from khala_simulator.api.types import Types
    from khala_simulator.api.wire import Part

BITS_PER_PIXEL = 24
cv2.setNumThreads(1)  # an image is too small to share, and a machine runs many games at once
_FIELDS = spatial_pb2.ObservationRender.DESCRIPTOR.fields_by_name


class Renders:
    """Paints what one client asked to see; keeps the parts that stay the same from frame to frame."""

    def __init__(self, view: ImagePair, types: Types) -> None:
        screen, minimap = view.screen, view.minimap
        self._scene = ScenePainter(screen, types)
        self._overview = OverviewPainter(minimap, screen, types)
        self._screen_part = RasterLayer(_FIELDS["map"].number, BITS_PER_PIXEL, screen.columns, screen.rows)
        self._minimap_part = RasterLayer(_FIELDS["minimap"].number, BITS_PER_PIXEL, minimap.columns, minimap.rows)

    def encode(self, frame: Frame) -> list[Part]:
        """Return the parts of an `ObservationRender`."""
        return self._screen_part.encode(self.screen(frame)) + self._minimap_part.encode(self.minimap(frame))

    def screen(self, frame: Frame) -> NDArray[np.uint8]:
        """Return the screen, [rows, columns, 3] RGB, row 0 at the top."""
        return self._scene.paint(frame)

    def minimap(self, frame: Frame) -> NDArray[np.uint8]:
        """Return the minimap, [rows, columns, 3] RGB, row 0 at the top."""
        return self._overview.paint(frame)
