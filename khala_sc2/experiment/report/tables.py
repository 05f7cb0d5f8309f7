"""Summaries of cells as tables: what is asked of all, and columns only where there are values."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_sc2.experiment.numbers import NONE, number, ratio, ratio_with, share, share_with
from khala_sc2.experiment.report.document import ReportTable
from khala_sc2.experiment.report.summary import FATES

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_sc2.experiment.report.summary import CellSummary


MOST_COLUMNS = 4
"""Values of the last factor that stand beside each other."""


class Column(NamedTuple):
    """One column."""

    title: str
    value: Callable[[CellSummary], str]
    always: bool = False
    """Whether it is there without any value."""


class Kind(NamedTuple):
    """One table."""

    title: str
    columns: tuple[Column, ...]
    note: str


KINDS = (
    Kind(
        "By cell",
        (
            Column("games", lambda summary: str(summary.games), always=True),
            Column("won", lambda summary: share_with(summary.won), always=True),
            Column("draws", lambda summary: str(summary.draws or NONE)),
            Column("decided", lambda summary: _some_share(summary.decided), always=True),
            Column("K/D", lambda summary: ratio_with(summary.kd), always=True),
            Column("length", lambda summary: _clock(summary.length_s)),
            Column("not counted", lambda summary: str(sum(summary.not_counted.values()) or NONE)),
        ),
        "Won: share of games with its Wilson interval of 95 %; a draw is not won. Decided: share of decisions that "
        "agents made themselves, without fallbacks, failures, late, empty or refused answers. K/D: value killed in all "
        "games / value lost in all games, with its bootstrap interval of 95 %. Length: median, in minutes of the game.",
    ),
    Kind(
        "Actions",
        (
            Column("accepted", lambda summary: number(summary.accepted)),
            Column("refused", lambda summary: number(summary.refused)),
            Column("input-conflicting", lambda summary: _hundredth(summary.hallucinations["input_conflicting"])),
            Column("fact-conflicting", lambda summary: _hundredth(summary.hallucinations["fact_conflicting"])),
            Column("context-conflicting", lambda summary: _hundredth(summary.hallucinations["context_conflicting"])),
        ),
        "Accepted and refused: calls per game. The others: hallucinations of the paper's three kinds, per 100 calls.",
    ),
    Kind(
        "Decisions",
        (
            *(Column(name, lambda summary, name=name: _some_share(summary.fates[name])) for name in FATES),  # type: ignore[misc]
            Column("latency p50", lambda summary: _seconds(summary.latency_p50_s)),
            Column("p95", lambda summary: _seconds(summary.latency_p95_s)),
            Column("age p50", lambda summary: _some_number(summary.age_p50_loops)),
            Column("age p95", lambda summary: _some_number(summary.age_p95_loops)),
        ),
        "What became of decisions, in shares. Latency: from observation to reply, in seconds of the wall; age: from "
        "observation to effect, in game loops; both are medians over games.",
    ),
    Kind(
        "Tokens and money",
        (
            Column("tokens a game", lambda summary: _some_number(summary.tokens)),
            Column("USD a game", lambda summary: _usd(summary.usd)),
            Column("USD a win", lambda summary: _usd(summary.usd_per_win)),
        ),
        "Tokens: read and written. USD: of requests whose price is known; a win costs what all games cost / games won.",
    ),
    Kind(
        "Messages",
        (
            Column("sent", lambda summary: _some_number(summary.messages["messages_sent"])),
            Column("undeliverable", lambda summary: _some_number(summary.messages["messages_undeliverable"])),
            Column("unfounded", lambda summary: _some_number(summary.messages["messages_unfounded"])),
            Column("read", lambda summary: _some_number(summary.messages["messages_read"])),
            Column("answered", lambda summary: _some_number(summary.messages["messages_answered"])),
            Column("acted on", lambda summary: _some_number(summary.messages["messages_acted_on"])),
        ),
        "Per game. Unfounded: name a tag that their sender did not see. Read: pairs of a message and a reader. Acted "
        "on: the reader gave a new order that names what the message names.",
    ),
    Kind(
        "Economy",
        (
            Column("supply blocked", lambda summary: _seconds(summary.supply_blocked_s)),
            Column("minerals unspent", lambda summary: number(summary.minerals)),
            Column("vespene unspent", lambda summary: number(summary.vespene)),
            Column("first expansion", lambda summary: _expansion(summary.expansion_s, summary.expanded, summary.games)),
        ),
        "Supply blocked: seconds per game. Unspent: mean over time. First expansion: median of the games that had one, "
        "in minutes of the game.",
    ),
)  # fmt: skip


def tables(summaries: Sequence[CellSummary]) -> list[ReportTable]:
    """Return the tables of cells, without those that would be empty."""
    return [table for kind in KINDS if (table := _table(kind, summaries)) is not None]


def _table(kind: Kind, summaries: Sequence[CellSummary]) -> ReportTable | None:
    texts = {column: [column.value(summary) for summary in summaries] for column in kind.columns}
    shown = [column for column in kind.columns if column.always or any(text != NONE for text in texts[column])]
    if not shown or not summaries:
        return None
    factors = tuple(summaries[0].where)
    rows = [(*summary.where.values(), *(texts[column][i] for column in shown)) for i, summary in enumerate(summaries)]
    return ReportTable(
        kind.title, (*factors, *(column.title for column in shown)), tuple(rows), len(factors), kind.note
    )


def overview(summaries: Sequence[CellSummary]) -> ReportTable | None:
    """Return wins and K/D with columns for each value of the last factor, as papers print them."""
    if not summaries or len(summaries[0].where) < 2:
        return None
    *first, last = summaries[0].where
    values = list(dict.fromkeys(summary.where[last] for summary in summaries))
    rows: dict[tuple[str, ...], dict[str, CellSummary]] = {}
    for summary in summaries:
        rows.setdefault(tuple(summary.where[name] for name in first), {})[summary.where[last]] = summary
    if not 2 <= len(values) <= MOST_COLUMNS:
        return None
    columns = (*first, *(f"{value}: {what}" for value in values for what in ("won", "K/D")))
    texts = [
        (*where, *(text for value in values for text in _won_and_kd(found.get(value)))) for where, found in rows.items()
    ]
    return ReportTable("Overview", columns, tuple(texts), len(first))


def not_counted(summaries: Sequence[CellSummary]) -> ReportTable | None:
    """Return which matches are in no number, and why; None if there are none."""
    causes = list(dict.fromkeys(cause for summary in summaries for cause in summary.not_counted))
    if not causes:
        return None
    rows = [
        (*summary.where.values(), *(str(summary.not_counted.get(cause, NONE)) for cause in causes))
        for summary in summaries
        if summary.not_counted
    ]
    factors = tuple(summaries[0].where)
    note = (
        "Invalid: played, and says nothing about its agents. Crashed: not played to its end. `resume` plays them again."
    )
    return ReportTable("Not counted", (*factors, *causes), tuple(rows), len(factors), note)


def _won_and_kd(summary: CellSummary | None) -> tuple[str, str]:
    return (share_with(summary.won), ratio(summary.kd.value)) if summary is not None else (NONE, NONE)


def _clock(seconds: float | None) -> str:
    return NONE if seconds is None else f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def _expansion(seconds: float | None, expanded: int, games: int) -> str:
    return NONE if seconds is None else f"{_clock(seconds)} ({expanded} of {games})"


def _seconds(value: float | None) -> str:
    return NONE if value is None else f"{value:.2f} s"


def _some_number(value: float | None) -> str:
    """Return a number that is worth a column only if it is not 0 everywhere."""
    return number(value) if value else NONE


def _some_share(value: float | None) -> str:
    return share(value, digits=1) if value else NONE


def _hundredth(value: float | None) -> str:
    return NONE if value is None else f"{value:.1f}"


def _usd(value: float | None) -> str:
    return NONE if value is None else f"{value:.4f}" if 0 < value < 0.1 else f"{value:.2f}"
