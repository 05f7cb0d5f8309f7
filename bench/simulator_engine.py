"""How many game loops per second the simulator's engine plays, without the SC2 API around it.

Each shipped map is played with both sides on attack-move, restarted with the next seed when it ends; then armies of 10
to 400 units meet on an open map. Run ``python -m bench.simulator_engine``, with ``--json`` for one JSON object.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from functools import partial
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from simulator import commands
from simulator.maps import load_map, map_names
from simulator.systems.placement import free_places
from simulator.systems.triggers import players_of
from simulator.tick import advance, new_game
from simulator.world import World

if TYPE_CHECKING:
    from collections.abc import Callable

LOOPS_PER_STEP = 8
ARMY_SIZES = (10, 20, 50, 100, 200, 400)


def battle(name: str, seed: int) -> World:
    """A game on a shipped map in which player 1 attacks too."""
    world = new_game(load_map(name), seed=seed)
    x, y = world.pos[world.units_of(2)].mean(axis=0)
    commands.attack_move(world, world.units_of(1).tolist(), (float(x), float(y)))
    return world


def armies(units: int, seed: int) -> World:
    """Two armies of Marines, Zealots and Stalkers on an open map, each on attack-move to the other's place."""
    field = load_map("llm_smac/3s_vs_3z")
    world = World(field, players_of(field), seed=seed)  # without the map's own script, which would end it
    homes = {1: (9.0, 16.0), 2: (23.0, 16.0)}
    shares = {"Marine": units // 4, "Zealot": (units // 2 - units // 4) // 2}
    shares["Stalker"] = units // 2 - sum(shares.values())
    for player, home in homes.items():
        for name, count in shares.items():
            kind = world.catalog.unit(name)
            for place in free_places(world, kind, home, count):
                world.spawn(kind, player, place)
    for player, enemy in ((1, 2), (2, 1)):
        commands.attack_move(world, world.units_of(player).tolist(), homes[enemy])
    return world


def measure(make: Callable[[int], World], seconds: float, max_loops: int = 1440) -> dict[str, float]:
    """Play fresh games until enough CPU time is used; the making of worlds is timed apart."""
    loops = seed = 0
    playing = making = 0.0
    units: list[int] = []
    while playing < seconds:
        began = time.process_time()
        world = make(seed)
        units.append(len(world.live))
        ready = time.process_time()
        making += ready - began
        while not world.ended and world.loop < max_loops and playing + time.process_time() - ready < 2 * seconds:
            loops += advance(world, LOOPS_PER_STEP)
        playing += time.process_time() - ready
        seed += 1
    return {
        "units": max(units),
        "loops": loops,
        "loops_per_s": round(loops / playing, 1),
        "ms_per_loop": round(playing / loops * 1e3, 4),
        "ms_to_make": round(making / seed * 1e3, 2),
        "games": seed,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    parser.add_argument("--seconds", type=float, default=2.0, help="CPU seconds per row")
    parser.add_argument("--maps", nargs="*", default=list(map_names()), help="maps to play; none: only the armies")
    parser.add_argument("--sizes", nargs="*", type=int, default=list(ARMY_SIZES), help="units in the open battles")
    options = parser.parse_args()
    rows = {name: measure(partial(battle, name), options.seconds) for name in options.maps}
    for size in options.sizes:
        rows[f"open field, {size} units"] = measure(partial(armies, size), options.seconds, max_loops=400)
    if options.json:
        json.dump({"command": " ".join(sys.argv), "rows": rows}, sys.stdout)
        return
    table = Table("battle", "units", "loops/s", "ms per loop", "ms to make", title="simulator engine, one core")
    for name, row in rows.items():
        cells = (row["units"], row["loops_per_s"], row["ms_per_loop"], row["ms_to_make"])
        table.add_row(name, *(f"{cell:g}" for cell in cells))
    Console().print(table)


if __name__ == "__main__":
    main()
