"""A host that was killed goes on from its recording; on a clock that jumps."""

from __future__ import annotations

import asyncio
import hashlib
import itertools
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.host import host
from khala_orchestrator.past.replay import replay
from khala_orchestrator.past.resume import RESUMED, ResumeError, read_unfinished
from khala_protocol.bus import Delivery
from khala_protocol.codec import encode
from khala_protocol.keys import Topic
from khala_protocol.messages import ModelCall, Observation, Reply, Report, Run, Scene, Terrain
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable
    from pathlib import Path

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Result, Wire
    from tests.orchestrator.conftest import Hall, Peer, StillGame

    MakeConfig = Callable[..., MatchConfig]
    MakeGame = Callable[..., StillGame]
    Start = Callable[[StillGame], Awaitable[Sides]]

CLOCK = "jumps"

ATTACK = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>\n<MessageTo(Zealots, 'step {}')>"
KEPT = "\n<Note(it is step {})>\nTeam Stalker-1:\n<Standing(Move_Screen([9, 9]), until 0:05)>"
GAME = "Khala simulator 0.1.0, as"
EVENTS: dict[int, dict[str, Any]] = {2: {"dead": [0xB]}}
CLOCKS: list[dict[str, Any]] = [
    {"rule": "frozen"},
    {"rule": "budget", "thinking_loops": 20},
    {"rule": "token"},
    {"rule": "realtime", "speed": 10.0},
]


async def stalkers(peer: Peer, seen: Observation) -> None:
    await peer.answer(seen, (ATTACK + KEPT).format(seen.step, seen.step), usage={"requests": 1})


def killed_after(whole: Path, reports: int, path: Path) -> Recording:
    """Write what a host leaves that is killed before its next report."""
    with Recorder(path) as recorder:
        for sample in Recording.open(whole):
            reports -= isinstance(sample.message, Report)
            if reports < 0:
                break
            recorder.write(sample.key, sample.payload)
    return Recording.open(path)


def digest(recording: Recording) -> str:
    """Hash everything that agents saw, in its order."""
    texts = (seen.model_dump_json() for seen in recording.of(Observation))
    return hashlib.sha256("".join(texts).encode()).hexdigest()


@pytest.mark.parametrize("clock", CLOCKS, ids=lambda clock: clock["rule"])
@pytest.mark.parametrize("killed", [(0, 3, 6), pytest.param(range(10), marks=pytest.mark.slow)], ids=["some", "all"])
async def test_wherever_it_is_killed_it_ends_as_if_it_had_not_been(
    hall: Hall, config: MakeConfig, start: Start, tmp_path: Path, clock: dict[str, Any], killed: Iterable[int]
) -> None:
    hall.game.after = EVENTS
    kept = {"memory": {"notes": 2, "messages_s": 1}, "standing_orders": 1}
    match = config(game=GAME, episodes=2, max_steps=5, step_loops=8, **kept, **clock)
    whole = tmp_path / "whole.mcap"
    results = await hall.play(match.model_copy(update={"record": whole}), Stalkers=stalkers)
    views = [seen.view for seen in Recording.open(whole).of(Observation)]
    assert any(view.notes for view in views)
    assert any(view.standing for view in views)
    for reports in killed:
        past = read_unfinished(killed_after(whole, reports, tmp_path / f"killed-{reports}.mcap"))
        assert (past.episode, past.steps) == divmod(reports, 5)
        path = tmp_path / f"resumed-{reports}.mcap"
        again = await _resume(hall, past.config.model_copy(update={"record": path}), past)
        if clock["rule"] != "realtime":  # where the moment of an arrival decides
            assert [_plain(result) for result in again] == [_plain(result) for result in results]
            assert digest(Recording.open(path)) == digest(Recording.open(whole))
        assert [report.step for report in Recording.open(path).of(Report)] == [0, 1, 2, 3, 4] * 2
        assert [scene.step for scene in Recording.open(path).of(Scene)] == [0, 1, 2, 3, 4] * 2
        assert {terrain.episode for terrain in Recording.open(path).of(Terrain)} == {0, 1}


