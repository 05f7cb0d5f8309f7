"""One game loop, as a table of contents: the systems of the world in the order in which they run.

Each system is a function of the world and the only place of its rule. Above: the game, which advances it. Below: one
file of ``systems`` per line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.native import engine
from khala_simulator.systems import (
    acquire,
    area_effects,
    autocast,
    avoidance,
    buffs,
    casts,
    collision,
    construction,
    creep,
    death,
    engagement,
    harvest,
    hits,
    idleness,
    lifetimes,
    missiles,
    movement,
    navigation,
    opponents,
    orders,
    passives,
    power,
    production,
    regeneration,
    sweeps,
    triggers,
    vision,
    weapons,
)
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.players import PlayerSetup

engine.check()


def new_game(
    game_map: GameMap,
    players: Sequence[PlayerSetup] = (),
    *,
    seed: int = 0,
    catalog: Catalog | None = None,
    fog: bool = True,
) -> World:
    """Return a world at loop 0 in which the map's script has run its start.

    Args:
        game_map: MapTerrain and scenario.
        players: The players in the slots; by default as the scenario says.
        seed: The seed of every random draw of the game.
        catalog: The tables of a game version; 4.10 by default.
        fog: False lifts the fog of the map.
    """
    world = World(game_map, players or triggers.players_of(game_map), seed=seed, catalog=catalog, fog=fog)
    triggers.start(world)
    creep.spread(world)
    vision.look(world)
    return world


def play_loop(world: World, *, fights: bool = True) -> None:
    """Play one game loop: every system in turn.

    Args:
        world: The world.
        fights: Whether units pick fights by themselves; False is for tests of what else they do.
    """
    world.loop += 1
    death.bury(world)  # what a debug command killed since the last loop
    opponents.run(world)  # computer players give their orders
    orders.carry_out(world)  # finished orders end, queued ones begin
    if fights:
        acquire.choose_targets(world)  # units choose their targets
    autocast.look_out(world)  # units use abilities with autocast
    engagement.measure(world)  # which units are in reach of their target, and where each wants to walk
    power.run(world)  # which structures have power
    construction.run(world)  # what is being built
    casts.carry_on(world)  # abilities are prepared, take effect, go on
    death.bury(world)  # what an ability killed at once: it makes, mines and hits nothing more
    production.run(world)  # queues of structures and eggs
    harvest.run(world)  # workers take, deliver and come again
    passives.run(world)  # what units do by their nature
    weapons.fire(world)  # attacks start, take effect, cool down
    navigation.find_ways(world)  # the next corner on the way to every goal
    avoidance.find_headings(world)  # around bodies in the way
    movement.move(world)  # steps, turning, acceleration
    collision.separate(world)  # bodies and walls
    missiles.fly(world)
    sweeps.run(world)  # lines of hits in progress
    hits.fall_due(world)
    area_effects.run(world)  # storms, scans and other effects on the ground
    buffs.run_out(world)
    idleness.count(world)
    regeneration.regenerate(world)
    creep.spread(world)
    lifetimes.run_out(world)
    death.bury(world)
    vision.look(world)
    triggers.run(world)  # the map's own script, which may end the game


def advance(world: World, loops: int = 1, *, fights: bool = True) -> int:
    """Play up to ``loops`` game loops; return how many, fewer when the game ends on the way."""
    for done in range(loops):
        if world.ended:
            return done
        play_loop(world, fights=fights)
    return loops
