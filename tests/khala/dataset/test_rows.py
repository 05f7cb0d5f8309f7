"""A recording becomes one row for each decision, with the prompt that a model got, and what the decision was worth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_protocol.messages import ModelCall, Reply, Report, Result
from khala_sc2.dataset import rows as module
from khala_sc2.dataset.rewards import Reward
from khala_sc2.dataset.rows import Rows

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_protocol.messages import Wire
    from khala_protocol.recording import Recorded, Recording
    from khala_sc2.dataset.row import Row

    Rewrite = Callable[..., Recording]

pytestmark = pytest.mark.game


def rows_of(recording: Recording, gamma: float = 0.9) -> dict[str, Row]:
    assert recording.run is not None
    return {row.id: row for row in Rows(recording, recording.run, gamma=gamma)}


def reports(change: Callable[[Report], Report]) -> Callable[[Recorded], Iterable[Wire]]:
    """Return a change of a recording's reports."""
    return lambda sample: [change(sample.message) if isinstance(sample.message, Report) else sample.message]  # type: ignore[list-item]


def test_prompts_can_be_made_with_less_detail_than_they_were_sent_with(recording: Recording) -> None:
    assert recording.run is not None
    for row in Rows(recording, recording.run, detail="tiny"):
        assert sum(-(-len(message.content) // 4) for message in row.prompt) <= 1_000
        assert not row.prompt_recorded


def test_every_reply_that_counted_has_a_row(recording: Recording) -> None:
    (result,) = recording.results
    found = rows_of(recording)
    assert len(found) == sum(counts["ok"] for counts in result.statuses.values()) > 20
    replies = {f"first/blue/{reply.agent}/0/{reply.step}": reply.text for reply in recording.of(Reply)}
    assert {place: row.reply for place, row in found.items()} == replies


def test_a_model_has_its_request_word_for_word(recording: Recording) -> None:
    found = rows_of(recording)
    calls = list(recording.of(ModelCall))
    assert calls
    for call in calls:
        row = found[f"first/blue/{call.agent}/0/{call.step}"]
        assert (row.prompt, row.reply, row.model) == (call.prompt, call.completion, "focus-fire")
        assert [picture.ref for picture in row.pictures] == list(call.prompt[-1].images) != []
    assert {row.agent for row in found.values() if not row.prompt_recorded} == {"Zealots"}


def test_a_prompt_that_was_not_recorded_is_made_as_the_agent_makes_it(recording: Recording, rewritten: Rewrite) -> None:
    """The agents remember two steps, and see pictures."""
    without = rewritten(lambda sample: [] if isinstance(sample.message, ModelCall) else [sample.message])
    asked = {place: row for place, row in rows_of(recording).items() if row.model}
    made = rows_of(without)
    assert not any(row.prompt_recorded for row in made.values())
    for place, row in asked.items():
        assert made[place].prompt == row.prompt
        assert made[place].pictures == row.pictures


@pytest.mark.parametrize(("most_waiting", "in_time"), [(64, True), (2, False)])
def test_requests_that_arrive_late_are_waited_for_within_a_limit(
    recording: Recording, rewritten: Rewrite, monkeypatch: pytest.MonkeyPatch, most_waiting: int, *, in_time: bool
) -> None:
    calls = list(recording.of(ModelCall))

    def at_the_end(sample: Recorded) -> list[Wire]:
        if isinstance(sample.message, ModelCall):
            return []
        assert sample.message is not None
        return [*calls, sample.message] if isinstance(sample.message, Result) else [sample.message]

    monkeypatch.setattr(module, "MOST_WAITING", most_waiting)
    found = [row for row in rows_of(rewritten(at_the_end)).values() if row.agent == "Stalkers"]
    assert all(row.prompt_recorded for row in found) is in_time
    assert len(found) == len(calls)


def test_rewards_sum_up_to_the_values_of_the_result(recording: Recording) -> None:
    (result,) = recording.results
    by_step = {row.step: row.reward.reward or 0.0 for row in rows_of(recording).values()}
    assert result.killed.value > 0
    assert sum(by_step.values()) == result.killed.value - result.lost.value
    values = {r.step: (r.killed_value or 0.0) - (r.lost_value or 0.0) for r in recording.of(Report)}
    assert by_step == values  # each step has a decision


def test_what_a_step_without_a_decision_gains_belongs_to_the_decision_before(rewritten: Rewrite) -> None:
    values = {0: 10.0, 1: 0.0, 2: 5.0, 3: -4.0}

    def change(report: Report) -> Report:
        agents = () if report.step in {1, 2} else report.agents
        value = values.get(report.step, 0.0)
        return report.but(agents=agents, killed_value=max(value, 0.0), lost_value=max(-value, 0.0))

    found = {row.step: row.reward for row in rows_of(rewritten(reports(change)), gamma=0.5).values()}
    assert found[0] == Reward(15.0, 15.0 + 0.5 * -4.0)
    assert found[3] == Reward(-4.0, -4.0)
    assert 1 not in found


def test_without_values_in_the_reports_the_last_decision_has_that_of_the_episode(rewritten: Rewrite) -> None:
    old = rewritten(reports(lambda report: report.but(killed_value=None, lost_value=None)))
    (result,) = old.results
    by_step = {row.step: row.reward.reward for row in rows_of(old).values()}
    assert by_step.pop(max(by_step)) == result.killed.value - result.lost.value
    assert set(by_step.values()) == {0.0}


def test_an_episode_that_was_cut_off_is_unfinished_and_without_values_worth_nothing_known(rewritten: Rewrite) -> None:
    def cut(sample: Recorded) -> list[Wire]:
        match sample.message:
            case Result():
                return []
            case Report() as report:
                return [report.but(killed_value=None, lost_value=None)]
        assert sample.message is not None
        return [sample.message]

    found = rows_of(rewritten(cut)).values()
    assert {(row.outcome, row.valid, row.reward) for row in found} == {("unfinished", False, Reward(None, None))}


def test_a_reply_that_did_not_count_is_no_row_and_is_counted(recording: Recording, rewritten: Rewrite) -> None:
    def late(report: Report) -> Report:
        return report.but(agents=tuple(agent.but(status="late") for agent in report.agents))

    changed = rewritten(reports(lambda report: late(report) if report.step == 2 else report))
    assert changed.run is not None
    rows = Rows(changed, changed.run)
    assert {row.step for row in rows} == {row.step for row in rows_of(recording).values()} - {2}
    assert rows.left_out == {"late": 2, "no report": 0}


def test_a_reply_under_the_key_of_another_agent_is_nobodys(recording: Recording, rewritten: Rewrite) -> None:
    def forged(sample: Recorded) -> list[Wire]:
        assert sample.message is not None
        if isinstance(sample.message, Reply) and sample.message.agent == "Stalkers":
            return [sample.message.but(agent="Zealots", text="forged"), sample.message]
        return [sample.message]

    assert rows_of(rewritten(forged)) == rows_of(recording)
