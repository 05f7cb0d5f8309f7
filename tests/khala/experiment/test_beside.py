"""Published tables beside ours: their files, the layout, the tests, and cells that silence wins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from khala_protocol.configfile import load, loads
from khala_protocol.errors import ConfigError
from khala_sc2.experiment.plan import cells
from khala_sc2.experiment.published import PublishedTable, published_tables
from khala_sc2.experiment.report import report
from khala_sc2.experiment.spec import Experiment
from khala_sc2.experiment.statistics import p_of_published_ratio, variation_of_ratio
from tests.khala.experiment.handmade import HandMade

if TYPE_CHECKING:
    from pathlib import Path

    from khala_sc2.experiment.report.document import ReportTable

FILE = """
name: made
factors:
  task: [2s3z, 3s5z]
  model: [gpt-4o, gpt-4o-mini, silent]
seeds: 20
published:
  source: A paper
  where: {model: "{row}", task: "{column}"}
  games: {others: 20, gpt-4o: 50}
  columns: [2s3z, 3s5z]
  rows:
    gpt-4o: [0.50 (20), inf (100)]
    gpt-4o-mini: [2.00 (75), null]
"""


def play(made: HandMade, model: str, task: str, won: int, **values: Any) -> None:
    for seed in range(1, 21):
        killed = 500.0 + 10.0 * (seed % 5)
        outcome = "win" if seed <= won else "loss"
        made.add(
            {"task": task, "model": model}, seed, outcome, **{"killed_value": killed, "lost_value": 250.0} | values
        )


@pytest.fixture
def made(tmp_path: Path) -> HandMade:
    made = HandMade(tmp_path / "made")
    (made.store.directory / "experiment.yaml").write_text(FILE)
    play(made, "gpt-4o", "2s3z", 18)
    play(made, "gpt-4o-mini", "2s3z", 15)
    play(made, "gpt-4o", "3s5z", 20, lost_value=0.0)
    return made


def lines(made: HandMade) -> dict[tuple[str, str], tuple[str, ...]]:
    """Return the cells of each line by its label, which the first line of a row alone has, and its kind."""
    label = ""
    found = {}
    for first, kind, *texts in compared(made).rows:
        label = first or label
        found[label, kind] = tuple(texts)
    return found


def compared(made: HandMade) -> ReportTable:
    sections = report(made.store).document.sections
    return next(section.tables[0] for section in sections if section.title == "Beside what was published")


def test_our_numbers_stand_below_the_published_ones_with_intervals_and_whether_they_differ(made: HandMade) -> None:
    found = lines(made)
    assert compared(made).columns == ("model", "", "2s3z", "3s5z")
    assert found["gpt-4o", "published"] == ("0.50 (20 [11–33])", "∞ (100 [93–100])")  # the report's
    assert found["gpt-4o", "here"][0].startswith("2.08 [2.0")
    assert found["gpt-4o", "here"][0].endswith("(90 [70–97])")
    assert found["gpt-4o", "differ"] == ("K/D and WR", "no (WR alone)")
    assert found["gpt-4o-mini", "differ"] == ("K/D", "–")
    assert ("silent", "here") not in found


def test_a_cell_that_silence_wins_is_marked_and_named_as_one_that_measures_nothing(made: HandMade) -> None:
    play(made, "silent", "2s3z", 10)
    play(made, "silent", "3s5z", 9)
    assert all(texts[0].endswith("†") for (_, kind), texts in lines(made).items() if kind != "differ")
    assert not any("†" in texts[1] for texts in lines(made).values())
    assert (
        "Of 3 published cells, a player without orders has the higher win rate in 1, the higher K/D in 2."
        in compared(made).note
    )
    (warning,) = [text for text in report(made.store).document.warnings if "measure nothing" in text]
    assert warning.endswith("measure nothing: 2s3z")


def test_a_row_of_another_model_is_added_to_the_grid_and_to_the_table(made: HandMade) -> None:
    mine = made.store.experiment().only({"model": "openai/gpt-6"})
    assert [cell.names["model"] for cell in cells(mine)] == ["openai/gpt-6"] * 2
    play(made, "openai/gpt-6", "2s3z", 20)
    assert lines(made)["openai/gpt-6", "here"][0].endswith("(100 [84–100])")
    assert len(list(cells(made.store.experiment().only({"task": "2s3z"})))) == 3
    with pytest.raises(ValueError, match="there is no factor 'modl'; the factors are task, model"):
        made.store.experiment().only({"modl": "silent"})


def test_a_published_table_of_one_model_has_the_players_below_each_of_its_rows(tmp_path: Path) -> None:
    made = HandMade(tmp_path / "made")
    where = 'where: {model: gpt-4o, task: "{column}", level: "{row}"}'
    text = FILE.replace('where: {model: "{row}", task: "{column}"}', where).replace("    gpt-4o-mini:", "    hard:")
    text = text.replace("    gpt-4o: [", "    easy: [").replace(", gpt-4o: 50}", "}")
    text = text.replace("  model: [", "  level: [easy, hard]\n  model: [")
    (made.store.directory / "experiment.yaml").write_text(text)
    for model in ("gpt-4o", "silent"):
        made.add({"task": "2s3z", "level": "hard", "model": model}, 1)
    assert list(lines(made)) == [
        ("easy · gpt-4o", "published"), ("hard · gpt-4o", "published"), ("hard · gpt-4o", "here"),
        ("hard · gpt-4o", "differ"), ("hard · silent", "here"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("table9", "there is no published table 'table9': there are"),
        ("{source: P, columns: [a], rows: {x: [0.5 20]}}", "as 0.66 \\(20\\), or the win rate alone: '0.5 20'"),
        ("{source: P, columns: [a], rows: {x: [1, 2]}}", "the row x has 2 cells for 1 columns"),
        ("{source: P, columns: [a], rows: {x: [101]}}", "less than or equal to 1"),
        ("{source: P, columns: [a], rows: {x: [1]}, games: {y: 3}}", "games names the row 'y'; the rows are x"),
    ],
)
def test_a_wrong_table_is_refused(table: str, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        loads(f"{{name: e, factors: {{task: [2s3z]}}, published: {table}}}", Experiment, source="e.yaml")


def test_the_shipped_tables_are_those_of_the_paper_and_of_others() -> None:
    tables = {name: load(path, PublishedTable) for name, path in published_tables().items()}
    assert {name: (len(table.rows), len(table.columns)) for name, table in tables.items()} == {
        "hep": (1, 3), "hima": (1, 7), "table1": (3, 7), "table2": (6, 6), "table3": (9, 7), "table4": (3, 7),
    }  # fmt: skip
    gaps = {row for row, of_row in tables["table3"].rows.items() if None in of_row}
    assert gaps == {"gpt-4o", "gpt-o1-mini"}
    assert tables["table3"].rows["gpt-3.5-turbo"] == tables["table4"].rows["level1"]
    assert tables["table3"].cell("gpt-4o", "task3") == tables["table3"].rows["gpt-4o"][2]
    assert (tables["table2"].games_of("gpt-3.5-turbo"), tables["table2"].games_of("gpt-4o")) == (50, 20)
    assert (tables["table1"].only_wins, tables["table2"].only_wins, tables["hima"].games_of("HIMA")) == (
        True,
        False,
        None,
    )


@pytest.mark.parametrize("games", [(20, 20), (20, 50)])
def test_a_ratio_that_was_published_is_found_to_differ_by_chance_in_a_twentieth_of_cases(
    games: tuple[int, int],
) -> None:
    drawn = np.random.default_rng(1)
    found = []
    for _ in range(1000):
        killed, lost = (drawn.gamma(3, 100, sum(games)) for _ in range(2))
        ours, theirs = slice(games[0]), slice(games[0], None)
        ratio, published = (float(killed[part].sum() / lost[part].sum()) for part in (ours, theirs))
        variation = variation_of_ratio(list(killed[ours]), list(lost[ours]))
        found.append(p_of_published_ratio(ratio, variation, games[0], published, games[1]))
    assert 0.03 <= np.mean([p is not None and p < 0.05 for p in found]) <= 0.07
    assert variation_of_ratio([1.0], [2.0]) is None
    assert p_of_published_ratio(1.0, 0.5, 20, float("inf"), 20) is None
