"""Play battles on the simulator through PySC2, and measure the cost of a step and of its parts.

    python -m bench.simulator_env                     a table
    python -m bench.simulator_env --json              one JSON object on stdout
    python -m bench.simulator_env layers:2s3z:8       one row: interface, map and game loops per step

With `layers` it is `SC2Env` with feature layers of 128 and 64 pixels, raw units and feature units, as LLM-PySC2 plays.
With `raw` it is PySC2's controller with the raw interface alone, as SMAC plays; SMAC's own work on the units is not
included. In every step all own units attack the first enemy, and a new episode begins when one ends (not
counted). The parts of the server are measured in this process on the same battle: `tick` is the loops, `observe` the
observation as bytes, `act` the action. The rest is the client: parsing, PySC2's own transformation, and the socket.
`cpu` is the processor time of both processes, including resets; on a busy machine it is more reliable than wall
time.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from absl import flags
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import features, maps, run_configs, sc2_env
from khala_simulator.process.client import Client, command, interface
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from types import TracebackType

GENERAL_ATTACK = 3674
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
    Setting("layers", "2s3z", 8, 120),
    Setting("layers", "3s5z", 8, 120),
    Setting("layers", "2c_vs_64zg", 8, 60),
    Setting("layers", "pvz_task6_level1", 8, 60),
    Setting("layers", "2s3z", 1),
    Setting("layers", "2c_vs_64zg", 1),
    Setting("raw", "2s3z", 8, 300),
    Setting("raw", "3s5z", 8, 250),
    Setting("raw", "2c_vs_64zg", 8, 100),
    Setting("raw", "2s3z", 1),
)


def directory_of(name: str) -> str:
    """Return the folder of a map below the install's Maps directory."""
    return "llm_pysc2" if name.startswith("pvz_") else "llm_smac"


def map_of(name: str) -> Any:
    """Return a map in PySC2's form."""
    return type(f"Bench_{name}", (maps.Map,), {"directory": directory_of(name), "filename": name, "players": 2})()


def make_env(name: str, step_mul: int = 8) -> Any:
    """Return PySC2's environment on a map, with all feature layers."""
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
        step_mul=step_mul,
        random_seed=1,
    )


class LayersGame:
    """A game as LLM-PySC2 plays it."""

    def __init__(self, name: str, step_mul: int) -> None:
        self._env = make_env(name, step_mul)
        self._seen = self._env.reset()[0]

    @property
    def pid(self) -> int:
        """Id of the game process."""
        pid: int = self._env._sc2_procs[0].pid  # noqa: SLF001  # PySC2 tells the process nowhere else
        return pid

    def prepare(self) -> sc.Action:
        """Return the next action, after a reset if the episode is over."""
        if self._seen.last():
            self._seen = self._env.reset()[0]
        unit = features.FeatureUnit
        units = self._seen.observation.raw_units
        own = [int(row[unit.tag]) for row in units if row[unit.alliance] == 1]
        foes = [int(row[unit.tag]) for row in units if row[unit.alliance] == 4]
        return attack(own, foes)

    def step(self, action: sc.Action) -> None:
        """Make one step of the environment."""
        self._seen = self._env.step([action])[0]

    def close(self) -> None:
        """End the process."""
        self._env.close()


class RawGame:
    """A game as SMAC plays it: PySC2's controller, the raw interface and nothing else."""

    def __init__(self, name: str, step_mul: int) -> None:
        self._map, self._step_mul = f"{directory_of(name)}/{name}.SC2Map", step_mul
        self._process = run_configs.get().start(want_rgb=False)
        self._controller = self._process.controller
        self._begin()

    @property
    def pid(self) -> int:
        """Id of the game process."""
        pid: int = self._process.pid
        return pid

    def _begin(self) -> None:
        create = sc.RequestCreateGame(
            local_map=sc.LocalMap(map_path=self._map),
            player_setup=[
                sc.PlayerSetup(type=sc.Participant),
                sc.PlayerSetup(type=sc.Computer, race=common_pb2.Random, difficulty=sc.VeryHard),
            ],
            random_seed=1,
        )
        options = sc.InterfaceOptions(raw=True, score=False)
        self._controller.create_game(create)
        self._controller.join_game(sc.RequestJoinGame(race=common_pb2.Protoss, options=options))
        self._seen = self._controller.observe()

    def prepare(self) -> sc.Action:
        """Return the next action, in a new game if this one is over."""
        if self._seen.player_result:
            self._begin()
        return attack_of(self._seen)

    def step(self, action: sc.Action) -> None:
        """Act, step, and observe."""
        self._controller.actions(sc.RequestAction(actions=[action]))
        self._controller.step(self._step_mul)
        self._seen = self._controller.observe()

    def close(self) -> None:
        """End the process."""
        self._process.close()


