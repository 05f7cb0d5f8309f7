"""Rows of a world model: two observations of an agent, and the joint orders of its side between them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.messages import LOOPS_PER_S, Observation, Report, Run, Scene
from khala_protocol.recording import Recorder, Recording
from khala_sc2.cli import main
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.choose import Split
from khala_sc2.dataset.dynamics import Transitions
from khala_sc2.dataset.export import export
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.read import read_rows

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_sc2.dataset.row import Row

    Rewrite = Callable[..., Recording]

pytestmark = pytest.mark.game

HORIZON_S = 2.0


def rows_of(recording: Recording, horizon_s: float = HORIZON_S) -> list[Row]:
    assert recording.run is not None
    return list(Transitions(recording, recording.run, horizon_s=horizon_s))


def test_a_row_ends_with_the_first_observation_that_is_late_enough(recording: Recording) -> None:
    rows = rows_of(recording)
    assert rows
    for row in rows:
        seen = list(recording.observations(row.agent))
        assert row.following is not None
        expected = next(o for o in seen if o.game_loop >= row.game_loop + round(HORIZON_S * LOOPS_PER_S))
        assert (row.following.step, row.following.game_loop) == (expected.step, expected.game_loop)
        assert row.following.next_view == expected.view
        own_lines = {line for line in expected.text.splitlines() if "| tag 0x" in line}
        assert own_lines
        assert own_lines <= set(row.reply.splitlines())


def test_the_next_observation_of_a_horizon_of_nothing_is_that_of_the_next_step(recording: Recording) -> None:
    assert {row.following.step - row.step for row in rows_of(recording, 0.0) if row.following} == {1}


def test_orders_are_those_of_all_agents_of_the_side_that_took_effect_in_between(recording: Recording) -> None:
    reports = list(recording.of(Report))
    loops = {seen.step: seen.game_loop for seen in recording.of(Observation)}
    agents = set()
    for row in rows_of(recording):
        assert row.following is not None
        within = [report for report in reports if row.step <= report.step < row.following.step]
        expected = [
            (loops[report.step], agent.agent, action)
            for report in within
            for agent in report.agents
            for action in agent.accepted
        ]
        assert [tuple(order) for order in row.following.orders] == expected
        assert all(f"{agent}: {action}" in row.prompt[-1].content for _, agent, action in expected)
        assert row.reward.reward == sum((report.killed_value or 0) - (report.lost_value or 0) for report in within)
        agents |= {order.agent for order in row.following.orders}
    assert agents == {"Stalkers", "Zealots"}


def test_the_fog_is_that_of_the_first_observation(recording: Recording, rewritten: Rewrite) -> None:
    fog = {scene.step: scene.fog["blue"].data for scene in recording.of(Scene)}
    assert [row.following.fog for row in rows_of(recording) if row.following] == [
        fog[row.step] for row in rows_of(recording)
    ]
    without = rewritten(lambda sample: [] if isinstance(sample.message, Scene) else [sample.message])
    assert {row.following.fog for row in rows_of(without) if row.following} == {None}


def test_orders_and_rewards_of_steps_that_are_played_again_count_once(recording: Recording, tmp_path: Path) -> None:
    """A host that was killed asks again from its last step on, in the same recording."""
    samples = list(recording)
    until = next(at for at, sample in enumerate(samples) if getattr(sample.message, "step", 0) == 5)
    again = [sample for sample in samples[:until] if getattr(sample.message, "step", None) in (3, 4)]
    with Recorder(tmp_path / "again.mcap") as recorder:
        for sample in (*samples[:until], *again, *samples[until:]):
            recorder.write(sample.key, sample.payload)
    resumed = rows_of(Recording.open(tmp_path / "again.mcap"))
    assert [(row.id, row.following, row.reward) for row in resumed] == [
        (row.id, row.following, row.reward) for row in rows_of(recording)
    ]


def test_all_forms_are_written_and_their_splits_share_no_prompt(
    recording: Recording, rewritten: Rewrite, tmp_path: Path
) -> None:
    def other_seed(sample: Any) -> list[Any]:
        return [sample.message.but(seed=7) if isinstance(sample.message, Run) else sample.message]

    again = rewritten(other_seed)
    recipe = Recipe(split=Split.of("0.5,0.5", "seed"), horizon_s=HORIZON_S)
    contents = export([recording.path, again.path], tmp_path / "out", recipe)
    rows = rows_of(recording)
    assert contents.rows == {"train": 2 * len(rows)}
    assert (contents.moved, contents.repeats.duplicates) == (len(rows), len(rows))
    assert contents.left_out["too late for a next observation"] == 2 * (28 - len(rows))
    for form in RowForm:
        written = list(read_rows(tmp_path / "out" / form / f"train.{form.suffix}"))
        assert [row.reply for row in written][: len(rows)] == [row.reply for row in rows]
        card = (tmp_path / "out" / form / "README.md").read_text(encoding="utf-8")
        assert "pretty_name: Dynamics of StarCraft II" in card
        assert "at least 2 s of the game later" in card


def test_the_columns_have_what_a_world_model_is_trained_and_judged_with(recording: Recording, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    export([recording.path], tmp_path / "out", Recipe((RowForm.PARQUET,), horizon_s=HORIZON_S))
    found = parquet.read_table(tmp_path / "out" / "parquet" / "train.parquet").to_pylist()
    assert recording.run is not None
    for got, row in zip(found, rows_of(recording), strict=True):
        assert row.following is not None
        assert got["clock"]["step_loops"] == recording.run.clock.step_loops
        assert (got["side"], got["next_observation"]) == ("blue", row.reply)
        assert got["observation"] in got["prompt"][-1]["content"]
        assert [order["action"] for order in got["orders"]] == list(row.accepted)
        assert json.loads(got["next_view"])["teams"]


def test_the_command_splits_dynamics_unless_told_otherwise(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["dataset", "export", str(recording.path), "--out", str(out), "--dynamics", "--format", "trl"])
    assert ended.value.code == 0
    assert "observations with the next one are in" in capsys.readouterr().out
    assert "train 0.8, validation 0.1, test 0.1" in (out / "trl" / "README.md").read_text(encoding="utf-8")
