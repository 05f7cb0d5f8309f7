"""One thought of a computer player, as a table of contents.

It acts only through the orders that every client has (``hands``) and pays what they cost. What it keeps in mind is the
player's ``mind``, part of the world's digest; every choice follows from the world and its seed. Above:
``systems.opponents``. Below: the modules of this package.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.opponent import army, bases, boosts, casts, drops, economy, hands, scouting, spending
from khala_simulator.opponent.build_file import load_race, name_of
from khala_simulator.opponent.economy import Staff
from khala_simulator.opponent.enemy import Enemy
from khala_simulator.opponent.side import OwnSide
from khala_simulator.world.opponent_memory import OpponentMemory

if TYPE_CHECKING:
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

PATIENCE: Final = 0.1
"""By this share of the time since its opening a player is early or late, drawn from the seed."""


def think(world: World, player: int) -> None:
    """Play one turn of a computer player."""
    if world.players[player].mind is None:
        world.players[player].mind = begin(world, player)
    side = OwnSide(world, player)
    if not side.slots.size:
        return
    enemy = Enemy(side)
    hands.rest(side)
    tax(side)
    casts.cast(side, enemy)
    army.lead(side, enemy)
    drops.lead(side, enemy)
    staff = Staff(side)
    economy.mine(side, staff)
    spending.spend(side, enemy, staff)
    boosts.boost(side)
    scouting.look(side)


def begin(world: World, player: int) -> OpponentMemory:
    """Return the memory with which a player begins: its build, and what the map says."""
    owner = world.players[player]
    draws = np.random.default_rng([world.seed, player]).random(2).tolist()
    places = bases.find(world, player, world.catalog.unit(load_race(owner.race).hall))
    own = owner.start or next(iter(places), None) or _middle(world, player)
    starts = [place for place in world.map.scenario.start_locations if math.dist(place, own) > 1.0]
    return OpponentMemory(
        build=name_of(owner.build, draws[0]),
        patience=1.0 + PATIENCE * (2.0 * draws[1] - 1.0),
        bases=(own, *(place for place in places if place != own)),
        resources=bases.resources(world),
        enemy_start=min(starts, default=own),
    )


def _middle(world: World, player: int) -> Point:
    """Return the middle of a player's units, or of the map: where it is at home if the map does not say it."""
    slots = world.units_of(player)
    x0, y0, x1, y1 = world.map.terrain.playable
    x, y = world.pos[slots].mean(axis=0).tolist() if slots.size else ((x0 + x1) / 2, (y0 + y1) / 2)
    return x, y


def tax(side: OwnSide) -> None:
    """Give a player that cheats by income its extra on what its workers have delivered since."""
    collected, taxed = side.owner.score.collected, side.mind.taxed
    extra = side.level.income - 1.0
    side.owner.minerals += extra * (collected[0] - taxed[0])
    side.owner.vespene += extra * (collected[1] - taxed[1])
    side.mind.taxed = list(collected)
