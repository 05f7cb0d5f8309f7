"""`khala fork`: the golden battle, forked on the simulator, and what is said of forks."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import psutil
import pytest

from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.past.fork import Trunk, trunk_of
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.messages import Casualties, ModelCall, Observation, Reply, Result
from khala_protocol.recording import Recorder, Recording
from khala_sc2.cli import main
from khala_sc2.commands.exit_codes import NOT_VALID, SIGNALLED
from khala_sc2.fork.figures import are_alike, figures, of_side, rate
from khala_sc2.fork.futures import Future, Plan, Purse, play_all
from khala_sc2.fork.players import players_of
from khala_sc2.fork.recorded import play_recorded
from khala_sc2.fork.scan import rank, steps_of
from khala_sc2.playing import one_process, worker
from khala_sc2.playing.jobs import Ended
from khala_sc2.playing.minds import Minds
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    from khala_sc2.playing.jobs import Job

GOLDEN = Path(__file__).with_name("golden.mcap")
SIDE = "blue"


class Here:
    """An engine that plays one match at a time in this process."""

    slots = 1

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        """Leave nothing behind."""

    async def play(self, job: Job) -> Ended:
        return await worker.play(job, game="simulator")


@pytest.fixture(scope="module")
def golden() -> Trunk:
    return trunk_of(Recording.open(GOLDEN))


def planned(trunk: Trunk, out: Path, who: str, **options: Any) -> Plan:
    return Plan(trunk, players_of(trunk.config.task, Minds().with_name(who), {}, []), out, **options)


def seen_in(recording: Recording, steps: range) -> list[bytes]:
    """Return what agents saw in some steps, as bytes, as if the run had no name."""
    return [encode(seen.but(run="x")) for seen in recording.of(Observation) if seen.step in steps]


# --- on the simulator -----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.game
async def test_the_recorded_future_comes_about_again(golden: Trunk, tmp_path: Path) -> None:
    again = await play_recorded(golden, tmp_path, game="simulator")
    assert again.differences == []
    assert again.same
    (now,), (recorded,) = again.results, golden.results
    assert (now.outcome, now.game_loop, now.killed, now.lost, now.accepted, now.statuses) == (
        recorded.outcome, recorded.game_loop, recorded.killed, recorded.lost, recorded.accepted, recorded.statuses,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.game
async def test_a_fork_is_the_recorded_match_up_to_its_step_and_goes_on_as_others_decide(
    golden: Trunk, tmp_path: Path
) -> None:
    step, steps = 40, len(golden.loops)
    (future,) = await play_all(planned(golden, tmp_path, "skilled").forks(step, 1), Here())
    assert future.error == ""
    forked = Recording.open(future.fork.record)
    assert seen_in(forked, range(step + 1)) == seen_in(golden.recording, range(step + 1))
    assert seen_in(forked, range(step + 1, steps)) != seen_in(golden.recording, range(step + 1, steps))
    assert forked.run is not None
    assert forked.run.forked is not None
    assert forked.run.forked.model_dump() == {"run": "golden", "sha256": golden.sha256, "episode": 0, "step": step}
    assert [path.name for path in future.fork.record.parent.iterdir()] == ["recording.mcap"]
    assert (future.decisions, future.failed) == (sum(reply.step >= step for reply in forked.of(Reply)), 0)
    assert await replay_host(future.fork.record) == []


@pytest.mark.game
@pytest.mark.slow
@pytest.mark.parametrize("step", [0, 7, 30, -1])
async def test_the_model_that_was_recorded_comes_to_the_recorded_end(golden: Trunk, tmp_path: Path, step: int) -> None:
    step = step % len(golden.loops)
    futures = await play_all(planned(golden, tmp_path, "scripted/focus-fire").forks(step, 2), Here())
    steps = range(len(golden.loops))
    for future in futures:
        assert seen_in(Recording.open(future.fork.record), steps) == seen_in(golden.recording, steps)
    assert are_alike(futures)
    found = figures(of_side(futures, SIDE), from_loop=golden.loop_at(step))
    recorded = figures(golden.results, from_loop=golden.loop_at(step))
    assert (found.won, found.kd, found.balance, found.game_s) == (2, recorded.kd, recorded.balance, recorded.game_s)


@pytest.mark.game
@pytest.mark.slow
async def test_a_model_that_goes_on_remembers_the_recorded_steps(golden: Trunk, tmp_path: Path) -> None:
    plan = planned(golden, tmp_path, "scripted", memory="steps=2,whole=true")
    last = len(golden.loops) - 1
    (future,) = await play_all(plan.forks(last, 1), Here())
    replies = {(reply.agent, reply.step): reply.text for reply in golden.recording.of(Reply)}
    first = next(call for call in Recording.open(future.fork.record).of(ModelCall) if call.step == last)
    remembered = [message.content for message in first.prompt if message.role == "assistant"]
    assert remembered[1:] == [replies[first.agent, last - 2], replies[first.agent, last - 1]]


@pytest.mark.game
@pytest.mark.slow
async def test_a_scan_finds_where_it_matters_that_somebody_decides(golden: Trunk, tmp_path: Path) -> None:
    plan = planned(golden, tmp_path, "silent")
    steps = steps_of(golden, 20)
    assert steps == [*range(0, len(golden.loops), 20)]
    points = rank(golden, await play_all([fork for step in steps for fork in plan.forks(step, 1)], Here()))
    assert [point.step for point in points][-1] == steps[-1]
    assert [abs(point.more_won) for point in points] == sorted((abs(one.more_won) for one in points), reverse=True)


@pytest.mark.game
@pytest.mark.slow
async def test_each_side_of_a_duel_gets_a_player(tmp_path: Path) -> None:
    config = MatchConfig(task=change(load_task("duel_3m"), max_steps=12), run="duel", record=tmp_path / "duel.mcap")
    await one_process.play(config, dict.fromkeys(("blue", "red"), Minds().with_name("skilled")), game="simulator")
    trunk = trunk_of(Recording.open(tmp_path / "duel.mcap"))
    minds = players_of(trunk.config.task, None, {"blue": "silent", "red": "skilled"}, [])
    (future,) = await play_all(Plan(trunk, minds, tmp_path / "forks").forks(6, 1), Here())
    assert {result.side for result in future.results} == {"blue", "red"}
    forked = Recording.open(future.fork.record)
    assert seen_in(forked, range(7)) == seen_in(trunk.recording, range(7))


# --- the command ----------------------------------------------------------------------------------------


def khala(*arguments: str, cwd: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "khala_sc2", *arguments],
        cwd=cwd, env=os.environ | {"COLUMNS": "200"}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.game
def test_the_command_prints_what_became_of_forks_and_leaves_their_recordings(tmp_path: Path) -> None:
    command = ["fork", str(GOLDEN), "--at", "40", "--policy", "focus-fire", "--times", "1", "--out", "forks", "--json"]
    with khala(*command, cwd=tmp_path) as process:
        told, words = process.communicate(timeout=110)
    assert process.returncode == 0, words
    data = json.loads(told)
    assert (data["run"], data["step"], data["recorded"][SIDE]["won"], data["forked"][SIDE]["futures"]) == (
        "golden", 40, 1, 1,
    )  # fmt: skip
    (fork,) = data["forks"]
    assert Recording.open(tmp_path / fork["recording"]).complete
    assert fork["recording"] == "forks/fork-40-1/recording.mcap"
    assert "fork-40-1: win" in words


@pytest.mark.game
@pytest.mark.slow
def test_ctrl_c_ends_every_process_and_keeps_what_was_played(tmp_path: Path) -> None:
    command = ["fork", str(GOLDEN), "--at", "1", "--policy", "skilled", "--times", "50", "--out", "forks"]
    with khala(*command, "--jobs", "2", cwd=tmp_path) as process:
        assert process.stderr is not None
        assert "fork-1-" in process.stderr.readline()
        below = psutil.Process(process.pid).children(recursive=True)
        assert below
        process.send_signal(signal.SIGINT)
        _, words = process.communicate(timeout=60)
    assert process.returncode == SIGNALLED + signal.SIGINT, words
    assert "interrupted; the forks that were played are in forks" in words
    gone, alive = psutil.wait_procs(below, timeout=10)
    assert len(gone) == len(below), alive


PRICED = """
profile: compatible
model: skilled
base_url: {base_url}
prices: {{prompt: 100.0, completion: 100.0}}
"""


@pytest.mark.game
@pytest.mark.slow
def test_forks_never_spend_more_than_the_budget(tmp_path: Path) -> None:
    llm = [sys.executable, "-m", "khala_sc2", "llm", "--port", "0", "--json"]
    with subprocess.Popen(llm, stdout=subprocess.PIPE, text=True) as endpoint:
        assert endpoint.stdout is not None
        base_url = json.loads(endpoint.stdout.readline())["base_url"]
        (tmp_path / "priced.yaml").write_text(PRICED.format(base_url=base_url))
        command = ["fork", str(GOLDEN), "--at", "30", "--model", "priced.yaml", "--times", "3", "--out", "forks"]
        with khala(*command, "--budget-usd", "6", "--json", cwd=tmp_path) as process:
            told, words = process.communicate(timeout=300)
        endpoint.terminate()
    assert process.returncode in (0, NOT_VALID), words
    forks = json.loads(told)["forks"]
    assert 0 < sum(fork["spent_usd"] for fork in forks) <= 6
    assert any(fork["failed"] for fork in forks)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the golden recording, and with copies that nobody can fork."""
    place = tmp_path_factory.mktemp("fork")
    changes = {
        "golden": (b"", b""),
        "real": (b"Khala simulator", b"StarCraft II"),
        "timed": (b'"rule":"frozen"', b'"rule":"realtime"'),
    }
    for name, (old, new) in changes.items():
        with Recorder(place / f"{name}.mcap") as recorder:
            for sample in Recording.open(GOLDEN):
                is_card = sample.key.endswith("/run") and old
                recorder.write(sample.key, sample.payload.replace(old, new) if is_card else sample.payload)
    return place


