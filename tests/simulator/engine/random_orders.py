"""Play a map with random orders, and print the world's digest: run by tests, some in processes of their own.

    python random_orders.py MAP SEED LOOPS

Every few loops some units of each player get an order that they can carry out now, at any target. Fails when a unit
leaves the map or a number becomes NaN or infinite.
"""

from __future__ import annotations

import random
import sys

import numpy as np

from khala_simulator.api import abilities, giving
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import load_map
from khala_simulator.movement.placement import free_places
from khala_simulator.systems.triggers import players_of
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tick import advance, new_game
from khala_simulator.world.world import World

FIELD = "llm_smac/corridor"
EVERY = 8
ORDERS = 6


def give_orders(world: World, chance: random.Random) -> None:
    """Give some orders to some units of each player, as a client would."""
    for player in range(1, len(world.players)):
        mine = world.units_of(player).tolist()
        for _ in range(min(ORDERS, len(mine))):
            slot = chance.choice(mine)
            usable = abilities.usable(world, slot)
            if usable:
                _give(world, player, slot, chance.choice(usable).id, chance)


def _give(world: World, player: int, slot: int, ability: int, chance: random.Random) -> None:
    aims = [aim for aim in AbilityAim if aim & world.catalog.ability(ability).aim]
    aim = chance.choice(aims)
    target, point = 0, None
    if aim is AbilityAim.UNIT:
        target = world.tag_of(chance.choice(world.live.tolist()))
    elif aim is AbilityAim.POINT:
        x, y = world.pos[slot].tolist()
        point = (x + chance.uniform(-9, 9), y + chance.uniform(-9, 9))
    queue = chance.random() < 0.2
    command = abilities.UnitCommand(ability, (world.tag_of(slot),), target, point, queue)
    giving.carry_out(world, abilities.judge(world, player, command))


def check(world: World) -> None:
    """Check that no unit is off the map, and that every number is finite."""
    width, height = world.map.terrain.size
    pos = world.pos[world.live]
    assert np.isfinite(pos).all()
    assert (pos >= 0).all()
    assert (pos <= (width, height)).all()
    for column in (world.life, world.shields, world.energy, world.cooldown, world.step_max, world.speed):
        assert np.isfinite(column[world.live]).all()
    assert (world.life[world.live] > 0).all()
    assert (world.energy[world.live] >= 0).all()


def play(world: World, seed: int, loops: int) -> World:
    """Play at most ``loops`` loops with random orders; every debug state that allows more is on."""
    chance = random.Random(seed)
    for player in world.players[1:]:
        player.cheats += ["tech_tree", "cooldown"]
        player.minerals = player.vespene = 5000.0
    while world.loop < loops and not world.ended:
        if world.loop % EVERY == 0:
            give_orders(world, chance)
        advance(world)
        check(world)
    return world


def crowd(units: int, seed: int) -> World:
    """Return a world with so many units a side, of any types that walk or fly, on a map with walls."""
    world, chance = World(load_map(FIELD), players_of(load_map(FIELD)), seed=seed), random.Random(seed)
    kinds = [kind for kind in world.catalog.units if kind.supply > 0]
    x0, y0, x1, y1 = world.map.terrain.playable
    for player in (1, 2):
        home = (chance.uniform(x0, x1), chance.uniform(y0, y1))
        for kind in chance.choices(kinds, k=units):
            lifecycle.spawn(world, kind, player, free_places(world, kind, home, 1)[0])
    return world


if __name__ == "__main__":
    name, seed, loops = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    played = play(new_game(load_map(name), seed=seed), seed, loops)
    sys.stdout.write(f"{played.loop} {played.digest()}\n")
