"""A recorded match played again: the recording speaks for the agents; on a clock that jumps."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING, Any, cast

import pytest

from khala_bridge.observe.text import SECTIONS
from khala_orchestrator.config import change, load_task
from khala_orchestrator.match.turn import Question
from khala_orchestrator.past.replay import RecordedTurn, recorded_config, replay
from khala_orchestrator.past.resume import read_unfinished
from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic
from khala_protocol.messages import Observation, Reply, Report, Run
from khala_protocol.recording import Recorder, Recording
from khala_protocol.trust import Untrusted

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Collection
    from pathlib import Path

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Wire
    from khala_protocol.recording.difference import Difference
    from tests.orchestrator.conftest import Hall, Peer, StillGame

    Replay = Callable[..., Awaitable[list[Difference]]]

CLOCK = "jumps"

RUN = "test"
ATTACK = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>"
EVENTS: dict[int, dict[str, Any]] = {2: {"dead": [0xB]}}


@pytest.fixture
async def recording(hall: Hall, config: Callable[..., MatchConfig], tmp_path: Path) -> Recording:
    """Two episodes of four steps: orders, words, a reply said twice, one that is late, one that fails, one lost."""

    async def stalkers(peer: Peer, seen: Observation) -> None:
        match seen.step:
            case 0:
                await peer.answer(seen, f"<MessageTo(Zealots, 'go')>\n{ATTACK}")
                await peer.answer(seen, "<MessageTo(Zealots, 'stay')>")
            case 1:
                await asyncio.sleep(11)
                await peer.answer(seen, "<MessageTo(Zealots, 'too late')>")
            case 2:
                await peer.answer(seen, "<Fly()>", status="fallback", detail="timeout")
            case _:
                await peer.put(Topic.REPLY, b"garbage")

    async def zealots(peer: Peer, seen: Observation) -> None:
        await asyncio.sleep(2)
        await peer.answer(seen, "<MessageTo(Stalkers, 'ready')>")

    hall.game.after = EVENTS
    match = config(episodes=2, max_steps=4, default_reply="<MessageTo(Zealots, 'nothing')>", record=tmp_path / "a.mcap")
    await hall.play(match, Stalkers=stalkers, Zealots=zealots)
    statuses = [report.agents[0].status for report in hall.reports]
    assert statuses == ["ok", "late", "fallback", "malformed"] * 2
    return Recording.open(tmp_path / "a.mcap")


@pytest.fixture
def again(
    start: Callable[[StillGame], Awaitable[Sides]], still_game: Callable[..., StillGame]
) -> Callable[..., Awaitable[list[Difference]]]:
    """Replays a recording in a game of its own; `after` is what happens there."""

    async def run(
        recording: Recording, *, after: dict[int, dict[str, Any]] | None = None, modules: Collection[str] = ()
    ) -> list[Difference]:
        game = await start(still_game(after=EVENTS if after is None else after))
        return await replay(recording, game, modules=modules)

    return run


def changed(recording: Recording, path: Path, change: Callable[[Wire], Wire | None]) -> Recording:
    """A copy with some messages changed, or left out where `change` gives None; bytes that are none are kept."""
    with Recorder(path) as recorder:
        for sample in recording:
            message = sample.message and change(sample.message)
            if message is not None or sample.message is None:
                before, after = (getattr(one, "agent", None) for one in (sample.message, message))
                key = sample.key.replace(f"/{before}/", f"/{after}/")  # it says who an agent is, as the message does
                recorder.write(key, encode(message) if message else sample.payload)
    return Recording.open(path)


MODULE = """
from khala_bridge.observe.text import section

@section("mine")
def mine(page):
    yield "seen"
