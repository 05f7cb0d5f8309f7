"""The Sentry's skills: Guardian Shield, Force Field and Hallucination.

A force field is a neutral unit. No ground unit can enter its cells until it ends, a massive unit comes near or a bile
breaks it. A guardian shield is an area effect that follows its Sentry and applies a short buff to the units it covers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, around, friends, lay, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.traits import refresh
from khala_simulator.movement import placement
from khala_simulator.numeric import geometry
from khala_simulator.tables.stats import ATTRIBUTES, GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import UnitRule
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

SHIELD_EFFECT = 2
SHIELD_BUFF = "GuardianShield"
SCRAMBLED = "RavenScramblerMissile"
PUSHED_OUT_RADIUS = 4.0
FORCE_FIELD = 1526
MASSIVE: Final = 1 << ATTRIBUTES.index("massive")


# Guardian Shield ------------------------------------------------------------------------------------------------------


def _guardian_shield(world: World, cast: Cast) -> None:
    """Surround the Sentry with a shield that follows it and reduces the damage of ranged hits on friends."""
    end = world.loop + number(cast, "duration_loops")
    lay(world, cast, "guardian_shield", end=end, due=world.loop + 1, effect=SHIELD_EFFECT)


def _cover(world: World, area: AreaEffect) -> None:
    """Follow the Sentry, and every period cover its owner's units around it; structures are not covered."""
    sentry = world.slot_of(area.source)
    if sentry == NOBODY or buffs.has(world, sentry, SCRAMBLED):
        area.end = world.loop
        return
    area.points = [_place(world, sentry)]
    period = number(world.catalog.ability(area.ability), "period_loops")
    if (world.loop - area.begun) % period or world.carrier[sentry] != NOBODY:
        return
    near = around(world, area.at, area.radius + float(world.radius[sentry]), structures=False)
    for slot in friends(world, near, area.owner):
        buffs.apply(world, slot, SHIELD_BUFF, source=sentry)


def _place(world: World, slot: int) -> tuple[float, float]:
    x, y = world.pos[slot].tolist()
    return x, y


# Force Field ----------------------------------------------------------------------------------------------------------


def _force_field(world: World, cast: Cast) -> None:
    """Put up a wall that no ground unit can pass until it ends or a massive unit breaks it."""
    unit = world.catalog.unit("ForceField")
    point = place_of(world, cast)
    slot = lifecycle.spawn(world, unit, 0, point)
    lasts = number(cast, "duration_loops") + world.rng.random() * number(cast, "random_loops")
    teleport.live_until(world, slot, world.loop + lasts)
    cells = geometry.disc_cells(number(cast, "radius")) + np.floor(point).astype(np.int64)
    world.ground.block(slot, cells)
    _push_out(world, slot)


def _push_out(world: World, field: int) -> None:
    """Move the bodies under a new force field beside it, each to the nearest free place."""
    x, y = world.pos[field].tolist()
    for slot in around(world, (x, y), float(world.radius[field]), plane="ground", structures=False):
        unit = world.unit_type(slot)
        if world.layer_bits[slot] == 0 or "massive" in unit.attributes:
            continue
        ax, ay = world.pos[slot].tolist()
        places = placement.candidates(world, unit, (ax, ay), PUSHED_OUT_RADIUS, ignoring=slot)
        if len(places):
            px, py = places[0].tolist()
            teleport.to(world, slot, (px, py))


def _shatter_near_massive(world: World, slots: list[int]) -> None:
    """Break every force field that a massive ground unit comes near."""
    live = world.live
    massive = live[
        (world.stats.attribute_bits[world.type[live]] & MASSIVE != 0) & (world.plane_bits[live] & GROUND_PLANE != 0)
    ]
    if not massive.size:
        return
    reach = number(world.catalog.ability(FORCE_FIELD), "break_range") + float(world.radius[slots[0]])
    for slot in slots:
        offset = world.pos[massive] - world.pos[slot]
        near = offset[:, 0] ** 2 + offset[:, 1] ** 2 <= (world.radius[massive] + reach) ** 2
        if near.any():
            shatter(world, slot)


def shatter(world: World, slot: int) -> None:
    """End a force field now, as massive units and biles do."""
    world.life[slot] = 0.0
    world.attacker[slot] = NOBODY


# Hallucination --------------------------------------------------------------------------------------------------------


def _hallucinate(world: World, cast: Cast) -> None:
    """Make images that deal no damage, take double and last a while."""
    unit = world.catalog.unit(str(cast.ability.numbers["unit"]))
    for slot in teleport.beside(world, cast.slot, unit, int(number(cast, "count"))):
        make_hallucination(world, slot, number(cast, "duration_loops"))


def make_hallucination(world: World, slot: int, loops: float) -> None:
    """Make a unit an image of itself for a time: it deals no damage, takes double and has no abilities."""
    world.hallucination[slot] = True
    buffs.apply(world, slot, "Hallucination", loops=0)
    buffs.apply(world, slot, "HallucinationTimedLife", loops=loops)
    world.autocast.pop(slot, None)
    teleport.live_until(world, slot, world.loop + loops)
    refresh(world, slot)


SKILLS: Final = {
    "guardian_shield": Skill(
        _guardian_shield,
        estimates=(
            "The shield ends with its Sentry.",
            "It covers a unit whose edge is within the radius, counted from the Sentry's edge.",
        ),
    ),
    "force_field": Skill(
        _force_field,
        estimates=(
            "A force field blocks the three by three cells around its middle.",
            "Units that stand there are beside it at once.",
            "A massive unit breaks it from a distance of 1, edge to edge.",
        ),
    ),
    "hallucination": Skill(_hallucinate, estimates=("Images appear at the nearest free places around the Sentry.",)),
}
AREA_EFFECTS: Final = {"guardian_shield": _cover}
PASSIVES: Final[dict[str, UnitRule]] = {"ForceField": _shatter_near_massive}
