"""A match under each rule of the clock, on a bus in memory and a clock that jumps."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.task.config import TeamConfig
from khala_protocol.messages import Pace, Usage
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Observation
    from tests.orchestrator.conftest import Hall, Peer

    MakeConfig = Callable[..., MatchConfig]
    React = Callable[[Peer, Observation], Awaitable[None]]

CLOCK = "jumps"

ATTACK = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>"


def now_s() -> float:
    return asyncio.get_running_loop().time()


def taking(seconds: float, text: str = "", **reply: Any) -> React:
    async def react(peer: Peer, seen: Observation) -> None:
        await asyncio.sleep(seconds)
        await peer.answer(seen, text, **reply)

    return react


def steps(hall: Hall, agent: str) -> list[tuple[int, int | None, int, str | None]]:
    """Each decision of an agent: the step of its effect and of its observation, its age in loops, and its fate."""
    return [
        (report.step, found.asked_step, found.age_loops, found.fate)
        for report in hall.reports
        for found in report.agents
        if found.agent == agent
    ]


async def test_frozen_decisions_are_fresh(hall: Hall, config: MakeConfig) -> None:
    (result,) = await hall.play(config(step_loops=11), Stalkers=taking(3, ATTACK))
    assert steps(hall, "Stalkers") == [(step, None, 0, "fresh") for step in range(3)]
    assert [report.game_loop for report in hall.reports] == [11, 22, 33]
    assert result.fates == {"Stalkers": {"fresh": 3}, "Zealots": {"fresh": 3}}


@pytest.mark.parametrize("seconds", [0.0, 9.0])
async def test_a_budget_is_the_same_however_long_it_took(hall: Hall, config: MakeConfig, seconds: float) -> None:
    await hall.play(
        config(rule="budget", thinking_loops=20, step_loops=11, max_steps=6), Stalkers=taking(seconds, ATTACK)
    )
    assert [report.game_loop for report in hall.reports] == [11, 20, 31, 42, 51, 62]
    assert steps(hall, "Stalkers") == [(2, 0, 20, "stale"), (5, 3, 20, "stale")]
    assert [len(report.functions) for report in hall.reports] == [0, 0, 1, 0, 0, 1]


async def test_tokens_make_game_time_pass(hall: Hall, config: MakeConfig) -> None:
    usage = Usage(requests=1, prompt_tokens=1000, completion_tokens=100)  # 0.5 + 1 s by the pace of its model
    pace = Pace(latency_s=0.0, read_tokens_per_s=2000.0, write_tokens_per_s=100.0)
    talks = taking(5, ATTACK, usage=usage, pace=pace)
    (result,) = await hall.play(config(rule="token", step_loops=17, max_steps=3), Stalkers=talks)
    assert steps(hall, "Stalkers") == [(2, 0, 34, "stale")]
    assert steps(hall, "Zealots") == [(step, None, 0, "fresh") for step in range(3)]
    assert result.age_p95_loops == 34


async def test_in_real_time_everybody_decides_at_their_own_pace(hall: Hall, config: MakeConfig) -> None:
    match = config(rule="realtime", step_loops=8, speed=22.4 / 8 / 2.8, max_steps=28, max_wait_s=60)  # 28 steps, 10 s
    began = now_s()
    (result,) = await hall.play(match, Stalkers=taking(0.2, ATTACK), Zealots=taking(4.9))
    assert now_s() - began == pytest.approx(27 * 8 / 22.4)
    quick, slow = steps(hall, "Stalkers"), steps(hall, "Zealots")
    assert [taken - (asked or 0) for taken, asked, _, _ in quick] == [1] * len(quick)
    assert len(quick) == 14  # every second step: one to think, one for its orders to play out
    assert slow == [(14, 0, 112, "stale"), (27, 15, 104, "dropped")]
    assert result.lag_s == 0


async def test_in_real_time_an_agent_that_is_late_is_asked_again(hall: Hall, config: MakeConfig) -> None:
    async def first_one_never(peer: Peer, seen: Observation) -> None:
        if seen.step:
            await peer.answer(seen)

    match = config(rule="realtime", step_loops=8, max_steps=6, max_wait_s=1.0)
    await hall.play(match, Stalkers=first_one_never)
    assert [(found.status, found.asked_step) for found in hall.of("Stalkers")] == [("late", 0), ("ok", 4)]


async def test_the_lag_is_what_a_slow_game_loses(hall: Hall, config: MakeConfig) -> None:
    loop = asyncio.get_running_loop()
    play = hall.game.act

    def slowly(plans: Any) -> Any:
        loop._jumping.now_s += 0.5  # type: ignore[attr-defined]  # the clock of the tests
        return play(plans)

    hall.game.act = slowly  # type: ignore[method-assign]
    (result,) = await hall.play(config(rule="realtime", step_loops=8, max_steps=5))
    assert result.lag_s == pytest.approx(4 * (0.5 - 8 / 22.4))


async def test_what_is_too_old_is_refused_with_a_reason(hall: Hall, config: MakeConfig) -> None:
    match = config(rule="budget", thinking_loops=20, step_loops=20, max_age_loops=19, max_steps=4)
    heard: list[str] = []

    async def stalkers(peer: Peer, seen: Observation) -> None:
        heard.extend(rejection.message for rejection in seen.rejections)
        await peer.answer(seen, ATTACK)

    await hall.play(match, Stalkers=stalkers)
    assert steps(hall, "Stalkers") == [(1, 0, 20, "refused"), (3, 2, 20, "refused")]
    assert not any(report.functions for report in hall.reports)
    assert heard == [
        "Your reply came 20 game loops after its observation, which is too late: no order of it was given."
    ]


async def test_a_decision_after_the_end_is_dropped_and_paid_for(hall: Hall, config: MakeConfig) -> None:
    hall.game.after = {0: {"outcome": "win"}}
    paid = taking(0, ATTACK, usage=Usage(requests=1))
    (result,) = await hall.play(config(rule="budget", thinking_loops=20, step_loops=11), Stalkers=paid)
    assert steps(hall, "Stalkers") == [(0, None, 11, "dropped")]
    assert result.usage["Stalkers"].requests == 1


async def test_an_agent_with_a_cadence_is_asked_by_it_and_hears_all_that_was_said(
    hall: Hall, config: MakeConfig
) -> None:
    match = config(step_loops=10, max_steps=7)
    stalkers, zealots = match.task.agents
    slow = zealots.model_copy(update={"every_loops": 30})
    match = match.model_copy(update={"task": match.task.model_copy(update={"agents": (stalkers, slow)})})
    heard: list[tuple[int, int]] = []

    async def listen(peer: Peer, seen: Observation) -> None:
        heard.append((seen.step, len(seen.messages)))
        await peer.answer(seen)

    await hall.play(match, Stalkers=taking(0, "<MessageTo(Zealots, 'go')>"), Zealots=listen)
    assert heard == [(0, 0), (3, 3), (6, 3)]


async def test_an_agent_may_be_asked_only_when_something_happens(hall: Hall, config: MakeConfig) -> None:
    match = config(step_loops=10, max_steps=4)
    stalkers, zealots = match.task.agents
    called = zealots.model_copy(update={"when": ("message",)})
    match = match.model_copy(update={"task": match.task.model_copy(update={"agents": (stalkers, called)})})

    async def calls(peer: Peer, seen: Observation) -> None:
        await peer.answer(seen, "<MessageTo(Zealots, 'help')>" if seen.step == 1 else "")

    await hall.play(match, Stalkers=calls)
    assert [step for step, *_ in steps(hall, "Zealots")] == [0, 2]


async def test_an_agent_without_units_is_asked_only_when_somebody_writes_to_it(hall: Hall, config: MakeConfig) -> None:
    match = config(step_loops=10, max_steps=4)
    stalkers, zealots = match.task.agents
    team = TeamConfig(name="Sentry-1", unit_types=("Sentry",))
    bare = zealots.model_copy(update={"teams": (team,), "actions": {"Sentry": ("Stop",)}})
    match = match.model_copy(update={"task": match.task.model_copy(update={"agents": (stalkers, bare)})})

    async def calls(peer: Peer, seen: Observation) -> None:
        await peer.answer(seen, "<MessageTo(Zealots, 'help')>" if seen.step == 1 else "")

    (result,) = await hall.play(match, Stalkers=calls)
    assert [step for step, *_ in steps(hall, "Zealots")] == [2]
    assert [dict(report.unasked) for report in hall.reports] == [{"Zealots": "no_units"}] * 2 + [{}] + [
        {"Zealots": "no_units"}
    ]
    assert result.unasked == {"Zealots": {"no_units": 3}}
    assert result.valid


async def test_a_match_without_a_required_agent_ends_and_is_not_valid(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    async def dies(peer: Peer, seen: Observation) -> None:
        if seen.step == 1:
            peer.bus.kill()
        else:
            await peer.answer(seen)

    path = tmp_path / "run.mcap"
    results = await hall.play(config(episodes=3, max_steps=5, grace_s=7, record=path), Stalkers=dies)
    (result,) = results
    assert now_s() == 7
    assert (result.outcome, result.cause, result.steps, result.valid) == ("aborted", "agents gone", 2, False)
    assert result.invalid_because == "required agents went away: blue/Stalkers"
    assert result.incidents == ("step 1: required agent blue/Stalkers did not come back within 7 s",)
    assert Recording.open(path).results == tuple(results)


@pytest.mark.parametrize(("rule", "steps", "outcome"), [("go_on", 5, "cut"), ("end", 2, "aborted")])
async def test_the_task_says_what_becomes_of_a_match_without_an_agent(
    hall: Hall, config: MakeConfig, rule: str, steps: int, outcome: str
) -> None:
    async def dies(peer: Peer, seen: Observation) -> None:
        if seen.step == 1:
            peer.bus.kill()
        else:
            await peer.answer(seen)

    (result,) = await hall.play(config(max_steps=5, faults={"agent_gone": rule}), Stalkers=dies)
    assert now_s() == 0
    assert (result.steps, result.outcome) == (steps, outcome)


async def test_a_match_in_which_a_model_never_answered_is_not_valid(hall: Hall, config: MakeConfig) -> None:
    hall.game.after = {2: {"outcome": "win"}}
    fails = taking(0, ATTACK, status="failed", detail="http 500", reason="the endpoint is on fire")
    (result,) = await hall.play(config(), Stalkers=fails)
    assert (result.outcome, result.valid) == ("win", False)
    assert result.invalid_because == "Stalkers never decided (3 http 500, first: the endpoint is on fire)"
    assert result.fallbacks == {"Stalkers": {"http 500": 3}}


async def test_an_endpoint_that_refuses_an_agent_for_good_ends_the_match_in_its_first_step(
    hall: Hall, config: MakeConfig
) -> None:
    refused = taking(0, "", status="failed", detail="http 404", reason="there is no model 'x'", hopeless=True)
    (result,) = await hall.play(config(max_steps=50), Stalkers=refused)
    assert (result.steps, result.outcome, result.cause, result.valid) == (1, "aborted", "model refused", False)
    assert result.invalid_because == "the endpoint of blue/Stalkers will not answer it: there is no model 'x'"
