"""The game in this process is the game of the process: the same orders, the same units after each step, the same world.

A battle is played in both at once. What the environment orders here is also sent to the game there, as SMAC sends it:
raw commands, debug commands that kill, steps. Below the messages is the same engine, so it is the way to it that is
tested: which orders arrive when, what is rounded, what an observation shows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pytest
from absl import flags
from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import run_configs
from khala_sc2.env.numeric import MAPS, StarCraft2Env, starcraft2
from khala_sc2.playing import games
from khala_simulator.api.game import HostedGame
from khala_simulator.battle import ENEMY, PLAYER, Battle
from khala_simulator.maps.game_map import load_map
from khala_simulator.process.client import Client, command
from khala_simulator.process.replay import Replay
from khala_simulator.smac.orders import give_orders
from khala_simulator.tables.versions import DEFAULT_VERSION

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_simulator.battle import Units
    from khala_simulator.smac.fighters import Fighters
    from khala_simulator.world.world import World

EPISODES = 200
"""Of all maps together, through PySC2."""


class Door(Protocol):
    """A game in another place, to which messages are sent."""

    def begin(self, map_name: str, seed: int) -> None: ...
    def act(self, action: sc.Action) -> None: ...
    def debug(self, command: debug_pb2.DebugCommand) -> None: ...
    def step(self, loops: int) -> None: ...
    def observe(self) -> sc.Observation: ...
    def replay(self) -> bytes: ...


class InMemory:
    """The game process without its socket."""

    def begin(self, map_name: str, seed: int) -> None:
        self.client = Client()
        self.client.play(map_name, sc.InterfaceOptions(raw=True), seed=seed)

    def act(self, action: sc.Action) -> None:
        self.client.act(action)

    def debug(self, command: debug_pb2.DebugCommand) -> None:
        self.client.debug(command)

    def step(self, loops: int) -> None:
        self.client.ask(step=sc.RequestStep(count=loops))

    def observe(self) -> sc.Observation:
        return self.client.observe().observation

    def replay(self) -> bytes:
        data: bytes = self.client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
        return data


class ThroughPySC2:
    """The game as a process, and PySC2's controller."""

    def __init__(self) -> None:
        flags.FLAGS(["test"])
        self.process = run_configs.get().start(want_rgb=False)
        self.controller = self.process.controller

    def begin(self, map_name: str, seed: int) -> None:
        create = sc.RequestCreateGame(local_map=sc.LocalMap(map_path=f"{map_name}.SC2Map"), random_seed=seed)
        create.player_setup.add(type=sc.Participant)
        create.player_setup.add(type=sc.Computer, race=common_pb2.Random, difficulty=sc.VeryHard)
        self.controller.create_game(create)
        join = sc.RequestJoinGame(race=common_pb2.Terran, options=sc.InterfaceOptions(raw=True, score=False))
        self.controller.join_game(join)

    def act(self, action: sc.Action) -> None:
        self.controller.actions(sc.RequestAction(actions=[action]))

    def debug(self, command: debug_pb2.DebugCommand) -> None:
        self.controller.debug([command])

    def step(self, loops: int) -> None:
        self.controller.step(loops)

    def observe(self) -> sc.Observation:
        observation: sc.Observation = self.controller.observe().observation
        return observation

    def replay(self) -> bytes:
        data: bytes = self.controller.save_replay()
        return data


def mirrored(door: Door) -> type[Battle]:
    """Return a battle that is also played behind a door, and compared after each step."""

    class Mirrored(Battle):
        def __init__(self, map_name: str, *, seed: int, **rest: Any) -> None:
            super().__init__(map_name, seed=seed, **rest)
            door.begin(map_name, seed)
            self.compare()

        def kill(self, tags: Iterable[int]) -> None:
            tags = list(tags)
            super().kill(tags)
            door.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags)))

        def advance(self, loops: int) -> None:
            super().advance(loops)
            door.step(loops)
            self.compare()

        def compare(self) -> None:
            seen = door.observe()
            assert seen.game_loop == self.loop
            for player in (PLAYER, ENEMY):
                theirs = [unit for unit in seen.raw_data.units if unit.owner == player]
                there, ours = self.look(self.tags()[player == ENEMY])
                assert there.all()
                np.testing.assert_array_equal(columns(ours, own=player == PLAYER), read(theirs, own=player == PLAYER))

    return Mirrored


