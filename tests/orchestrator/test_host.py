"""A whole match on a bus in memory, from the run card to the last result; on a clock that jumps."""

from __future__ import annotations

import asyncio
import gc
import weakref
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.errors import GameError
from khala_orchestrator.host import host
from khala_orchestrator.roster import MissingAgents, Seat
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode, decode_as, encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic, agent_key
from khala_protocol.messages import Briefing, Message, ModelCall, Observation, Reply, Report, Result, Run
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.bus import Sample, Subscription
    from khala_protocol.bus.memory import MemoryBroker, MemoryBus
    from khala_protocol.messages import Wire
    from tests.orchestrator.conftest import Hall, Peer

    MakeConfig = Callable[..., MatchConfig]
    Drain = Callable[[Subscription[Sample]], Awaitable[list[Sample]]]
    MakePeer = Callable[[Seat], Peer]

CLOCK = "jumps"

RUN = "test"
STOP = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>"
"""The units do not move, but this is an order that the game gets."""


class Left:
    """A circle, as a match leaves many."""

    def __init__(self) -> None:
        self.own = self


def now_s() -> float:
    return asyncio.get_running_loop().time()


def thinking(takes_s: float, text: str = STOP, *, at: int = 0) -> Callable[[Peer, Observation], Awaitable[None]]:
    """An agent that thinks for some seconds at one step, and otherwise says nothing at once."""

    async def react(peer: Peer, seen: Observation) -> None:
        if seen.step == at:
            await asyncio.sleep(takes_s)
            await peer.answer(seen, text)
        else:
            await peer.answer(seen)

    return react


# --- what is published ----------------------------------------------------------------------------------


async def test_everything_is_on_the_bus_in_its_order(hall: Hall, config: MakeConfig, drain: Drain) -> None:
    samples = await hall.broker.session().subscribe("**", Delivery.STATE)
    (result,) = await hall.play(config(max_steps=2), Stalkers=thinking(1, "<MessageTo(Zealots, 'go')>"))
    published = [sample.key.removeprefix("khala/test/").removeprefix("blue/") for sample in await drain(samples)]
    said = [topic for topic in published if topic not in {"terrain", "scene"}]  # they are made while agents think
    agents = ("Stalkers", "Zealots")
    assert said[:5] == [
        "run",
        *(f"{agent}/briefing" for agent in agents),
        *(f"{agent}/observation" for agent in agents),
    ]
    assert sorted(said[5:7]) == [f"{agent}/reply" for agent in agents]
    assert said[7:11] == ["Stalkers/message", "report", *(f"{agent}/observation" for agent in agents)]
    assert sorted(said[11:13]) == [f"{agent}/reply" for agent in agents]
    assert said[13:] == ["report", "result"]
    assert [topic for topic in published if topic in {"terrain", "scene", "report"}] == [
        "terrain", "scene", "report", "scene", "report"
    ]  # fmt: skip
    assert (result.steps, result.cause) == (2, "step limit")


async def test_who_watches_sees_the_card_every_report_and_every_result(hall: Hall, config: MakeConfig) -> None:
    results = await hall.play(config(episodes=2, max_steps=2))
    assert [type(message) for message in hall.watched] == [Run, Report, Report, Result, Report, Report, Result]
    assert [(report.episode, report.step) for report in hall.reports] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert [message for message in hall.watched if isinstance(message, Result)] == results
    assert hall.game.calls == ["reset", "act", "act", "reset", "act", "act"]


