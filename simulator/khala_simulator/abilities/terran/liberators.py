"""Liberators: the ship marks a Defender zone, changes its mode, and then fires at ground units in the circle.

The zone is an area effect from the order on (the API's effect 8 while it is set up, 9 when it works); it ends when the
ship leaves its mode, dies, or is carried away from it. The columns ``zone`` and ``zone_radius`` keep a ship's fire
inside; the systems that choose and measure targets read them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import projectiles
from khala_simulator.abilities.skill import Skill, distance, number
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

SETTING_UP: Final = 8  # the API's LiberatorTargetMorphDelayPersistent
WORKING: Final = 9  # and LiberatorTargetMorphPersistent
TO_GROUND: Final = "LiberatorMorphtoAG"
TO_AIR: Final = "LiberatorMorphtoAA"


def _lay_out(world: World, cast: Cast) -> None:
    """Mark the zone and begin the morph; the rest of the queue comes after it."""
    slot, point = cast.slot, cast.point
    assert point is not None
    _leave(world, slot)
    zone = AreaEffect(
        "liberator_zone",
        owner=int(world.owner[slot]),
        points=[point],
        radius=number(cast, "radius"),
        begun=world.loop,
        end=FOREVER,
        effect=SETTING_UP,
        due=world.loop + 1,
        ability=cast.ability.id,
        source=world.tag_of(slot),
        sights=number(cast, "reveal_radius"),
        memory={"works": world.loop + number(cast, "setup_loops")},
    )
    world.area_effects.append(zone)
    world.zone[slot], world.zone_radius[slot] = point, zone.radius
    _morph(world, slot, TO_GROUND)


def _guard(world: World, zone: AreaEffect) -> None:
    """Activate the zone when it is set up, and end it when its ship is gone or too far away."""
    slot = world.slot_of(zone.source)
    if slot == NOBODY or world.carrier[slot] != NOBODY:
        projectiles.end(world, zone)
        return
    leash = number(world.catalog.ability(zone.ability), "leash_range") + _more_range(world, zone)
    if distance(world, slot, zone.at) > leash:
        _leave(world, slot)
        if not world.bound[slot]:
            world.queue[slot] = []
            _morph(world, slot, TO_AIR)
    elif world.loop >= zone.memory["works"]:
        zone.effect = WORKING


def _more_range(world: World, zone: AreaEffect) -> float:
    """Return how much farther upgrades allow a zone to be from the ship; the leash grows with it."""
    ability = world.catalog.ability(zone.ability)
    return world.stats.ability(zone.owner, ability).range - ability.range


def _take_off(world: World, cast: Cast) -> None:
    """Give up the zone and change to the mode against air."""
    _leave(world, cast.slot)
    _morph(world, cast.slot, TO_AIR)


def _leave(world: World, slot: int) -> None:
    world.zone_radius[slot] = 0.0
    for zone in world.area_effects:
        if zone.rule == "liberator_zone" and zone.source == world.tag_of(slot):
            projectiles.end(world, zone)
            zone.effect = 0


def _morph(world: World, slot: int, link: str) -> None:
    """Make the morph with this link the unit's current order; the queue behind it stays."""
    waiting = world.queue[slot]
    ability = next(a for a in world.catalog.abilities if a.link == link and a.effect == "morph")
    commands.begin(world, slot, Order(OrderKind.CAST, ability.id))
    world.queue[slot] = waiting


SKILLS: Final = {
    "liberator_ag_target": Skill(
        _lay_out,
        estimates=("A Liberator that is carried away from its zone leaves its mode when it is free to do so.",),
    ),
    "liberator_aa_target": Skill(_take_off),
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"liberator_zone": _guard}
