from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.knowledge import facts_of
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_orchestrator.match.tally import Tally, valid_together
from khala_protocol.messages import AgentReport, Rejection, Report, Usage

if TYPE_CHECKING:
    from khala_bridge.state import Forfeit
    from khala_protocol.messages import AgentStatus, Outcome, Result


def snapshot(
    own: set[int], enemy: set[int], *, dead: set[int] | None = None, killed: float = 0, lost: float = 0, loop: int = 0,
    outcome: Outcome | None = None,
) -> Snapshot:  # fmt: skip
    response = sc_pb.ResponseObservation()
    response.observation.game_loop = loop
    for tags, alliance in ((own, raw_pb2.Self), (enemy, raw_pb2.Enemy)):
        for tag in sorted(tags):
            response.observation.raw_data.units.add(tag=tag, alliance=alliance, display_type=raw_pb2.Visible)
    details = response.observation.score.score_details
    details.killed_minerals.army, details.lost_minerals.army = killed * 0.75, lost * 0.75
    details.killed_vespene.army, details.lost_vespene.army = killed * 0.25, lost * 0.25
    return read_snapshot(
        response, read_info(sc_pb.ResponseGameInfo(), facts_of("multi")), dead=frozenset(dead or ()), outcome=outcome
    )


def report(step: int, status: AgentStatus = "ok", latency_s: float | None = 1.0, rejected: int = 0) -> Report:
    fault = Rejection(reason="unknown_target", message="No.", text="<A(0x1)>", start=0)
    agent = AgentReport(
        agent="A", side="blue", status=status, latency_s=latency_s, accepted=("A <Stop()>",),
        rejections=(fault,) * rejected, usage=Usage(requests=1, prompt_tokens=100, completion_tokens=10, cost_usd=0.5),
    )  # fmt: skip
    return Report(run="r", episode=0, step=step, game_loop=8 * step, agents=(agent,), env_steps=3)


def result(*afters: Snapshot, reports: list[Report] | None = None) -> Result:
    tally = Tally(snapshot({1, 2, 3}, {11, 12}, killed=50, lost=25))
    for step, after in enumerate(afters):
        tally.add(reports[step] if reports else report(step), after)
    return tally.result("r", 0, wall_s=2.0)


def test_a_result_names_the_variant_and_counts_hallucinations_of_the_agents_themselves() -> None:
    world = snapshot({1}, {11})
    tally = Tally(world, variant="paper")
    tally.add(report(0, rejected=2), world)
    tally.add(report(1, "fallback", rejected=5), world)
    found = tally.result("r", 0, wall_s=1.0)
    assert (found.variant, found.rejections) == ("paper", {"unknown_target": 7})
    assert found.hallucinations == {"input_conflicting": 2}


def test_deaths_are_counted_by_side_and_values_since_the_beginning() -> None:
    found = result(
        snapshot({1, 3}, {11, 12}, dead={2}, killed=50, lost=125),
        snapshot({1, 3}, set(), dead={11, 12, 99}, killed=350, lost=125, loop=160, outcome="win"),
    )
    assert (found.lost.units, found.lost.value, found.killed.units, found.killed.value) == (1, 100, 2, 300)
    assert (found.outcome, found.cause, found.kd) == ("win", "enemy defeated", 3.0)


@pytest.mark.parametrize(
    ("forfeit", "why_not"),
    [("guest left", ""), ("guest gone", "connection or process ended"), ("guest hung", "did not go on")],
)
def test_a_win_over_a_guest_that_went_away_says_so_and_is_valid_only_if_it_gave_up(
    forfeit: Forfeit, why_not: str
) -> None:
    found = result(dataclasses.replace(snapshot({1}, {11}, outcome="win"), forfeit=forfeit))
    assert (found.outcome, found.cause, found.valid) == ("win", forfeit, not why_not)
    assert why_not in found.invalid_because


def test_units_that_came_later_are_counted_too() -> None:
    found = result(snapshot({1, 2, 3, 4}, {11}), snapshot({1, 2, 3}, {11}, dead={4}))
    assert found.lost.units == 1


def test_nothing_lost_has_no_ratio() -> None:
    assert result(snapshot({1, 2, 3}, set(), dead={11, 12}, killed=250, lost=25, outcome="win")).kd is None


