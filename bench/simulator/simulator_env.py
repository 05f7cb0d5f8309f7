"""Measure a step of battles that PySC2 plays on the simulator, and the parts of a step.

    python -m bench simulator_env                     a table
    python -m bench simulator_env layers:2s3z:8       one row: interface, map and game loops per step
    python -m bench simulator_env --floor             also what the client makes of a server that answers at once

With `layers` it is `SC2Env` with feature layers of 128 and 64 pixels, raw units and feature units, as LLM-PySC2 plays.
With `raw` it is PySC2's controller with the raw interface alone, as SMAC plays; `smac_speed.py` measures SMAC itself.
In every step all own units attack the first enemy, and a new episode begins when one ends (not counted). Simple64 is a
full game in which armies of 100 units a side meet and are filled up as they fall.

`client` and `server` are the processor time of the two processes, including resets; on a busy machine they are more
reliable than wall time. The parts of the server are measured in this process on the same battle: `tick` is the loops,
`observe` the observation as bytes, `act` the action.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from absl import flags
from s2clientprotocol import sc2api_pb2 as sc

from bench.command_line import make_parser
from bench.figures import Figure
from bench.simulator.at_once import floor
from bench.simulator.env_games import (
    FULL,
    CpuTime,
    LayersGame,
    RawGame,
    attack_of,
    directory_of,
    fighters,
    reinforcements,
)
from bench.tables import print_table, two_digits
from khala_simulator.process.client import Client, interface
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from bench.simulator.env_games import EnvGame

WARM_UP_STEPS = 5
SIZES = {"layers": (128, 64), "raw": (0, 0)}


@dataclass(frozen=True)
class Setting:
    """One row: the interface, the map, the game loops per step, and the target of steps per second."""

    interface: str
    map: str
    step_mul: int
    goal: int | None = None

    def __str__(self) -> str:
        return f"{self.interface}:{self.map}:{self.step_mul}"


SETTINGS = (
    Setting("layers", "2s3z", 8, 150),
    Setting("layers", "3s5z", 8, 120),
    Setting("layers", "2c_vs_64zg", 8, 60),
    Setting("layers", "pvz_task6_level1", 8, 70),
    Setting("layers", FULL, 8, 60),
    Setting("layers", "2s3z", 1),
    Setting("layers", "2c_vs_64zg", 1),
    Setting("raw", "2s3z", 8, 300),
    Setting("raw", "3s5z", 8, 250),
    Setting("raw", "2c_vs_64zg", 8, 100),
    Setting("raw", "2s3z", 1),
)


def start(setting: Setting) -> EnvGame:
    """Return a new game of a setting."""
    return (LayersGame if setting.interface == "layers" else RawGame)(setting.map, setting.step_mul)


@dataclass(frozen=True)
class Measured:
    """Environment steps of one game."""

    durations_ms: list[float]
    client_ms: float
    """Mean processor time of the client a step, resets and the choice of actions included."""
    server_ms: float
    """The same of the game process."""
    start_ms: float


def measure_env(setting: Setting, steps: int) -> Measured:
    """Return the times of environment steps."""
    started_s = time.perf_counter()
    game = start(setting)
    try:
        start_ms = (time.perf_counter() - started_s) * 1e3
        durations_ms: list[float] = []
        with CpuTime(game.pid) as cpu:
            while len(durations_ms) < steps + WARM_UP_STEPS:
                action = game.prepare()
                begun_s = time.perf_counter()
                game.step(action)
                durations_ms.append((time.perf_counter() - begun_s) * 1e3)
        client_ms, server_ms = (spent_s / len(durations_ms) * 1e3 for spent_s in (cpu.client_s, cpu.server_s))
        return Measured(durations_ms[WARM_UP_STEPS:], client_ms, server_ms, start_ms)
    finally:
        game.close()


def measure_server(setting: Setting, steps: int) -> dict[str, float]:
    """Return the processor time of the server's parts of a step, in ms."""
    client = Client()
    spent_s = dict.fromkeys(("act", "tick", "observe"), 0.0)
    step = sc.Request(step=sc.RequestStep(count=setting.step_mul)).SerializeToString()
    look = sc.Request(observation=sc.RequestObservation()).SerializeToString()
    screen, minimap = SIZES[setting.interface]
    options = interface(screen=screen, minimap=minimap)
    name = f"{directory_of(setting.map)}/{setting.map}"
    seen = client.play(name, options)
    for _ in range(steps):
        if seen.player_result:
            seen = client.play(name, options)
        if setting.map == FULL:
            client.debug(*reinforcements(fighters(seen)))
        act = sc.Request(action=sc.RequestAction(actions=[attack_of(seen)])).SerializeToString()
        answer = b""
        for part, data in (("act", act), ("tick", step), ("observe", look)):
            begun_s = time.process_time()
            answer = client.session.handle(data)
            spent_s[part] += time.process_time() - begun_s
        seen = sc.Response.FromString(answer).observation
    return {part: seconds / steps * 1e3 for part, seconds in spent_s.items()}


def measure(setting: Setting, steps: int, *, with_floor: bool) -> dict[str, float | None]:
    """Return one row of the table."""
    game = measure_env(setting, steps)
    least = floor(partial(measure_env, setting, steps)) if with_floor else None
    server = measure_server(setting, steps)
    step_ms = statistics.fmean(game.durations_ms)
    return {
        "steps_per_s": 1e3 / step_ms,
        "goal_steps_per_s": setting.goal,
        "floor_steps_per_s": None if least is None else 1e3 / statistics.fmean(least.durations_ms),
        "step_ms": step_ms,
        "step_ms_p50": statistics.median(game.durations_ms),
        "client_cpu_ms": game.client_ms,
        "server_cpu_ms": game.server_ms,
        "server_tick_ms": server["tick"],
        "server_observe_ms": server["observe"],
        "server_act_ms": server["act"],
        "start_ms": game.start_ms,
    }


def setting_of(text: str) -> Setting:
    """Return the setting written as interface:map:loops."""
    kind, name, step_mul = text.split(":")
    if kind not in SIZES:
        raise argparse.ArgumentTypeError(f"the interface is one of {', '.join(SIZES)}, not {kind!r}")
    return next((known for known in SETTINGS if str(known) == text), Setting(kind, name, int(step_mul)))


def measures(found: Mapping[str, Mapping[str, Any]]) -> Iterator[Figure]:
    """Yield the figures of what `--json` printed."""
    for name, row in found.items():
        yield Figure(f"steps a second, {name}", "steps", (row["steps_per_s"],), "more")
        yield Figure(f"processor time of a step, {name}", "ms", (row["client_cpu_ms"] + row["server_cpu_ms"],))


def main() -> None:
    """Print one line per setting."""
    parser = make_parser(__doc__)
    parser.add_argument(
        "--floor", action="store_true", help="also the steps a second with a server that answers at once"
    )
    parser.add_argument("--steps", type=int, default=300, help="steps per row")
    parser.add_argument("settings", nargs="*", type=setting_of, default=SETTINGS, help="interface:map:loops per step")
    arguments = parser.parse_args()
    flags.FLAGS(["bench"])
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(Path(directory)))
        rows = {
            str(setting): measure(setting, arguments.steps, with_floor=arguments.floor)
            for setting in arguments.settings
        }
    if arguments.json:
        print(json.dumps(rows))
        return
    head = ("steps/s", "goal", "floor", "step ms", "p50", "client", "server", "tick", "observe", "act", "start ms")
    print_table(("", *head), ((name, *map(two_digits, row.values())) for name, row in rows.items()))
