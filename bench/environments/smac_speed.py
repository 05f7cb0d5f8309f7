"""Measure how many steps a second SMAC's own package makes on the simulator, and which process takes the time.

    python -m bench smac_speed ~/smac                         2s3z, 3s5z and 2c_vs_64zg, with their goals
    python -m bench smac_speed ~/smac --maps MMM2 --steps 1000
    python -m bench smac_speed ~/smac --floor                 also with a server that answers at once

The path is that of `python -m bench smac`. Agents act at random. `steps/s` counts `StarCraft2Env.step` alone, which is
three requests and what SMAC makes of their answers; `all` also the choice of actions, observations, state and resets.
`client` and `server` are the processor time of the two processes a step, in ms, of all that; on a busy machine they are
more reliable than wall time.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.command_line import make_parser
from bench.environments.smac import package_root
from bench.simulator.at_once import floor
from bench.simulator.env_games import CpuTime
from bench.tables import print_table, two_digits
from khala_simulator.process.install import install

GOALS = {"2s3z": 400, "3s5z": 350, "2c_vs_64zg": 200}


@dataclass(frozen=True)
class Speed:
    """Steps of one map."""

    steps_per_s: float
    all_per_s: float
    client_ms: float
    server_ms: float


def measure(map_name: str, steps: int, seed: int) -> Speed:
    """Play so many steps of a map; `smac` must be importable and SC2PATH set."""
    from smac.env import StarCraft2Env  # noqa: PLC0415  # a package that only such measurements need

    env = StarCraft2Env(map_name=map_name, seed=seed)
    rng = np.random.default_rng(seed)
    env.reset()
    stepping_s = 0.0
    over = False
    with CpuTime(env._sc2_proc.pid) as cpu:  # noqa: SLF001  # SMAC tells the process nowhere else
        begun_s = time.perf_counter()
        for _ in range(steps):
            if over:
                env.reset()
            actions = _choose(env, rng)
            step_begun_s = time.perf_counter()
            _, over, _ = env.step(actions)
            stepping_s += time.perf_counter() - step_begun_s
            env.get_obs()
            env.get_state()
        all_s = time.perf_counter() - begun_s
    env.close()
    return Speed(steps / stepping_s, steps / all_s, cpu.client_s / steps * 1e3, cpu.server_s / steps * 1e3)


def _choose(env: Any, rng: np.random.Generator) -> list[int]:
    return [int(rng.choice(np.flatnonzero(env.get_avail_agent_actions(i)))) for i in range(env.n_agents)]


def main() -> None:
    """Print one line per map."""
    parser = make_parser(__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--maps", nargs="+", default=list(GOALS))
    parser.add_argument("--steps", type=int, default=500, help="of each map")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--floor", action="store_true", help="also the steps a second with a server that answers at once"
    )
    options = parser.parse_args()
    sys.path.insert(0, str(package_root(options.path)))
    rows: dict[str, dict[str, float | None]] = {}
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(directory))
        for name in options.maps:
            speed = measure(name, options.steps, options.seed)
            least = floor(partial(measure, name, options.steps, options.seed)).steps_per_s if options.floor else None
            rows[name] = {"goal": GOALS.get(name), "floor": least, **vars(speed)}
    if options.json:
        print(json.dumps(rows))
        return
    columns = ("", "goal", "floor", "steps/s", "all", "client", "server")
    print_table(columns, ((name, *map(two_digits, row.values())) for name, row in rows.items()))
