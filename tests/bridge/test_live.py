"""Whole battles on the simulator, through PySC2, by a player that reads nothing but the text."""

from __future__ import annotations

import contextlib
import os
import re
import signal
from typing import TYPE_CHECKING

import pytest

from khala_bridge.act import Actor, executor_of
from khala_bridge.errors import GameError, GameHangs
from khala_bridge.game.game import GameConfig, GamePatience, GameThread, Sides, StepResult
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.observe import Feedback, Observer
from khala_bridge.task.maps import known_maps
from khala_protocol.speech import parse
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Play = Callable[..., "Battle"]

pytestmark = pytest.mark.game

TEAM = re.compile(r"^Team (\S+)\n((?: .*\n)+)", re.MULTILINE)
ENEMY = re.compile(r"\| tag (0x[0-9a-f]+) \| screen \S+ \S+ \| distance \S+ \| health (\d+)/\d+ \| shield (\d+)")


def focus_fire(text: str) -> str:
    """Return a reply in which every team attacks the weakest enemy on its screen."""
    lines = ["Actions:"]
    life = {tag: int(health) + int(shield) for tag, health, shield in ENEMY.findall(text)}
    for name, block in TEAM.findall(text):  # a second team's block names those that the first one's describes
        enemies = [(life[tag], tag) for tag in re.findall(r"0x[0-9a-f]+", block) if tag in life]
        lines += [f"Team {name}:"] + ([f"<Attack_Unit({min(enemies)[1]})>"] if enemies else [])
    return "\n".join(lines)


class Battle:
    """A task in a game, played turn by turn."""

    def __init__(self, game: PySC2Game, task: TaskConfig) -> None:
        self.game, self.task = game, task
        self.actor, self.observer, self.executor = Actor(task), Observer(task), executor_of(task)
        self.texts: list[str] = []
        self.turns: list[StepResult] = []
        self.reasons: list[str] = []
        self._feedback: dict[str, Feedback] = {}
        (self.now,) = game.reset()

    def turn(self, policy: Callable[[str], str]) -> Snapshot:
        observation = self.observer.observe(self.now, self._feedback)
        self.texts += [agent.text for agent in observation.agents.values()]
        joint = self.actor.joint(
            observation, {name: parse(policy(agent.text)) for name, agent in observation.agents.items()}
        )
        (turn,) = self.game.act([self.executor.plan(joint.commands, self.now, self.task.clock.step_loops)])
        self.turns.append(turn)
        refused = {
            name: (*joint.rejections[name], *(r.rejection for r in turn.played.refusals if r.agent == name))
            for name in joint.accepted
        }
        self.reasons += [rejection.reason for rejections in refused.values() for rejection in rejections]
        self._feedback = {name: Feedback(joint.accepted[name], refused[name]) for name in joint.accepted}
        self.now = turn.snapshot
        return self.now

    def to_the_end(self) -> Battle:
        while not self.now.ended:
            self.turn(focus_fire)
        return self


@pytest.fixture(scope="module")
def sc2path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("sc2"))


@contextlib.contextmanager
def starting(sc2path: Path, task: Callable[..., TaskConfig]) -> Iterator[Play]:
    """Start battles, and close them all at the end."""
    games: list[PySC2Game] = []

    def begin(executor: str, name: str = "2s3z") -> Battle:
        config = task(name, executor=executor)
        games.append(PySC2Game(GameConfig(sc2path=sc2path, map=config.map_spec, seed=3)))
        return Battle(games[-1], config)

    yield begin
    for game in games:
        game.close()


@pytest.fixture
def start(sc2path: Path, task: Callable[..., TaskConfig]) -> Iterator[Play]:
    with starting(sc2path, task) as begin:
        yield begin


@pytest.fixture(scope="module")
def finished(sc2path: Path, task: Callable[..., TaskConfig]) -> Iterator[Battle]:
    """Yield a battle that was played to its end."""
    with starting(sc2path, task) as begin:
        yield begin("raw").to_the_end()


BATTLES = [name for name, spec in known_maps().items() if spec.file.startswith("llm_smac/")]
SEVERAL_TEAMS = "1c3s5z"  # of three types, one of them three times


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n != SEVERAL_TEAMS else []) for n in BATTLES]
)
def test_the_teams_of_a_battle_begin_with_the_units_of_the_paper(
    name: str, start: Play, paper_teams: dict[str, dict[str, int]]
) -> None:
    battle = start("raw", name)
    (agent,) = battle.observer.observe(battle.now).agents.values()
    assert {team.name: len(team.view.units) for team in agent.teams} == paper_teams[name]
    battle.turn(focus_fire)
    assert battle.reasons == []


