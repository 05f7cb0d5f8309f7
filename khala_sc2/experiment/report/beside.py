"""Our numbers beside a published table, in its layout, and which cells measure nothing.

Each published row has its K/D (win rate) with an interval, ours below it, and whether the two differ by more than
chance. A cell that a player without orders wins measures nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from khala_sc2.experiment import statistics
from khala_sc2.experiment.compare import LEVEL
from khala_sc2.experiment.numbers import DASH, NONE, number, ratio
from khala_sc2.experiment.report.document import ReportTable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_sc2.experiment.published import PublishedCell, PublishedTable
    from khala_sc2.experiment.report.summary import CellSummary
    from khala_sc2.experiment.spec import Experiment
    from khala_sc2.experiment.statistics import Interval

MODEL = "model"
SILENT = ("silent", "scripted/silent")
"""Models that give no order."""
SILENCE_WINS = 0.5
"""Share of games that a silent player wins in a cell that measures nothing."""
MARK = "\N{DAGGER}"
OF_WINS = "Wins by Boschloo's exact test"
OF_KD = "; K/D, unless it is 0 or infinite, by a t-test of logarithms that takes published games to vary as ours do"
MOST_NAMED = 12
"""Cells that one warning names."""


# what silence wins ----------------------------------------------------------------------------------------------------


class Idle(NamedTuple):
    """A cell that a player without orders has played."""

    where: dict[str, str]
    """Values of the other factors."""
    summary: CellSummary

    @property
    def wins(self) -> bool:
        """Whether it wins so often that wins of others measure nothing."""
        return (self.summary.won.value or 0.0) >= SILENCE_WINS


def idle_cells(experiment: Experiment, summaries: Iterable[CellSummary]) -> list[Idle]:
    """Return the cells of players that give no order."""
    return [
        Idle({name: value for name, value in summary.where.items() if name not in silent}, summary)
        for summary in summaries
        if (silent := {name for name, value in summary.where.items() if _is_silent(experiment, name, value)})
    ]


def _is_silent(experiment: Experiment, factor: str, value: str) -> bool:
    known = {level.name: level.settings.model for level in experiment.factors.get(factor, ())}
    return known.get(value, value if factor == MODEL else None) in SILENT


def words_of_idle_wins(idle: Iterable[Idle]) -> list[str]:
    """Return a warning that names the cells that measure nothing; none if there are none."""
    won = [", ".join(cell.where.values()) for cell in idle if cell.wins]
    if not won:
        return []
    more = f" and {len(won) - MOST_NAMED} more" if len(won) > MOST_NAMED else ""
    names = "; ".join(won[:MOST_NAMED])
    return [f"a player without orders wins half of its games or more, so that wins measure nothing: {names}{more}"]


# the published layout -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Place:
    """A row of the published table, or of a player that it does not have."""

    row: str
    """Of the published table; the player's name if the table has a row for each model."""
    player: str

    @property
    def label(self) -> str:
        return self.row if self.row == self.player else f"{self.row} \N{MIDDLE DOT} {self.player}"


@dataclass(frozen=True, slots=True)
class _Pair:
    """A published cell, ours, or both."""

    theirs: PublishedCell | None
    their_games: int | None
    ours: CellSummary | None
    idle: Idle | None
    """Of a player without orders, in the same cell."""

    @property
    def measures_nothing(self) -> bool:
        return self.idle is not None and self.idle.wins


def beside(table: PublishedTable, summaries: Sequence[CellSummary], idle: Sequence[Idle] = ()) -> ReportTable | None:
    """Return published numbers beside ours; None if none of our cells belongs there.

    Args:
        table: what was published.
        summaries: our cells.
        idle: cells of players that give no order, as `idle_cells` returns them.
    """
    pairs = _pairs(table, summaries, idle)
    if not any(pair.ours for cells in pairs.values() for pair in cells):
        return None
    verdicts = _verdicts(pairs)
    rows = [line for place, cells in pairs.items() for line in _lines(table, place, cells, verdicts[place])]
    first = "model" if "{row}" in table.where.get(MODEL, "") else "row"
    return ReportTable(table.source, (first, "", *table.columns), tuple(rows), 2, _note(table, pairs))


def _pairs(table: PublishedTable, summaries: Sequence[CellSummary], idle: Sequence[Idle]) -> dict[_Place, list[_Pair]]:
    """Return the cells of each row: the published rows first, each followed by our other players in it."""
    found = {at: summary for summary in summaries if summary.games and (at := _place(table, summary)) is not None}
    published = [_Place(row, table.values_at(row, "").get(MODEL, row)) for row in table.rows]
    others = dict.fromkeys(place for place, _ in found if place not in published)
    of_rows = [other for place in published for other in (place, *(o for o in others if o.row == place.row))]
    places = dict.fromkeys([*of_rows, *others])
    return {
        place: [
            _Pair(
                theirs=table.cell(place.row, column) if place in published else None,
                their_games=table.games_of(place.row),
                ours=found.get((place, column)),
                idle=next((cell for cell in idle if cell.where == _where(table, place, column)), None),
            )
            for column in table.columns
        ]
        for place in places
    }


def _where(table: PublishedTable, place: _Place, column: str) -> dict[str, str]:
    """Return the values of our factors at a place, without the model."""
    return {name: value for name, value in table.values_at(place.row, column).items() if name != MODEL}


