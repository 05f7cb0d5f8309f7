"""Boosts of the economy: MULEs, the Queens' larvae, and Chrono Boost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import casting
from khala_simulator.opponent import bases, hands
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.opponent.side import OwnSide

INJECT: Final = 251
MULE: Final = 171
CHRONO: Final = 3755
NEAR: Final = 9.0


def boost(side: OwnSide) -> None:
    """Use what the race has to make the economy faster."""
    if "boosts" in side.level.skills:
        BOOSTS[side.owner.race](side)


def _inject(side: OwnSide) -> None:
    """Make each Queen with the energy spit larvae on the nearest town hall that has none waiting."""
    world = side.world
    ability = world.catalog.ability(INJECT)
    injected = set(world.buffs.rows["slot"].tolist()) if len(world.buffs) else set()
    queens = [q for q in side.of_type("Queen") if world.energy[q] >= ability.energy and not world.casts[q]]
    for hall in side.halls:
        if not queens or hall in injected:
            continue
        at = side.place(hall)
        queen = min(queens, key=lambda q: (float(((world.pos[q] - at) ** 2).sum()), q))
        if hands.use(side, [queen], ability, target=world.tag_of(hall)):
            queens.remove(queen)


def _mule(side: OwnSide) -> None:
    """Call a MULE down on a field of a base from every Orbital Command with the energy."""
    world = side.world
    ability = world.catalog.ability(MULE)
    for orbital in side.of_type("OrbitalCommand"):
        if world.energy[orbital] < ability.energy:
            continue
        fields = [f for hall in side.halls for f in bases.fields_near(world, side.place(hall))]
        if fields:
            fullest = max(fields, key=lambda f: (world.contents[f], -f))
            hands.use(side, [orbital], ability, target=world.tag_of(fullest))


def _chrono(side: OwnSide) -> None:
    """Speed up busy structures: research first, then producers, then workers."""
    world = side.world
    ability = world.catalog.ability(CHRONO)
    for nexus in side.of_type("Nexus"):
        if casting.refusal(world, nexus, ability) is not ActionResult.SUCCESS:
            continue
        boosted = set(world.buffs.rows["slot"].tolist()) if len(world.buffs) else set()
        busy = [s for s in sorted(world.jobs) if world.owner[s] == side.player and s not in boosted]
        if not busy:
            return
        target = max(busy, key=lambda s: (world.jobs[s][0].kind == "research", s in side.halls, -s))
        hands.use(side, [nexus], ability, target=world.tag_of(target))


BOOSTS: Final[dict[str, Callable[[OwnSide], None]]] = {"zerg": _inject, "terran": _mule, "protoss": _chrono}
