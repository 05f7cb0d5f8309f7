"""Advisers: what a person writes from outside the match, who reads it, and what says so afterwards."""

from __future__ import annotations

import asyncio
import io
import json
import os
import subprocess
import sys
import tempfile
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_workers
from khala_bridge.task.config import AdviserConfig
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_orchestrator.publish.advisers import AdviceInbox
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError
from khala_protocol.keys import Topic, agent_key, host_key, run_key
from khala_protocol.messages import Advice, Casualties, Message, Report, Result, Run
from khala_protocol.recording import Recording
from khala_sc2.commands.advise import Adviser, Advising, MatchGone, lines_about, run_advise
from khala_sc2.playing import games, local_bus
from khala_sc2.playing.hosting import game_of
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Coroutine, Iterator
    from pathlib import Path

    from khala_protocol.messages import Briefing, Observation

RUN = "advised"


def match(steps: int, record: Path | None = None) -> MatchConfig:
    task = change(load_task("2s3z_pair"), max_steps=steps)
    coach = AdviserConfig(name="Ada", role="a human coach")
    return MatchConfig(task=task.model_copy(update={"advisers": (coach,)}), run=RUN, record=record)


@pytest.mark.game
async def test_what_an_adviser_writes_is_read_recorded_counted_and_replayed(tmp_path: Path) -> None:
    sc2path, name = games.find("simulator")
    config = match(6, tmp_path / "advised.mcap").model_copy(update={"game": name})
    broker, heard, wrote = MemoryBroker(), dict[tuple[str, int], list[tuple[str, str]]](), asyncio.Event()
    shown: list[Run | Report | Result] = []
    complaints: list[str] = []

    async def lines() -> AsyncIterator[str]:
        for line in ("fall back", "@Zealots hold", "@Nobody hello"):
            yield line
        wrote.set()

    async def decide(briefing: Briefing, seen: Observation) -> str:
        heard[briefing.agent, seen.step] = [(m.sender, m.text) for m in seen.messages]
        await wrote.wait()
        return "Analysis: I listen."

    adviser = Advising(broker.session(), Adviser(RUN, "blue", "Ada"), show=shown.append, complain=complaints.append)
    policies = {agent: FunctionPolicy(decide) for agent in ("Stalkers", "Zealots")}
    async with game_of(config, sc2path) as game, asyncio.TaskGroup() as group:
        group.create_task(run_workers(broker.session(), RUN, "blue", policies))
        group.create_task(adviser.play(lines()))
        (result,) = await host(config, game, broker.session())

    who = "Ada (a human coach)"
    assert {place: said for place, said in heard.items() if said} == {
        ("Stalkers", 1): [(who, "fall back")],
        ("Zealots", 1): [(who, "fall back"), (who, "hold")],
    }
    assert complaints == ["there is no agent 'Nobody': write to Stalkers, Zealots or everyone"]
    assert result.advisers == {"Ada": 2}
    recording = Recording.open(tmp_path / "advised.mcap")
    assert recording.run is not None
    assert recording.run.advisers == ("Ada",)
    assert [(m.agent, m.recipient, m.text) for m in recording.of(Message) if m.human] == [
        ("Ada", "everyone", "fall back"),
        ("Ada", "Zealots", "hold"),
    ]
    assert [report.advisers for report in shown if isinstance(report, Report)] == [("Ada", "Ada"), *[()] * 5]
    assert isinstance(shown[0], Run)
    assert shown[-1] == result
    assert await replay_host(tmp_path / "advised.mcap") == []


async def test_advice_of_a_stranger_is_dropped_and_an_adviser_may_write_five_messages_a_step() -> None:
    broker = MemoryBroker()
    async with AdviceInbox(broker.session(), RUN, [Seat("blue", "Ada")]) as inbox:
        for sender, author in (("Stalkers", "Stalkers"), ("Ada", "Stalkers"), *[("Ada", "Ada")] * 9):
            publisher = await broker.session().publisher(agent_key(RUN, "blue", sender, Topic.ADVICE), Delivery.SPEECH)
            await publisher.put(encode(Advice(run=RUN, side="blue", agent=author, recipient="everyone", text="go")))
            await publisher.put(b"no message")
        await asyncio.sleep(0)
        taken = inbox.take()
        assert [advice.agent for advice in taken] == ["Ada"] * 5
        assert inbox.take() == []


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("@Stalkers ", "there is no text: write a line, or @NAME and a line"),
        ("x" * 501, "a message has at most 500 characters, and this one 501"),
        ("@Red go", "there is no agent 'Red': write to Stalkers, Zealots or everyone"),
    ],
)
def test_a_line_that_is_no_message_gets_a_sentence(line: str, sentence: str) -> None:
    card = run_card()
    with pytest.raises(ConfigError) as caught:
        Adviser(RUN, "blue", "Ada").advice(line, card)
    assert str(caught.value) == sentence


async def test_a_run_that_is_not_there_is_a_sentence() -> None:
    advising = Advising(MemoryBroker().session(), Adviser("none", "blue", "Ada"), show=print, complain=print)
    with pytest.raises(ConfigError, match="no match of the name 'none' was found"):
        await advising.play(nothing(), find_s=0.01)


