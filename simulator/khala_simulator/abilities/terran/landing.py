"""Terran structures that fly: lifting off, landing, and the add-ons that stay behind and are taken up again.

An add-on belongs to the structure at its left; without one it is a plain tech lab or reactor at which any structure of
its owner may land. Production makes and uses add-ons.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.shared.push_units_off import push_units_off
from khala_simulator.abilities.skill import Skill
from khala_simulator.abilities.terran import addons
from khala_simulator.combat import lifecycle
from khala_simulator.economy import building_sites
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

KINDS: Final = ("TechLab", "Reactor")
CLOSE: Final = 0.1


def _lift(world: World, cast: Cast) -> None:
    """Take off and leave the add-on behind."""
    slot = cast.slot
    detach(world, slot)
    lifecycle.become(world, slot, world.catalog.unit(cast.ability.unit))


def _can_lift(world: World, cast: Cast) -> ActionResult:
    """Refuse a structure that is at work or has an add-on in the making."""
    return ActionResult.CANT_QUEUE_THAT_ORDER if cast.slot in world.jobs else ActionResult.SUCCESS


def _can_land(world: World, cast: Cast) -> ActionResult:
    if cast.point is None:
        return ActionResult.CANT_LAND_LOCATION_INVALID
    owner = int(world.owner[cast.slot])
    unit = world.catalog.unit(cast.ability.unit)
    why = building_sites.refusal(world, owner, unit, cast.point, on_site=cast.is_carried_out)
    return ActionResult.SUCCESS if why is ActionResult.SUCCESS else ActionResult.CANT_LAND_LOCATION_INVALID


def _settle(world: World, cast: Cast) -> None:
    """Land, unless something is under it by now, and take up an add-on at the right place."""
    slot = cast.slot
    unit = world.catalog.unit(cast.ability.unit)
    if cast.point is None or _can_land(world, cast) is not ActionResult.SUCCESS:
        return
    teleport.to(world, slot, building_sites.centre(world, unit, cast.point))
    lifecycle.become(world, slot, unit)
    push_units_off(world, slot)
    attach(world, slot)


# add-ons --------------------------------------------------------------------------------------------------------------


def detach(world: World, slot: int) -> None:
    """Leave a structure's add-on behind, as a plain one."""
    addon = int(world.addon[slot])
    world.addon[slot] = NOBODY
    if addon != NOBODY:
        lifecycle.become(world, addon, _plain(world, addon))


def attach(world: World, slot: int) -> None:
    """Take up the plain add-on of the same owner that stands beside a structure, if there is one."""
    goal = addons.place_of(world, slot)
    for other in world.units_of(int(world.owner[slot])).tolist():
        unit = world.unit_type(other)
        own = world.catalog.row_of_name.get(world.unit_type(slot).name + unit.name)
        if unit.name in KINDS and own is not None and _is_at(world, other, goal):
            world.addon[slot] = other
            lifecycle.become(world, other, world.catalog.units[own])
            return


def _is_at(world: World, slot: int, point: Point) -> bool:
    x, y = world.pos[slot].tolist()
    return bool(abs(x - point[0]) < CLOSE and abs(y - point[1]) < CLOSE)


def _plain(world: World, addon: int) -> UnitType:
    kind = next(kind for kind in KINDS if world.unit_type(addon).name.endswith(kind))
    return world.catalog.unit(kind)


SKILLS: Final = {
    "lift": Skill(_lift, refuse=_can_lift, binds=True),
    "land": Skill(
        _settle,
        refuse=_can_land,
        binds=True,
        estimates=("A landing structure that finds its place taken in the end stays in the air.",),
    ),
}