async def test_a_host_that_is_killed_before_its_first_report_can_be_resumed(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    path = tmp_path / "whole.mcap"
    left: list[tuple[int, int]] = []

    def look(message: Wire) -> None:
        if isinstance(message, Run):  # what a host leaves that is killed now
            past = read_unfinished(Recording.open(path))
            left.append((past.episode, past.steps))

    await hall.play(config(game=GAME, max_steps=4, record=path), Stalkers=stalkers, watch=look)
    past = read_unfinished(killed_after(path, 3, tmp_path / "killed.mcap"))
    path = tmp_path / "resumed.mcap"

    async def played(*arguments: Any, **options: Any) -> list[Result]:
        return await host(*arguments, **options, past=past)

    await hall.play(past.config.model_copy(update={"record": path}), by=played, Stalkers=stalkers, watch=look)
    assert left == [(0, 0), (0, 3)]


async def test_a_match_that_was_resumed_with_open_questions_is_resumed_once_more(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    async def slow(peer: Peer, seen: Observation) -> None:
        await asyncio.sleep(0.1)  # for three steps of the game
        await peer.answer(seen)

    path = tmp_path / "0.mcap"
    match = config(game=GAME, max_steps=12, rule="realtime", speed=10.0, step_loops=8)
    await hall.play(match.model_copy(update={"record": path}), Stalkers=slow)
    for reports in (4, 5, 7):
        past = read_unfinished(killed_after(path, reports, tmp_path / f"killed-{reports}.mcap"))
        path = tmp_path / f"{reports}.mcap"

        async def played(*arguments: Any, past: Any = past, **options: Any) -> list[Result]:
            return await host(*arguments, **options, past=past)

        await hall.play(past.config.model_copy(update={"record": path}), by=played, Stalkers=slow)
    assert [report.step for report in Recording.open(path).of(Report)] == [*range(12)]


def killed_with_answers_on_the_table(whole: Path, reports: int, path: Path) -> Recording:
    """Write what a host leaves that is killed when answers have arrived that it has not taken yet."""
    samples = list(Recording.open(whole))
    ends = [number for number, sample in enumerate(samples) if isinstance(sample.message, Report)]
    last, end = ends[reports - 1 : reports + 1]
    replies = ((sample, sample.message) for sample in samples[last:end])
    arrived = [sample for sample, reply in replies if isinstance(reply, Reply) and reply.step < reports]
    with Recorder(path) as recorder:
        for sample in (*samples[:last], *arrived, samples[last]):
            recorder.write(sample.key, sample.payload)
    return Recording.open(path)


@pytest.mark.parametrize("kills", [(3, 7), pytest.param((2, 6), marks=pytest.mark.slow)])
async def test_what_was_asked_before_the_kill_and_is_answered_anew_after_it_plays_the_same_game_again(
    hall: Hall, config: MakeConfig, start: Start, still_game: MakeGame, tmp_path: Path, kills: tuple[int, ...]
) -> None:
    numbers = itertools.count()

    async def slow(peer: Peer, seen: Observation) -> None:
        number = next(numbers)  # an agent that was started again answers a question in another way
        await asyncio.sleep({"Stalkers": 0.05, "Zealots": 0.08}[seen.agent])  # for some steps of the game
        await peer.answer(seen, ATTACK.format(f"{seen.step}, answer {number}"))

    path = tmp_path / "0.mcap"
    match = config(game=GAME, max_steps=12, rule="realtime", speed=10.0, step_loops=8)
    await hall.play(match.model_copy(update={"record": path}), Stalkers=slow, Zealots=slow)
    for reports in kills:
        past = read_unfinished(killed_with_answers_on_the_table(path, reports, tmp_path / f"killed-{reports}.mcap"))
        path = tmp_path / f"{reports}.mcap"

        async def played(*arguments: Any, past: Any = past, **options: Any) -> list[Result]:
            return await host(*arguments, **options, past=past)

        resumed = past.config.model_copy(update={"record": path})
        await hall.play(resumed, by=played, Stalkers=slow, Zealots=slow)
        assert [report.step for report in Recording.open(path).of(Report)] == [*range(12)]
        assert await replay(Recording.open(path), await start(still_game())) == []
    answered = Counter((reply.agent, reply.step) for reply in Recording.open(path).of(Reply))
    assert max(answered.values()) > 1


async def _resume(hall: Hall, config: MatchConfig, past: Any) -> list[Result]:
    async def played(*arguments: Any, **options: Any) -> list[Result]:
        return await host(*arguments, **options, past=past)

    return await hall.play(config, by=played, Stalkers=stalkers)


def _plain(result: Result) -> dict[str, Any]:
    return result.model_dump(exclude={"incidents", "wall_s", "latency_p50_s", "latency_p95_s", "lag_s"})


async def test_agents_are_asked_for_the_open_step_and_for_nothing_before(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    whole = tmp_path / "whole.mcap"
    await hall.play(config(game=GAME, max_steps=4, record=whole), Stalkers=stalkers)
    past = read_unfinished(killed_after(whole, 2, tmp_path / "killed.mcap"))
    heard = await hall.broker.session().subscribe("**/Zealots/*", Delivery.STATE)
    await _resume(hall, past.config.model_copy(update={"record": tmp_path / "resumed.mcap"}), past)
    await heard.close()
    steps = list(Recording.open(tmp_path / "resumed.mcap").of(Report))
    assert [report.incidents for report in steps] == [(), (), (RESUMED,), ()]
    topics = [sample.key.rsplit("/", 1)[1] async for sample in heard]
    assert topics == ["briefing", "observation", "reply", "observation", "reply"]


async def test_what_a_model_was_asked_in_the_open_step_is_kept(hall: Hall, config: MakeConfig, tmp_path: Path) -> None:
    async def ask(peer: Peer, seen: Observation) -> None:
        call = ModelCall(
            run=seen.run, side="blue", agent="Stalkers", episode=0, step=seen.step, attempt=1, model="m", endpoint="e",
            prompt=(), completion="", status="ok", started_s=0, latency_s=0,
        )  # fmt: skip
        await peer.put(Topic.EXCHANGE, encode(call))
        await stalkers(peer, seen)

    whole = tmp_path / "whole.mcap"
    await hall.play(config(game=GAME, max_steps=4, record=whole), Stalkers=ask)
    kept = list(read_unfinished(killed_after(whole, 2, tmp_path / "killed.mcap")).kept())
    assert [call.message.step for call in kept if isinstance(call.message, ModelCall)] == [0, 1, 2]
    assert [seen.message.step for seen in kept if isinstance(seen.message, Observation)] == [0, 0, 1, 1]


async def test_a_reply_under_the_key_of_another_agent_is_not_taken_for_one_of_its_own(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    async def forge(peer: Peer, seen: Observation) -> None:
        await peer.answer(seen, ATTACK.format("forged"), agent="Stalkers")  # from Zealots, under their key
        await peer.answer(seen)

    async def later(peer: Peer, seen: Observation) -> None:
        await asyncio.sleep(0.1)
        await stalkers(peer, seen)

    whole = tmp_path / "whole.mcap"
    match = config(game=GAME, max_steps=4, record=whole)
    await hall.play(match, Stalkers=later, Zealots=forge)
    past = read_unfinished(killed_after(whole, 3, tmp_path / "killed.mcap"))
    await _resume(hall, past.config.model_copy(update={"record": tmp_path / "resumed.mcap"}), past)
    assert digest(Recording.open(tmp_path / "resumed.mcap")) == digest(Recording.open(whole))


async def test_a_game_that_goes_another_way_is_found_out(hall: Hall, config: MakeConfig, tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    await hall.play(config(game=GAME, max_steps=4, record=whole), Stalkers=stalkers)
    hall.game.after = {1: {"dead": [0x2]}}
    past = read_unfinished(killed_after(whole, 3, tmp_path / "killed.mcap"))
    with pytest.raises(ResumeError, match="differs from the recorded one at step 2 of episode 0"):
        await _resume(hall, past.config, past)


async def test_what_cannot_be_resumed_is_refused(hall: Hall, config: MakeConfig, tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    await hall.play(config(game=GAME, max_steps=2, record=whole), Stalkers=stalkers)
    with pytest.raises(ResumeError, match="is over: begin a new one"):
        read_unfinished(Recording.open(whole))
    real = tmp_path / "real.mcap"
    with Recorder(real) as recorder:
        for sample in Recording.open(whole):
            payload = sample.payload
            if isinstance(sample.message, Run):
                payload = payload.replace(b"Khala simulator", b"StarCraft II")
            recorder.write(sample.key, payload)
    with pytest.raises(ResumeError, match="does not play the same game twice"):
        read_unfinished(Recording.open(real))