BAD = [
    ("nowhere.mcap --at 3", "nowhere.mcap: there is no such file"),
    ("golden.mcap", "say where to fork: --at STEP, or --scan for many steps"),
    ("golden.mcap --at 3 --scan --model skilled", "say where to fork: --at STEP, or --scan"),
    ("golden.mcap --at 51", "has the steps 0 to 50 of episode 0: it cannot be forked at step 51"),
    ("golden.mcap --at 51 --policy silent", "it cannot be forked at step 51"),
    ("golden.mcap --at 3 --episode 2", "has no complete step of episode 2"),
    ("real.mcap --at 3", "was played on StarCraft II"),
    ("real.mcap --at 3 --policy silent", "which does not play the same game twice"),
    ("timed.mcap --at 3 --policy silent", "play the match with --clock token, which counts tokens instead"),
    ("golden.mcap --at 3 --model nope", "there is no model file 'nope'"),
    ("golden.mcap --at 3 --model openai", "no key: set the environment variable OPENAI_API_KEY"),
    ("golden.mcap --at 3 --policy silent --budget-usd 1 --agent Stalkers=vllm", "a budget needs the price of Qwen"),
    ("golden.mcap --at 3 --agent Stalkers=silent", "nobody decides for blue/Zealots after the step"),
    ("golden.mcap --at 3 --agent Stalkers", "--agent: 'Stalkers' names no agent with its model"),
    ("golden.mcap --at 3 --model silent --agent Who=silent", "there are blue/Stalkers, blue/Zealots"),
    ("golden.mcap --at 3 --policy silent --red silent", "the task has no side red: its only side is blue"),
    ("golden.mcap --at 3 --advise Who:go --policy silent", "--advise: there is no single 'Who' to advise"),
    ("golden.mcap --at 3 --advise everyone:go", "nobody decides for blue/Stalkers, blue/Zealots after the step"),
    ("golden.mcap --at 3 --memory notes=2 --policy silent", "notes would change what agents saw before the step"),
    ("golden.mcap --at 3 --base-url http://localhost:1/v1", "--base-url is for a model: name the model with --model"),
    ("golden.mcap --at 3 --model recorded --memory 2", "the recorded future cannot be changed: leave out --memory"),
    ("golden.mcap --scan --model recorded", "the recorded future cannot be changed: leave out --scan, or say --model"),
    ("golden.mcap --scan", "nobody decides for blue/Stalkers, blue/Zealots after the step"),
]