async def test_a_match_whose_host_stays_away_is_gone_and_one_whose_host_goes_on_is_not() -> None:
    broker, shown = MemoryBroker(), asyncio.Queue[Run | Report | Result]()
    lost, resumed = broker.session(), broker.session()

    async def advise(away_s: float) -> None:
        advising = Advising(broker.session(), Adviser(RUN, "blue", "Ada"), show=shown.put_nowait, complain=print)
        await advising.play(nothing(), find_s=away_s)

    await lost.announce(host_key(RUN))
    await (await lost.publisher(run_key(RUN, Topic.RUN), Delivery.STATE)).put(encode(run_card()))
    async with asyncio.TaskGroup() as group:
        hasty = group.create_task(_error_of(advise(0.01)))
        group.create_task(advise(60))
        assert [await shown.get(), await shown.get()] == [run_card()] * 2
        lost.kill()
        assert str(await hasty).startswith(
            "the match 'advised' is gone: its host went away without a result, and was not back within 0.01 s; "
        )
        await resumed.announce(host_key(RUN))
        results = await resumed.publisher(run_key(RUN, Topic.RESULT), Delivery.STATE)
        for side in ("blue", "red"):
            await results.put(encode(drawn().but(side=side)))


async def _error_of(advising: Coroutine[None, None, None]) -> MatchGone:
    with pytest.raises(MatchGone) as gone:
        await advising
    return gone.value


async def test_of_all_matches_on_this_machine_the_one_of_the_name_is_found(
    short: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another one is newer: of `khala serve`, for example."""
    monkeypatch.setattr("tempfile.tempdir", short)
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    card = run_card()
    card = card.but(agents=card.agents[:2])  # of one side
    async with AsyncExitStack() as stack:
        for played in (True, False):
            listen = stack.enter_context(local_bus.local_endpoint())
            bus = await open_bus(BusConfig(mode="router", listen=(listen,)))
            stack.push_async_callback(bus.close)
            for topic, message in ((Topic.RUN, card), (Topic.RESULT, drawn())) if played else ():
                await (await bus.publisher(run_key(RUN, topic), Delivery.STATE)).put(encode(message))
            if not played:
                os.utime(listen.partition("/")[2], (2**31, 2**31))
        ada = Adviser(RUN, "blue", "Ada")
        await asyncio.to_thread(run_advise, ada, connect=(), tls=None, insecure=False, as_json=False)
    assert "blue: draw, time limit" in capsys.readouterr().out


def test_a_persons_lines_say_what_happened_and_hide_no_control_characters() -> None:
    report = Report.model_validate(
        {
            "run": RUN, "episode": 0, "step": 3, "game_loop": 224, "score": 50, "advisers": ["Ada"],
            "agents": [{"agent": "Stalkers", "side": "blue", "status": "late"}],
            "messages": [{"sender": "Ada", "recipient": "everyone", "text": "go\x1b[2J"}],
        }
    )  # fmt: skip
    assert list(lines_about(report)) == ["0:10  step 3  score 50  Stalkers late", "    Ada → everyone: go\\x1b[2J"]


@pytest.fixture
def short() -> Iterator[str]:
    """Yield a directory with a path that is short enough for a unix socket in it."""
    with tempfile.TemporaryDirectory() as directory:
        yield directory


@pytest.mark.slow
@pytest.mark.game
def test_the_command_advises_a_running_match(tmp_path: Path, short: str) -> None:
    environ = {**os.environ, "TMPDIR": short}
    khala = [sys.executable, "-m", "khala_sc2"]
    options = ["--run", "live", "--latency", "0.5", "--max-steps", "12", "--out", str(tmp_path), "--json"]
    with subprocess.Popen(
        [*khala, "run", "2s3z_pair", *options], env=environ, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as playing:
        while not list(tmp_path.glob("live/*.mcap")):
            assert playing.poll() is None
        advised = subprocess.run(
            [*khala, "advise", "live"], env=environ, input="fire on one\n", capture_output=True, text=True, check=True
        )
        assert playing.stdout is not None
        (result,) = json.loads(playing.stdout.read())["results"]
    assert result["advisers"] == {"Adviser": 1}
    assert "    Adviser → everyone: fire on one" in advised.stdout.splitlines()


def run_card() -> Run:
    seats = [{"name": name, "side": "blue", "teams": ()} for name in ("Stalkers", "Zealots")]
    seats.append({"name": "Red", "side": "red", "teams": ()})
    fields = {
        "run": RUN, "task": "t", "map_name": "m", "map_sha256": "", "seed": 1, "episodes": 1, "game": "g",
        "executor": "raw", "clock": {}, "agents": seats, "catalogue_sha256": "", "versions": {}, "advisers": ("Ada",),
    }  # fmt: skip
    return Run.model_validate(fields)


def drawn() -> Result:
    nothing_lost = Casualties(units=0, value=0)
    return Result(
        run=RUN, episode=0, outcome="draw", cause="time limit", steps=1, game_loop=8, game_s=0.4, wall_s=0.1,
        killed=nothing_lost, lost=nothing_lost, kd=None,
    )  # fmt: skip


async def nothing() -> AsyncIterator[str]:
    return
    yield
