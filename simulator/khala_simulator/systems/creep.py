"""Creep spreads from finished structures and standing Overlords, and recedes when they are gone.

Structures that need creep wither without it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.creep import GENERATING, spreads

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World

LOOK_PERIOD: Final = 8
WITHERING: Final = "ZergBuildingNotOnCreep"


def spread(world: World) -> None:
    """Look for new and lost sources, take the steps that are due, and harm structures that have lost their creep."""
    if world.bare_at == world.population:
        return
    creep = world.growth
    if creep.looked_at != world.population or ((creep.sources or creep.has_makers) and world.loop % LOOK_PERIOD == 0):
        _look_over(world)
    if creep.sources and creep.due <= world.loop:
        _step(world)
    if creep.withering:
        _wither(world)


def _look_over(world: World) -> None:
    """Compare the sources with the present units."""
    creep = world.growth
    creep.looked_at = world.population
    standing = _of_types(world, makers(world.catalog))
    creep.withering = _of_types(world, needy(world.catalog))
    creep.has_makers = bool(standing)
    if not (standing or creep.withering or creep.sources):
        world.bare_at = world.population
        return
    stand = {world.tag_of(s): s for s in standing if _generates(world, s)}
    for source in creep.sources:
        slot = stand.get(source.tag, NOBODY)
        if source.fades:
            continue
        if slot != NOBODY and _cell(world, slot) == source.cell:
            del stand[source.tag]
        else:
            source.fades = True
            source.due = world.loop + MECHANICS.creep_decay_loops
            creep.due = min(creep.due, source.due)
    for tag, slot in stand.items():
        creep.add(tag, world.unit_type(slot).name, _cell(world, slot), world.loop, grown=_old(world, slot))
    if stand:
        creep.settle()


def _of_types(world: World, wanted: Bools) -> list[int]:
    """Return the living units whose type is marked in (unit rows,), by slot."""
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    marked = memory.bools(wanted)
    return [slots[i] for i in range(len(live)) if marked[c.type[slots[i]]]]


def _generates(world: World, slot: int) -> bool:
    """Return whether creep comes from a unit: a finished structure, or a generating Overlord that stood long enough."""
    spread = world.growth.spreads[world.unit_type(slot).name]
    if not spread.delay_loops:
        return bool(world.build_progress[slot] >= 1.0)
    tag, (x, y) = world.tag_of(slot), world.pos[slot].tolist()
    if not buffs.has(world, slot, GENERATING):
        world.growth.waiting.pop(tag, None)
        return False
    was = world.growth.waiting.get(tag)
    if was is None or was[:2] != (x, y):
        world.growth.waiting[tag] = was = (x, y, world.loop)
    return world.loop - was[2] >= spread.delay_loops


def _old(world: World, slot: int) -> bool:
    """Return whether a source exists since the game began, and has all its creep."""
    return bool(world.born_loop[slot] == 0) and not world.growth.spreads[world.unit_type(slot).name].delay_loops


def _cell(world: World, slot: int) -> tuple[int, int]:
    x, y = world.pos[slot].tolist()
    return int(x), int(y)


def _step(world: World) -> None:
    """Make every source that is due cover a few cells more, or less."""
    creep = world.growth
    changed = False
    for source in creep.sources:
        while source.due <= world.loop and not _rests(world, source.extent, source.unit, fades=source.fades):
            source.due += creep.spreads[source.unit].period_loops
            cells = MECHANICS.creep_cells_per_step
            creep.reach(source, source.extent + (-cells if source.fades else cells))
            changed = True
    if changed:
        creep.settle()
    busy = (s.due for s in creep.sources if not _rests(world, s.extent, s.unit, fades=s.fades))
    creep.due = min(busy, default=float("inf"))


def _rests(world: World, extent: int, unit: str, *, fades: bool) -> bool:
    return extent == (0 if fades else len(world.growth.spreads[unit].cells))


def _wither(world: World) -> None:
    """Take a point of life from every finished structure off its creep, once per period."""
    period = world.catalog.buff(WITHERING).period_loops
    if int(world.loop / period) == int((world.loop - 1) / period):
        return
    for slot in world.growth.withering:
        if world.build_progress[slot] >= 1.0 and not world.on_creep(slot):
            apply_damage(world, NOBODY, int(world.owner[slot]), slot, MECHANICS.off_creep_damage)


@lru_cache(maxsize=4)
def makers(catalog: Catalog) -> Bools:
    """Return (unit rows,) whether units of the type can generate creep."""
    known = spreads(catalog.version)
    return np.array([unit.name in known for unit in catalog.units])


@lru_cache(maxsize=4)
def needy(catalog: Catalog) -> Bools:
    """Return (unit rows,) whether structures of the type wither off creep: those that need it and make none."""
    return np.array([unit.structure and unit.needs_creep and not unit.makes_creep for unit in catalog.units])
