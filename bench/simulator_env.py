"""Plays battles on the simulator through PySC2, and says what a step costs and who spends it.

    python bench/simulator_env.py            a table
    python bench/simulator_env.py --json     one JSON object on stdout

`SC2Env` with feature layers of 128 and 64 pixels, raw units and feature units, 8 game loops per step; every step all
own units are told to attack the nearest enemy, and a new episode begins when one ends (not counted). The parts of the
server are measured in this process on the same battle: `tick` is the 8 loops, `observe` the observation with all
layers as bytes, `act` the action. The rest is the client: parsing, PySC2's own transformation, and the socket.
`cpu` is the processor time of both processes, resets included; on a machine that does other things too it says more
than the clock on the wall.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from absl import flags
from s2clientprotocol import sc2api_pb2 as sc

from bridge.compat import features, maps, sc2_env
from simulator.client import Client, command, interface
from simulator.install import install

GOALS = {"2s3z": 150, "3s5z": 120, "2c_vs_64zg": 60}  # SC2Env.step per second
STEP_MUL = 8
GENERAL_ATTACK = 3674
WARM_UP_STEPS = 5


def map_of(name: str) -> Any:
    return type(f"Bench_{name}", (maps.Map,), {"directory": "llm_smac", "filename": name, "players": 2})()


def make_env(name: str) -> Any:
    layers = sc2_env.AgentInterfaceFormat(
        feature_dimensions=sc2_env.Dimensions(screen=128, minimap=64),
        use_feature_units=True,
        use_raw_units=True,
    )
    return sc2_env.SC2Env(
        map_name=map_of(name),
        players=[
            sc2_env.Agent(sc2_env.Race.protoss),
            sc2_env.Bot(sc2_env.Race.random, sc2_env.Difficulty.very_hard),
        ],
        agent_interface_format=layers,
        step_mul=STEP_MUL,
        random_seed=1,
    )


def attack(units: Any) -> sc.Action:
    """All own units (rows of PySC2's raw units) on the first enemy."""
    unit = features.FeatureUnit
    own = [int(row[unit.tag]) for row in units if row[unit.alliance] == 1]
    foes = [int(row[unit.tag]) for row in units if row[unit.alliance] == 4]
    return command(GENERAL_ATTACK, own, target=foes[0]) if own and foes else sc.Action()


def server_cpu_s(env: Any) -> float:
    """Processor time that the game process has used."""
    pid = env._sc2_procs[0].pid  # noqa: SLF001  # PySC2 tells the process nowhere else
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure_env(name: str, steps: int) -> tuple[list[float], float, float]:
    """Durations of environment steps, their mean of processor time in both processes, and the start-up, in ms."""
    started_s = time.perf_counter()
    env = make_env(name)
    try:
        timestep = env.reset()[0]
        start_ms = (time.perf_counter() - started_s) * 1e3
        durations_ms: list[float] = []
        cpu_s = -server_cpu_s(env) - time.process_time()
        while len(durations_ms) < steps + WARM_UP_STEPS:
            if timestep.last():
                timestep = env.reset()[0]
            action = attack(timestep.observation.raw_units)
            begun_s = time.perf_counter()
            timestep = env.step([action])[0]
            durations_ms.append((time.perf_counter() - begun_s) * 1e3)
        cpu_s += server_cpu_s(env) + time.process_time()
        return durations_ms[WARM_UP_STEPS:], cpu_s / len(durations_ms) * 1e3, start_ms
    finally:
        env.close()


def measure_server(name: str, steps: int) -> dict[str, list[float]]:
    """Durations of the server's parts of each step, in ms."""
    client = Client()
    parts: dict[str, list[float]] = {"act": [], "tick": [], "observe": []}
    step = sc.Request(step=sc.RequestStep(count=STEP_MUL)).SerializeToString()
    look = sc.Request(observation=sc.RequestObservation()).SerializeToString()
    seen = client.play(name, interface(screen=128, minimap=64))
    while len(parts["act"]) < steps:
        if seen.player_result:
            seen = client.play(name, interface(screen=128, minimap=64))
        units = seen.observation.raw_data.units
        own, foes = ([unit.tag for unit in units if unit.alliance == side] for side in (1, 4))
        act = command(GENERAL_ATTACK, own, target=foes[0]) if own and foes else sc.Action()
        request = sc.Request(action=sc.RequestAction(actions=[act])).SerializeToString()
        answers = []
        for part, data in (("act", request), ("tick", step), ("observe", look)):
            begun_s = time.perf_counter()
            answers.append(client.session.handle(data))
            parts[part].append((time.perf_counter() - begun_s) * 1e3)
        seen = sc.Response.FromString(answers[-1]).observation
    return parts


def measure(name: str, steps: int) -> dict[str, float]:
    durations_ms, cpu_ms, start_ms = measure_env(name, steps)
    server = {part: statistics.fmean(values) for part, values in measure_server(name, steps).items()}
    step_ms = statistics.fmean(durations_ms)
    return {
        "goal_steps_per_s": GOALS[name],
        "steps_per_s": 1e3 / step_ms,
        "step_ms": step_ms,
        "step_ms_p50": statistics.median(durations_ms),
        "cpu_ms": cpu_ms,
        "server_tick_ms": server["tick"],
        "server_observe_ms": server["observe"],
        "server_act_ms": server["act"],
        "client_ms": step_ms - sum(server.values()),
        "start_ms": start_ms,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")
    parser.add_argument("--steps", type=int, default=300, help="steps per map")
    parser.add_argument("maps", nargs="*", default=list(GOALS), help="shipped llm_smac maps")
    arguments = parser.parse_args()
    flags.FLAGS(["bench"])
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(Path(directory)))
        rows = {name: measure(name, arguments.steps) for name in arguments.maps}
    if arguments.json:
        print(json.dumps(rows))
        return
    head = ("map", "steps/s", "goal", "step ms", "p50", "cpu ms", "tick", "observe", "act", "client", "start ms")
    print(f"{head[0]:<12}" + "".join(f"{title:>10}" for title in head[1:]))
    for name, row in rows.items():
        cells = (row["steps_per_s"], row["goal_steps_per_s"], row["step_ms"], row["step_ms_p50"],
                 row["cpu_ms"], row["server_tick_ms"], row["server_observe_ms"], row["server_act_ms"], row["client_ms"],
                 row["start_ms"])  # fmt: skip
        print(f"{name:<12}" + "".join(f"{cell:>10.2f}" for cell in cells))


if __name__ == "__main__":
    main()
