"""The game from outside: found or missing, in its thread, hanging, dead. Without a game: with one see test_live."""

from __future__ import annotations

import asyncio
import gc
import os
import stat
import threading
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.act import JointAction, PlanResult, PlanStep
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.errors import GameError, GameHangs, GameMissing
from khala_bridge.game import pysc2_game
from khala_bridge.game.game import GameConfig, GameIdentity, GamePatience, GameThread, Sides, StepResult, find_sc2
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.knowledge import facts_of
from khala_bridge.state import EpisodeInfo
from khala_bridge.state.grid import NO_GRID
from khala_bridge.task.maps import known_maps
from khala_bridge.task.opponent import Opponent
from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from khala_bridge.act import Plan
    from khala_bridge.state import Snapshot


class FakeGame:
    """A game that counts loops, or hangs until it is killed."""

    def __init__(self, snapshot: Callable[..., Snapshot], *, hangs: bool = False) -> None:
        self._snapshot = snapshot
        self.hangs = hangs
        self._killed = threading.Event()
        self._loop = 0
        self.calls: list[str] = []
        self.threads: set[int] = set()

    @property
    def info(self) -> GameIdentity:
        return GameIdentity("4.10.0.75689", "B89B", "m.SC2Map", "0" * 64)

    def reset(self) -> tuple[Snapshot, ...]:
        self._note("reset")
        if self.hangs:
            self._killed.wait()
            raise GameError("the game died")
        self._loop = 0
        return (self._snapshot([], loop=0),)

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        self._note("act")
        if self.hangs:
            self._killed.wait()
            raise GameError("the game died")
        (plan,) = plans
        self._loop += next(plan).loops
        after = self._snapshot([], loop=self._loop)
        try:
            plan.send(after)
        except StopIteration as done:
            return (StepResult(after, done.value, 1),)
        raise AssertionError

    def whole(self) -> None:
        self._note("whole")

    def kill(self) -> None:
        self.calls.append("kill")
        self._killed.set()

    def close(self) -> None:
        self._note("close")

    def _note(self, call: str) -> None:
        self.calls.append(call)
        self.threads.add(threading.get_ident())


async def test_a_side_plays_commands_and_gets_snapshots(snapshot: Callable[..., Snapshot]) -> None:
    fake = FakeGame(snapshot)
    async with Sides(GameThread(lambda: fake), [RawExecutor()]) as game:
        (first,) = await game.reset()
        (turn,) = await game.act([JointAction().commands], 11)
        assert (first.game_loop, turn.snapshot.game_loop) == (0, 11)
        assert (turn.played, turn.env_steps) == (PlanResult(), 1)
        assert game.info.version == "4.10.0.75689"
    assert fake.calls == ["reset", "act", "close"]


async def test_the_game_has_a_thread_of_its_own(snapshot: Callable[..., Snapshot]) -> None:
    fake = FakeGame(snapshot)
    async with GameThread(lambda: fake) as game:
        await game.reset()
    assert len(fake.threads) == 1
    assert threading.get_ident() not in fake.threads


@pytest.mark.parametrize(
    ("slowest_s", "limit_s"), [(None, 120), (0.001, 10), (0.5, 10), (1, 20), (3, 60), (6, 120), (60, 120)]
)
def test_the_limit_for_a_step_suits_what_the_game_has_shown(slowest_s: float | None, limit_s: float) -> None:
    assert GamePatience().limit_s(slowest_s) == limit_s


def test_an_opponent_who_joins_may_take_its_time_too_and_is_named_if_the_game_hangs() -> None:
    patience = GamePatience().against(Opponent(kind="lan", wait_s=30))
    assert (patience.limit_s(None), patience.limit_s(0.5)) == (150, 40)
    assert patience.hangs == "the game, or the player over LAN at 127.0.0.1:14380"
    assert GamePatience().against(Opponent()) == GamePatience()


async def test_a_game_that_has_played_is_given_less_time_to_answer(
    snapshot: Callable[..., Snapshot], caplog: pytest.LogCaptureFixture
) -> None:
    fake = FakeGame(snapshot)
    async with GameThread(lambda: fake, patience=GamePatience(least_s=0.2, times_slowest=0, remark_s=0.1)) as game:
        await game.act([RawExecutor().plan([], snapshot([]), 8)])
        assert caplog.messages == []
        fake.hangs = True
        with pytest.raises(GameHangs, match=r"within 0.2 s"):
            await game.act([RawExecutor().plan([], snapshot([]), 8)])
    assert caplog.messages == ["the game has not answered for 0.1 s"]


