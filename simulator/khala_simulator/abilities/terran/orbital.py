"""Orbital commands: scanner sweep, MULE and extra supplies. ``harvesting`` has what a MULE does then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from khala_simulator.abilities.skill import AreaEffectRule, BuffRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

SWEEP: Final = 6  # the API's ScannerSweep

# scanner sweep --------------------------------------------------------------------------------------------------------


def _sweep(world: World, cast: Cast) -> None:
    """Reveal everything in a circle anywhere on the map for a while, also cloaked or burrowed units."""
    lasts, radius = number(cast, "duration_loops"), number(cast, "radius")
    world.area_effects.append(
        AreaEffect(
            "scanner_sweep",
            owner=int(world.owner[cast.slot]),
            points=[place_of(world, cast)],
            radius=radius,
            begun=world.loop,
            end=world.loop + lasts,
            effect=SWEEP,
            due=world.loop + lasts,
            ability=cast.ability.id,
            sights=radius,
            detects=True,
        )
    )
    world.looked_at = -1


# MULE -----------------------------------------------------------------------------------------------------------------

SEEN: Final = 2


def _can_call(world: World, cast: Cast) -> ActionResult:
    """Refuse units that hold no minerals, and places that the player does not see now."""
    target = cast.target
    if target != NOBODY and world.unit_type(target).resource != "minerals":
        return ActionResult.MUST_TARGET_RESOURCES
    x, y = place_of(world, cast)
    seen = not world.fog or world.visibility[int(world.owner[cast.slot]), int(y), int(x)] == SEEN
    return ActionResult.SUCCESS if seen else ActionResult.MUST_TARGET_VISIBLE_LOCATION


def _call_mule(world: World, cast: Cast) -> None:
    """Drop a MULE, which mines as long as it lives."""
    falls = number(cast, "delay_loops")
    world.area_effects.append(
        AreaEffect(
            "calldown_mule",
            owner=int(world.owner[cast.slot]),
            points=[place_of(world, cast)],
            radius=0.0,
            begun=world.loop,
            end=world.loop + falls,
            due=world.loop + falls,
            ability=cast.ability.id,
            target=world.tag_of(cast.target) if cast.target != NOBODY else 0,
        )
    )


def _land_mule(world: World, item: AreaEffect) -> None:
    ability = world.catalog.ability(item.ability)
    unit = world.catalog.unit(str(ability.numbers["unit"]))
    mule = lifecycle.spawn(world, unit, item.owner, free_places(world, unit, item.at, 1)[0])
    lasts = number(ability, "duration_loops") + world.rng.random() * number(ability, "duration_random_loops")
    teleport.live_until(world, mule, world.loop + lasts)
    if world.slot_of(item.target) != NOBODY and item.target:
        commands.smart(world, [mule], target=item.target)


def _expire(world: World, slot: int) -> None:
    """Tell the owner of a MULE whose time is over."""
    if world.expires[slot] <= world.loop:
        world.alert(int(world.owner[slot]), "MULEExpired")


# extra supplies -------------------------------------------------------------------------------------------------------

DEPOTS: Final = frozenset({"SupplyDepot", "SupplyDepotLowered"})
ON_ITS_WAY: Final = "SupplyDropEnRoute"
DROPPED: Final = "SupplyDrop"


def _is_plain_depot(world: World, cast: Cast) -> ActionResult:
    slot = cast.target
    depot = slot != NOBODY and world.unit_type(slot).name in DEPOTS
    taken = depot and any(buffs.has(world, slot, name) for name in (ON_ITS_WAY, DROPPED))
    return ActionResult.SUCCESS if depot and not taken else ActionResult.CANT_TARGET_THAT_UNIT


def _drop_supplies(world: World, cast: Cast) -> None:
    """Make a depot provide more supply from a moment later on."""
    buffs.apply(world, cast.target, ON_ITS_WAY, source=cast.slot, loops=number(cast, "delay_loops"))


def _arrive(world: World, slot: int, row: np.void) -> None:
    buffs.apply(world, slot, DROPPED, owner=int(row["owner"]))


SKILLS: Final = {
    "scanner_sweep": Skill(_sweep),
    "calldown_mule": Skill(
        _call_mule,
        refuse=_can_call,
        estimates=(
            "A MULE is in the world from the moment it lands, at the free place nearest to where it was called.",
        ),
    ),
    "supply_drop": Skill(_drop_supplies, refuse=_is_plain_depot),
}
DEATHS: Final[dict[str, Callable[[World, int], None]]] = {"MULE": _expire}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"calldown_mule": _land_mule}
ENDS: Final[dict[str, BuffRule]] = {ON_ITS_WAY: _arrive}
