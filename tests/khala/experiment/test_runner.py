"""The runner plays what is missing, tries again what crashed, and never spends more than it may."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.llm.money import MoneyLedger
from khala_protocol.errors import ConfigError
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.runner import Runner, RunnerEvent, pilot_of
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import Store
from tests.khala.experiment.made import MadeEngine, record

if TYPE_CHECKING:
    from pathlib import Path

    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.playing.jobs import Job


def experiment(**fields: Any) -> Experiment:
    given = {"name": "e", "fixed": {"model": "scripted"}, "factors": {"task": ["2s3z_pair", "3s5z"]}, "seeds": 3}
    return Experiment.model_validate(given | fields)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "e")


async def run(store: Store, engine: MadeEngine, found: Experiment | None = None, **budget: Any) -> Runner:
    found = found or experiment()
    runner = Runner(found, store, engine, ExperimentBudget(**budget))
    await runner.play(plan(found))
    return runner


def states(store: Store) -> list[str]:
    return [played.state for played in store.matches().values()]


async def test_every_match_is_played_once_and_a_second_run_plays_nothing(store: Store) -> None:
    engine = MadeEngine()
    await run(store, engine)
    assert (states(store), len(engine.jobs), engine.most_at_once) == (["done"] * 6, 6, 2)
    again = MadeEngine()
    await run(store, again)
    assert again.jobs == []


async def test_a_grown_grid_plays_only_what_is_new(store: Store) -> None:
    await run(store, MadeEngine())
    engine = MadeEngine()
    await run(store, engine, experiment(seeds=4))
    assert [job.config.seed for job in engine.jobs] == [4, 4]


async def test_a_crashed_match_is_played_again_and_counted_apart_in_the_end(store: Store) -> None:
    seen: list[RunnerEvent] = []
    always, once = (match.key for match in plan(experiment())[:2])

    def ends(job: Job, attempt: int) -> str:
        key = job.config.labels["match"]
        return "lost" if key == always or (key == once and attempt == 1) else "done"

    found = experiment()
    runner = Runner(found, store, MadeEngine(ends=ends), ExperimentBudget(), see=seen.append)
    await runner.play(plan(found))
    played = store.matches()
    assert (played[always].state, played[always].cause, played[always].attempts) == ("crashed", "crash", 3)
    assert (played[once].state, played[once].attempts) == ("done", 2)
    assert [event.what for event in seen if event.match.key == always and event.what != "begins"] == [
        "again", "again", "ends",
    ]  # fmt: skip


async def test_matches_of_a_model_that_is_refused_for_good_are_not_begun_any_more(store: Store) -> None:
    found = experiment(factors={"model": ["scripted/skilled", "silent"]}, fixed={"task": "2s3z_pair"})
    engine = MadeEngine(slots=1, ends=lambda job, _: "done" if job.minds["blue"].policy else "refused")
    runner = await run(store, engine, found)
    assert [job.minds["blue"].policy for job in engine.jobs] == [None, "silent", "silent", "silent"]
    assert runner.stopped == "the endpoint of blue/A will not answer it: there is no model 'x'"
    assert states(store).count("invalid") == 1


async def test_a_match_whose_recording_is_lost_has_cost_what_its_ledger_says(store: Store) -> None:
    def ends(job: Job, _: int) -> str:
        assert job.config.record is not None
        with MoneyLedger(job.config.record.with_suffix(".ledger")) as ledger:
            ledger.pay("blue", 0.25)
            ledger.hold("blue", 0.125, None)
        return "nothing"

    runner = await run(store, MadeEngine(ends=ends), experiment(seeds=1, retries=0), usd=9.0)
    assert runner.spent.usd == pytest.approx(2 * 0.375)
    assert Runner(experiment(), store, MadeEngine(), ExperimentBudget(usd=9.0)).spent.usd == pytest.approx(2 * 0.375)


async def test_a_match_without_any_recording_is_known_as_crashed(store: Store) -> None:
    await run(store, MadeEngine(ends=lambda _job, _try: "nothing"), experiment(seeds=1, retries=0))
    assert [(one.state, one.recording) for one in store.matches().values()] == [("crashed", "")] * 2


async def test_a_lost_match_is_a_result_and_one_without_a_model_is_not(store: Store) -> None:
    def ends(job: Job, attempt: int) -> str:
        return "invalid" if job.config.seed == 1 else "done"

    await run(store, MadeEngine(ends=ends))
    assert [(one.seed, one.state, one.cause) for one in store.matches().values()] == [
        (1, "invalid", "A never decided"), (1, "invalid", "A never decided"), *[(s, "done", "") for s in (2, 2, 3, 3)],
    ]  # fmt: skip
    assert {row["outcome"] for row in store.results() if row["state"] == "done"} == {"win", "loss"}


@pytest.mark.parametrize(("slots", "price"), [(1, 0.3), (2, 0.3), (5, 0.1), (2, 2.0)])
async def test_the_budget_is_never_exceeded(store: Store, slots: int, price: float) -> None:
    engine = MadeEngine(slots=slots, cost_usd=lambda job: price * (1 + job.config.seed % 3))
    runner = await run(store, engine, usd=1.9)
    assert 0 < sum(one.cost_usd or 0.0 for one in store.matches().values()) <= 1.9 + 1e-9
    assert runner.spent.usd == pytest.approx(sum(one.cost_usd or 0.0 for one in store.matches().values()))
    assert runner.spent.held_usd == pytest.approx(0.0)
    assert not runner.stopped or "USD" in runner.stopped


async def test_a_match_whose_money_went_is_not_valid(store: Store) -> None:
    await run(store, MadeEngine(slots=1, cost_usd=lambda _: 1.0), experiment(seeds=1), usd=0.5)
    assert [(one.state, one.cause) for one in store.matches().values()] == [("invalid", "budget")]


async def test_no_further_match_is_begun_with_less_than_was_not_enough(store: Store) -> None:
    engine = MadeEngine(slots=1, cost_usd=lambda _: 1.0)
    runner = await run(store, engine, usd=0.5)
    assert len(engine.jobs) == 1
    assert "the budget of 0.5 USD is used up" in runner.stopped


async def test_a_match_gets_more_where_its_part_was_not_enough(store: Store) -> None:
    found = experiment(factors={"task": ["2s3z_pair"]}, seeds=2)
    engine = MadeEngine(slots=4, cost_usd=lambda _: 0.3)
    await run(store, engine, found, usd=0.2)
    assert states(store) == ["invalid"]
    await run(store, engine, found, usd=2.0)
    assert states(store) == ["done"] * 2
    assert [job.minds["blue"].budget_usd for job in engine.jobs] == [0.2, 0.4, 0.4]


async def test_a_model_of_a_single_agent_is_held_to_the_budget(store: Store) -> None:
    found = experiment(fixed={"model": "silent", "agents": {"Stalkers": "scripted"}, "task": "2s3z_pair"},
                       factors={"clock": ["frozen"]}, seeds=1)  # fmt: skip
    engine = MadeEngine(slots=1)
    await run(store, engine, found, usd=0.01)
    assert [job.minds["blue"].budget_usd for job in engine.jobs] == [0.01]


async def test_while_nobody_knows_what_a_match_costs_one_is_played_alone(store: Store) -> None:
    engine = MadeEngine(slots=4, cost_usd=lambda _: 0.3)
    runner = await run(store, engine, usd=1.0)
    assert [job.minds["blue"].budget_usd for job in engine.jobs] == pytest.approx([1.0, 0.6, 0.4])
    assert (states(store), runner.stopped) == (["done"] * 3, "the budget of 1 USD is used up (0.9000 were spent)")


async def test_the_first_match_of_a_cell_gets_room_where_much_is_left(store: Store) -> None:
    engine = MadeEngine(slots=1, cost_usd=lambda job: 0.3 if job.config.task.name == "2s3z_pair" else 1.5)
    await run(store, engine, usd=100.0)
    assert [job.minds["blue"].budget_usd for job in engine.jobs] == pytest.approx([100.0, 9.97, 0.6, 3.0, 0.6, 3.0])
    assert states(store) == ["done"] * 6


async def test_a_match_waits_for_money_that_others_give_back(store: Store) -> None:
    engine = MadeEngine(slots=4, cost_usd=lambda _: 0.3)
    runner = await run(store, engine, usd=1.9)
    assert (states(store), runner.stopped, engine.most_at_once) == (["done"] * 6, "", 3)


async def test_matches_of_free_models_are_played_at_the_same_time(store: Store) -> None:
    engine = MadeEngine(slots=2)
    await run(store, engine, usd=1.0)
    assert (states(store), engine.most_at_once) == (["done"] * 6, 2)


async def test_what_crashed_tries_have_cost_counts(store: Store) -> None:
    def ends(job: Job, attempt: int) -> str:
        return "lost" if attempt < 3 else "done"

    runner = await run(store, MadeEngine(ends=ends, cost_usd=lambda _: 0.25), experiment(seeds=1))
    assert runner.spent.usd == pytest.approx(2 * 3 * 0.25)
    assert Runner(experiment(), store, MadeEngine(), ExperimentBudget()).spent.usd == pytest.approx(1.5)


async def test_the_money_of_a_runner_that_was_killed_counts(store: Store) -> None:
    match = plan(experiment())[0]
    path = store.recording_for(match.key)
    record(path, match.config, cost_usd=0.5, result=False)
    runner = Runner(experiment(), store, MadeEngine(), ExperimentBudget())
    assert runner.spent.usd == 0.5
    assert [(one.state, one.cause) for one in store.matches().values()] == [("crashed", "interrupted")]


async def test_budgets_of_tokens_and_of_time(store: Store) -> None:
    runner = await run(store, MadeEngine(slots=1), tokens=3_500)
    assert (len(store.matches()), "3500 tokens" in runner.stopped) == (3, True)


async def test_the_pilot_estimates_the_rest(store: Store) -> None:
    found = experiment(seeds=20)
    matches = plan(found)
    runner = Runner(
        found,
        store,
        MadeEngine(cost_usd=lambda job: 0.1 if job.config.task.name == "3s5z" else 0.3),
        ExperimentBudget(),
    )
    await runner.play(pilot_of(matches, 2))
    estimate = runner.estimate(matches)
    assert (estimate.matches, estimate.tokens) == (36, 36_000)
    assert estimate.usd == pytest.approx(18 * 0.4)
    assert estimate.hours == pytest.approx(36 * 2.0 / 3600 / 2)


async def test_the_index_is_made_again_of_the_recordings(store: Store) -> None:
    def ends(job: Job, attempt: int) -> str:
        return "lost" if job.config.seed == 2 and attempt == 1 else "done"

    found = experiment()
    await run(store, MadeEngine(ends=ends), found)
    before, rows = store.matches(), store.results()
    assert store.rebuild() == len(before)
    assert store.matches() == before
    assert sorted(store.results(), key=str) == sorted(rows, key=str)


async def test_two_runners_do_not_share_a_directory(store: Store) -> None:
    store.directory.mkdir()
    other = Store(store.directory).lock()
    with store.lock(), pytest.raises(ConfigError, match="another process plays the experiment"):
        other.__enter__()


def test_the_pilot_has_some_of_each_cell() -> None:
    def places(matches: list[PlannedMatch]) -> list[tuple[str, int]]:
        return [(match.cell["task"], match.seed) for match in matches]

    assert places(pilot_of(plan(experiment()), 2)) == [(t, s) for s in (1, 2) for t in ("2s3z_pair", "3s5z")]


async def test_who_is_cancelled_leaves_what_was_played(store: Store) -> None:
    found, seen = experiment(), asyncio.Queue[RunnerEvent]()
    runner = Runner(found, store, MadeEngine(slots=1), ExperimentBudget(), see=seen.put_nowait)
    playing = asyncio.create_task(runner.play(plan(found)))
    while len(store.matches()) < 2:
        await seen.get()
    playing.cancel()
    await asyncio.gather(playing, return_exceptions=True)
    assert states(store) == ["done"] * 2
