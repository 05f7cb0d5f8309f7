"""One game loop, as a table of contents: the systems of the world in the order in which they run.

Each system is a function of the world and the only place of its rule. Above: the game, which advances it. Below: one
file of ``systems`` per line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

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
    from collections.abc import Callable, Sequence

    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.players import PlayerSetup

engine.check()

SYSTEMS: Final[tuple[Callable[[World], None], ...]] = (
    death.bury,  # what a debug command killed since the last loop
    opponents.run,  # computer players give their orders
    orders.carry_out,  # finished orders end, queued ones begin
    acquire.choose_targets,  # units choose their targets
    autocast.look_out,  # units use abilities with autocast
    engagement.measure,  # which units are in reach of their target, and where each wants to walk
    power.run,  # which structures have power
    construction.run,  # what is being built
    casts.carry_on,  # abilities are prepared, take effect, go on
    death.bury,  # what an ability killed at once: it makes, mines and hits nothing more
    production.run,  # queues of structures and eggs
    harvest.run,  # workers take, deliver and come again
    passives.run,  # what units do by their nature
    weapons.fire,  # attacks start, take effect, cool down
    navigation.find_ways,  # the next corner on the way to every goal
    avoidance.find_headings,  # around bodies in the way
    movement.move,  # steps, turning, acceleration
    collision.separate,  # bodies and walls
    missiles.fly,
    sweeps.run,  # lines of hits in progress
    hits.fall_due,
    area_effects.run,  # storms, scans and other effects on the ground
    buffs.run_out,
    idleness.count,
    regeneration.regenerate,
    creep.spread,
    lifetimes.run_out,
    death.bury,
    vision.look,
    triggers.run,  # the map's own script, which may end the game
)


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


def advance(world: World, loops: int = 1, systems: Sequence[Callable[[World], None]] | None = None) -> int:
    """Advance by up to ``loops`` game loops; return how many, fewer when the game ends on the way.

    ``systems`` are ``SYSTEMS`` unless the caller, such as a test, names others.
    """
    chosen = SYSTEMS if systems is None else systems
    for done in range(loops):
        if world.ended:
            return done
        world.loop += 1
        for system in chosen:
            system(world)
    return loops