async def test_a_game_that_has_begun_once_is_given_less_time_to_begin_again(snapshot: Callable[..., Snapshot]) -> None:
    fake = FakeGame(snapshot)
    async with GameThread(lambda: fake, patience=GamePatience(least_s=0.2, times_slowest=0)) as game:
        await game.reset()
        fake.hangs = True
        with pytest.raises(GameHangs, match=r"within 0.2 s"):
            await game.reset()


async def test_a_game_that_dies_when_nobody_waits_for_it_any_more_says_nothing(
    snapshot: Callable[..., Snapshot], caplog: pytest.LogCaptureFixture
) -> None:
    """As after Ctrl-C, which a terminal sends to every process of the match."""
    fake = FakeGame(snapshot, hangs=True)
    async with GameThread(lambda: fake) as game:
        step = asyncio.create_task(game.act([RawExecutor().plan([], snapshot([]), 8)]))
        await asyncio.sleep(0)  # the step is in its thread's queue
        step.cancel()
        await asyncio.wait([step])
        fake.kill()
    del step
    gc.collect()
    assert caplog.messages == []


async def test_a_game_that_hangs_is_killed_and_named(snapshot: Callable[..., Snapshot]) -> None:
    fake = FakeGame(snapshot, hangs=True)
    async with GameThread(lambda: fake, patience=GamePatience(unknown_s=0.05)) as game:
        with pytest.raises(GameHangs, match=r"^the game did not answer within 0.05 s and was ended; try again"):
            await game.act([RawExecutor().plan([], snapshot([]), 8)])
    assert fake.calls == ["act", "kill", "close"]


async def test_a_game_that_cannot_be_started_is_an_error_of_the_entering() -> None:
    def fail() -> FakeGame:
        raise GameError("no luck")

    with pytest.raises(GameError, match="no luck"):
        await GameThread(fail).__aenter__()


# --- plans in SC2Env ----------------------------------------------------------------------------------------------


class StubEnv:
    """An `SC2Env` of two players that counts loops and notes what enters."""

    forfeit = None

    def __init__(self, last_loop: int) -> None:
        self.entered: list[tuple[list[list[str]], int]] = []
        self._last_loop = last_loop

    def step(self, actions: list[list[str]], step_mul: int) -> list[SimpleNamespace]:
        self.entered.append((actions, step_mul))
        loop = sum(loops for _, loops in self.entered)
        return [self._time_step(loop, player) for player in (1, 2)]

    def _time_step(self, loop: int, player: int) -> SimpleNamespace:
        response = sc_pb.ResponseObservation()
        response.observation.game_loop = loop
        response.observation.player_common.player_id = player
        response.observation.raw_data.event.dead_units.append(100 * player + loop)
        ended = loop >= self._last_loop
        if ended:
            for number, result in ((1, sc_pb.Victory), (2, sc_pb.Defeat)):
                response.player_result.add(player_id=number, result=result)
        observation = {"_response_observation": lambda: response, "available_actions": [0]}
        return SimpleNamespace(observation=observation, last=lambda: ended)


def play(plans: list[list[PlanStep]], last_loop: int) -> tuple[StubEnv, tuple[StepResult, ...]]:
    """Play plans of two players, which return their numbers of steps."""

    def plan(steps: list[PlanStep]) -> Plan:
        for step in steps:
            if (yield step).ended:
                break
        return PlanResult((f"{len(steps)} steps",))

    game = object.__new__(PySC2Game)
    env = StubEnv(last_loop)
    game._env, game._ended, game._asks = env, False, False
    game._maps = (EpisodeInfo(facts_of("multi")), EpisodeInfo(facts_of("multi")))
    game._creep = [NO_GRID, NO_GRID]
    game._battle = None
    return env, game.act([plan(steps) for steps in plans])


def test_two_players_share_the_steps_and_each_action_enters_once() -> None:
    env, turns = play([[PlanStep(("a",), 1), PlanStep(("b",), 3)], [PlanStep(("c",), 8)]], last_loop=99)
    assert env.entered == [([["a"], ["c"]], 1), ([["b"], []], 3), ([[], []], 4)]
    assert [turn.snapshot.game_loop for turn in turns] == [8, 8]
    assert [turn.snapshot.dead for turn in turns] == [{101, 104, 108}, {201, 204, 208}]
    assert [(turn.env_steps, turn.played.functions) for turn in turns] == [(3, ("2 steps",)), (3, ("1 steps",))]


