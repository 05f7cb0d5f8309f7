"""The ground of an episode, and what stands on it from the beginning for nobody: resources, rocks, towers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.overview.grids import pack
from khala_bridge.overview.marks import Pen
from khala_protocol.messages import ResourceMark, Terrain

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Snapshot, Unit
    from khala_protocol.messages import Frames


def terrain_of(
    snapshots: Sequence[Snapshot], whole: Snapshot | None, frames: Frames, *, run: str, episode: int
) -> Terrain:
    """Return the ground of an episode.

    Args:
        snapshots: the first one of each side.
        whole: of the whole map at the same moment; None if the game does not show it.
        frames: of the task.
        run: name of the run.
        episode: number of the episode.
    """
    info = snapshots[0].info
    frame = info.frame(frames)
    pen = Pen.of(frame)
    x0, y0, x1, y1 = frame.bounds
    return Terrain(
        run=run,
        episode=episode,
        size=info.size,
        bounds=(round(x0, 3), round(y0, 3), round(x1, 3), round(y1, 3)),
        minimap=frames.minimap,
        height=pack(info.height),
        walkable=pack(info.pathing),
        resources=tuple(_resources(snapshots if whole is None else [whole], pen)),
        starts=tuple(dict.fromkeys(pen.place(start) for start in _starts(snapshots))),
    )


def is_ground(unit: Unit) -> bool:
    """Return whether a unit is a part of the map that belongs to nobody and does not move."""
    return unit.is_neutral and unit.facts is not None and unit.facts.structure


def _resources(snapshots: Iterable[Snapshot], pen: Pen) -> Iterator[ResourceMark]:
    """Yield the fixed things of the map once each, although two sides remember one under two tags."""
    units = [unit for snapshot in snapshots for unit in snapshot.known.values() if is_ground(unit)]
    for (x, y), unit in {pen.place(unit.pos): unit for unit in reversed(units)}.items():
        yield ResourceMark(unit.tag, unit.name, x, y, pen.length(unit.radius))


def _starts(snapshots: Sequence[Snapshot]) -> Iterator[WorldPoint]:
    """Yield where the players of a melee game begin: the game tells each of the others, and its hall stands already."""
    for snapshot in snapshots:
        if snapshot.info.starts:
            yield from (unit.pos for unit in snapshot.own if unit.is_structure)
            yield from snapshot.info.starts
