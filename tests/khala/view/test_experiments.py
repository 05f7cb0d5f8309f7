"""An experiment as a view shows it: the table of its report, with a way to each recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_sc2.experiment.report import report
from khala_sc2.view.runs import NotThere
from khala_sc2.view.sources import Sources
from tests.khala.experiment.handmade import HandMade

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def sources(tmp_path: Path) -> Sources:
    made = HandMade(tmp_path / "made")
    made.fill({"skilled": set(range(1, 16)), "focus": set(range(9, 21))})
    return Sources("here", tmp_path)


def test_a_directory_lists_its_experiments(sources: Sources) -> None:
    (line,) = sources.library().experiments
    assert (line.name, line.played, line.matches) == ("made", 40, 40)


def test_its_table_is_that_of_its_report(sources: Sources, tmp_path: Path) -> None:
    (line,) = sources.library().experiments
    view = sources.experiment(line.id)
    made = report(HandMade(tmp_path / "made").store)
    (table,) = (one for section in made.document.sections for one in section.tables if one.title == "By cell")
    assert (*view.factors, *view.columns) == table.columns
    assert [(*row.names, *(cell.text for cell in row.cells)) for row in view.rows] == list(table.rows)
    won = view.rows[0].cells[view.columns.index("won")]
    assert (won.value, won.low, won.high) == (
        made.summaries[0].won.value, made.summaries[0].won.low, made.summaries[0].won.high,
    )  # fmt: skip


def test_an_experiment_that_is_not_there_is_missed(sources: Sources) -> None:
    with pytest.raises(NotThere):
        sources.experiment("../made")
