"""The land: everything on the ground at one moment, and the places that must stay free.

Made of a snapshot, and cached for the last two. Grids are indexed `[x, y]` like those of
`khala_bridge.state.ground.terrain`. `khala_bridge.auto` chooses among the free places.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from khala_bridge.catalogue.functions import functions_of
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground.footprints import ADDON, ADDON_OFFSET, footprint_of, sites, stands_on
from khala_bridge.state.ground.resources import base_places, coordinates, mark
from khala_bridge.state.ground.terrain import MapGround

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_bridge.state import PowerSource, Snapshot, Unit
    from khala_bridge.state.ground.footprints import Footprint
    from khala_bridge.state.ground.resources import Base, Places
    from khala_bridge.state.ground.terrain import Bools, Bytes

POWER_RISE = 0.5
"""Ground that is higher than a Pylon by this much has no power from it: the field does not reach up a cliff."""
GIVE_POWER = frozenset({"Pylon", "PylonOvercharged", "WarpPrismPhasing", ""})
"""Types that give power; an unknown source does, too."""
AROUND_HALL = 4
"""Cells from the middle of a town hall that stay free on each side: its own 2, and 2 for walking."""
LINE_WIDTH = 1.0
"""A cell is on the workers' way if the way over it is longer than the straight one by less than this."""
LINE_REACH = 10.0
"""Distance up to which resources belong to a town hall."""
SEEN_NOW = 2
"""The game's number for a cell that is in sight; 1 means seen before, 0 never seen."""
RESOURCES = ("mineral_field", "geyser")
"""Footprints of resources; a gas structure has that of its geyser."""
_PLACES = "Build_"


