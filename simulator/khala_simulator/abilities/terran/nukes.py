"""Nukes: a Ghost paints a place, and a missile that its owner has armed in an academy comes down there.

The strike takes one of the owner's Nukes when it is called, wherever that is. The Ghost has to keep painting until the
missile is down; a moment later it goes off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.shared.cancel import cancelling
from khala_simulator.abilities.skill import Skill, around, number
from khala_simulator.combat import lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.casts import Cast

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.world.world import World

PAINTED: Final = 7  # the API's NukePersistent


def _call(world: World, cast: Cast) -> None:
    """Take one of the owner's Nukes and paint the place until it is down; it explodes a moment later."""
    owner = int(world.owner[cast.slot])
    point = cast.point
    assert point is not None
    nuke = world.catalog.unit("Nuke").row
    armed = np.flatnonzero(world.alive & (world.owner == owner) & (world.type == nuke))
    if armed.size:
        lifecycle.remove(world, int(armed[0]))
    down = world.loop + number(cast, "delay_loops")
    strike = AreaEffect(
        "nuke",
        owner=owner,
        points=[point],
        radius=cast.ability.numbers["area"][-1]["radius"],
        begun=world.loop,
        end=down + number(cast, "post_detonate_damage_delay_loops"),
        effect=PAINTED,
        due=world.loop + 1,
        ability=cast.ability.id,
        source=world.tag_of(cast.slot),
        memory={"down": down},
    )
    world.area_effects.append(strike)
    for player in world.players[1:]:
        if player.id != owner:
            world.alert(player.id, "NuclearLaunchDetected")


def _paint(world: World, cast: Cast) -> bool:
    return bool(world.can_cast[cast.slot]) and world.loop < cast.begun + number(cast, "delay_loops")


def _fall(world: World, strike: AreaEffect) -> None:
    """Wait for the missile while the Ghost paints, then for the explosion."""
    if world.loop < strike.memory["down"]:
        painter = world.channelling.get(world.slot_of(strike.source))
        if not (isinstance(painter, Cast) and painter.ability.id == strike.ability and painter.begun == strike.begun):
            strike.end = world.loop
    elif world.loop == strike.memory["down"]:
        strike.sights = strike.radius
    elif world.loop >= strike.end:
        _detonate(world, strike)


def _detonate(world: World, strike: AreaEffect) -> None:
    """Hurt everything around, by its ring, friend and foe, on the ground and in the air."""
    ability = world.catalog.ability(strike.ability)
    source = world.slot_of(strike.source)
    struck: set[int] = set()
    for ring in ability.numbers["area"]:
        for slot in around(world, strike.at, ring["radius"]):
            if slot not in struck:
                struck.add(slot)
                extra = number(ability, "bonus_structure") if world.unit_type(slot).structure else 0.0
                apply_damage(world, source, strike.owner, slot, (number(ability, "damage") + extra) * ring["fraction"])
    afterglow = AreaEffect(
        "afterglow",
        owner=strike.owner,
        points=[strike.at],
        radius=strike.radius,
        begun=world.loop,
        end=world.loop + number(ability, "afterglow_loops"),
        due=world.loop + number(ability, "afterglow_loops"),
        sights=strike.radius,
    )
    world.area_effects.append(afterglow)


SKILLS: Final = {"tac_nuke_strike": Skill(_call, hold=_paint), "cancel_tac_nuke_strike": cancelling("tac_nuke_strike")}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"nuke": _fall}
