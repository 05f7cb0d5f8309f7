"""Death: units without life leave the world, and both players' scores remember them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities.registry import DEATHS, FINALS
from khala_simulator.combat import lifecycle
from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.world import Death

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.players import SpentResources
    from khala_simulator.world.world import World

NO_KILLER = -1


def bury(world: World) -> None:
    """Remove every unit without life, in the order of slots, and those that their deaths kill in turn."""
    killers: dict[int, int] = {}  # slot of a dying unit -> player, where the killer itself is gone already
    while _count_dead(world):
        c = columns.columns_of(world)
        for slot in [slot for slot in world.live.tolist() if c.life[slot] <= 0.0]:
            _bury(world, slot, killers)


def _count_dead(world: World) -> int:
    """Return how many units are without life."""
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    dead = 0
    for i in range(len(live)):
        dead += c.life[slots[i]] <= 0.0
    return dead


def _bury(world: World, slot: int, killers: dict[int, int]) -> None:
    c = columns.columns_of(world)
    attacker, owner = c.attacker[slot], c.owner[slot]
    killer = c.owner[attacker] if attacker != NOBODY else killers.get(slot, NO_KILLER)
    name = world.unit_type(slot).name
    if name in DEATHS:
        DEATHS[name](world, slot)
    if len(world.buffs):
        _last_of_buffs(world, slot)
    _note(world, slot, killer)
    if _carries(world, slot):
        for passenger in world.passengers(slot):
            world.life[passenger] = 0.0
            _note(world, passenger, killer)
            lifecycle.remove(world, passenger)
    c = columns.columns_of(world)
    for victim in range(world.top):
        if c.attacker[victim] == slot and c.life[victim] <= 0.0:
            killers[victim] = owner
    lifecycle.remove(world, slot)


def _carries(world: World, slot: int) -> bool:
    """Return whether a unit has passengers."""
    c = columns.columns_of(world)
    for other in range(world.top):  # noqa: SIM110  # a loop that is compiled
        if c.carrier[other] == slot:
            return True
    return False


def _last_of_buffs(world: World, slot: int) -> None:
    """Run the last effect of a dying unit's buffs."""
    for row in world.buffs.of(slot):
        rule = FINALS.get(world.catalog.buffs[int(row["buff"])].name)
        if rule is not None:
            rule(world, slot, row)


def _note(world: World, slot: int, killer: int) -> None:
    """Remember a death, and enter it into the scores unless it was a hallucination's."""
    owner = int(world.owner[slot])
    unit = world.unit_type(slot)
    world.deaths.append(Death(world.loop, world.tag_of(slot), unit.id, owner, killer))
    if not world.hallucination[slot]:
        _count(world, unit, owner, killer)


def _count(world: World, unit: UnitType, owner: int, killer: int) -> None:
    """Enter a death into the scores of the loser and of the killer, if it was an enemy."""
    if unit.no_score:
        return
    lost = world.players[owner].score
    _add(lost.lost, unit)
    if unit.structure:
        lost.lost_structures += 1
    else:
        lost.lost_units += 1
    if killer in (NO_KILLER, owner):
        return
    won = world.players[killer].score
    _add(won.killed, unit)
    if unit.structure:
        won.killed_structures += 1
        won.killed_value_structures += unit.score_kill
    else:
        won.killed_units += 1
        won.killed_value_units += unit.score_kill


def _add(spent: SpentResources, unit: UnitType) -> None:
    """Add a unit's price to its category: workers and town halls are economy, other structures technology."""
    if unit.worker or (unit.structure and unit.provides > 0 and "structure" in unit.attributes):
        category = spent.economy
    else:
        category = spent.technology if unit.structure and not unit.weapons else spent.army
    category[0] += unit.cost[0]
    category[1] += unit.cost[1]
