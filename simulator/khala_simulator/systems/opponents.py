"""Opponents: computer players of melee games think, each in its own loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.opponent import player as computer
from khala_simulator.opponent.levels import level_of

if TYPE_CHECKING:
    from khala_simulator.world.world import World

RACES = ("protoss", "terran", "zerg")


def run(world: World) -> None:
    """Make every computer player that leads a side think when its time has come."""
    if world.opponents is None:
        world.opponents = tuple(_led(world))
    for player in world.opponents:
        if (world.loop + player) % level_of(world.players[player].difficulty).think_loops == 0:
            computer.think(world, player)


def _led(world: World) -> list[int]:
    """Return the computer players that the scenario leaves to the game's own."""
    specs = world.map.scenario.players
    return [
        player.id for player in world.players[1:]
        if player.control == "computer" and player.race in RACES and player.id in specs
        and specs[player.id].ai == "melee"
    ]  # fmt: skip