class Land:
    """The state of the ground at the moment of a snapshot."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.ground = MapGround.of(snapshot.info)
        self._snapshot = snapshot
        self.answers: dict[Any, Any] = {}
        """Answers of layers above about this moment, by their questions."""

    @functools.cached_property
    def _standing(self) -> list[tuple[str, Footprint, Unit]]:
        """Units that take ground, with their footprints, by ascending tags; ordered structures are in `plans`."""
        found = ((stands_on(unit.unit_type), unit) for unit in self._snapshot.known.values())
        return [(*kind, unit) for kind, unit in found if kind]

    @functools.cached_property
    def _bodies(self) -> list[Unit]:
        """Units of other players that are on the ground and in the way of a structure."""
        others = (unit for unit in self._snapshot.known.values() if not unit.is_own and not unit.is_flying)
        return [unit for unit in others if stands_on(unit.unit_type) is None]

    def unit(self, tag: int) -> Unit | None:
        """Return a unit that is seen or remembered, by its tag."""
        return self._snapshot.known.get(tag)

    def standing(self, footprint: str) -> list[Unit]:
        """Return the known units with a footprint of this name, by ascending tags."""
        return [unit for name, _, unit in self._standing if name == footprint]

    def standing_on(self, cells: Iterable[tuple[int, int]]) -> Unit | None:
        """Return a unit that stands on any of some cells: the one with the least tag."""
        wanted = set(cells)
        return next((u for _, f, u in self._standing if not wanted.isdisjoint(_footprint_cells(f, u))), None)

    # --- things on the ground ---------------------------------------------------------------------------------

    @functools.cached_property
    def taken(self) -> Bools:
        """(w, h): cells where nothing can be built, since something stands there or a unit of others is in the way."""
        taken = np.zeros(self.ground.size, np.bool_)
        for footprint, cells in self._cells.values():
            mark(taken, footprint.cells, cells, value=True)
        mark(taken, ((0, 0),), [(int(unit.pos.x), int(unit.pos.y)) for unit in self._bodies], value=True)
        return taken

    @functools.cached_property
    def _cells(self) -> dict[str, tuple[Footprint, list[tuple[int, int]]]]:
        """By name of a footprint, the cells of its units."""
        found: dict[str, tuple[Footprint, list[tuple[int, int]]]] = {}
        for name, footprint, unit in self._standing:
            _, cells = found.setdefault(name, (footprint, []))
            cells.append(footprint.cell(unit.pos.x, unit.pos.y))
        return found

    @functools.cached_property
    def plans(self) -> tuple[tuple[str, WorldPoint], ...]:
        """Structures that own workers are on their way to build, and their future middles; nothing stands there yet.

        The game takes the price when construction begins, so these are not paid for.
        """
        return tuple(plan for unit in self._snapshot.own for plan in self._plans_of(unit))

    def _plans_of(self, unit: Unit) -> Iterator[tuple[str, WorldPoint]]:
        for order in unit.orders:
            structure = built_by(order.ability_id)
            footprint = footprint_of(structure) if structure is not None else None
            if structure is None or footprint is None:
                continue
            target = self.unit(order.target_unit_tag)
            if target is not None:
                middle, begun = target.pos, target.is_own
            else:
                point = order.target_world_space_pos or WorldPoint(0.0, 0.0)
                cell = footprint.cell(point.x, point.y)
                middle = footprint.middle(cell)
                begun = self._is_begun(footprint, cell)
            if not begun:
                yield structure, middle

    def _is_begun(self, footprint: Footprint, cell: tuple[int, int]) -> bool:
        return self.ground.holds(*cell) and any(
            unit.is_own and other.cell(unit.pos.x, unit.pos.y) == cell
            for _, other, unit in self._standing
            if other.size == footprint.size
        )

    @functools.cached_property
    def planned(self) -> Bools:
        """(w, h): cells of the structures that own units are on their way to build."""
        planned = np.zeros(self.ground.size, np.bool_)
        for structure, middle in self.plans:
            footprint = footprint_of(structure)
            if footprint is not None:
                mark(planned, footprint.cells, [footprint.cell(*middle)], value=True)
        return planned

    @functools.cached_property
    def open(self) -> Bools:
        """(w, h): cells where ground units can walk now."""
        walls = np.zeros(self.ground.size, np.bool_)
        for footprint, cells in self._cells.values():
            if not footprint.flat:
                mark(walls, footprint.cells, cells, value=True)
        return self.ground.walkable & ~walls

    @functools.cached_property
    def free(self) -> Bools:
        """(w, h): cells where a structure could stand now: buildable, not occupied, and not planned for another one."""
        return self.ground.buildable & ~self.taken & ~self.planned

    @functools.cached_property
    def clear(self) -> Bools:
        """(w, h): cells where the game allows town halls, as far as resources go."""
        clear = np.ones(self.ground.size, np.bool_)
        for name, (footprint, cells) in self._cells.items():
            if name in RESOURCES:
                mark(clear, footprint.near, cells, value=False)
        return clear

    # --- creep, sight, power ----------------------------------------------------------------------------------

    @functools.cached_property
    def creep(self) -> Bools:
        """(w, h): cells with creep."""
        cells = self._snapshot.creep.cells()
        return cells > 0 if cells is not None else np.zeros(self.ground.size, np.bool_)

    @functools.cached_property
    def sight(self) -> Bytes:
        """(w, h): 2 where the player sees, 1 where it once saw, 0 elsewhere; all is seen if the game sent no map."""
        cells = self._snapshot.visibility.cells()
        return cells if cells is not None else np.full(self.ground.size, SEEN_NOW, np.uint8)

    @functools.cached_property
    def power_sources(self) -> tuple[PowerSource, ...]:
        """The fields that power structures and allow warping in, by ascending tags.

        The game may also list those that only speed up warping in, such as a Nexus.
        """
        found = (s for s in self._snapshot.power_sources if self._name(s.tag) in GIVE_POWER)
        return tuple(sorted(found, key=lambda source: source.tag))

    def _name(self, tag: int) -> str:
        unit = self.unit(tag)
        return "" if unit is None else unit.name

    def power_cells(self, *, corner: bool, by: int | None = None) -> Bools:
        """Return the cells (w, h) where a structure's middle would be in a power field.

        Args:
            corner: whether the middle is the lower left corner of the cell, as of structures of 2 x 2, and not its
                own middle.
            by: tag of the only source that counts; None for all.
        """
        result = np.zeros(self.ground.size, np.bool_)
        shift = 0.0 if corner else 0.5
        for source in self.power_sources:
            if by is not None and source.tag != by:
                continue
            reach = math.ceil(source.radius) + 1
            x0, y0 = max(int(source.pos.x) - reach, 0), max(int(source.pos.y) - reach, 0)
            part = np.s_[x0 : int(source.pos.x) + reach + 1, y0 : int(source.pos.y) + reach + 1]
            height = self.ground.height[part]
            x, y = coordinates((height.shape[0], height.shape[1]), (x0, y0))
            inside = (x + shift - source.pos.x) ** 2 + (y + shift - source.pos.y) ** 2 <= source.radius**2
            if source.tag not in self._flying:
                inside = inside & (height <= self.ground.level(source.pos.x, source.pos.y) + POWER_RISE)
            result[part] |= inside
        return result

    @functools.cached_property
    def _flying(self) -> frozenset[int]:
        units = self._snapshot.known.values()
        return frozenset(unit.tag for unit in units if unit.is_flying or unit.name == "WarpPrismPhasing")

    # --- bases ------------------------------------------------------------------------------------------------

    @functools.cached_property
    def bases(self) -> tuple[Base, ...]:
        """Every place for a town hall with its resources, by ascending coordinates."""
        halls = [WorldPoint(round(u.pos.x, 3), round(u.pos.y, 3)) for u in self.own_halls]
        return base_places(
            self.ground, self._places("mineral_field"), self._places("geyser"), (*self.ground.starts, *halls)
        )

    def _places(self, footprint: str) -> Places:
        found = {(round(u.pos.x, 3), round(u.pos.y, 3)) for name, _, u in self._standing if name == footprint}
        return tuple(sorted(found))

    @functools.cached_property
    def halls(self) -> tuple[Unit, ...]:
        """Every known town hall of any player, also those under construction, by ascending tags."""
        return tuple(self.standing("town_hall"))

    @functools.cached_property
    def own_halls(self) -> tuple[Unit, ...]:
        """The player's own town halls, finished or not, by ascending tags."""
        return tuple(unit for unit in self.halls if unit.is_own)

    # --- cells that stay free ---------------------------------------------------------------------------------

    @functools.cached_property
    def kept(self) -> Bools:
        """(w, h): cells where the host builds nothing by itself: workers' ways, town hall places, room for add-ons."""
        kept = _lines(self.ground, self.bases, tuple((u.pos.x, u.pos.y) for u in self.own_halls)).copy()
        for _, footprint, unit in self._standing:
            site = sites().get(unit.name) if unit.is_own else None
            if site is not None and site.addon and not unit.add_on_tag:
                mark(kept, ADDON, [footprint.cell(unit.pos.x, unit.pos.y)], value=True)
        return kept


