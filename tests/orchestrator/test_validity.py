"""Whether an episode counts, from what each agent did."""

from __future__ import annotations

import pytest

from khala_orchestrator.match.validity import AWAY, Deeds, why_not_valid
from khala_orchestrator.roster import Seat
from khala_protocol.messages import AgentReport, AgentStatus


def deeds(**counts: int) -> Deeds:
    """Return what agent A did: so many decisions of each status."""
    found = Deeds()
    for status, count in counts.items():
        for _ in range(count):
            found.add(AgentReport.model_validate({"agent": "A", "side": "blue", "status": status}))
    return found


def judged(found: Deeds, *, limit: float = 0.1, required: tuple[str, ...] = ("A",), **others: object) -> str:
    given = {"lost": {}, "forfeit": None} | others
    return why_not_valid(found, required, limit=limit, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "status", ["empty", "cut", "refused", "filtered", "malformed", "failed", "late", "fallback", "gone"]
)
def test_an_agent_that_made_too_few_decisions_itself_makes_the_episode_not_valid(status: AgentStatus) -> None:
    assert judged(deeds(ok=18, **{status: 2})) == ""
    assert judged(deeds(ok=17, **{status: 3})) == (
        f"A did not make 3 of 20 decisions (15%, the limit is 10%: 3 {status})"
    )
    assert judged(deeds(**{status: 3})) == f"A never decided (3 {status})"


def test_a_model_that_was_away_for_nearly_all_of_its_decisions_does_not_count() -> None:
    assert judged(deeds(ok=10, fallback=254)).startswith("A did not make 254 of 264 decisions (96%")


def test_the_limit_is_that_of_the_task_and_an_agent_decides_at_least_once() -> None:
    assert judged(deeds(ok=1, late=9), limit=1.0) == ""
    assert judged(deeds(late=9), limit=1.0) == "A never decided (9 late)"
    assert judged(deeds(ok=98, late=2), limit=0.0) != ""


def test_a_short_episode_is_not_lost_by_one_late_answer() -> None:
    assert judged(deeds(ok=4, late=1)) == ""
    assert judged(deeds(ok=3, late=2)) != ""
    assert judged(deeds(late=1)) == "A never decided (1 late)"


def test_agents_that_were_not_asked_or_are_not_required_change_nothing() -> None:
    assert judged(Deeds()) == ""
    assert judged(deeds(late=5), required=("B",)) == ""


def test_where_no_agent_is_required_all_that_were_asked_count() -> None:
    assert judged(deeds(late=5), required=()) == "A never decided (5 late)"


def test_the_most_frequent_causes_and_the_first_words_of_an_endpoint_are_named() -> None:
    found = Deeds()
    for cause, count in {"http 500": 3, "timeout": 2, "connection": 2, "budget": 1}.items():
        for number in range(count):
            reason = f"{cause}, number {number}"
            found.add(AgentReport(agent="A", side="blue", status="failed", detail=cause, reason=reason))
    assert judged(found) == "A never decided (3 http 500, 2 timeout, 2 connection, first: http 500, number 0)"


def test_what_ended_the_episode_is_named_before_all_else() -> None:
    lost = {Seat("blue", "A"): AWAY, Seat("blue", "B"): "there is no model 'x'"}
    assert judged(deeds(late=9), lost=lost) == (
        "required agents went away: blue/A; the endpoint of blue/B will not answer it: there is no model 'x'"
    )
    assert judged(deeds(ok=9), forfeit="guest hung").startswith("the guest did not go on")


def test_orders_that_were_carried_out_are_counted_by_agent() -> None:
    found = Deeds()
    found.add(AgentReport(agent="A", side="blue", status="ok", accepted=("T <X()>", "T <Y()>")))
    found.add(AgentReport(agent="B", side="blue", status="ok"))
    assert (found.accepted["A"], found.accepted["B"]) == (2, 0)