def attack_of(seen: sc.ResponseObservation) -> sc.Action:
    """Return an attack of all own units on the first enemy."""
    units = seen.observation.raw_data.units
    own, foes = ([unit.tag for unit in units if unit.alliance == side] for side in (1, 4))
    return attack(own, foes)


def attack(own: list[int], foes: list[int]) -> sc.Action:
    """Return an attack of all units on the first enemy, both as tags."""
    return command(GENERAL_ATTACK, own, target=foes[0]) if own and foes else sc.Action()


class CpuTime:
    """Processor time of this process and another one, while the block runs."""

    def __init__(self, pid: int) -> None:
        self._stat = Path(f"/proc/{pid}/stat")
        self.seconds = 0.0

    def _now(self) -> float:
        fields = self._stat.read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + time.process_time()

    def __enter__(self) -> Self:
        self.seconds -= self._now()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.seconds += self._now()


def measure_env(setting: Setting, steps: int) -> tuple[list[float], float, float]:
    """Return durations of environment steps, their mean processor time in both processes, and the start-up, in ms."""
    started_s = time.perf_counter()
    game = (LayersGame if setting.interface == "layers" else RawGame)(setting.map, setting.step_mul)
    try:
        start_ms = (time.perf_counter() - started_s) * 1e3
        durations_ms: list[float] = []
        with CpuTime(game.pid) as cpu:
            while len(durations_ms) < steps + WARM_UP_STEPS:
                action = game.prepare()
                begun_s = time.perf_counter()
                game.step(action)
                durations_ms.append((time.perf_counter() - begun_s) * 1e3)
        return durations_ms[WARM_UP_STEPS:], cpu.seconds / len(durations_ms) * 1e3, start_ms
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
        act = sc.Request(action=sc.RequestAction(actions=[attack_of(seen)])).SerializeToString()
        answer = b""
        for part, data in (("act", act), ("tick", step), ("observe", look)):
            begun_s = time.process_time()
            answer = client.session.handle(data)
            spent_s[part] += time.process_time() - begun_s
        seen = sc.Response.FromString(answer).observation
    return {part: seconds / steps * 1e3 for part, seconds in spent_s.items()}


def measure(setting: Setting, steps: int) -> dict[str, float | None]:
    """Return one row of the table."""
    durations_ms, cpu_ms, start_ms = measure_env(setting, steps)
    server = measure_server(setting, steps)
    step_ms = statistics.fmean(durations_ms)
    return {
        "steps_per_s": 1e3 / step_ms,
        "goal_steps_per_s": setting.goal,
        "step_ms": step_ms,
        "step_ms_p50": statistics.median(durations_ms),
        "cpu_ms": cpu_ms,
        "server_tick_ms": server["tick"],
        "server_observe_ms": server["observe"],
        "server_act_ms": server["act"],
        "client_ms": step_ms - sum(server.values()),
        "start_ms": start_ms,
    }


def setting_of(text: str) -> Setting:
    """Return the setting written as interface:map:loops."""
    kind, name, step_mul = text.split(":")
    if kind not in SIZES:
        raise argparse.ArgumentTypeError(f"the interface is one of {', '.join(SIZES)}, not {kind!r}")
    return next((known for known in SETTINGS if str(known) == text), Setting(kind, name, int(step_mul)))


def main() -> None:
    """Print one line per setting."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")
    parser.add_argument("--steps", type=int, default=300, help="steps per row")
    parser.add_argument("settings", nargs="*", type=setting_of, default=SETTINGS, help="interface:map:loops per step")
    arguments = parser.parse_args()
    flags.FLAGS(["bench"])
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(Path(directory)))
        rows = {str(setting): measure(setting, arguments.steps) for setting in arguments.settings}
    if arguments.json:
        print(json.dumps(rows))
        return
    head = ("steps/s", "goal", "step ms", "p50", "cpu ms", "tick", "observe", "act", "client", "start ms")
    print(f"{'':<28}" + "".join(f"{title:>9}" for title in head))
    for name, row in rows.items():
        cells = ("" if value is None else f"{value:.2f}" for value in row.values())
        print(f"{name:<28}" + "".join(f"{cell:>9}" for cell in cells))


if __name__ == "__main__":
    main()