@pytest.mark.parametrize(("options", "words"), BAD)
def test_what_cannot_be_forked_is_one_sentence(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], options: str, words: str
) -> None:
    monkeypatch.chdir(place)
    monkeypatch.setenv("OPENAI_API_KEY", "")
    with pytest.raises(SystemExit) as ended:
        main(["fork", *options.split()])
    told = capsys.readouterr()
    assert ended.value.code == 1
    assert words in told.err
    assert len(told.err.strip().splitlines()) == 1


# --- who decides ----------------------------------------------------------------------------------------


def test_agents_and_sides_have_players_of_their_own() -> None:
    duel = load_task("duel_3m")
    players = players_of(duel, None, {"red": "focus-fire"}, ["blue/Captain=skilled"])
    assert players["blue"].groups(["Captain"])[0][0].policy == "skilled"
    assert players["red"].groups(["Captain"])[0][0].policy == "focus-fire"
    with pytest.raises(ConfigError, match="'Captain' is not the name of one agent: there are blue/Captain"):
        players_of(duel, Minds(), {}, ["Captain=skilled"])
    with pytest.raises(ConfigError, match="nobody decides for red/Captain after the step"):
        players_of(duel, None, {"blue": "silent"}, [])


# --- money ----------------------------------------------------------------------------------------------


