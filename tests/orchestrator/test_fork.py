"""A fork has the recorded decisions up to its step, and live ones from there on; on a clock that jumps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.host import host
from khala_orchestrator.past.fork import advice_of, trunk_of, write_beginning, write_whole
from khala_orchestrator.past.replay import replay
from khala_orchestrator.past.resume import FORKED, read_unfinished
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, KhalaError, RecordingError
from khala_protocol.keys import Topic
from khala_protocol.messages import Briefing, ModelCall, Observation, Report, Result, Run
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence
    from pathlib import Path

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from tests.orchestrator.conftest import Hall, Peer, StillGame

    MakeConfig = Callable[..., MatchConfig]
    MakeGame = Callable[..., StillGame]
    Start = Callable[[StillGame], Awaitable[Sides]]

CLOCK = "jumps"

RUN = "test"
GAME = "Khala simulator 0.1.0, as"
ATTACK = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>\n<MessageTo(Zealots, 'step {}')>"
EVENTS: dict[int, dict[str, Any]] = {2: {"dead": [0xB]}}
STEPS = 6


async def stalkers(peer: Peer, seen: Observation) -> None:
    call = ModelCall(
        run=seen.run, side="blue", agent="Stalkers", episode=seen.episode, step=seen.step, attempt=1, model="m",
        endpoint="e", prompt=(), completion="", status="ok", started_s=0, latency_s=0,
    )  # fmt: skip
    await peer.put(Topic.EXCHANGE, encode(call))
    await peer.answer(seen, ATTACK.format(seen.step), usage={"requests": 1})


@pytest.fixture
def record(hall: Hall, config: MakeConfig, tmp_path: Path) -> Callable[..., Awaitable[Recording]]:
    """Plays a match of six steps in which the Stalkers attack and write, and returns its recording."""

    async def played(**changes: Any) -> Recording:
        hall.game.after = EVENTS
        path = tmp_path / "whole.mcap"
        await hall.play(config(record=path, **{"game": GAME, "max_steps": STEPS} | changes), Stalkers=stalkers)
        return Recording.open(path)

    return played


@pytest.fixture
def fork(hall: Hall, tmp_path: Path) -> Callable[..., Awaitable[tuple[list[Result], Recording]]]:
    """Forks a recording at a step; agents that are not given order nothing."""

    async def played(
        recording: Recording, step: int, *, episode: int = 0, advice: Sequence[str] = (), **agents: Any
    ) -> tuple[list[Result], Recording]:
        forked = trunk_of(recording, episode).fork(step, RUN)
        beginning, path = tmp_path / f"beginning-{step}.mcap", tmp_path / f"fork-{step}.mcap"
        write_beginning(recording, forked, beginning, advice_of(forked, advice))
        past = read_unfinished(Recording.open(beginning))

        async def resumed(*arguments: Any, **options: Any) -> list[Result]:
            return await host(*arguments, **options, past=past)

        results = await hall.play(past.config.model_copy(update={"record": path}), by=resumed, **agents)
        return results, Recording.open(path)

    return played


def seen_in(recording: Recording, steps: range, episode: int = 0) -> list[bytes]:
    """Return what agents saw in some steps, as bytes, as if the episode were the first."""
    found = (one for one in recording.of(Observation) if one.episode == episode and one.step in steps)
    return [encode(one.but(episode=0)) for one in found]


@pytest.mark.parametrize(
    "clock",
    [{"rule": "frozen"}, {"rule": "budget", "thinking_loops": 20}, {"rule": "token"}],
    ids=lambda clock: clock["rule"],
)
async def test_a_fork_is_the_recorded_match_before_its_step_and_another_one_after(
    record: Callable[..., Any], fork: Callable[..., Any], clock: dict[str, Any]
) -> None:
    steps = 14  # a decision of the other clocks takes effect some steps later
    whole = await record(**clock, max_steps=steps)
    _, forked = await fork(whole, 3)
    assert seen_in(forked, range(4)) == seen_in(whole, range(4))
    assert seen_in(forked, range(4, steps)) != seen_in(whole, range(4, steps))
    assert forked.run.forked.model_dump(exclude={"sha256"}) == {"run": RUN, "episode": 0, "step": 3}
    incidents = {report.step: report.incidents for report in forked.of(Report)}
    assert incidents == {step: (FORKED,) if step == 3 else () for step in range(steps)}


@pytest.mark.parametrize("step", [0, 4])
async def test_a_fork_with_the_same_decisions_is_the_recorded_match(
    record: Callable[..., Any], fork: Callable[..., Any], step: int
) -> None:
    whole = await record()
    results, forked = await fork(whole, step, Stalkers=stalkers)
    assert seen_in(forked, range(STEPS)) == seen_in(whole, range(STEPS))
    assert [report.agents[0].accepted for report in forked.of(Report)] == [
        report.agents[0].accepted for report in whole.of(Report)
    ]
    assert [(one.outcome, one.game_loop, one.accepted) for one in results] == [
        (one.outcome, one.game_loop, one.accepted) for one in whole.results
    ]
    assert [call.step for call in forked.of(ModelCall)] == [*range(STEPS)]


async def test_an_episode_becomes_a_match_of_its_own(
    record: Callable[..., Any], fork: Callable[..., Any], start: Start, still_game: MakeGame
) -> None:
    whole = await record(episodes=3)
    results, forked = await fork(whole, 2, episode=1)
    assert [(one.episode, one.steps) for one in results] == [(0, STEPS)]
    assert (forked.run.seed, forked.run.episodes, forked.run.forked.episode) == (2, 1, 1)
    assert seen_in(forked, range(3)) == seen_in(whole, range(3), episode=1)
    assert {briefing.episodes for briefing in forked.of(Briefing)} == {1}
    assert await replay(forked, await start(still_game(after=EVENTS))) == []


async def test_a_fork_of_a_fork_is_one_of_its_own(record: Callable[..., Any], fork: Callable[..., Any]) -> None:
    whole = await record()
    _, first = await fork(whole, 2)
    _, second = await fork(first, 4, Stalkers=stalkers)
    assert seen_in(second, range(5)) == seen_in(first, range(5))
    assert second.run.forked.step == 4
    assert second.run.forked.sha256 != first.run.forked.sha256


async def test_advice_is_read_in_the_first_observation_that_others_decide_on(
    record: Callable[..., Any], fork: Callable[..., Any], start: Start, still_game: MakeGame
) -> None:
    whole = await record()
    advice = ["Stalkers: fall back", "everyone: hold: wait"]
    (result,), forked = await fork(whole, 3, advice=advice)
    assert seen_in(forked, range(3)) == seen_in(whole, range(3))
    read = {
        (seen.agent, seen.step): [message.text for message in seen.messages if "Adviser" in message.sender]
        for seen in forked.of(Observation)
    }
    assert read["Stalkers", 3] == ["fall back", "hold: wait"]
    assert read["Zealots", 3] == ["hold: wait"]
    assert not any(texts for (_, step), texts in read.items() if step != 3)
    assert result.advisers == {"Adviser": 2}
    assert await replay(forked, await start(still_game(after=EVENTS))) == []


async def test_the_whole_episode_repeats_itself(
    record: Callable[..., Any], start: Start, still_game: MakeGame, tmp_path: Path
) -> None:
    whole = await record(episodes=2)
    write_whole(trunk_of(whole, 1), tmp_path / "copy.mcap")
    copy = Recording.open(tmp_path / "copy.mcap")
    assert await replay(copy, await start(still_game(after=EVENTS))) == []
    assert seen_in(copy, range(STEPS)) == seen_in(whole, range(STEPS), episode=1)


async def test_a_step_that_only_one_side_reported_is_none(record: Callable[..., Any], tmp_path: Path) -> None:
    whole = await record()
    torn = tmp_path / "torn.mcap"
    with Recorder(torn) as recorder:
        for sample in whole:
            if isinstance(sample.message, Report) and sample.message.step == 4:
                break
            recorder.write(sample.key, sample.payload)
    trunk = trunk_of(Recording.open(torn))
    assert (len(trunk.loops), trunk.results) == (4, [])
    with pytest.raises(RecordingError, match="has the steps 0 to 3 of episode 0: it cannot be forked at step 4"):
        trunk.fork(4, RUN)


def with_card(whole: Recording, path: Path, change: Callable[[bytes], bytes]) -> Recording:
    """Return a copy of a recording with another run card."""
    with Recorder(path) as recorder:
        for sample in whole:
            payload = change(sample.payload) if isinstance(sample.message, Run) else sample.payload
            recorder.write(sample.key, payload)
    return Recording.open(path)


async def test_what_does_not_play_the_same_twice_cannot_be_forked(record: Callable[..., Any], tmp_path: Path) -> None:
    whole = await record()
    real = with_card(
        whole, tmp_path / "real.mcap", lambda card: card.replace(b"Khala simulator 0.1.0, as", b"StarCraft II")
    )
    with pytest.raises(RecordingError, match="was played on StarCraft II, which does not play the same game twice"):
        trunk_of(real)
    timed = with_card(
        whole, tmp_path / "timed.mcap", lambda card: card.replace(b'"rule":"frozen"', b'"rule":"realtime"')
    )
    with pytest.raises(RecordingError, match="clock realtime, where the time of a reply matters"):
        trunk_of(timed)
    with pytest.raises(RecordingError, match="has no complete step of episode 7"):
        trunk_of(whole, 7)


@pytest.mark.parametrize(
    ("said", "step", "words"),
    [
        ("attack", 3, "'attack' names no recipient and what to say: write 'Commander: attack now'"),
        ("Stalkers:", 3, "names no recipient and what to say"),
        (
            "Nobody: attack",
            3,
            "there is no single 'Nobody' to advise: there are Stalkers, Zealots, Channel-1, everyone",
        ),
        ("red/Stalkers: attack", 3, "there is no single 'red/Stalkers' to advise"),
        ("Stalkers: attack", 0, "no step comes before step 0, in which advice could arrive"),
        ("Stalkers: " + "x" * 501, 3, "a message has at most 500 characters"),
    ],
)
async def test_wrong_advice_says_what_would_be_right(
    record: Callable[..., Any], said: str, step: int, words: str
) -> None:
    forked = trunk_of(await record()).fork(step, RUN)
    with pytest.raises(ConfigError) as refused:
        advice_of(forked, [said])
    assert words in str(refused.value)


async def test_an_adviser_says_no_more_than_counts_in_a_step(record: Callable[..., Any]) -> None:
    forked = trunk_of(await record()).fork(3, RUN)
    assert len(advice_of(forked, ["everyone: go"] * 5)) == 5
    with pytest.raises(ConfigError, match="an adviser has 5 messages in a step"):
        advice_of(forked, ["everyone: go"] * 6)


async def test_a_fork_may_change_what_prompts_have_and_not_what_was_seen(record: Callable[..., Any]) -> None:
    trunk = trunk_of(await record())
    task = trunk.fork(3, RUN, memory="steps=4,summary=20").task
    assert (task.memory_of(task.agents[0]).steps, task.memory_of(task.agents[0]).summary) == (4, 20)
    for rule, words in (
        ("notes=3", "notes would change what agents saw"),
        ("soon", "steps: Input should be a valid integer"),
    ):
        with pytest.raises(KhalaError, match=words):
            trunk.fork(3, RUN, memory=rule)
