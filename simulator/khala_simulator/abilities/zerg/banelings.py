"""Banelings burst on order, and when they die without having burst in an attack."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import hit_with
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import Shot

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

BURST = "VolatileBurst"
BUILDINGS = "VolatileBurstBuilding"


def burst(world: World, slot: int) -> None:
    """Harm the ground enemies around a Baneling, as its attack does."""
    weapon = next(w for w in world.catalog.weapons if w.id == BURST)
    x, y = world.pos[slot].tolist()
    world.spent[slot] = True
    for index, hit in enumerate(weapon.hits):
        if hit.area and not hit.when:
            shot = Shot(slot, int(world.owner[slot]), NOBODY, NOBODY, weapon.row, index, (x, y), (x, y))
            hit_with(world, shot)


def _explode(world: World, cast: Cast) -> None:
    """Burst on the spot."""
    burst(world, cast.slot)
    world.life[cast.slot] = 0.0
    world.attacker[cast.slot] = NOBODY


def _dies(world: World, slot: int) -> None:
    """Burst a Baneling that is killed."""
    if not world.spent[slot] and not world.hallucination[slot]:
        burst(world, slot)


def _aim_at_buildings(world: World, cast: Cast) -> None:
    """Attack structures as well."""
    buffs.apply(world, cast.slot, BUILDINGS, source=cast.slot)


def _spare_buildings(world: World, cast: Cast) -> None:
    """Attack units only."""
    buffs.remove(world, cast.slot, BUILDINGS)


def _not_yet(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.ERROR if buffs.has(world, slot, BUILDINGS) else ActionResult.SUCCESS


def _already(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.SUCCESS if buffs.has(world, slot, BUILDINGS) else ActionResult.ERROR


SKILLS: Final = {
    "explode": Skill(_explode),
    "volatile_burst_building_on": Skill(_aim_at_buildings, ready=_not_yet),
    "volatile_burst_building_off": Skill(_spare_buildings, ready=_already),
}
DEATHS: Final = {"Baneling": _dies, "BanelingBurrowed": _dies}
