"""Triggers: the map's own script, as its scenario defines it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.economy import melee_start
from khala_simulator.maps.script import At, Died, Enters, Every, Made, Touches
from khala_simulator.systems import staging
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.players import NEUTRAL, PlayerSetup

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.maps.script import Condition, EnterSpec, NumberCondition, TouchSpec, Trigger, When, Who
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import Death, World

FINISHED = 1.0


def players_of(game_map: GameMap) -> list[PlayerSetup]:
    """Return the players as the scenario seats them; one with an open slot is led by the computer."""
    seats = sorted(game_map.scenario.players.items())
    return [PlayerSetup(i, p.race, "agent" if p.control == "agent" else "computer") for i, p in seats]


def start(world: World) -> None:
    """Set up the map and run the triggers of its start."""
    staging.set_up(world)
    for number, trigger in enumerate(world.map.scenario.triggers):
        for when in trigger.when:
            if isinstance(when, Enters):
                world.script.inside[number] = _inside(world, when.enters)
        if "start" in trigger.when and _holds(world, trigger.condition):
            _do(world, trigger, NOBODY)
        if world.ended:
            return
    if world.map.scenario.watches:
        world.script.made.update(world.tag[world.live].tolist())


def run(world: World) -> None:
    """Run the triggers that are due at this loop, in the scenario's order, until one ends the game."""
    if len(world.deaths) == world.deaths_seen and not world.watches and not _is_time(world):
        return
    scenario = world.map.scenario
    deaths = world.deaths[world.deaths_seen :]
    world.deaths_seen = len(world.deaths)
    for number, trigger in enumerate(scenario.triggers):
        for subject in _occasions(world, number, trigger, deaths):
            if _holds(world, trigger.condition):
                _do(world, trigger, subject)
            if world.ended:
                return
    if deaths and scenario.melee and scenario.elimination:
        melee_start.judge(world)


def _is_time(world: World) -> bool:
    """Return whether this loop is one at which a trigger is due."""
    if world.loop in world.moments:
        return True
    for period in world.periods:  # noqa: SIM110  # a generator costs more than the question
        if world.loop % period == 0:
            return True
    return False


def _do(world: World, trigger: Trigger, subject: int) -> None:
    for action in trigger.do:
        staging.act(world, action, subject)
        if world.ended:
            return


# when -----------------------------------------------------------------------------------------------------------------


def _occasions(world: World, number: int, trigger: Trigger, deaths: list[Death]) -> Iterator[int]:
    """Yield the unit of each occasion on which the trigger is due in this loop, NOBODY for none in particular."""
    plain = False
    for when in trigger.when:
        if isinstance(when, Died):
            yield from (NOBODY for death in deaths if _is_meant(world, death, when.died))
        elif isinstance(when, Made):
            yield from _note_made(world, when.made)
        elif isinstance(when, Touches):
            yield from _touched_units(world, when.touches)
        elif isinstance(when, Enters):
            plain |= _note_entry(world, number, when.enters)
        else:
            plain |= _is_due(when, world.loop, bool(deaths))
    if plain:
        yield NOBODY


def _is_due(when: When, loop: int, died: bool) -> bool:
    if isinstance(when, Every):
        return loop % when.every_loops == 0
    if isinstance(when, At):
        return loop == when.at_loop
    return when == "unit_died" and died


def _is_meant(world: World, death: Death, who: Who) -> bool:
    fits = who.player is None or death.owner == who.player
    return fits and (who.unit is None or death.type_id == world.catalog.unit(who.unit).id)


def _note_made(world: World, who: Who) -> Iterator[int]:
    slots = staging.units_like(world, who)
    finished = slots[world.build_progress[slots] >= FINISHED]
    for slot in finished.tolist():
        if world.tag_of(slot) not in world.script.made:
            world.script.made.add(world.tag_of(slot))
            yield slot


def _inside(world: World, spec: EnterSpec) -> frozenset[int]:
    """Return the tags of the units in the region that the trigger is about."""
    slots = world.live[world.owner[world.live] != NEUTRAL]
    if spec.player is not None:
        slots = slots[world.owner[slots] == spec.player]
    if spec.unit is not None:
        slots = slots[world.type[slots] == world.catalog.unit(spec.unit).row]
    region = world.map.scenario.regions[spec.region]
    return frozenset(world.tag[slots[region.covers(world.pos[slots])]].tolist())


def _note_entry(world: World, number: int, spec: EnterSpec) -> bool:
    before = world.script.inside.get(number, frozenset())
    now = _inside(world, spec)
    world.script.inside[number] = now
    return not now <= before


def _touched_units(world: World, spec: TouchSpec) -> Iterator[int]:
    """Yield slots of the touched neutral units; each is checked again, because it may be gone by then."""
    row = world.catalog.unit(spec.unit).row
    mine = world.units_of(spec.player)
    neutral = world.live[(world.owner[world.live] == NEUTRAL) & (world.type[world.live] == row)]
    if not (mine.size and neutral.size):
        return
    offset = world.pos[neutral][:, None] - world.pos[mine]
    near = ((offset**2).sum(axis=2) <= spec.within**2).any(axis=1)
    for slot in neutral[near].tolist():
        if world.alive[slot] and world.type[slot] == row:
            yield slot


# if -------------------------------------------------------------------------------------------------------------------


def _holds(world: World, condition: Condition | None) -> bool:
    if condition is None:
        return True
    alive = condition.alive.items()
    return (
        all((len(world.units_of(player)) > 0) == (wanted == "some") for player, wanted in alive)
        and _counts(world, condition.count.items(), FINISHED)
        and _counts(world, condition.count_unfinished.items(), 0.0)
        and all(asked.holds(_score(world, player)) for player, asked in condition.score.items())
        and (not condition.any or any(_holds(world, other) for other in condition.any))
    )


def _score(world: World, player: int) -> float:
    """Return the curriculum score of a player; an absent player has none."""
    return world.players[player].score.curriculum if player < len(world.players) else 0.0


def _counts(world: World, asked: Iterable[tuple[int, dict[str, NumberCondition]]], least: float) -> bool:
    """Return whether every number of units of a type fits, among those that are finished to at least ``least``."""
    for player, types in asked:
        slots = _units_owned(world, player, least)
        rows = np.bincount(world.type[slots], minlength=len(world.catalog.units))
        for name, comparison in types.items():
            if not comparison.holds(int(rows[world.catalog.unit(name).row])):
                return False
    return True


def _units_owned(world: World, player: int, least: float) -> Ints:
    """Return the slots of all of a player's units, with passengers, without hallucinations."""
    mine = world.alive & (world.owner == player) & (world.build_progress >= least) & ~world.hallucination
    slots: Ints = np.flatnonzero(mine)
    return slots
