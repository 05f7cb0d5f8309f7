"""Lifetimes: units whose life is timed die when it is over, without a killer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.numeric.arrays import which
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def run_out(world: World) -> None:
    """Take the life of every unit whose time has come."""
    if not world.mortal:
        return
    n = world.top
    over = which((world.expires[:n] > 0) & (world.expires[:n] <= world.loop) & (world.life[:n] > 0.0))
    if over.size:
        world.life[over] = 0.0
        world.attacker[over] = NOBODY
