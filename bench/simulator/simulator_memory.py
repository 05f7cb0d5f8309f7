"""Measure the memory of a game process over many games, and how soon it returns its first observation.

    python -m bench simulator_memory                a table
    python -m bench simulator_memory --games 20     fewer games

PySC2 restarts each game (`SC2Env.reset`) and plays it for some steps with all feature layers; then the resident
memory of the game process is read. `growth` is the difference between the end and the tenth game: caches have
filled by then. `start` is from launching the process to the first observation at the client, including PySC2's own
wait for a connection.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from absl import flags

from bench.command_line import make_parser
from bench.memory import rss_mb
from bench.simulator.env_games import make_env
from khala_bridge.compat import actions
from khala_simulator.process.install import install

GOAL_MB = 200
GOAL_START_S = 1.5
SETTLED = 10
STEPS = 20


def measure(name: str, games: int) -> tuple[float, list[float]]:
    """Return the seconds to the first observation, and MB after each game."""
    begun_s = time.perf_counter()
    env = make_env(name)
    try:
        env.reset()
        start_s = time.perf_counter() - begun_s
        pid = env._sc2_procs[0].pid  # noqa: SLF001  # PySC2 tells the process nowhere else
        held = []
        for _ in range(games):
            for _ in range(STEPS):
                env.step([actions.FUNCTIONS.no_op()])
            held.append(rss_mb(pid))
            env.reset()
        return start_s, held
    finally:
        env.close()


def main() -> None:
    """Print one line per map."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--games", type=int, default=100, help="how many games each process plays")
    parser.add_argument("--maps", nargs="+", default=["2s3z", "2c_vs_64zg"], help="maps of llm_smac")
    options = parser.parse_args()
    print(f"goals: at most {GOAL_MB} MB and flat, first observation within {GOAL_START_S} s")
    print(f"{'map':<12} {'start s':>8} {'first MB':>9} {'last MB':>8} {'growth MB':>10}")
    flags.FLAGS(["bench"])
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(Path(directory)))
        for name in options.maps:
            start_s, held = measure(name, options.games)
            growth = held[-1] - held[min(SETTLED, len(held) - 1)]
            print(f"{name:<12} {start_s:8.2f} {held[0]:9.1f} {held[-1]:8.1f} {growth:10.1f}", flush=True)
