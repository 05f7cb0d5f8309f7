"""Infantry: stimpacks, concussive shells and the Reaper's charge.

The Reaper's leaps are in ``pathfinding``; its regeneration out of combat and combat shields are numbers in the tables.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared.basics import on_self
from khala_simulator.abilities.skill import Skill, around, lay, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.movement import pathfinding
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

# stimpack -------------------------------------------------------------------------------------------------------------


def _stim(world: World, cast: Cast) -> None:
    """Walk and fire faster for a time, at a cost in life."""
    on_self("Stimpack")(world, cast)


def _stim_marauder(world: World, cast: Cast) -> None:
    """Walk and fire faster for a time, at a cost in life."""
    on_self("StimpackMarauder")(world, cast)


# concussive shells ----------------------------------------------------------------------------------------------------

SHELLS: Final = "PunisherGrenades"


def _slow(world: World, source: int, owner: int, victim: int) -> None:
    """Slow units that a grenade hits when its owner has the shells; no massive ones and no structures."""
    unit = world.unit_type(victim)
    researched = world.catalog.upgrade(SHELLS).id in world.players[owner].upgrades
    if (
        researched
        and not unit.structure
        and "massive" not in unit.attributes
        and not buffs.has(world, victim, "Frenzy")
    ):
        buffs.apply(world, victim, "Slow", source=source, owner=owner)


# KD8 charge -----------------------------------------------------------------------------------------------------------

STAYS_PUT: Final = frozenset(
    {"Larva", "Egg", "BanelingCocoon", "BroodLordCocoon", "RavagerCocoon", "LurkerMPEgg", "TransportOverlordCocoon"}
)
UNTOUCHED: Final = frozenset({"DisruptorPhased", "AdeptPhaseShift"})
STEP_TESTED: Final = 0.25


def _throw_charge(world: World, cast: Cast) -> None:
    """Throw a charge that goes off after its fuse, hurts all ground units around it and throws them outwards."""
    point = place_of(world, cast)
    fuse = number(cast, "fuse_loops")
    owner = int(world.owner[cast.slot])
    charge = lifecycle.spawn(world, world.catalog.unit("KD8Charge"), owner, point)
    lay(world, cast, "kd8_charge", end=world.loop + fuse, due=world.loop + fuse).target = world.tag_of(charge)


def _explode(world: World, charge: AreaEffect) -> None:
    """Hurt every ground unit around a charge, friends as well, and throw them outwards."""
    ability = world.catalog.ability(charge.ability)
    source = world.slot_of(charge.source)
    body = world.slot_of(charge.target)
    for slot in around(world, charge.at, charge.radius, plane="ground"):
        if world.unit_type(slot).name not in UNTOUCHED:
            apply_damage(world, source, charge.owner, slot, number(ability, "damage"))
            _throw(world, charge, slot)
    if body != NOBODY:
        world.life[body] = 0.0
        world.attacker[body] = NOBODY


def _throw(world: World, charge: AreaEffect, slot: int) -> None:
    unit = world.unit_type(slot)
    firm = unit.structure or "massive" in unit.attributes or bool(world.burrowed[slot]) or unit.name in STAYS_PUT
    if firm or world.life[slot] <= 0.0 or buffs.has(world, slot, "Frenzy"):
        return
    ability = world.catalog.ability(charge.ability)
    loops = MECHANICS.knockback_loops
    buffs.apply(world, slot, "ReaperKD8Knockback", owner=charge.owner, loops=loops)
    (x, y), (from_x, from_y) = world.pos[slot].tolist(), charge.at
    away = math.hypot(x - from_x, y - from_y)
    across, along = ((x - from_x) / away, (y - from_y) / away) if away > 0.0 else (1.0, 0.0)
    step = number(ability, "knockback_distance") / loops
    world.area_effects.append(
        AreaEffect(
            "knockback",
            owner=charge.owner,
            points=[(x, y)],
            radius=0.0,
            begun=world.loop,
            end=world.loop + loops,
            due=world.loop + 1,
            target=world.tag_of(slot),
            memory={"dx": across * step, "dy": along * step},
        )
    )


def _fly_back(world: World, item: AreaEffect) -> None:
    """Carry a thrown unit on, until ground that it can't walk on is in its way."""
    slot = world.slot_of(item.target)
    if slot == NOBODY or world.carrier[slot] != NOBODY:
        item.end = world.loop
        return
    x, y = world.pos[slot].tolist()
    goal = x + item.memory["dx"], y + item.memory["dy"]
    surface = pathfinding.surface(world.ground, Layer(int(world.layer[slot])))
    there = world.pos[slot] * 0.0 + goal
    if not surface.flat[surface.cell(there[None])][0]:
        item.end = world.loop
        return
    world.pos[slot] = world.guard[slot] = there
    world.nav_loop[slot] = 0
    world.resting_version = -1


SKILLS: Final = {
    "stimpack": Skill(_stim),
    "stimpack_marauder": Skill(_stim_marauder),
    "kd8_charge": Skill(
        _throw_charge,
        estimates=(
            "A KD8 charge lies at its place at once; in the game it is thrown there.",
            "A thrown unit moves evenly for a fixed time and stops at the first cell that it can't walk on.",
        ),
    ),
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"kd8_charge": _explode, "knockback": _fly_back}
IMPACTS: Final[dict[str, Callable[[World, int, int, int], None]]] = {"PunisherGrenadesU": _slow}
