"""Who is asked at which game loop, and when a decision takes effect, by each rule of the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.match.schedule import Cadence, Schedule, StepId, loops_to_think
from khala_orchestrator.match.turn import Answer
from khala_orchestrator.roster import Seat
from khala_protocol.messages import Clock, Pace, Reply, Usage

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from khala_protocol.messages import Trigger

QUICK, SLOW = Seat("blue", "Quick"), Seat("blue", "Slow")
PACE = Pace(latency_s=1.0, read_tokens_per_s=100.0, write_tokens_per_s=10.0)


def reply(seat: Seat, *, written: int = 0, pace: Pace | None = None) -> Answer:
    usage = Usage(requests=1, completion_tokens=written)
    said = Reply(run="r", agent=seat.agent, side=seat.side, episode=0, step=0, text="", usage=usage, pace=pace)
    return Answer("ok", said)


def nothing(seat: Seat) -> Collection[Trigger]:
    return ()


def play(
    schedule: Schedule, answers: Callable[[Seat, int], Answer | None], *, until: int
) -> list[tuple[int, list[str], list[str]]]:
    """Play a schedule; return each moment's game loop, the agents asked, and those whose decisions take effect.

    Args:
        schedule: at its beginning.
        answers: the answer of an agent that thinks, by the present loop; None if it still thinks.
        until: game loop after which it ends.
    """
    schedule.begin()
    moments: list[tuple[int, list[str], list[str]]] = []
    loop, thinking = 0, set[Seat]()
    while loop <= until:
        asked, _ = schedule.choose(StepId(0, len(moments)), loop, nothing)
        thinking |= {*asked}
        found = {seat: answer for seat in sorted(thinking) if (answer := answers(seat, loop)) is not None}
        thinking -= found.keys()
        schedule.decide(found, loop)
        due = schedule.take_due(loop)
        moments.append((loop, [seat.agent for seat in asked], [decision.seat.agent for decision in due]))
        loop += schedule.loops(loop)
    return moments


def made(**clock: Any) -> Schedule:
    return Schedule(Clock(step_loops=8, **clock), {QUICK: Cadence(), SLOW: Cadence()})


def test_a_frozen_game_goes_on_by_the_loops_of_a_step() -> None:
    both = ["Quick", "Slow"]
    assert play(made(), lambda seat, _: reply(seat), until=16) == [(0, both, both), (8, both, both), (16, both, both)]


def test_a_budget_costs_every_agent_the_same_whatever_it_does() -> None:
    both = ["Quick", "Slow"]
    played = play(made(rule="budget", thinking_loops=20), lambda seat, _: reply(seat, written=99), until=48)
    assert played == [
        (0, both, []), (8, [], []), (16, [], []), (20, [], both), (28, both, []), (36, [], []), (44, [], []),
        (48, [], both),
    ]  # fmt: skip


def test_tokens_cost_only_the_agent_that_wrote_them() -> None:
    def answer(seat: Seat, _: int) -> Answer:
        return reply(seat, written=2 if seat is SLOW else 0)

    clock = {"rule": "token", "pace": Pace(latency_s=0.25, write_tokens_per_s=4.0)}
    played = play(made(**clock), answer, until=40)
    effects = [(6, ["Quick"]), (17, ["Slow"]), (20, ["Quick"]), (34, ["Quick"])]
    assert [(loop, due) for loop, _, due in played if due] == effects
    assert [(loop, asked) for loop, asked, _ in played if asked] == [
        (0, ["Quick", "Slow"]), (14, ["Quick"]), (25, ["Slow"]), (28, ["Quick"]),
    ]  # fmt: skip


def test_in_real_time_a_slow_agent_costs_another_nothing() -> None:
    played = play(
        made(rule="realtime"), lambda seat, loop: reply(seat) if seat is QUICK or loop == 24 else None, until=32
    )
    assert [(loop, asked, due) for loop, asked, due in played] == [
        (0, ["Quick", "Slow"], ["Quick"]),
        (8, ["Quick"], ["Quick"]),
        (16, ["Quick"], ["Quick"]),
        (24, ["Quick"], ["Quick", "Slow"]),
        (32, ["Quick", "Slow"], ["Quick"]),
    ]


def test_a_decision_knows_what_it_was_made_for() -> None:
    schedule = made(rule="budget", thinking_loops=20)
    schedule.begin()
    schedule.choose(StepId(0, 3), 100, nothing)
    schedule.decide({QUICK: reply(QUICK), SLOW: reply(SLOW)}, 100)
    assert schedule.take_due(119) == []
    (quick, slow) = schedule.take_due(120)
    assert (quick.asked, quick.asked_loop, quick.due_loop) == (StepId(0, 3), 100, 120)
    assert schedule.drop(99) == []
    assert slow.seat == SLOW


def test_a_decision_that_never_takes_effect_and_one_that_nobody_made_are_found_at_the_end() -> None:
    schedule = made(rule="budget", thinking_loops=20)
    schedule.begin()
    schedule.choose(StepId(0, 0), 0, nothing)
    schedule.decide({SLOW: reply(SLOW)}, 0)
    assert {one.seat: (one.answer.status, one.answer.detail) for one in schedule.drop(99)} == {
        SLOW: ("ok", ""),
        QUICK: ("late", "no reply before the episode ended"),
    }


@pytest.mark.parametrize(
    ("cadence", "waited_loops", "happened", "due"),
    [
        (Cadence(), 0, (), True),
        (Cadence(20), 19, (), False),
        (Cadence(20), 20, (), True),
        (Cadence(0, ("attacked",)), 10**6, (), False),
        (Cadence(0, ("attacked",)), 0, ("idle",), False),
        (Cadence(0, ("attacked", "idle")), 0, ("idle",), True),
        (Cadence(20, ("attacked",)), 19, ("attacked",), True),
        (Cadence(20, ("attacked",)), 20, (), True),
    ],
)
def test_an_agent_is_asked_by_its_cadence(
    cadence: Cadence, waited_loops: int, happened: Collection[Trigger], due: bool
) -> None:
    assert cadence.is_due(waited_loops, lambda: happened) is due


def test_whatever_its_cadence_an_agent_sees_the_beginning() -> None:
    schedule = Schedule(Clock(), {SLOW: Cadence(1000, ("message",))})
    schedule.begin()
    assert schedule.choose(StepId(0, 0), 5, nothing).seats == [SLOW]


def test_who_is_not_asked_is_told_with_the_reason() -> None:
    schedule = Schedule(Clock(step_loops=8), {QUICK: Cadence(), SLOW: Cadence(1000)})
    schedule.begin()
    schedule.choose(StepId(0, 0), 0, nothing)
    assert schedule.choose(StepId(0, 1), 0, nothing) == ([], {})
    schedule.decide({QUICK: reply(QUICK), SLOW: reply(SLOW)}, 0)
    schedule.take_due(0)
    asked = schedule.choose(StepId(0, 2), 8, nothing, is_needed=lambda seat: seat is SLOW)
    assert asked == ([], {QUICK: "no_units", SLOW: "not_due"})


@pytest.mark.parametrize(
    ("usage", "pace", "loops"),
    [
        (Usage(), None, 0),
        (Usage(requests=1), None, 23),  # 1 s is 22.4 loops
        (Usage(requests=2, prompt_tokens=100, completion_tokens=10), None, 90),  # 2 + 1 + 1 s
        (Usage(requests=1, completion_tokens=10), Pace(latency_s=0.0, write_tokens_per_s=5.0), 45),  # 2 s
    ],
    ids=["no request", "a request", "all that counts", "by the pace of the model"],
)
def test_the_price_of_tokens(usage: Usage, pace: Pace | None, loops: int) -> None:
    said = Reply(run="r", agent="a", side="blue", episode=0, step=0, text="", usage=usage, pace=pace)
    assert loops_to_think(Clock(rule="token", pace=PACE), Answer("ok", said)) == loops


def test_an_agent_that_failed_costs_nothing_by_tokens_and_the_same_by_budget() -> None:
    assert loops_to_think(Clock(rule="token", pace=PACE), Answer("late")) == 0
    assert loops_to_think(Clock(rule="budget", thinking_loops=20), Answer("late")) == 20