"""


@pytest.fixture
def foreign(recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recording:
    """Return a recording whose task reads a section of a module."""
    (tmp_path / "foreign_sections.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "foreign_sections", raising=False)
    monkeypatch.delitem(SECTIONS, "mine", raising=False)

    def sectioned(message: Wire) -> Wire:
        if not isinstance(message, Run):
            return message
        agents = [{**agent, "sections": ["foreign_sections:mine"]} for agent in cast("Any", message.config["agents"])]
        return message.but(config={**message.config, "agents": agents})

    return changed(recording, tmp_path / "foreign.mcap", sectioned)


async def test_a_recording_imports_no_module_by_itself(foreign: Recording, again: Replay) -> None:
    with pytest.raises(Untrusted, match=r"foreign.mcap: this names the code 'foreign_sections'") as error:
        await again(foreign)
    assert str(error.value).endswith("if you trust it, say --trust, or set KHALA_TRUST=foreign_sections")
    assert "foreign_sections" not in sys.modules


async def test_a_recording_reads_the_modules_that_are_allowed(foreign: Recording, again: Replay) -> None:
    differences = await again(foreign, modules=["foreign_sections"])
    assert "foreign_sections" in sys.modules
    assert any('"text":"seen' in found.sent for found in differences)


async def test_a_match_against_a_player_whose_decisions_are_not_recorded_is_not_played_again(
    recording: Recording, tmp_path: Path
) -> None:
    task = change(load_task("simple64_eceb_terran"), opponent="guest:rm -r x").model_dump(mode="json")
    met = {"config": task, "game": "Khala simulator 1, as 4.10", "opponent": "guest bot Rush, zerg"}
    other = changed(recording, tmp_path / "b.mcap", lambda m: m.but(**met) if isinstance(m, Run) else m)
    for repeat in (recorded_config, read_unfinished):
        with pytest.raises(RecordingError, match=r"against a guest bot Rush, zerg, whose decisions are not recorded"):
            repeat(other)


async def test_a_run_card_of_another_version_is_named(recording: Recording, tmp_path: Path) -> None:
    other = changed(recording, tmp_path / "b.mcap", lambda m: m.but(config={"name": 7}) if isinstance(m, Run) else m)
    with pytest.raises(RecordingError, match=r"b\.mcap: its run card is not of this version: name: "):
        recorded_config(other)


def places(differences: list[Difference]) -> list[tuple[str, int, int, str]]:
    return [(found.agent, found.episode, found.step, found.what) for found in differences]


# --- the same -----------------------------------------------------------------------------------------------


async def test_a_match_that_is_played_again_is_the_same_to_the_last_byte(recording: Recording, again: Replay) -> None:
    assert await again(recording) == []


async def test_a_recording_that_was_cut_off_is_played_up_to_its_last_whole_step(
    recording: Recording, again: Replay, tmp_path: Path
) -> None:
    over = asyncio.Event()

    def cut(message: Wire) -> Wire | None:
        kept = None if over.is_set() else message
        if isinstance(message, Observation) and (message.episode, message.step) == (1, 1):
            over.set()
        return kept

    torn = changed(recording, tmp_path / "torn.mcap", cut)
    assert len(list(torn.of(Report))) == 5
    assert await again(torn) == []
    assert [p for p in places(await again(torn, after={0: {"dead": [0xB]}})) if p[1:3] == (0, 1)]


async def test_what_was_recorded_of_no_step_at_all_is_no_difference(
    recording: Recording, again: Replay, tmp_path: Path
) -> None:
    card = changed(recording, tmp_path / "card.mcap", lambda message: message if isinstance(message, Run) else None)
    assert await again(card) == []


async def test_how_long_an_agent_took_is_taken_from_the_report(recording: Recording) -> None:
    turn = RecordedTurn(recording)
    step = next(recording.by_step())
    answers = await turn.ask([Question(seen) for seen in step.of(Observation)])
    (report,) = step.of(Report)
    assert [(seat.agent, a.status, a.latency_s, a.ignored, a.detail) for seat, a in answers.by_seat.items()] == [
        (agent.agent, agent.status, agent.latency_s, agent.ignored, agent.detail) for agent in report.agents
    ]
    stalkers, zealots = answers.by_seat.values()
    assert stalkers.text is not None
    assert stalkers.text.startswith("<MessageTo(Zealots, 'go')>")  # the first of two replies
    assert (zealots.latency_s, stalkers.ignored) == (2.0, 1)


# --- another game -------------------------------------------------------------------------------------------


async def test_a_game_that_goes_another_way_is_noticed_at_its_first_step(
    recording: Recording, again: Replay, subtests: pytest.Subtests
) -> None:
    both = [("Stalkers", "observation"), ("Zealots", "observation")]
    for when, step in ((0, 1), (1, 2)):
        with subtests.test(when=when):
            found = await again(recording, after={when: {"dead": [0xB]}})
            assert places(found) == [(agent, 0, step, what) for agent, what in both]
            assert found[0].recorded != found[0].sent != ""
            assert str(found[0]).startswith(f"observation of Stalkers in episode 0, step {step}: recorded …")


async def test_other_words_lead_to_another_observation(recording: Recording, again: Replay, tmp_path: Path) -> None:
    def change(message: Wire) -> Wire:
        if isinstance(message, Reply) and message.text.startswith("<MessageTo(Zealots, 'go')>"):
            return message.model_copy(update={"text": message.text.replace("'go'", "'no'")})
        return message

    found = await again(changed(recording, tmp_path / "b.mcap", change))
    assert places(found) == [("Zealots", 0, 1, "observation")]
    assert ("go" in found[0].recorded, "no" in found[0].sent) == (True, True)


async def test_what_was_said_too_late_may_be_changed_without_a_difference(
    recording: Recording, again: Replay, tmp_path: Path
) -> None:
    def change(message: Wire) -> Wire:
        if isinstance(message, Reply) and ("too late" in message.text or "stay" in message.text):
            return message.model_copy(update={"text": "<MessageTo(Zealots, 'something else')>"})
        return message

    assert await again(changed(recording, tmp_path / "b.mcap", change)) == []


async def test_an_agent_that_was_not_asked_then_is_a_difference(
    recording: Recording, again: Replay, tmp_path: Path
) -> None:
    def without(message: Wire) -> Wire | None:
        is_it = isinstance(message, Observation) and message.agent == "Zealots" and message.step == 1
        return None if is_it else message

    (found,) = await again(changed(recording, tmp_path / "b.mcap", without))
    assert (found.agent, found.step, found.recorded) == ("Zealots", 1, "")
    assert found.sent.startswith("{")


async def test_an_agent_that_is_not_asked_now_is_a_difference(
    recording: Recording, again: Replay, tmp_path: Path
) -> None:
    def rename(message: Wire) -> Wire:
        if isinstance(message, Observation) and message.agent == "Zealots" and message.step == 0:
            return message.model_copy(update={"agent": "Probes"})
        return message

    found = await again(changed(recording, tmp_path / "b.mcap", rename))
    assert [(d.agent, bool(d.recorded), bool(d.sent)) for d in found] == [
        ("Probes", True, False),
        ("Zealots", False, True),
    ]


# --- what is played -----------------------------------------------------------------------------------------


async def test_the_match_is_configured_as_the_run_card_says(recording: Recording) -> None:
    found = recorded_config(recording)
    assert (found.run, found.seed, found.episodes, found.record) == (RUN, 1, 2, None)
    assert recording.run is not None
    assert found.task.model_dump(mode="json") == recording.run.config


def test_a_recording_without_a_run_card_cannot_be_played(tmp_path: Path) -> None:
    Recorder(tmp_path / "empty.mcap").close()
    with pytest.raises(RecordingError) as raised:
        recorded_config(Recording.open(tmp_path / "empty.mcap"))
    assert str(raised.value) == f"{tmp_path / 'empty.mcap'} has no run card: the run ended before the match began"
