"""The table of an experiment, with a way to each recording.

Nothing is computed here that a report does not compute: see `khala_sc2.experiment.report`, which takes a second to load.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from khala_sc2.experiment.plan import count_matches
from khala_sc2.experiment.report.build import report
from khala_sc2.experiment.store import FILE, INDEX, Store
from khala_sc2.view.library import lines, run_id
from khala_sc2.view.wire import ExperimentLine, ExperimentView, TableCell, TableRow

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_sc2.experiment.played import PlayedMatch
    from khala_sc2.experiment.report.document import ReportTable
    from khala_sc2.experiment.report.summary import CellSummary
    from khala_sc2.experiment.statistics import Interval


def line_of(directory: Path) -> ExperimentLine:
    """Return an experiment as a list shows it.

    Raises:
        KhalaError: it cannot be read.
    """
    store = Store(directory)
    experiment = store.experiment()
    return ExperimentLine(
        id=run_id(directory),
        name=experiment.name,
        description=experiment.description,
        played=len(store.matches()),
        matches=count_matches(experiment),
    )


def experiment_view(directory: Path, below: Path) -> ExperimentView:
    """Return the table of an experiment; its intervals are computed again only if a match was played since.

    Raises:
        KhalaError: it cannot be read, or no match of it was played.
    """
    return _view(directory, below, *(_changed_ns(directory / name) for name in (FILE, INDEX)))


def _changed_ns(path: Path) -> int:
    return path.stat().st_mtime_ns if path.exists() else 0


@lru_cache(maxsize=8)
def _view(directory: Path, below: Path, file_ns: int, index_ns: int) -> ExperimentView:  # noqa: ARG001  # as they were
    store = Store.open(directory)
    made = report(store)
    played = list(store.matches().values())
    table = next(table for section in made.document.sections for table in section.tables if table.title == "By cell")
    recordings = [directory / match.recording for match in played if match.recording]
    line = line_of(directory)
    said = [words for words in made.document.paragraphs if words != line.description]
    return ExperimentView(
        line=line,
        factors=table.columns[: table.words],
        columns=table.columns[table.words :],
        rows=tuple(_rows(table, made.summaries, played, directory)),
        notes=(*said, *made.document.warnings, table.note),
        runs=tuple(lines(recordings, below)),
    )


def _rows(
    table: ReportTable, summaries: list[CellSummary], played: list[PlayedMatch], directory: Path
) -> Iterator[TableRow]:
    columns = table.columns[table.words :]
    for texts, summary in zip(table.rows, summaries, strict=True):
        cells = zip(columns, texts[table.words :], strict=True)
        mine = [match for match in played if match.recording and match.cell.items() <= summary.where.items()]
        yield TableRow(
            names=texts[: table.words],
            games=summary.games,
            cells=tuple(_cell(column, text, summary) for column, text in cells),
            runs=tuple(run_id(directory / match.recording) for match in mine),
        )


def _cell(column: str, text: str, summary: CellSummary) -> TableCell:
    intervals: dict[str, Interval] = {"won": summary.won, "K/D": summary.kd}
    if (interval := intervals.get(column)) is None or interval.value is None:
        return TableCell(text=text)
    return TableCell(text=text, value=_finite(interval.value), low=_finite(interval.low), high=_finite(interval.high))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