@pytest.mark.parametrize(
    ("outcome", "told", "cause"),
    [("win", "win", "enemy defeated"), ("loss", "loss", "defeated"), ("draw", "draw", "time limit"),
     (None, "cut", "step limit")],
)  # fmt: skip
def test_the_cause_goes_with_the_outcome(outcome: Outcome | None, told: str, cause: str) -> None:
    found = result(snapshot({1}, {11}, outcome=outcome))
    assert (found.outcome, found.cause) == (told, cause)


def test_a_draw_without_survivors_is_no_time_limit() -> None:
    assert result(snapshot(set(), set(), dead={1, 2, 3, 11, 12}, outcome="draw")).cause == "both sides dead"


def test_steps_usage_statuses_and_rejections_are_added_up() -> None:
    now = snapshot({1}, {11}, loop=224)
    reports = [report(0, rejected=2), report(1, "late", None), report(2, latency_s=3.0)]
    found = result(now, now, now, reports=reports)
    assert (found.steps, found.env_steps, found.accepted) == (3, 9, 3)
    assert found.statuses == {"A": {"ok": 2, "late": 1}}
    assert found.rejections == {"unknown_target": 2}
    assert found.usage["A"] == Usage(requests=3, prompt_tokens=300, completion_tokens=30, cost_usd=1.5)
    assert (found.latency_p50_s, found.latency_p95_s) == (2.0, 3.0)
    assert (found.game_loop, found.game_s) == (224, 10.0)


def test_an_episode_without_a_step_has_no_latency_and_nothing_to_count() -> None:
    found = result()
    assert (found.steps, found.env_steps, found.accepted, found.game_loop) == (0, 0, 0, 0)
    assert (found.latency_p50_s, found.latency_p95_s, found.kd) == (None, None, None)
    assert (found.usage, found.statuses, found.rejections) == ({}, {}, {})


def test_steps_without_a_reply_have_no_latency() -> None:
    found = result(snapshot({1}, {11}), reports=[report(0, "late", None)])
    assert (found.latency_p50_s, found.latency_p95_s) == (None, None)


def test_one_step_in_twenty_may_be_slower_than_the_95th_percentile(subtests: pytest.Subtests) -> None:
    for latencies, median, slowest in (
        ([1.0], 1.0, 1.0),
        ([4.0, 1.0], 2.5, 4.0),
        ([float(number) for number in range(20)], 9.5, 19.0),
        ([float(number) for number in range(21)], 10.0, 19.0),
        ([float(number) for number in range(100)], 49.5, 95.0),
    ):
        with subtests.test(count=len(latencies)):
            now = snapshot({1}, {11})
            reports = [report(step, latency_s=latency) for step, latency in enumerate(latencies)]
            found = result(*[now] * len(latencies), reports=reports)
            assert (found.latency_p50_s, found.latency_p95_s) == (median, slowest)


def test_rejections_are_counted_by_their_reason() -> None:
    now = snapshot({1}, {11})
    reports = [report(0, rejected=1), report(1, rejected=1)]
    (agent,) = reports[1].agents
    other = agent.rejections[0].model_copy(update={"reason": "malformed"})
    reports[1] = reports[1].model_copy(
        update={"agents": (agent.model_copy(update={"rejections": (*agent.rejections, other, other)}),)}
    )
    assert result(now, now, reports=reports).rejections == {"unknown_target": 2, "malformed": 2}


def test_a_unit_that_changed_sides_is_counted_for_the_last_one() -> None:
    found = result(snapshot({1, 11}, {12}), snapshot({1}, {12}, dead={11}))
    assert (found.lost.units, found.killed.units) == (1, 0)


def test_a_win_over_a_side_that_never_answered_is_not_valid_either() -> None:
    units = snapshot({1}, {11})
    silent = Tally(units, "red", required=["A"])
    silent.add(report(0, "fallback"), units)
    won = Tally(units, "blue").result("r", 0, wall_s=1.0)
    blue, red = valid_together([won, silent.result("r", 0, wall_s=1.0)])
    assert (blue.valid, blue.invalid_because) == (False, f"side red: {red.invalid_because}")
    assert valid_together([won]) == [won]
