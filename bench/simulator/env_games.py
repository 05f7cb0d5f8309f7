"""Games that measurements of the simulator play through unmodified clients: PySC2's environment, and its controller.

In every step all own units attack the first enemy, and a new game begins when one ends. Above: `simulator_env.py`,
`simulator_memory.py`.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np
from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import features, maps, run_configs, sc2_env
from khala_simulator.process.client import command
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import DEFAULT_VERSION

if TYPE_CHECKING:
    from types import TracebackType

GENERAL_ATTACK = 3674


FULL = "Simple64"
"""The map of a full game: two bases and their economy, and two armies, which are filled up again as they fall."""
ARMIES = {1: {"Zealot": 40, "Stalker": 40, "Immortal": 20}, 2: {"Zergling": 50, "Roach": 30, "Hydralisk": 20}}
PLACES = {1: (36.0, 42.0), 2: (52.0, 42.0)}
REFILL = 10
"""So many units of a type are missing before they come again."""


class EnvGame(Protocol):
    """A game of a client, step by step."""

    @property
    def pid(self) -> int:
        """Id of the game process."""

    def prepare(self) -> sc.Action:
        """Return the next action, after what is not to be measured, such as a new game."""

    def step(self, action: sc.Action) -> None:
        """Make one step of the environment."""

    def close(self) -> None:
        """End the process."""


def directory_of(name: str) -> str:
    """Return the folder of a map below the install's Maps directory."""
    if name == FULL:
        return "Melee"
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
            sc2_env.Bot(sc2_env.Race.zerg if name == FULL else sc2_env.Race.random, sc2_env.Difficulty.very_hard),
        ],
        agent_interface_format=layers,
        step_mul=step_mul,
        random_seed=1,
    )


class LayersGame:
    """A game as LLM-PySC2 plays it."""

    def __init__(self, name: str, step_mul: int) -> None:
        self._map = name
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
        own, foes = (units[units[:, unit.alliance] == side] for side in (1, 4))
        if self._map == FULL:
            fighting = {1: own[:, unit.unit_type].tolist(), 2: foes[:, unit.unit_type].tolist()}
            self._env._controllers[0].debug(reinforcements(fighting))  # noqa: SLF001  # no public way to it
            types = {load_catalog(DEFAULT_VERSION).unit(name).id for name in ARMIES[1]}
            own = own[np.isin(own[:, unit.unit_type], list(types))]
        return attack(own[:, unit.tag].tolist(), foes[:, unit.tag].tolist())

    def step(self, action: sc.Action) -> None:
        """Make one step of the environment."""
        self._seen = self._env.step([action])[0]

    def close(self) -> None:
        """End the process."""
        self._env.close()


class RawGame:
    """A game as SMAC plays it: PySC2's controller, the raw interface and nothing else."""

    def __init__(self, name: str, step_mul: int) -> None:
        self._map = f"{directory_of(name)}/{name}.SC2Map"
        self._step_mul = step_mul
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


def reinforcements(fighting: dict[int, list[int]]) -> list[debug_pb2.DebugCommand]:
    """Return the commands that fill the armies up, from the types of each side's units."""
    commands = []
    for player, army in ARMIES.items():
        x, y = PLACES[player]
        for name, wanted in army.items():
            number = load_catalog(DEFAULT_VERSION).unit(name).id
            missing = wanted - fighting[player].count(number)
            if missing >= REFILL:
                create = debug_pb2.DebugCreateUnit(unit_type=number, owner=player, quantity=missing)
                create.pos.x, create.pos.y = x, y
                commands.append(debug_pb2.DebugCommand(create_unit=create))
    return commands


def fighters(seen: sc.ResponseObservation) -> dict[int, list[int]]:
    """Return the types of each side's units."""
    units = seen.observation.raw_data.units
    return {player: [unit.unit_type for unit in units if unit.owner == player] for player in ARMIES}


def attack_of(seen: sc.ResponseObservation) -> sc.Action:
    """Return an attack of all own units on the first enemy."""
    units = seen.observation.raw_data.units
    own, foes = ([unit.tag for unit in units if unit.alliance == side] for side in (1, 4))
    return attack(own, foes)


def attack(own: list[int], foes: list[int]) -> sc.Action:
    """Return an attack of all units on the first enemy, both as tags."""
    return command(GENERAL_ATTACK, own, target=foes[0]) if own and foes else sc.Action()


class CpuTime:
    """Processor time of this process, the client, and of another one, the server, while the block runs."""

    def __init__(self, pid: int) -> None:
        self._stat = Path(f"/proc/{pid}/stat")
        self.client_s = self.server_s = 0.0

    def _server_s(self) -> float:
        fields = self._stat.read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def __enter__(self) -> Self:
        self.client_s -= time.process_time()
        self.server_s -= self._server_s()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.client_s += time.process_time()
        self.server_s += self._server_s()