def test_a_fork_may_spend_an_equal_part_of_what_those_before_it_left() -> None:
    purse = Purse(4.0, 4)
    assert [purse.take(), purse.take()] == [1.0, 1.0]
    purse.give_back(0.5)
    assert purse.take() == 1.25
    purse.give_back(-1.0)
    assert purse.take() == 1.25
    assert Purse(None, 4).take() is None


# --- figures --------------------------------------------------------------------------------------------


def result(outcome: str, *, killed: float = 100.0, lost: float = 50.0, valid: bool = True) -> Result:
    return Result.model_validate({
        "run": "r", "episode": 0, "outcome": outcome, "cause": "", "steps": 1, "game_loop": 224, "game_s": 10.0,
        "wall_s": 1.0, "killed": Casualties(value=killed), "lost": Casualties(value=lost), "kd": None, "valid": valid,
    })  # fmt: skip


def test_figures_count_valid_futures_and_say_how_sure_they_are() -> None:
    every = [result("win"), result("win"), result("loss", killed=40), result("draw"), result("win", valid=False)]
    found = figures(every, from_loop=112)
    assert (found.futures, found.invalid, found.won, found.drawn, found.lost) == (4, 1, 2, 1, 1)
    assert found.kd == pytest.approx(340 / 200)
    assert found.balance == pytest.approx(35)
    assert found.game_s == pytest.approx(5)
    assert figures([result("cut")], from_loop=0).cut == 1
    assert rate(found) == "50 % (15 to 85)"  # Wilson's of 2 in 4
    assert rate(figures([], from_loop=0)) == "unknown"


@pytest.fixture
def futures(golden: Trunk, tmp_path: Path) -> Any:
    """Makes what became of a fork at a step."""
    plan = planned(golden, tmp_path, "silent")

    def make(step: int, *results: Result) -> list[Future]:
        (fork,) = plan.forks(step, 1)
        return [Future(fork, [one]) for one in results]

    return make


def test_steps_are_ranked_by_wins_and_then_by_value(golden: Trunk, futures: Any) -> None:
    (recorded,) = golden.results
    better = recorded.but(killed=Casualties(value=recorded.killed.value + 100))
    played = [
        *futures(10, recorded, recorded),
        *futures(20, recorded, recorded.but(outcome="loss")),
        *futures(30, better, recorded),
        *futures(40, recorded.but(outcome="loss"), recorded.but(outcome="loss")),
    ]
    points = rank(golden, played)
    assert [(point.step, point.more_won, point.more_value) for point in points] == [
        (40, -1.0, 0.0), (20, -0.5, 0.0), (30, 0.0, 50.0), (10, 0.0, 0.0),
    ]  # fmt: skip


def test_a_scan_has_a_dozen_steps_and_needs_an_end_to_compare_with(golden: Trunk) -> None:
    assert steps_of(golden, None) == [*range(0, 51, 5)]
    assert steps_of(golden, 20, advised=True) == [20, 40]
    with pytest.raises(RecordingError, match="has no end of episode 0 to compare forks with"):
        steps_of(replace(golden, results=[]), None)


def test_a_fork_takes_a_number_that_is_free(golden: Trunk, tmp_path: Path) -> None:
    plan = planned(golden, tmp_path, "silent")
    (tmp_path / "fork-3-7").mkdir()
    (tmp_path / "fork-30-9").mkdir()
    assert [fork.record.parent.name for fork in plan.forks(3, 2)] == ["fork-3-8", "fork-3-9"]
    assert [fork.config.run for fork in plan.forks(4, 1)] == ["golden-fork-4-1"]


async def test_a_fork_that_could_not_be_played_says_why(golden: Trunk, tmp_path: Path) -> None:
    class Broken(Here):
        async def play(self, job: Job) -> Ended:
            assert job.beginning is not None
            assert job.beginning.exists()
            return Ended(state="lost", words="its process ended with SIGKILL")

    (future,) = await play_all(planned(golden, tmp_path, "silent").forks(3, 1), Broken(), budget_usd=1.0)
    assert (future.error, future.results) == ("its process ended with SIGKILL", ())
    assert list(future.fork.record.parent.iterdir()) == []
