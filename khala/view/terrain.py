"""The ground of an episode: as recorded, or of an older recording what its observations say of it.

The scale, cells of the minimap per world unit, places what agents say in the screen frame. A recorded terrain knows the
size of the map; otherwise pairs of units tell it, for an observation has their places in both frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic_core import from_json

from khala.view.scan import WRONG
from khala_protocol.keys import Topic
from khala_protocol.messages import GridView, ResourceMark, Terrain

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala.view.index import Index, Spot

MINIMAP = 64.0
USUAL = 64 / 152
"""Cells per world unit, if nothing says it: of a map for two."""
FARTHEST_LOOK = 40
"""Observations that are looked at."""
_NEAREST = 8.0
"""Cells of the screen between two units that say the scale: positions are given to a tenth."""
_NOTHING = GridView(width=0, height=0, data="")
_RESOURCE_RADIUS = 1.0


def recorded(index: Index, episode: int) -> Spot | None:
    """Return where the terrain of an episode is; None if there is none."""
    found = index.newest(Topic.TERRAIN, episode, "", "", 0)
    return found.spot if found else None


def scale_of(index: Index, episode: int) -> float:
    """Return cells of the minimap frame per world unit."""
    if (spot := recorded(index, episode)) is not None:
        try:
            said = from_json(index.payload(spot))
            return float(said.get("minimap", MINIMAP)) / float(max(said["size"]))
        except (*WRONG, ZeroDivisionError):
            return USUAL
    scales = sorted(scale for view in _views(index, episode) for scale in _scales(view))
    return scales[len(scales) // 2] if scales else USUAL


def from_views(index: Index, run: str, episode: int) -> Terrain:
    """Return a terrain without heights: its size, its bounds, and the resources that were seen."""
    scale = scale_of(index, episode)
    side = round(MINIMAP / scale)
    bounds, resources = (0.0, 0.0, MINIMAP, MINIMAP), {}
    for view in _views(index, episode):
        bounds = tuple(view.get("bounds") or bounds)
        for team in view["teams"]:
            resources |= {unit["tag"]: unit for unit in team.get("resources", ())}
    marks = tuple(
        ResourceMark(int(tag, 16), unit["type"], *unit["minimap"], round(_RESOURCE_RADIUS * scale, 2))
        for tag, unit in resources.items()
    )
    return Terrain(
        run=run, episode=episode, size=(side, side), bounds=bounds, height=_NOTHING, walkable=_NOTHING, resources=marks
    )


def _views(index: Index, episode: int) -> Iterator[dict[str, Any]]:
    for found in list(index.at(Topic.OBSERVATION, episode, 0, FARTHEST_LOOK))[:FARTHEST_LOOK]:
        try:
            view = from_json(index.payload(found.spot))["view"]
            if isinstance(view["teams"], list):
                yield view
        except WRONG:
            continue


def _scales(view: dict[str, Any]) -> Iterator[float]:
    """Yield cells per world unit, of pairs of units far from each other on a screen of world units."""
    for team in view["teams"]:
        units = [unit for group in ("units", "allies", "enemies", "resources") for unit in team.get(group, ())]
        for axis in (0, 1):
            yield from _scale(units, axis)


def _scale(units: Iterable[dict[str, Any]], axis: int) -> Iterator[float]:
    places = sorted((unit["screen"][axis], unit["minimap"][axis]) for unit in units)
    if places and (apart := places[-1][0] - places[0][0]) >= _NEAREST and places[-1][1] > places[0][1]:
        yield (places[-1][1] - places[0][1]) / apart