@pytest.mark.parametrize(
    ("name", "units"),
    [
        pytest.param("MoveToBeacon", {"Marine": 1}, marks=pytest.mark.slow),
        ("smac_MMM", {"Marine": 7, "Marauder": 2, "Medivac": 1}),
        pytest.param("pvz_task4_level1", {"Stalker": 12}, marks=pytest.mark.slow),
        pytest.param("Simple64", {"Probe": 12, "Base": 0}, marks=pytest.mark.slow),
    ],
)
def test_a_map_without_a_task_file_is_played_by_one_commander(start: Play, name: str, units: dict[str, int]) -> None:
    battle = start("raw", name)
    (agent,) = battle.observer.observe(battle.now).agents.values()
    assert {team.name: len(team.view.units) for team in agent.teams} == units
    battle.turn(lambda _: "")
    assert battle.now.outcome is None


@pytest.mark.parametrize("executor", ["raw", pytest.param("screen", marks=pytest.mark.slow)])
def test_a_battle_is_played_to_its_end(executor: str, start: Play, finished: Battle) -> None:
    battle = finished if executor == "raw" else start(executor).to_the_end()
    assert battle.now.outcome in ("win", "loss")  # five against five do not last until the time is up
    assert len(battle.turns) > 10
    assert set(battle.reasons) <= {"refused_by_game"}
    steps = {turn.env_steps for turn in battle.turns}
    assert steps == {1} if executor == "raw" else max(steps) > 3 * 2
    dead = frozenset[int]().union(*(turn.snapshot.dead for turn in battle.turns))
    assert len(dead) >= 5


def test_a_battle_of_smac_ends_with_the_last_unit_of_a_side_and_begins_anew(start: Play) -> None:
    battle = start("raw", "smac_3m")
    while not battle.now.ended:
        battle.turn(lambda _: "")
    assert (battle.now.outcome, battle.now.own, len(battle.now.dead)) == ("loss", (), 1)
    (fresh,) = battle.game.reset()
    assert (fresh.ended, fresh.outcome, len(fresh.own)) == (False, None, 3)


@pytest.mark.slow
def test_both_executors_give_the_same_orders(start: Play) -> None:
    battles = [start("raw"), start("screen")]
    for battle in battles:
        while "Enemy units" not in battle.observer.observe(battle.now).agents["CombatGroupSmac"].text:
            battle.turn(lambda _: "")
    before = [_orders(battle) for battle in battles]
    for battle in battles:
        battle.turn(focus_fire)
    after = [_orders(battle) for battle in battles]
    assert before[0] == before[1]
    assert after[0] == after[1] != before[0]


def _orders(battle: Battle) -> dict[int, list[tuple[int, int]]]:
    return {u.tag: [(o.ability_id, o.target_unit_tag) for o in u.orders] for u in battle.now.own}


@pytest.mark.slow
def test_the_same_seed_and_replies_give_the_same_observations(start: Play, finished: Battle) -> None:
    assert start("raw").to_the_end().texts == finished.texts


def test_an_episode_that_is_over_is_not_played_on_but_reset(finished: Battle) -> None:
    battle = finished
    with pytest.raises(GameError, match="the episode is over: reset the game before you play on"):
        battle.game.act([battle.executor.plan([], battle.now, 8)])
    (fresh,) = battle.game.reset()
    assert (fresh.ended, fresh.outcome, len(fresh.own)) == (False, None, 5)
    assert fresh.game_loop < 16


def test_a_game_that_dies_is_an_error_and_can_be_closed(start: Play) -> None:
    battle = start("raw")
    battle.game.kill()
    with pytest.raises(GameError, match=r"^the game died or broke its contract: "):
        battle.turn(lambda _: "")
    battle.game.close()
    battle.game.close()


@pytest.mark.posix
@pytest.mark.slow
async def test_a_stopped_game_is_noticed_killed_and_named(
    sc2path: Path, task: Callable[..., TaskConfig], caplog: pytest.LogCaptureFixture
) -> None:
    games: list[PySC2Game] = []

    def begin() -> PySC2Game:
        games.append(PySC2Game(GameConfig(sc2path=sc2path, map=task("2s3z").map_spec, seed=3)))
        return games[0]

    thread = GameThread(begin, patience=GamePatience(least_s=4.0))
    async with Sides(thread, [executor_of(task("2s3z"))]) as side:
        await side.reset()
        for _ in range(3):
            await side.act([[]], 11)
        (process,) = games[0]._env._sc2_procs
        pid = process.pid
        os.kill(pid, signal.SIGSTOP)
        with pytest.raises(GameHangs, match=r"^the game did not answer within \d[.\d]* s and was ended"):
            await side.act([[]], 11)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    assert caplog.messages[0] == "the game has not answered for 2 s"