def _footprint_cells(footprint: Footprint, unit: Unit) -> list[tuple[int, int]]:
    x, y = footprint.cell(unit.pos.x, unit.pos.y)
    return [(x + dx, y + dy) for dx, dy in footprint.cells]


def addon_place(structure: WorldPoint) -> WorldPoint:
    """Return the place of a structure's add-on."""
    return WorldPoint(structure.x + ADDON_OFFSET[0], structure.y + ADDON_OFFSET[1])


@functools.lru_cache(2048)
def built_by(ability: int) -> str | None:
    """Return the structure that a worker places with an ability; None for any other ability."""
    for function in functions_of(ability):
        name = function.stem.removeprefix(_PLACES)
        if function.stem.startswith(_PLACES) and name in sites():
            return name
    return None


_last: list[tuple[Snapshot, Land]] = []


def land_of(snapshot: Snapshot) -> Land:
    """Return the land at the moment of a snapshot; cached for the last two snapshots."""
    for known, land in _last[:]:  # a copy: other threads of the process may play other matches
        if known is snapshot:
            return land
    land = Land(snapshot)
    _last[:] = [(snapshot, land), *_last[:1]]
    return land


@functools.lru_cache(maxsize=8)
def _lines(ground: MapGround, bases: tuple[Base, ...], halls: Places) -> Bools:
    """Return the cells (w, h) between town halls and their resources, and around the places for town halls."""
    kept = np.zeros(ground.size, np.bool_)
    resources = [place for base in bases for place in (*base.fields, *base.geysers)]
    for place in dict.fromkeys((*(tuple(base.place) for base in bases), *halls)):
        x, y = int(place[0]), int(place[1])
        kept[max(x - AROUND_HALL, 0) : x + AROUND_HALL + 1, max(y - AROUND_HALL, 0) : y + AROUND_HALL + 1] = True
        for resource in resources:
            if math.dist(place, resource) <= LINE_REACH:
                _mark_way(kept, place, resource)
    return kept


def _mark_way(kept: Bools, start: tuple[float, ...], end: WorldPoint) -> None:
    """Mark the cells over which the way between two points is little longer than the straight one."""
    x0, x1 = sorted((int(start[0]), int(end.x)))
    y0, y1 = sorted((int(start[1]), int(end.y)))
    x0, y0 = max(x0 - 2, 0), max(y0 - 2, 0)
    part = kept[x0 : x1 + 3, y0 : y1 + 3]
    x, y = coordinates((part.shape[0], part.shape[1]), (x0, y0))
    way = np.hypot(x + 0.5 - start[0], y + 0.5 - start[1]) + np.hypot(x + 0.5 - end.x, y + 0.5 - end.y)
    part |= way <= math.dist(start, end) + LINE_WIDTH