def test_plans_end_with_the_episode() -> None:
    env, turns = play([[PlanStep(("a",), 1), PlanStep(("b",), 1)], [PlanStep(("c",), 8)]], last_loop=1)
    assert env.entered == [([["a"], ["c"]], 1)]
    assert [(turn.snapshot.ended, turn.snapshot.outcome) for turn in turns] == [(True, "win"), (True, "loss")]
    assert [turn.played.functions for turn in turns] == [("2 steps",), ("1 steps",)]


# --- where the game is --------------------------------------------------------------------------------------------


def lay_out(directory: Path, *, script: str = "#!/bin/sh\nexit 3\n", maps: bool = True) -> Path:
    """Return a directory that looks like an install, whose game is a script."""
    binary = directory / "Versions" / "Base75689" / "SC2_x64"
    binary.parent.mkdir(parents=True)
    binary.write_text(script)
    binary.chmod(binary.stat().st_mode | stat.S_IXUSR)
    if maps:
        battle = directory / "Maps" / "llm_smac" / "2s3z.SC2Map"
        battle.parent.mkdir(parents=True)
        battle.write_bytes(b"a map")
    return directory


def test_a_game_is_found_by_name_by_sc2path_or_by_directory(tmp_path: Path) -> None:
    install = lay_out(tmp_path / "sc2")
    assert find_sc2("simulator", simulator=install) == install
    assert find_sc2("starcraft2", environ={"SC2PATH": str(install)}) == install
    assert find_sc2(str(install)) == install


def test_a_missing_game_is_told_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("simulator", {}, "the simulator is not installed: `khala sc2 install DIR` installs it"),
        (
            "starcraft2",
            {"environ": {"SC2PATH": "/no/where"}},
            "there is no StarCraft II in /no/where (SC2PATH): no such directory; set SC2PATH to where it is",
        ),
        (
            str(tmp_path / "empty"),
            {},
            f"there is no StarCraft II in {tmp_path}/empty: it has no directory Versions with a Base in it",
        ),
    ]
    for source, options, text in cases:
        with pytest.raises(GameMissing) as error:
            find_sc2(source, **options)
        assert str(error.value) == text
        assert isinstance(error.value, KhalaError)


def config(directory: Path) -> GameConfig:
    return GameConfig(sc2path=directory, map=known_maps()["2s3z"], start_timeout_s=8)


@pytest.mark.posix
def test_a_map_that_is_no_file_of_a_fair_size_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install = lay_out(tmp_path / "sc2", maps=False)
    path = install / "Maps" / "llm_smac" / "2s3z.SC2Map"
    path.parent.mkdir(parents=True)
    os.mkfifo(path)
    with pytest.raises(GameMissing, match=r"2s3z.SC2Map cannot be read: it is a pipe or a device"):
        PySC2Game(config(install))
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(GameMissing, match=r"2s3z.SC2Map cannot be read: it is a pipe or a device"):
        PySC2Game(config(install))
    path.unlink()
    path.write_bytes(b"x" * 11)
    monkeypatch.setattr(pysc2_game, "MAX_MAP_BYTES", 10)
    with pytest.raises(GameMissing, match=r"2s3z.SC2Map cannot be read: it is larger than"):
        PySC2Game(config(install))


def test_a_missing_map_is_told(tmp_path: Path) -> None:
    install = lay_out(tmp_path / "sc2", maps=False)
    with pytest.raises(GameMissing) as error:
        PySC2Game(config(install))
    assert str(error.value) == (
        f"there is no map llm_smac/2s3z.SC2Map in {install}/Maps: copy it there, or play with the simulator"
    )


def test_a_game_that_ends_before_it_listens_is_told_and_leaves_the_environment_alone(tmp_path: Path) -> None:
    before = dict(os.environ)
    seen = "it ended before it listened|Failed to connect to the SC2 websocket"  # by what is seen of it first
    with pytest.raises(GameError, match=rf"^the game could not be started: ({seen})"):
        PySC2Game(config(lay_out(tmp_path / "sc2")))
    assert dict(os.environ) == before
