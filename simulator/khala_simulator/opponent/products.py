"""Making anything by its name: a unit, a structure, an add-on, an upgrade, or a change of kind.

``make`` looks for the abilities that produce it, for a unit of the side that can use one now, and for the money; when
only the money is missing it is put aside, so that it is there later.
"""

from __future__ import annotations

from enum import Enum
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import casting
from khala_simulator.abilities.terran import addons
from khala_simulator.economy import building_sites, harvesting, production
from khala_simulator.economy.harvesting import Phase
from khala_simulator.economy.requirements import ALIAS
from khala_simulator.opponent import hands, sites
from khala_simulator.opponent.side import names_of
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.world import NO_TAG

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.abilities import Ability, Need
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

MAKES: Final = frozenset({"train", "build", "build_addon", "warp_in", "structure_morph", "grow", "research"})


class MakeOutcome(Enum):
    """How an attempt to make something ended."""

    DONE = "ordered"
    SHORT = "the money is put aside"
    BLOCKED = "nothing can make it now"


def make(side: OwnSide, name: str, *, near: Point | None = None) -> MakeOutcome:
    """Make one of a type or an upgrade, if possible now; structures ``near`` a point, by default in the main base."""
    found = MakeOutcome.BLOCKED
    for ability in ways(side.world.catalog, name):
        if ability.supply > 0.0 and ability.supply > side.purse.room:
            continue
        maker = next(_makers(side, ability), NOBODY)
        if maker == NOBODY:
            continue
        if not side.purse.affords(ability):
            found = MakeOutcome.SHORT
        elif _order(side, ability, maker, near):
            side.purse.spend(ability)
            side.underway[name] += 1
            return MakeOutcome.DONE
    if found is MakeOutcome.SHORT:
        side.purse.put_aside(ways(side.world.catalog, name)[0])
    return found


@lru_cache(maxsize=512)
def ways(catalog: Catalog, name: str) -> tuple[Ability, ...]:
    """Return the abilities that make a type of unit or an upgrade."""
    made = [a for a in catalog.abilities if a.effect in MAKES and name in (a.unit, a.upgrade) and not _back(catalog, a)]
    return tuple(sorted(made, key=lambda a: (a.effect != "warp_in", a.id)))


def _back(catalog: Catalog, ability: Ability) -> bool:
    """Return whether an ability makes nothing new, as when a Warp Gate, which counts as a Gateway, becomes one."""
    return bool(ability.unit) and set(ability.users) <= set(names_of(catalog, ability.unit))


def lacking(side: OwnSide, name: str) -> str:
    """Return a structure that has to stand before something can be made, and that is not even begun; "" for none."""
    for ability in ways(side.world.catalog, name)[:1]:
        for need in _structures(ability.requires):
            if not side.count(need):
                return lacking(side, need) or need
    return ""


def _structures(need: Need | None) -> Iterator[str]:
    """Yield the structures that a condition names, where it asks for all of its parts."""
    if need is not None and need.kind == "unit":
        yield need.name.removeprefix(ALIAS)
    elif need is not None and need.kind == "and":
        for part in need.parts:
            yield from _structures(part)


def _makers(side: OwnSide, ability: Ability) -> Iterator[int]:
    """Yield the units that could use an ability now, cost aside."""
    world = side.world
    for slot in side.of_type(*ability.users):
        if not _is_free(side, slot, ability):
            continue
        if casting.refusal(world, slot, ability, free=True) is ActionResult.SUCCESS:
            yield slot


def _is_free(side: OwnSide, slot: int, ability: Ability) -> bool:
    world = side.world
    if ability.effect == "build":
        return True
    if ability.effect == "warp_in":
        return casting.cooldown_left(world, slot, ability) <= 0.0
    if ability.effect == "grow":
        return world.target[slot] == NOBODY and not world.casts[slot]
    if ability.effect == "train" and slot in side.kept:
        return False
    parallel = production.parallel(world, slot) if ability.effect == "train" else 1
    return len(world.jobs.get(slot, ())) < parallel


def keep_for(side: OwnSide, name: str) -> None:
    """Keep the structure that is free first from training, so that an add-on can be made there."""
    world = side.world
    ability = ways(world.catalog, name)[0]
    unit = world.catalog.unit(ability.unit)
    bare = [s for s in side.of_type(*ability.users) if world.addon[s] == NOBODY]
    bare.sort(key=lambda s: (len(world.jobs.get(s, ())), -_done(world, s), s))
    for slot in bare if side.purse.affords(ability) else ():
        place = addons.place_of(world, slot)
        if building_sites.refusal(world, side.player, unit, place) is ActionResult.SUCCESS:
            side.kept.add(slot)
            return


def _done(world: World, slot: int) -> float:
    """Return what part of its first job a structure has done."""
    return max((job.done / job.loops for job in world.jobs.get(slot, ())[:1]), default=1.0)


def _order(side: OwnSide, ability: Ability, maker: int, near: Point | None) -> bool:
    if ability.effect == "build":
        return _build(side, ability, near)
    if ability.effect == "warp_in":
        return _warp_in(side, ability, maker)
    return hands.use(side, [maker], ability)


# structures and warping in --------------------------------------------------------------------------------------------


def _build(side: OwnSide, ability: Ability, near: Point | None) -> bool:
    """Send the nearest free worker to build."""
    if not hands.free(side):
        return False
    world = side.world
    unit = side.product(ability)
    if unit is None:
        return False
    geyser = sites.geyser(side) if unit.name == side.race.gas else NOBODY
    point = side.place(geyser) if geyser != NOBODY else sites.place_for(side, unit, near)
    if point is None:
        return False
    worker = free_worker(side, point)
    if worker == NOBODY:
        return False
    field = world.tag_of(int(world.patch[worker]))
    if geyser != NOBODY:
        taken = hands.use(side, [worker], ability, target=world.tag_of(geyser))
    else:
        taken = hands.use(side, [worker], ability, point=point)
    if taken and field != NO_TAG:
        hands.gather(side, [worker], field, queue=True)
    return taken


def free_worker(side: OwnSide, point: Point) -> int:
    """Return the nearest worker to a point that does nothing more important than mine, or NOBODY."""
    world = side.world
    busy = set(map(world.slot_of, side.mind.pulled))
    free = [w for w in side.workers if w not in busy and _interruptible(world, w)]
    if not free:
        return NOBODY
    offset = world.pos[free] - np.array(point)
    return free[int(np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2))]


def _interruptible(world: World, slot: int) -> bool:
    fields = harvesting.kinds(world.catalog)[1]
    patch = int(world.patch[slot])
    mines = int(world.harvest[slot]) == Phase.TO_RESOURCE and patch != NOBODY and bool(fields[world.type[patch]])
    return mines or (world.order_kind[slot] == 0 and world.carrier[slot] == NOBODY)


def _warp_in(side: OwnSide, ability: Ability, gate: int) -> bool:
    point = sites.warp_place(side, side.world.catalog.unit(ability.unit))
    return point is not None and hands.use(side, [gate], ability, point=point)