async def test_a_process_of_many_matches_keeps_none_of_them(
    hall: Hall, config: MakeConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    await hall.play(config(max_steps=1))
    monkeypatch.setattr("khala_protocol.garbage._next_s", 0.0)  # as long after the first match as it takes
    first = Left()
    gone = weakref.finalize(first, lambda: None)
    del first
    frozen = gc.get_freeze_count()
    await hall.play(config(max_steps=1))
    assert not gone.alive
    assert 0 < gc.get_freeze_count() <= frozen


async def test_nobody_need_watch(hall: Hall, config: MakeConfig, peer: MakePeer) -> None:
    task = config(max_steps=1, max_wait_s=1.0)
    for name in ("Stalkers", "Zealots"):
        await peer(Seat("blue", name)).arrive()
    (result,) = await host(task, hall.side, hall.broker.session())
    assert result.statuses == {"Stalkers": {"late": 1}, "Zealots": {"late": 1}}


async def test_one_that_joins_at_the_end_still_gets_nothing_old(hall: Hall, config: MakeConfig, drain: Drain) -> None:
    await hall.play(config())
    assert await drain(await hall.broker.session().subscribe("**", Delivery.STATE)) == []


# --- who has to be there ----------------------------------------------------------------------------------


async def test_the_match_begins_when_the_last_required_agent_comes(
    hall: Hall, config: MakeConfig, peer: MakePeer
) -> None:
    zealots = peer(Seat("blue", "Zealots"))

    async def late() -> None:
        await asyncio.sleep(45)
        await zealots.arrive()
        await zealots.play(lambda peer, seen: peer.answer(seen))

    coming = asyncio.create_task(late())
    (result,) = await hall.play(config(), Zealots=None)
    coming.cancel()
    assert now_s() == 45
    assert result.statuses["Zealots"] == {"ok": 3}


async def test_agents_are_briefed_while_others_are_waited_for(hall: Hall, config: MakeConfig, drain: Drain) -> None:
    samples = await hall.broker.session().subscribe("**/briefing", Delivery.STATE)
    with pytest.raises(MissingAgents):
        await hall.play(config(episodes=3), Zealots=None)
    briefed = [decode_as(Briefing, sample.payload) for sample in await drain(samples)]
    assert [(one.agent, one.episode, one.episodes) for one in briefed] == [("Stalkers", 0, 3), ("Zealots", 0, 3)]


async def test_a_required_agent_that_never_comes_ends_it_before_it_begins(hall: Hall, config: MakeConfig) -> None:
    with pytest.raises(MissingAgents) as raised:
        await hall.play(config(assemble_s=30), Zealots=None)
    assert str(raised.value) == (
        "no agent took the place of blue/Zealots within 30 s: start one with "
        "`khala agent Zealots --side blue --run … --connect …`"
    )
    assert now_s() == 30
    assert [type(message) for message in hall.watched] == [Run]
    assert hall.game.calls == []


async def test_without_an_optional_agent_the_others_play(hall: Hall, config: MakeConfig) -> None:
    match = config()
    stalkers, zealots = match.task.agents
    task = match.task.model_copy(update={"agents": (stalkers, zealots.model_copy(update={"required": False}))})
    (result,) = await hall.play(match.model_copy(update={"task": task}), Zealots=None)
    assert result.statuses == {"Stalkers": {"ok": 3}, "Zealots": {"gone": 3}}
    assert now_s() == 0


# --- who answers in time ----------------------------------------------------------------------------------


async def test_what_comes_late_is_neither_carried_out_nor_delivered(hall: Hall, config: MakeConfig) -> None:
    heard: list[tuple[str, ...]] = []

    async def zealots(peer: Peer, seen: Observation) -> None:
        heard.append(tuple(message.text for message in seen.messages))
        if seen.step == 1:
            await asyncio.sleep(1)  # so that the step is still open when the other's old reply comes
        await peer.answer(seen)

    words = f"{STOP}\nCommunications:\n<MessageTo(Zealots, 'go')>"
    for takes_s, statuses, ignored in ((9.9, ["ok"] * 3, 0), (10.1, ["late", "ok", "ok"], 1)):
        heard.clear()
        hall.watched.clear()
        (result,) = await hall.play(config(), Stalkers=thinking(takes_s, words), Zealots=zealots)
        in_time = not ignored
        assert [found.status for found in hall.of("Stalkers")] == statuses
        assert [found.ignored for found in hall.of("Stalkers")] == [0, ignored, 0]
        assert [len(report.functions) for report in hall.reports] == [int(in_time), 0, 0]
        assert [[m.text for m in report.messages] for report in hall.reports] == [["go"] * in_time, [], []]
        assert heard == [(), ("go",) * in_time, ()]
        assert result.accepted == int(in_time)


async def test_the_default_reply_counts_for_an_agent_that_failed_and_not_for_one_that_says_nothing(
    hall: Hall, config: MakeConfig, subtests: pytest.Subtests
) -> None:
    async def fail(peer: Peer, seen: Observation) -> None:
        await peer.answer(seen, status="fallback", detail="http 500")

    async def garbage(peer: Peer, seen: Observation) -> None:
        await peer.put(Topic.REPLY, b"garbage")

    async def leave(peer: Peer, seen: Observation) -> None:
        await peer.leave()

    async def speak(peer: Peer, seen: Observation) -> None:
        await peer.answer(seen, "Analysis: I wait.", status="fallback", detail="timeout")

    default = "<Attack_Unit(0xb)>\n<MessageTo(Zealots, 'I am late')>"
    order = ("Stalker-1 <Attack_Unit(0xb)>",)
    rows: list[tuple[str, Any, str, tuple[str, ...]]] = [
        ("late", thinking(11), "late", order),
        ("gone", leave, "gone", order),
        ("garbage", garbage, "malformed", order),
        ("a reply without words", thinking(0, ""), "ok", ()),
        ("a fallback without words", fail, "fallback", order),
        ("a fallback with words", speak, "fallback", ()),
    ]
    for name, react, status, accepted in rows:
        with subtests.test(name):
            hall.watched.clear()
            await hall.play(config(max_steps=1, default_reply=default), Stalkers=react, Zealots=speak)
            (found,) = hall.of("Stalkers")
            assert (found.status, found.accepted) == (status, accepted)
            assert [m.text for m in hall.reports[0].messages] == ["I am late"] * bool(accepted)


async def test_an_agent_that_may_be_missing_and_comes_back_misses_the_steps_between(
    hall: Hall, config: MakeConfig, peer: MakePeer
) -> None:
    again, arrived = peer(Seat("blue", "Stalkers")), asyncio.Event()

    async def dies(stalkers: Peer, seen: Observation) -> None:
        if seen.step == 1:
            stalkers.bus.kill()
            await asyncio.Event().wait()
        await stalkers.answer(seen)

    async def zealots(peer: Peer, seen: Observation) -> None:
        await asyncio.sleep(4)
        if seen.step == 2:
            await again.arrive("2")
            arrived.set()
        await peer.answer(seen)

    async def next_step(peer: Peer, seen: Observation) -> None:
        if seen.step > 2:
            await peer.answer(seen, STOP)

    async def come_back() -> None:
        await arrived.wait()
        await again.play(next_step)

    back = asyncio.create_task(come_back())
    await hall.play(config(max_steps=5, required=False), Stalkers=dies, Zealots=zealots)
    back.cancel()
    assert [found.status for found in hall.of("Zealots")] == ["ok"] * 5
    assert [found.status for found in hall.of("Stalkers")] == ["ok", "gone", "late", "ok", "ok"]
    assert now_s() == 20  # nobody waited longer than for the Zealots


# --- the recording ----------------------------------------------------------------------------------------


async def test_a_recording_holds_what_was_sent_what_was_taken_and_what_models_were_asked(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    async def ask(peer: Peer, seen: Observation) -> None:
        asked = ModelCall(
            run=RUN, side="blue", agent="Stalkers", episode=0, step=seen.step, attempt=1, model="m", prompt=(),
            endpoint="http://m/v1", completion="", status="ok", started_s=0.0, latency_s=0.0,
        )  # fmt: skip
        await peer.put(Topic.EXCHANGE, encode(asked))
        await peer.answer(seen, "<MessageTo(Zealots, 'go')>")
        await peer.answer(seen, "once more")

    samples = await hall.broker.session().subscribe("**", Delivery.STATE)
    path = tmp_path / "deep" / "run.mcap"
    results = await hall.play(config(max_steps=2, record=path), Stalkers=ask)
    await samples.close()
    sent = sorted([(sample.key, sample.payload) async for sample in samples])
    recording = Recording.open(path)
    assert sorted((sample.key, sample.payload) for sample in recording) == sent
    assert recording.complete
    assert (recording.run, recording.results) == (hall.watched[0], tuple(results))
    assert len(list(recording.of(ModelCall))) == len(list(recording.of(Message))) == 2
    assert [reply.text for reply in recording.of(Reply, agent="Stalkers")].count("once more") == 2


async def test_the_recording_is_safe_up_to_each_report(hall: Hall, config: MakeConfig, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    safe: list[tuple[Wire, int, int]] = []

    def look(message: Wire) -> None:
        if not isinstance(message, Run):
            recording = Recording.open(path)
            safe.append((message, len(list(recording.of(Report))), len(recording.results)))

    await hall.play(config(max_steps=2, record=path), watch=look)
    assert [(reports, results) for _, reports, results in safe] == [(1, 0), (2, 0), (2, 1)]


async def test_a_disk_that_fills_up_within_a_step_ends_the_match_with_one_sentence(
    hall: Hall, config: MakeConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What is flushed in the middle of a step belongs to no task that could report an error."""
    flushed = 0

    def flush(recorder: Recorder) -> None:
        nonlocal flushed
        flushed += 1
        if flushed > 1:
            raise RecordingError("no space left on device")

    monkeypatch.setattr(Recorder, "flush", flush)
    with pytest.raises(RecordingError, match="no space left on device"):
        await hall.play(config(record=tmp_path / "run.mcap"), Stalkers=thinking(2.0))
    assert flushed == 3, "the one within the step, and the one at its end"
    assert "Exception in callback" not in caplog.text


async def test_a_recording_is_not_overwritten(hall: Hall, config: MakeConfig, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(RecordingError, match="exists already: choose another name: recordings are not overwritten"):
        await hall.play(config(record=path))
    assert path.read_bytes() == b"precious"
    assert hall.watched == []


# --- the end ------------------------------------------------------------------------------------------------


def declared(bus: MemoryBus) -> list[object]:
    node = bus._node
    return [*node.publishers, *node.subscribers, *node.watchers, *node.tokens]


async def test_the_bus_and_the_game_stay_open_with_nothing_left_behind(hall: Hall, config: MakeConfig) -> None:
    bus = hall.broker.session()
    await hall.play(config(max_steps=1), bus=bus)
    assert declared(bus) == []
    assert hall.game.calls == ["reset", "act"]
    (again,) = await hall.play(config(max_steps=1), bus=bus)
    assert again.statuses == {"Stalkers": {"ok": 1}, "Zealots": {"ok": 1}}


async def test_a_cancelled_match_takes_back_what_it_declared_and_ends_its_recording(
    hall: Hall, config: MakeConfig, tmp_path: Path, subtests: pytest.Subtests
) -> None:
    for name, agents, steps in (
        ("while agents are awaited", {"Zealots": None}, 0),
        ("in the middle of a step", {"Stalkers": thinking(1e6, at=1)}, 1),
    ):
        with subtests.test(name):
            bus, path = hall.broker.session(), tmp_path / f"{steps}.mcap"
            changes: dict[str, Any] = {"record": path, "max_wait_s": 1e6}
            playing = asyncio.create_task(hall.play(config(**changes), bus=bus, **agents))
            await asyncio.sleep(20)
            playing.cancel()
            with pytest.raises(asyncio.CancelledError):
                await playing
            assert declared(bus) == []
            recording = Recording.open(path)
            assert recording.complete
            assert recording.run is not None
            assert len(list(recording.of(Report))) == steps
            assert recording.results == ()


async def test_a_game_that_dies_ends_the_match_and_leaves_a_whole_recording(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    hall.game.fails_at = 1
    bus = hall.broker.session()
    with pytest.raises(GameError, match="the game died"):
        await hall.play(config(record=tmp_path / "run.mcap"), bus=bus)
    assert declared(bus) == []
    recording = Recording.open(tmp_path / "run.mcap")
    assert recording.complete
    assert [report.step for report in recording.of(Report)] == [0]
    assert [seen.step for seen in recording.observations("Zealots")] == [0, 1]


# --- what is put together ---------------------------------------------------------------------------------


async def test_agents_write_to_those_and_on_the_channels_that_the_task_says(
    hall: Hall, config: MakeConfig, subtests: pytest.Subtests
) -> None:
    words = "Communications:\n<ListenTo(Channel-1)>\n<MessageTo(Zealots, 'a')>\n<MessageTo(Channel-1, 'b')>"
    for name, changes, heard, refused in (
        ("all", {}, ["a", "b"], 0),
        ("nobody", {"communication": False}, [], 8),
    ):
        with subtests.test(name):
            got: list[str] = []

            async def listen(peer: Peer, seen: Observation, got: list[str] = got) -> None:
                got += [message.text for message in seen.messages]
                await peer.answer(seen, "<ListenTo(Channel-1)>")

            (result,) = await hall.play(
                config(max_steps=2, **changes),
                Stalkers=lambda peer, seen: peer.answer(seen, words),
                Zealots=listen,
            )
            assert got == heard
            assert result.rejections.get("unknown_recipient", 0) == refused


async def test_a_stranger_that_speaks_for_another_agent_is_counted_and_not_heard(
    hall: Hall, broker: MemoryBroker, config: MakeConfig
) -> None:
    key = agent_key(RUN, "blue", "Stalkers", Topic.REPLY)
    stranger = await broker.session().publisher(key, Delivery.SPEECH)

    async def zealots(peer: Peer, seen: Observation) -> None:
        lie = Reply(run=RUN, side="blue", agent="Zealots", episode=0, step=seen.step, text=STOP)
        await stranger.put(encode(lie))
        await asyncio.sleep(1)
        await peer.answer(seen)

    def slow(peer: Peer, seen: Observation) -> Awaitable[None]:
        return thinking(0.5, "", at=seen.step)(peer, seen)

    (result,) = await hall.play(config(max_steps=2), Stalkers=slow, Zealots=zealots)
    assert [(found.status, found.ignored) for found in hall.of("Stalkers")] == [("ok", 1)] * 2
    assert [(found.status, found.ignored) for found in hall.of("Zealots")] == [("ok", 0)] * 2
    assert result.accepted == 0
    assert decode(encode(result)) == result
