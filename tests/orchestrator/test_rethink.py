"""A reply of which nothing is possible, of an agent that rethinks: it is told so at once, and its next reply counts."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.keys import Topic

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest

    from khala_orchestrator.match.turn import Answer, Question
    from tests.orchestrator.conftest import Peer, Table

    Observe = Callable[..., list[Question]]

CLOCK = "jumps"
ZEALOTS, STALKERS = Seat("p1", "Zealots"), Seat("p1", "Stalkers")


def nonsense_is_refused(seat: Seat, answer: Answer) -> str:
    """Judge by the text alone."""
    return f"{seat.agent}: not so, {answer.text}" if "nonsense" in (answer.text or "") else ""


async def test_a_refused_reply_is_answered_with_a_verdict_and_the_next_one_counts(
    table: Table, observe: Observe
) -> None:
    async with table(ZEALOTS, STALKERS, judge=nonsense_is_refused) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        seen = await zealots.observed()
        await stalkers.reply("nonsense")  # which does not want to rethink
        await asyncio.sleep(10)
        await zealots.reply("nonsense", rethink=1)
        again = await zealots.observed()
        assert again.verdict is not None
        assert (again.verdict.number, again.verdict.text) == (1, "Zealots: not so, nonsense")
        assert again.model_copy(update={"verdict": None}) == seen
        await asyncio.sleep(5)
        await zealots.reply("nonsense", rethink=1)  # sent twice, for its link was down
        await zealots.reply("attack", rethink=1, rethinks=1)
        answers = await asked
    answer = answers.by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.latency_s, answer.ignored) == ("ok", "attack", 15.0, 1)
    assert answer.verdicts == ("Zealots: not so, nonsense",)
    assert (answers.by_seat[STALKERS].text, answers.by_seat[STALKERS].verdicts) == ("nonsense", ())


async def test_it_is_asked_again_as_often_as_it_wants_and_no_oftener(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, judge=nonsense_is_refused) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        for number in range(3):
            await zealots.observed()
            await zealots.reply(f"nonsense {number}", rethink=2, rethinks=number)
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.text, answer.verdicts) == (
        "nonsense 2",
        ("Zealots: not so, nonsense 0", "Zealots: not so, nonsense 1"),
    )


async def test_the_reply_before_stands_if_no_other_comes_before_the_same_deadline(
    table: Table, observe: Observe
) -> None:
    async with table(ZEALOTS, judge=nonsense_is_refused) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await asyncio.sleep(40)
        await zealots.reply("nonsense", rethink=1)
        answers = await asked
        late = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        await zealots.reply("attack", rethink=1, rethinks=1)
        await zealots.reply("go on", step=1, rethink=1)
        after = (await late).by_seat[ZEALOTS]
    answer = answers.by_seat[ZEALOTS]
    assert answers.wait_s == 60
    assert (answer.status, answer.text, answer.latency_s, answer.verdicts) == ("ok", "nonsense", 40.0, ())
    assert (after.text, after.ignored) == ("go on", 1)


async def test_the_reply_before_stands_if_the_agent_goes_or_sends_what_is_no_reply(
    table: Table, observe: Observe, subtests: pytest.Subtests
) -> None:
    async def go(zealots: Peer) -> None:
        await zealots.leave()

    async def break_down(zealots: Peer) -> None:
        await zealots.put(Topic.REPLY, b"no reply")

    for end in (go, break_down):
        with subtests.test(end.__name__):
            async with table(ZEALOTS, judge=nonsense_is_refused, required=[ZEALOTS], grace_s=30.0) as (
                turn,
                (zealots,),
            ):
                asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
                await asyncio.sleep(1)
                await zealots.reply("nonsense", rethink=1)
                await asyncio.sleep(1)
                await end(zealots)
                answers = await asked
            assert (answers.by_seat[ZEALOTS].text, answers.wait_s, answers.lost) == ("nonsense", 2.0, {})


async def test_an_agent_that_was_away_gets_the_verdict_again(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, judge=nonsense_is_refused) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await zealots.reply("nonsense", rethink=1)
        first = await zealots.observed()
        await zealots.arrive("2")  # it was started again, and takes over
        second = await zealots.observed()
        await zealots.reply("attack", rethink=1, rethinks=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert first == second
    assert answer.text == "attack"
