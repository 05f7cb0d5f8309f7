"""Measure how many game loops a second the simulator's engine plays, without the SC2 API around it.

Some shipped maps are played with both sides on attack-move, restarted with the next seed when they end; then armies of
10 to 400 units meet on an open map, which shows how the cost grows: `us per unit` is the mean time of a loop per
unit alive in it. `MB` is the memory of the process at the end of a row.
"""

from __future__ import annotations

import json
import sys
import time
from functools import partial
from typing import TYPE_CHECKING, Any

from bench.command_line import make_parser
from bench.figures import Figure
from bench.memory import rss_mb
from bench.tables import print_table
from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import load_map
from khala_simulator.movement.placement import free_places
from khala_simulator.systems.triggers import players_of
from khala_simulator.tick import advance, new_game
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LOOPS_PER_STEP = 8
ARMY_SIZES = (10, 25, 50, 100, 200, 400)
MAPS = (
    "llm_smac/2s3z", "llm_smac/3s5z", "llm_smac/1c3s5z", "llm_smac/2c_vs_64zg", "llm_pysc2/pvz_task1_level1",
    "llm_pysc2/pvz_task6_level1", "mini_games/DefeatRoaches",
)  # fmt: skip


def battle(name: str, seed: int) -> World:
    """Return a game on a shipped map in which player 1 attacks too."""
    world = new_game(load_map(name), seed=seed)
    x, y = world.pos[world.units_of(2)].mean(axis=0)
    commands.attack_move(world, world.units_of(1).tolist(), (float(x), float(y)))
    return world


def armies(units: int, seed: int) -> World:
    """Return two armies of Marines, Zealots and Stalkers on an open map, each on attack-move to the other's place."""
    field = load_map("llm_smac/3s_vs_3z")
    world = World(field, players_of(field), seed=seed)  # without the map's own script, which would end it
    homes = {1: (9.0, 16.0), 2: (23.0, 16.0)}
    shares = {"Marine": units // 4, "Zealot": (units // 2 - units // 4) // 2}
    shares["Stalker"] = units // 2 - sum(shares.values())
    for player, home in homes.items():
        for name, count in shares.items():
            kind = world.catalog.unit(name)
            for place in free_places(world, kind, home, count):
                lifecycle.spawn(world, kind, player, place)
    for player, enemy in ((1, 2), (2, 1)):
        commands.attack_move(world, world.units_of(player).tolist(), homes[enemy])
    return world


def measure(make: Callable[[int], World], seconds: float, max_loops: int = 1440) -> dict[str, float]:
    """Play fresh games until enough CPU time is used; the making of worlds is timed separately."""
    loops = seed = lived = 0
    playing = making = 0.0
    units: list[int] = []
    while playing < seconds:
        began = time.process_time()
        world = make(seed)
        units.append(len(world.live))
        ready = time.process_time()
        making += ready - began
        while not world.ended and world.loop < max_loops and playing + time.process_time() - ready < 2 * seconds:
            done = advance(world, LOOPS_PER_STEP)
            loops += done
            lived += done * len(world.live)
        playing += time.process_time() - ready
        seed += 1
    return {
        "units": max(units),
        "loops": loops,
        "loops_per_s": round(loops / playing, 1),
        "ms_per_loop": round(playing / loops * 1e3, 4),
        "us_per_unit": round(playing / max(lived, 1) * 1e6, 2),
        "ms_to_make": round(making / seed * 1e3, 2),
        "games": seed,
        "mb": round(rss_mb(), 1),
    }


def measures(found: Any) -> Iterator[Figure]:
    """Yield the speed of each battle, and the memory after all."""
    for name, row in found["rows"].items():
        yield Figure(f"loops a second, {name}", "loops", (row["loops_per_s"],), "more")
    yield Figure("memory after all battles", "MB", (max(row["mb"] for row in found["rows"].values()),))


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="CPU seconds per row")
    parser.add_argument("--maps", nargs="*", default=list(MAPS), help="maps to play; none: only the armies")
    parser.add_argument("--sizes", nargs="*", type=int, default=list(ARMY_SIZES), help="units in the open battles")
    options = parser.parse_args()
    rows = {name: measure(partial(battle, name), options.seconds) for name in options.maps}
    for size in options.sizes:
        rows[f"armies of {size // 2}"] = measure(partial(armies, size), options.seconds, max_loops=400)
    if options.json:
        json.dump({"command": " ".join(sys.argv), "rows": rows}, sys.stdout)
        return
    columns = ("units", "loops_per_s", "ms_per_loop", "us_per_unit", "ms_to_make", "mb")
    print_table(
        ("battle", "units", "loops/s", "ms per loop", "us per unit", "ms to make", "MB"),
        [(name.rpartition("/")[2], *(f"{row[column]:g}" for column in columns)) for name, row in rows.items()],
        title="simulator engine, one core",
    )
