"""The constants of an episode: the map and its data, and the sizes of the game's own pictures.

`khala_bridge.state.read` reads them once an episode. `khala_bridge.state.ground` works out from them where structures
can stand and units can walk.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.frames import MapFrame, WorldPoint
from khala_bridge.state.grid import NO_GRID, Grid

if TYPE_CHECKING:
    from khala_bridge.knowledge import MapFacts
    from khala_protocol.messages import Frames


class PictureSizes(NamedTuple):
    """The sizes of the game's screen and minimap."""

    screen: tuple[int, int] = (0, 0)
    """Width and height of the feature layers of the screen, in pixels."""
    minimap: tuple[int, int] = (0, 0)
    """Width and height of the feature layers of the minimap, in pixels."""
    layer_width: float = 0.0
    """World units that the feature layers of the screen show on their longer axis; 0 if unknown."""
    render_width: float = 0.0
    """World units that the rendered screen shows; 0 if nothing is rendered."""


class EpisodeInfo(NamedTuple):
    """The map of an episode, its data, and the pictures that the game draws of it."""

    facts: MapFacts
    """Those of the data that the map depends on."""
    size: tuple[int, int] = (0, 0)
    """Width and height of the map in cells, which are world units."""
    playable: tuple[int, int, int, int] = (0, 0, 0, 0)
    """The part of the map that units can be on: x0, y0, x1, y1 in the world frame."""
    enemy_race: str = ""
    """Race that the opponent chose, `random` too; "" if unknown."""
    starts: tuple[WorldPoint, ...] = ()
    """Possible starts of other players."""
    placement: Grid = NO_GRID
    """1 where the bare ground takes structures."""
    pathing: Grid = NO_GRID
    """1 where ground units could walk when the episode began."""
    height: Grid = NO_GRID
    """Height of the ground: a byte b stands for -16 + 32 b / 255 world units."""
    pictures: PictureSizes = PictureSizes()

    def frame(self, frames: Frames) -> MapFrame:
        """Return the map with a minimap of the size that `frames` says."""
        width, height = self.size
        x0, y0, x1, y1 = self.playable
        return MapFrame(
            float(width), float(height), (float(x0), float(y0), float(x1), float(y1)), minimap_size=frames.minimap
        )