def orders_of(fighters: Fighters, actions: Sequence[int], far: float) -> Iterator[sc.Action]:
    """Yield the orders that SMAC's package sends for some actions: 2 to 5 walk, from 6 on attack, a Medivac heals."""
    for agent, action in enumerate(actions):
        tag = int(fighters.tag[agent])
        if action == 1:
            yield command(4, [tag])
        elif 2 <= action <= 5:
            x, y = fighters.numbers[:2, agent].tolist()
            dx, dy = ((0, far), (0, -far), (far, 0), (-far, 0))[action - 2]
            yield command(16, [tag], point=(x + dx, y + dy))
        elif action >= 6 and fighters.medivac[agent]:
            yield command(386, [tag], target=int(fighters.tag[action - 6]))
        elif action >= 6:
            yield command(23, [tag], target=int(fighters.tag[fighters.agents + action - 6]))


def columns(units: Units, *, own: bool) -> np.ndarray[Any, Any]:
    return np.concatenate(([units.tag, units.type_id], units.numbers if own else units.numbers[:6]))


def read(units: Iterable[Any], *, own: bool) -> np.ndarray[Any, Any]:
    rows = [
        (
            u.tag,
            u.unit_type,
            u.pos.x,
            u.pos.y,
            u.health,
            u.health_max,
            u.shield,
            u.shield_max,
            u.energy,
            u.weapon_cooldown,
        )
        for u in units
    ]
    return np.array(rows).T.reshape(10, -1)[: 10 if own else 8]


def played(door: Door, name: str, episodes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Play random episodes in both places; after each, the worlds are the same."""

    def give(world: World, fighters: Fighters, actions: np.ndarray[Any, Any], far: float) -> None:
        give_orders(world, fighters, actions, far)
        for order in orders_of(fighters, actions.tolist(), far):
            door.act(order)

    monkeypatch.setattr(starcraft2, "Battle", mirrored(door))
    monkeypatch.setattr(starcraft2, "give_orders", give)
    env, rng, ends = StarCraft2Env(name, seed=7), np.random.default_rng(7), []
    for _ in range(episodes):
        env.reset()
        over = False
        while not over:
            _, over, _ = env.step([int(rng.choice(np.flatnonzero(can))) for can in env.masks()])
        ends.append((env.battle.loop, env.battle.digest()))
    replay = Replay.decode(door.replay())
    game = HostedGame(replay.setup, DEFAULT_VERSION, replay.log)
    for player, options in replay.interfaces.items():
        game.sit(player, options)
    for loop, digest in ends:
        game.step(loop - game.world.loop)
        assert game.world.digest() == digest


@pytest.mark.parametrize("name", ["MMM", *(pytest.param(n, marks=pytest.mark.slow) for n in MAPS if n != "MMM")])
def test_a_battle_in_this_process_is_that_behind_the_messages(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    played(InMemory(), name, 2, monkeypatch)


def test_the_map_is_that_of_the_games_information_with_the_structures_on_it() -> None:
    door = InMemory()
    door.begin("SMAC_Maps/2s_vs_1sc", 1)
    told = door.client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw
    ground = Battle("SMAC_Maps/2s_vs_1sc", seed=1).ground()
    assert ground.size == (told.map_size.x, told.map_size.y)
    assert np.packbits(ground.walkable).tobytes() == told.pathing_grid.data
    assert ground.height.tobytes() == told.terrain_height.data
    assert ground.walkable.sum() < load_map("SMAC_Maps/2s_vs_1sc").terrain.walk.sum()  # a SpineCrawler stands there


@pytest.fixture
def pysc2(monkeypatch: pytest.MonkeyPatch) -> Iterator[ThroughPySC2]:
    monkeypatch.setenv("SC2PATH", str(games.find("simulator")[0]))
    door = ThroughPySC2()
    yield door
    door.process.close()


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", MAPS)
def test_random_episodes_through_pysc2_end_in_the_same_world(
    pysc2: ThroughPySC2, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    played(pysc2, name, -(-EPISODES // len(MAPS)), monkeypatch)