def _place(table: PublishedTable, summary: CellSummary) -> tuple[_Place, str] | None:
    """Return where a cell of ours stands; None if it belongs to none of the rows and columns."""
    player = summary.where.get(MODEL, "")
    others = {name: value for name, value in summary.where.items() if name != MODEL}
    rows = (player,) if "{row}" in table.where.get(MODEL, "") else tuple(table.rows)
    for row in rows:
        place = _Place(row, player)
        for column in table.columns:
            if table.where and _where(table, place, column) == others:
                return place, column
    return None


# whether they differ --------------------------------------------------------------------------------------------------


def _verdicts(pairs: dict[_Place, list[_Pair]]) -> dict[_Place, list[str]]:
    """Return for each pair what differs by more than chance, after Holm's correction for all tests of the table."""
    p = [value for cells in pairs.values() for pair in cells for value in (_p_of_wins(pair), _p_of_kd(pair))]
    corrected = iter(statistics.holm(p))
    return {
        place: [_verdict(pair, wins=next(corrected), kd=next(corrected)) for pair in cells]
        for place, cells in pairs.items()
    }


def _p_of_wins(pair: _Pair) -> float | None:
    if pair.ours is None or pair.theirs is None or pair.their_games is None:
        return None
    won_there = round(pair.theirs.win_rate * pair.their_games)
    won_here = round((pair.ours.won.value or 0.0) * pair.ours.games)
    return statistics.compare_wins(won_here, pair.ours.games, won_there, pair.their_games).p


def _p_of_kd(pair: _Pair) -> float | None:
    if pair.ours is None or pair.theirs is None or pair.theirs.kd is None or pair.their_games is None:
        return None
    ours = pair.ours
    return statistics.p_of_published_ratio(
        ours.kd.value, ours.kd_variation, ours.games, pair.theirs.kd, pair.their_games
    )


def _verdict(pair: _Pair, *, wins: float | None, kd: float | None) -> str:
    if wins is None:
        return NONE
    differ = [name for name, p in (("K/D", kd), ("WR", wins)) if p is not None and p < LEVEL]
    if differ:
        return " and ".join(differ)
    return "no" if kd is not None or pair.theirs is None or pair.theirs.kd is None else "no (WR alone)"


# as texts -------------------------------------------------------------------------------------------------------------


def _lines(
    table: PublishedTable, place: _Place, pairs: Sequence[_Pair], verdicts: Sequence[str]
) -> Iterator[tuple[str, ...]]:
    label = place.label
    if any(pair.theirs for pair in pairs):
        yield (label, "published", *(_with_mark(_theirs(pair), pair) for pair in pairs))
        label = ""
    if any(pair.ours for pair in pairs):
        yield (label, "here", *(_with_mark(_ours(pair, only_wins=table.only_wins), pair) for pair in pairs))
    if any(verdict != NONE for verdict in verdicts):
        yield ("", "differ", *verdicts)


def _with_mark(text: str, pair: _Pair) -> str:
    return f"{text} {MARK}" if pair.measures_nothing and text != NONE else text


def _theirs(pair: _Pair) -> str:
    if pair.theirs is None:
        return NONE
    share = pair.theirs.win_rate
    wins = f"{100 * share:.0f}"
    if pair.their_games is not None:
        low, high = statistics.wilson_bounds(share, pair.their_games)
        wins += f" [{100 * low:.0f}{DASH}{100 * high:.0f}]"
    kd = pair.theirs.kd
    return wins if kd is None else f"{ratio(kd) if kd < 10 else number(kd)} ({wins})"


def _ours(pair: _Pair, *, only_wins: bool) -> str:
    if pair.ours is None:
        return NONE
    won = pair.ours.won
    wins = f"{100 * (won.value or 0.0):.0f} [{100 * won.low:.0f}{DASH}{100 * won.high:.0f}]"
    return wins if only_wins else f"{_kd(pair.ours.kd)} ({wins})"


def _kd(interval: Interval) -> str:
    if interval.value is None:
        return NONE
    return f"{ratio(interval.value)} [{ratio(interval.low)}{DASH}{ratio(interval.high)}]"


def _note(table: PublishedTable, pairs: dict[_Place, list[_Pair]]) -> str:
    cells = [pair for row in pairs.values() for pair in row]
    form = "Win rate in percent" if table.only_wins else "K/D by value (win rate in percent)"
    intervals = "Wilson's for wins" if table.only_wins else "Wilson's for wins, bootstrap for our K/D"
    of_kd = "" if table.only_wins else OF_KD
    sentences = [
        f"{form}, with intervals of 95 %: {intervals}.",
        f"Differ: by more than chance, at 5 % after Holm's correction for all tests of this table. {OF_WINS}{of_kd}.",
    ]
    if any(pair.measures_nothing for pair in cells):
        sentences.append(f"{MARK}: a player without orders wins half of its games or more: the cell measures nothing.")
    against = [(pair.idle.summary, pair.theirs) for pair in cells if pair.idle and pair.theirs]
    if against:
        wins = sum((ours.won.value or 0.0) > theirs.win_rate for ours, theirs in against)
        kds = sum((ours.kd.value or 0.0) > theirs.kd for ours, theirs in against if theirs.kd is not None)
        and_kd = "" if table.only_wins else f", the higher K/D in {kds}"
        sentences.append(
            f"Of {len(against)} published cells, a player without orders has the higher win rate in {wins}{and_kd}."
        )
    return " ".join(sentences)
