"""Put the report of an experiment together, and write it in the formats that are wanted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from khala_protocol.errors import ConfigError
from khala_protocol.files import make_private, write_together
from khala_sc2.experiment.plan import count_matches
from khala_sc2.experiment.report.beside import beside, idle_cells, words_of_idle_wins
from khala_sc2.experiment.report.calls import calls
from khala_sc2.experiment.report.conditions import conditions, warnings
from khala_sc2.experiment.report.document import ReportDocument, ReportSection
from khala_sc2.experiment.report.figures import figures
from khala_sc2.experiment.report.html import Html
from khala_sc2.experiment.report.latex import Latex
from khala_sc2.experiment.report.markdown import Markdown
from khala_sc2.experiment.report.summary import cells, summary
from khala_sc2.experiment.report.tables import not_counted, overview, tables
from khala_sc2.experiment.selection import factors_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from khala_sc2.experiment.report.summary import CellSummary
    from khala_sc2.experiment.report.writer import DocumentWriter
    from khala_sc2.experiment.spec import Experiment
    from khala_sc2.experiment.store import Store


FORMATS: dict[str, DocumentWriter] = {"markdown": Markdown(), "latex": Latex(), "html": Html()}


class ExperimentReport(NamedTuple):
    """The report as a document, and the numbers in it."""

    document: ReportDocument
    summaries: list[CellSummary]

    def data(self) -> dict[str, Any]:
        """Return the numbers, for JSON."""
        return {"experiment": self.document.title, "warnings": self.document.warnings, "cells": self.summaries}


def report(store: Store, by: Sequence[str] = ()) -> ExperimentReport:
    """Return the report of an experiment.

    Args:
        store: of the experiment.
        by: factors whose values get a line each; all of them if none is named.

    Raises:
        ConfigError: no match was played, or there is no such factor.
    """
    experiment = store.experiment()
    known = store.matches()
    if not known:
        raise ConfigError(f"no match of {experiment.name} was played: `khala experiment run` plays them")
    played = list(known.values())
    rows = store.results()
    done = {match.key for match in played if match.state == "done"}
    groups = cells(played, rows, by)
    summaries = sorted((summary(cell) for cell in groups), key=lambda cell: _place(experiment, cell))
    published = experiment.published
    idle = idle_cells(experiment, summaries)
    compared = beside(published, summaries, idle) if published else None
    of_cells = tables(summaries)
    sections = [
        ReportSection(
            "Results",
            tables=_existing(overview(summaries), of_cells[0]),
            figures=tuple(figures(summaries)),
        ),
        ReportSection(
            "Beside what was published",
            (published.differs,) if published and published.differs else (),
            _existing(compared),
        ),
        ReportSection("More", tables=_existing(*of_cells[1:], calls(store.calls(), done))),
        ReportSection("Not counted", tables=_existing(not_counted(summaries))),
        ReportSection("How it was played", tables=(conditions(store, played, rows),)),
    ]
    sections = [section for section in sections if section.tables or section.figures]
    found = [
        *words_of_idle_wins(idle),
        *warnings(cells(played, rows), played),
        *_missing(experiment, len(played)),
    ]
    paragraphs = tuple(filter(None, (experiment.description, _count(summaries, factors_of(played)))))
    return ExperimentReport(ReportDocument(experiment.name, paragraphs, tuple(found), tuple(sections)), summaries)


def write(document: ReportDocument, directory: Path, formats: Sequence[str]) -> list[Path]:
    """Write a document, and its pictures beside it; return the files, the documents first."""
    make_private(directory)
    texts: dict[Path, bytes] = {}
    pictures: dict[Path, bytes] = {}
    figures = [figure for section in document.sections for figure in section.figures]
    for name in formats:
        writer = FORMATS[name]
        texts[directory / f"report.{writer.suffix}"] = writer.text(document).encode()
        if writer.picture:
            drawn = {f"{figure.name}.{writer.picture}": figure.draw(writer.picture) for figure in figures}
            pictures |= {directory / file: picture for file, picture in drawn.items()}
    write_together(texts | pictures)
    return [*texts, *pictures]


def _existing(*tables: Any) -> tuple[Any, ...]:
    return tuple(table for table in tables if table is not None)


def _place(experiment: Experiment, cell: CellSummary) -> list[int]:
    """Return the place of a cell in the grid: an index that was made again has matches in the order of their keys."""
    names = {factor: [level.name for level in levels] for factor, levels in experiment.factors.items()}
    return [
        names[factor].index(value) if value in names.get(factor, ()) else len(names.get(factor, ()))
        for factor, value in cell.where.items()
    ]


def _missing(experiment: Experiment, played: int) -> list[str]:
    count = count_matches(experiment)
    return [f"{count - played} of {count} matches were not played yet"] if played < count else []


def _count(summaries: Sequence[CellSummary], factors: Sequence[str]) -> str:
    games = sum(cell.games for cell in summaries)
    costs = [cell.usd * cell.games for cell in summaries if cell.usd is not None]
    money = f" They cost {sum(costs):.2f} USD." if any(costs) else ""
    return f"{games} games in {len(summaries)} cells of {', '.join(factors)}.{money}"
