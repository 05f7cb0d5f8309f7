"""`Observation.raw_data.map_state`: what one player sees of the ground, and the creep on it.

Raw images start at the bottom-left, as the world's grids do. Above: `observation.py`. Below: `raster.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import raw_pb2

from khala_simulator.api.raster import RasterLayer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.wire import Part
    from khala_simulator.world.world import World

_FIELDS = raw_pb2.MapState.DESCRIPTOR.fields_by_name


class GroundImages:
    """The two images of one client; creep is drawn again when it has changed."""

    def __init__(self, box: tuple[int, int, int, int]) -> None:
        """Show this part of the map: x0, y0, x1, y1 in cells, the last ones exclusive."""
        x0, y0, x1, y1 = box
        self._box = slice(y0, y1), slice(x0, x1)
        self._visibility = RasterLayer(_FIELDS["visibility"].number, 8, x1 - x0, y1 - y0)
        self._creep = RasterLayer(_FIELDS["creep"].number, 1, x1 - x0, y1 - y0)
        self._drawn: NDArray[np.bool_] | None = None
        self._creep_field = b""

    def encode(self, world: World, player: int) -> list[Part]:
        """Return the parts of a `MapState`."""
        if self._drawn is not world.creep:
            self._drawn = world.creep
            self._creep_field = b"".join(self._creep.encode(world.creep[self._box]))
        return [*self._visibility.encode(world.visibility[player][self._box]), self._creep_field]
