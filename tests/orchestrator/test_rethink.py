"""A reply of which nothing is possible, of an agent that rethinks: it is told so at once, and its next reply counts."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from khala_bridge.game.game import GameIdentity
from khala_orchestrator.config import MatchConfig
from khala_orchestrator.console import card, table
from khala_orchestrator.match.cards import run_card
from khala_orchestrator.match.schedule import StepId
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.tally import Tally
from khala_orchestrator.match.turn import Answer
from khala_orchestrator.roster import Seat
from khala_protocol.keys import Topic
from khala_protocol.messages import AgentReport, Reply, Report

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import ReplyStatus
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


# --- the judgement ------------------------------------------------------------------------------------


class Judged(NamedTuple):
    """A reply, and what its verdict has; "" for none."""

    text: str
    verdict: str = ""
    status: ReplyStatus = "ok"
    cut: bool = False


ORDER = "Team Stalker-1:\n<Attack_Unit(0xb)>"
REPLIES = [
    Judged(f"Actions:\n{ORDER}"),
    Judged(f"Actions:\n{ORDER}\n<Fire()>"),
    Judged("Actions:\nTeam Stalker-1:\n<Standing(Attack_Unit(0xb))>"),
    Judged("Analysis: wait.\nActions:\n"),
    Judged("<MessageTo(Zealots, 'go')>"),
    Judged("", status="failed"),
    Judged("<Fire()>", status="fallback"),
    Judged("<MessageTo(Zealots, 'go')>\nTeam Stalker-1:\n<Fire()>", "There is no action Fire"),
    Judged("Team Stalker-1:\n<Attack_Unit(0xeeee)>", "0xeeee"),
    Judged("I shall attack.", "Nothing could be read in your last answer."),
    Judged("", "Your last answer was empty:", status="empty"),
    Judged("<think>If", "was cut at the limit of tokens", cut=True),
    Judged("<Revoke(3)>", "You have no standing order 3"),
    Judged("    rejected: <Fire()>: say it in words", "only repeats what you were shown"),
]


@pytest.mark.parametrize("judged", REPLIES, ids=[f"{judged.status} {judged.text!r}" for judged in REPLIES])
async def test_a_reply_is_judged_by_its_orders_alone_and_nothing_comes_of_it(
    judged: Judged, config: Any, start: Any, still_game: Any
) -> None:
    task = config().task.model_copy(update={"standing_orders": 2})
    (side,) = sides_of(MatchConfig(task=task, run="test"))
    side.begin()
    (snapshot,) = await (await start(still_game())).reset()
    side.look(snapshot)
    side.question("Stalkers", StepId(0, 0))
    reply = Reply(
        run="test", side="blue", agent="Stalkers", episode=0, step=0, text=judged.text, status=judged.status,
        cut=judged.cut,
    )  # fmt: skip
    answer = Answer(judged.status, reply, verdicts=("    rejected: <Fire()>: say it in words",))
    verdict = side.judge("Stalkers", answer)
    assert verdict == side.judge("Stalkers", answer)
    assert side._actor.standing.views("Stalkers", side._now, side._actor._translator(side._now)) == ()
    if not judged.verdict:
        assert verdict == ""
    else:
        assert judged.verdict in verdict
        first, *_, last = verdict.splitlines()
        assert first == "Nothing of this answer can be carried out:"
        assert last == "Answer the same observation again, and in full: only your new answer counts."


def test_the_result_counts_how_often_an_agent_rethought(snapshot: Any, printed: Any) -> None:
    tally = Tally(snapshot(), "blue")
    report = AgentReport(agent="Stalkers", side="blue", status="ok", latency_s=1.0)
    steps = [report, report.model_copy(update={"rethinks": 2}), report.model_copy(update={"rethinks": 1})]
    for step, agent in enumerate(steps):
        tally.add(Report(run="test", episode=0, step=step, game_loop=8, agents=(agent,)), snapshot())
    result = tally.result("test", 0, wall_s=1.0)
    assert result.rethinks == {"Stalkers": 3}
    assert any("3 ok, 3 asked to rethink" in line for line in printed(table(result)))


def test_the_run_card_says_who_may_rethink(config: Any, printed: Any) -> None:
    match = config().model_copy(update={"rethink": {"Stalkers": 1}})
    run = run_card(match, GameIdentity("1", "1", "a.SC2Map", ""))
    assert run.rethink == {"Stalkers": 1}
    assert any(line.split() == ["│", "rethink", "Stalkers", "1", "a", "step", "│"] for line in printed(card(run)))
