"""The ground of an episode: as recorded, or of an older recording what its observations say of it.

The scale, cells of the minimap per world unit, places what agents say in the screen frame. A recorded terrain knows the
size of the map; otherwise pairs of units tell it, for an observation has their places in both frames.
"""

from __future__ import annotations

import contextlib
from itertools import islice
from typing import TYPE_CHECKING

from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic
from khala_protocol.messages import GridView, Observation, ResourceMark, Terrain

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_protocol.messages import TeamView, View
    from khala_sc2.view.index import Index, Spot

MINIMAP = 64.0
USUAL = 64 / 152
"""Cells per world unit, if nothing says it: of a map for two."""
FARTHEST_LOOK = 40
"""Observations that are looked at."""
_NEAREST = 8.0
"""Cells of the screen between two units that say the scale: positions are given to a tenth."""
_NOTHING = GridView(width=0, height=0, data="")
_RESOURCE_RADIUS = 1.0


def find(index: Index, episode: int) -> Spot | None:
    """Return where the terrain of an episode is; None if there is none."""
    found = index.newest(Topic.TERRAIN, episode, "", "", 0)
    return found.spot if found else None


def scale_of(index: Index, episode: int) -> float:
    """Return cells of the minimap frame per world unit."""
    if (spot := find(index, episode)) is not None:
        try:
            said = decode_as(Terrain, index.payload(spot))
            return said.minimap / max(*said.size, 1)
        except PeerError:
            return USUAL
    return _scale(_views(index, episode))


def from_views(index: Index, run: str, episode: int) -> Terrain:
    """Return a terrain without heights: its size, its bounds, and the resources that were seen."""
    views = list(_views(index, episode))
    scale = _scale(views)
    side = round(MINIMAP / scale)
    seen = {unit.tag: unit for view in views for team in view.teams for unit in team.resources}
    return Terrain(
        run=run,
        episode=episode,
        size=(side, side),
        bounds=views[0].bounds if views else (0.0, 0.0, MINIMAP, MINIMAP),
        height=_NOTHING,
        walkable=_NOTHING,
        resources=tuple(
            ResourceMark(int(tag, 16), unit.type, *unit.minimap, round(_RESOURCE_RADIUS * scale, 2))
            for tag, unit in seen.items()
        ),
    )


def _views(index: Index, episode: int) -> Iterator[View]:
    for found in islice(index.at(Topic.OBSERVATION, episode, 0, FARTHEST_LOOK), FARTHEST_LOOK):
        with contextlib.suppress(PeerError):
            yield decode_as(Observation, index.payload(found.spot)).view


def _scale(views: Iterable[View]) -> float:
    scales = sorted(scale for view in views for team in view.teams for axis in (0, 1) for scale in _apart(team, axis))
    return scales[len(scales) // 2] if scales else USUAL


def _apart(team: TeamView, axis: int) -> Iterator[float]:
    """Yield cells per world unit, of the units that are farthest from each other on a screen of world units."""
    units = (*team.units, *team.allies, *team.enemies, *team.resources)
    places = sorted((unit.screen[axis], unit.minimap[axis]) for unit in units)
    if places and (apart := places[-1][0] - places[0][0]) >= _NEAREST and places[-1][1] > places[0][1]:
        yield (places[-1][1] - places[0][1]) / apart
