"""Triggers: the map's own script, as its scenario tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import commands
from simulator.players import GameResult, PlayerSetup
from simulator.scenario import At, Create, Every, Order, Result
from simulator.systems.placement import free_places

if TYPE_CHECKING:
    from simulator.maps import GameMap
    from simulator.scenario import Action, Condition, CreateSpec, OrderSpec, Trigger
    from simulator.world import World

OUTCOMES = {"victory": GameResult.VICTORY, "defeat": GameResult.DEFEAT, "tie": GameResult.TIE}


def players_of(game_map: GameMap) -> list[PlayerSetup]:
    """The players as the scenario seats them."""
    return [PlayerSetup(i, p.race, p.control) for i, p in sorted(game_map.scenario.players.items())]


def start(world: World) -> None:
    """Run the triggers of the map's start."""
    _run(world, [t for t in world.map.scenario.triggers if "start" in t.when])


def run(world: World) -> None:
    """Run the triggers that are due at this loop, in the scenario's order, until one ends the game."""
    died = world.deaths_seen < len(world.deaths)
    world.deaths_seen = len(world.deaths)
    scenario = world.map.scenario
    if died or world.loop in scenario.moments or any(world.loop % period == 0 for period in scenario.periods):
        _run(world, [t for t in scenario.triggers if _is_due(t, world.loop, died)])


def _is_due(trigger: Trigger, loop: int, died: bool) -> bool:
    for when in trigger.when:
        if isinstance(when, Every):
            if loop % when.every_loops == 0:
                return True
        elif isinstance(when, At):
            if loop == when.at_loop:
                return True
        elif when == "unit_died" and died:
            return True
    return False


def _run(world: World, triggers: list[Trigger]) -> None:
    for trigger in triggers:
        if trigger.condition is None or _holds(world, trigger.condition):
            for action in trigger.do:
                _act(world, action)
                if world.ended:
                    return


def _holds(world: World, condition: Condition) -> bool:
    return all((len(world.units_of(p)) > 0) == (wanted == "some") for p, wanted in condition.alive.items())


def _act(world: World, action: Action) -> None:
    if isinstance(action, Create):
        _create(world, action.create)
    elif isinstance(action, Order):
        _order(world, action.order)
    elif isinstance(action, Result):
        world.end({player: OUTCOMES[outcome] for player, outcome in action.result.items()})


def _create(world: World, spec: CreateSpec) -> None:
    unit = world.catalog.unit(spec.unit)
    point = world.map.scenario.place(spec.at)
    for place in free_places(world, unit, point, spec.count):
        world.spawn(unit, spec.player, place, spec.facing)


def _order(world: World, spec: OrderSpec) -> None:
    slots = world.units_of(spec.player).tolist()
    scenario = world.map.scenario
    if spec.attack_move is not None:
        commands.attack_move(world, slots, scenario.place(spec.attack_move))
    elif spec.move is not None:
        commands.move(world, slots, scenario.place(spec.move))
    elif spec.attack_units_of is not None:
        victims = world.units_of(spec.attack_units_of)
        for slot in slots:
            offset = world.pos[victims] - world.pos[slot]
            nearest_first = victims[np.argsort(offset[:, 0] ** 2 + offset[:, 1] ** 2, kind="stable")]
            for rank, victim in enumerate(nearest_first.tolist()):
                commands.attack_unit(world, [slot], world.tag_of(victim), queue=rank > 0)
