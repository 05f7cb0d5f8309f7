"""An export has a row for each episode and side, with factors as columns."""

from __future__ import annotations

import csv
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError
from khala_sc2.cli import app
from khala_sc2.experiment.commands import shipped_experiments
from khala_sc2.experiment.measures import Measures
from khala_sc2.experiment.plan import cells, plan
from khala_sc2.experiment.spec import Experiment
from tests.khala.experiment.handmade import HandMade

if TYPE_CHECKING:
    from khala_sc2.experiment.plan import PlannedMatch

ROOT = Path(__file__).parents[3]
PLANNED = {
    "smoke": 6, "full_game": 420, "llm_smac": 360, "llm_pysc2": 960, "pictures_and_messages": 320,
    "full_game_scripted": 840, "llm_smac_scripted": 360, "llm_pysc2_scripted": 960,
    "pictures_and_messages_scripted": 640, "table1": 1260, "table2": 1380, "table3": 1870, "table4": 2730,
}  # fmt: skip


@pytest.fixture
def made(tmp_path: Path) -> HandMade:
    made = HandMade(tmp_path / "made")
    made.fill({"skilled": {1, 2}, "focus": {2}}, 2)
    made.add({"task": "2s3z", "player": 'a,"b"\nc'}, 3, "loss", lost_value=0.0, kd=None, cost_usd=0.25)
    made.add({"task": "2s3z", "player": "gone"}, 4, state="crashed", cause="timeout")
    return made


def export(made: HandMade, option: str, name: str) -> Path:
    path = made.store.directory / name
    done = CliRunner().invoke(app, ["experiment", "export", str(made.store.directory), option, str(path)])
    assert done.exit_code == 0, done.exception
    assert done.stderr == f"5 rows are in {path}\n"
    return path


def test_csv_has_all_rows_and_columns(made: HandMade) -> None:
    with export(made, "--csv", "rows.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert set(rows[0]) >= {"match", "state", "factor.task", "factor.player", *Measures.__dataclass_fields__}
    assert [row["outcome"] for row in rows] == ["win", "win", "loss", "win", "loss"]
    assert (rows[4]["factor.player"], rows[4]["kd"], rows[4]["cost_usd"]) == ('a,"b"\nc', "", "0.25")


def test_parquet_has_the_types_of_the_measures(made: HandMade) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(export(made, "--parquet", "rows.parquet"))
    types = {name: str(table.schema.field(name).type) for name in ("valid", "seed", "kd", "outcome", "factor.player")}
    assert types == {"valid": "bool", "seed": "int64", "kd": "double", "outcome": "string", "factor.player": "string"}
    assert table.column("kd").to_pylist()[4] is None
    assert table.column("valid").to_pylist()[0] is True


def test_an_export_needs_a_file(made: HandMade) -> None:
    done = CliRunner().invoke(app, ["experiment", "export", str(made.store.directory)])
    assert isinstance(done.exception, ConfigError)
    assert "--parquet FILE or --csv FILE" in str(done.exception)


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.timeout(600)
def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("duckdb")
    notebook = nbformat.read(ROOT / "docs" / "notebooks" / "experiment.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=500, resources={"metadata": {"path": str(tmp_path)}}).execute()
    printed = str([cell.get("outputs") for cell in notebook.cells])
    assert "skilled" in printed
    assert "permutation test" in printed


# --- what is shipped ----------------------------------------------------------------------------------


def planned(name: str, monkeypatch: pytest.MonkeyPatch) -> list[PlannedMatch]:
    for key in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "DEEPSEEK_API_KEY"):
        monkeypatch.delenv(key, raising=False)
    return plan(load(shipped_experiments()[name], Experiment))


def test_the_shipped_experiments_are_these() -> None:
    assert sorted(shipped_experiments()) == sorted(PLANNED)
    for name, path in shipped_experiments().items():
        assert load(path, Experiment).name == name


@pytest.mark.parametrize(
    "name",
    [
        one if one in {"smoke", "pictures_and_messages", "table2"} else pytest.param(one, marks=pytest.mark.slow)
        for one in PLANNED
    ],
)
def test_a_shipped_experiment_can_be_planned(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    matches = planned(name, monkeypatch)
    assert len(matches) == PLANNED[name]
    assert all(match.config.task.rhythm == "paper" for match in matches)


def test_a_row_of_a_shipped_table_is_shown_for_a_model_of_ones_own_without_a_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    show = ["experiment", "show", "--out", str(tmp_path), "--json"]
    done = CliRunner().invoke(app, [*show, "table2:model=openai/gpt-6,task=2s3z"])
    assert done.exit_code == 0, done.exception
    (cell,) = json.loads(done.stdout)["cells"]
    assert (cell["task"], cell["model"], cell["matches"]) == ("2s3z", "openai/gpt-6", 20)
    (cell,) = json.loads(CliRunner().invoke(app, [*show, "table2:model=gpt-3.5-turbo,task=2s3z"]).stdout)["cells"]
    assert cell["matches"] == 50
    with pytest.raises(ConfigError, match="there is no factor 'modl'; the factors are task, model"):
        CliRunner().invoke(app, [*show, "table2:modl=silent"], catch_exceptions=False)


def test_retired_models_are_named_with_their_successors_before_anything_is_played(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["experiment", "show", "--out", str(tmp_path), "table4:task=pvz_task1_level1"])
    assert "gpt-3.5-turbo is retired on 2026-10-23; OpenAI named gpt-5.6-terra as its successor" in done.stderr


def test_a_table_has_the_repeats_and_the_gaps_of_the_paper_and_the_players_without_a_model() -> None:
    for name in ("table1", "table2", "table3", "table4"):
        found = load(shipped_experiments()[name], Experiment)
        games = {tuple(cell.names.values()): len(cell.seeds) for cell in cells(found)}
        assert {model for *_, model in games} >= {"silent", "random-legal", "focus-fire", "skilled"}
        table = found.published
        assert table is not None
        for row, of_row in table.rows.items():
            for column, cell in zip(table.columns, of_row, strict=True):
                where = table.values_at(row, column)
                assert games.get(tuple(where[factor] for factor in found.factors)) == (
                    table.games_of(row) if cell else None
                )
