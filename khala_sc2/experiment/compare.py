"""Compare two selections of matches, if they are alike: by task, paired where both played the same game.

A pair is two matches of the same task, other factors, seed and repetition. Where there is no pair at all, all games of
a task are compared. Games of one selection that the other has no partner for are counted and said.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from khala_protocol.errors import ConfigError
from khala_sc2.experiment import power, statistics
from khala_sc2.experiment.likeness import CardDifference, differences, forbidden
from khala_sc2.experiment.measures import Measures
from khala_sc2.experiment.selection import SIDE, Row, Selection, factor

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from khala_sc2.experiment.statistics import Comparison, Interval

WIN, KD = "win", "kd"
USUAL = (WIN, KD)
LEVEL = 0.05
"""Of a test: below it, a difference is taken to be real."""
MOST_GAMES = 100_000
"""More are not worth naming."""

Pair = tuple[Row, Row]


class Group(NamedTuple):
    """Games that are alike but for their seeds and what is compared."""

    task: str
    others: tuple[str, ...]
    """Values of the factors that both have and that are not compared."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One measure in one task."""

    task: str
    measure: str
    paired: bool
    games: int
    """Pairs, or games of the selection that has fewer."""
    a: Interval
    b: Interval
    test: Comparison | None
    """None if the measure needs pairs and there are none."""
    p_holm: float | None
    """p, corrected for the number of tests."""
    games_for_power: int | None
    """Pairs, or games a side, that would show such a difference in wins with a power of 80 %, if it is real; None if it
    is shown already, or if there is none."""


@dataclass(frozen=True, slots=True)
class Findings:
    """What a comparison found."""

    a: str
    b: str
    compared: tuple[Compared, ...]
    unpaired: tuple[int, int]
    """Games that have no partner."""
    left_out: tuple[dict[str, int], dict[str, int]]
    """Matches that say nothing, by state."""
    not_shared: tuple[str, ...]
    """Tasks that only one of the two has."""
    allowed: tuple[CardDifference, ...]
    """In what the matches differ, and it was allowed."""


def compare(a: Selection, b: Selection, *, measures: Sequence[str] = USUAL, allow: Collection[str] = ()) -> Findings:
    """Return how two selections compare.

    Raises:
        ConfigError: they have no task in common, are unlike, or a measure is none.
    """
    for name in measures:
        _check(name)
    others = _others(a, b)
    games_a, games_b = _games(a, others), _games(b, others)
    shared = [group for group in games_a if group in games_b]
    if not shared:
        raise ConfigError(f"{a.text} and {b.text} have no match in common: {_tasks(games_a)} and {_tasks(games_b)}")
    allowed = _require_alike(a, b, [(games_a[group], games_b[group]) for group in shared], allow)
    found = [
        _compare(task, name, [group for group in shared if group.task == task], games_a, games_b)
        for task in dict.fromkeys(group.task for group in shared)
        for name in measures
    ]
    pairs = sum(len(games_a[group].keys() & games_b[group].keys()) for group in shared)
    all_a, all_b = (sum(map(len, games.values())) for games in (games_a, games_b))
    either = sorted({group.task for group in games_a} ^ {group.task for group in games_b})
    return Findings(a.text, b.text, _with_holm(found), (all_a - pairs, all_b - pairs), (a.left_out, b.left_out),
                  tuple(either), tuple(allowed))  # fmt: skip


# --- which games belong together ----------------------------------------------------------------------

Seat = tuple[int, int, int, str]
"""Seed, repetition, episode, and the side unless it is compared."""


def _others(a: Selection, b: Selection) -> tuple[str, ...]:
    return tuple(name for name in a.factors if name in b.factors and name not in {*a.where, *b.where, "task"})


def _games(selection: Selection, others: tuple[str, ...]) -> dict[Group, dict[Seat, Row]]:
    if SIDE not in selection.where and len(selection.sides) > 1:
        sides = ", ".join(selection.sides)
        raise ConfigError(f"{selection.text} has matches of sides {sides}: name one, as {_with(selection, SIDE)}")
    groups: defaultdict[Group, dict[Seat, Row]] = defaultdict(dict)
    for row in selection.rows:
        group = Group(row["task"], tuple(factor(row, name) for name in others))
        seat = (row["seed"], row["repetition"], row["episode"], "" if SIDE in selection.where else row[SIDE])
        if (twin := groups[group].get(seat)) is not None:
            raise ConfigError(_ambiguous(selection, twin, row))
        groups[group][seat] = row
    return dict(groups)


def _ambiguous(selection: Selection, row: Row, other: Row) -> str:
    name = next((name for name in selection.factors if factor(row, name) != factor(other, name)), "")
    again = f"name one value, as {_with(selection, name)}" if name else "their models or files differ"
    return f"{selection.text} has two matches of task {row['task']} with seed {row['seed']}: {again}"


def _with(selection: Selection, name: str) -> str:
    value = factor(selection.rows[0], name)
    return f"{selection.text}{',' if selection.where else ':'}{name}={value}"


def _tasks(games: Iterable[Group]) -> str:
    return ", ".join(dict.fromkeys(" ".join((group.task, *group.others)).strip() for group in games))


def _require_alike(
    a: Selection, b: Selection, groups: Iterable[tuple[dict[Seat, Row], dict[Seat, Row]]], allow: Collection[str]
) -> list[CardDifference]:
    """Return the differences that are allowed.

    Raises:
        ConfigError: there are others.
    """
    found: dict[CardDifference, None] = {}
    for games_a, games_b in groups:
        matches_a = [a.matches[row["match"]] for row in games_a.values()]
        matches_b = [b.matches[row["match"]] for row in games_b.values()]
        found |= dict.fromkeys(differences(matches_a, matches_b))
    if unlike := forbidden(found, allow):
        names = sorted({difference.field.partition(".")[0] for difference in unlike})
        options = " ".join(f"--allow {name}" for name in names)
        words = "; ".join(map(str, unlike))
        raise ConfigError(f"{a.text} (A) and {b.text} (B) are not alike: {words}. {options} compares them nevertheless")
    return list(found)


# --- what they say ------------------------------------------------------------------------------------


def _compare(
    task: str,
    measure: str,
    groups: list[Group],
    games_a: dict[Group, dict[Seat, Row]],
    games_b: dict[Group, dict[Seat, Row]],
) -> Compared:
    pairs = [(row, games_b[group][seat]) for group in groups for seat, row in games_a[group].items()
             if seat in games_b[group]]  # fmt: skip
    if pairs:
        rows_a, rows_b = ([pair[i] for pair in pairs] for i in (0, 1))
    else:
        rows_a, rows_b = ([row for group in groups for row in games[group].values()] for games in (games_a, games_b))
    value = _estimate(measure)
    tested = _paired_test(measure) if pairs else _unpaired_test(measure)
    test = tested(rows_a, rows_b) if tested else None
    needed = _games_needed(rows_a, rows_b, test, paired=bool(pairs)) if measure == WIN else None
    games = min(len(rows_a), len(rows_b))
    return Compared(task, measure, bool(pairs), games, value(rows_a), value(rows_b), test, None, needed)


def _estimate(measure: str) -> Callable[[list[Row]], Interval]:
    if measure == WIN:
        return lambda rows: statistics.wilson(sum(_won(rows)), len(rows))
    if measure == KD:
        return lambda rows: statistics.ratio_of_sums(_column(rows, "killed_value"), _column(rows, "lost_value"))
    return lambda rows: statistics.mean(_column(rows, measure))


def _paired_test(measure: str) -> Callable[[list[Row], list[Row]], Comparison]:
    if measure == WIN:
        return lambda a, b: statistics.compare_paired_wins(_won(a), _won(b))
    if measure == KD:
        return lambda a, b: statistics.compare_paired_ratios(
            _column(a, "killed_value"), _column(a, "lost_value"), _column(b, "killed_value"), _column(b, "lost_value")
        )
    return lambda a, b: statistics.compare_paired_values(_column(a, measure), _column(b, measure))


def _unpaired_test(measure: str) -> Callable[[list[Row], list[Row]], Comparison] | None:
    if measure == WIN:
        return lambda a, b: statistics.compare_wins(sum(_won(a)), len(a), sum(_won(b)), len(b))
    if measure == KD:
        return None
    return lambda a, b: statistics.compare_values(_column(a, measure), _column(b, measure))


def _won(rows: Iterable[Row]) -> list[bool]:
    """Return which games were won; a draw is not."""
    return [row["outcome"] == "win" for row in rows]


def _column(rows: Iterable[Row], name: str) -> list[float | None]:
    return [row[name] for row in rows]


def _games_needed(a: list[Row], b: list[Row], test: Comparison | None, *, paired: bool) -> int | None:
    """Return how many games would show such a difference in wins."""
    won_a, won_b = _won(a), _won(b)
    if test is None or test.p < LEVEL or not test.effect.value:
        return None
    if not paired:
        return power.games_for_power(sum(won_a) / len(a), sum(won_b) / len(b))
    both = list(zip(won_a, won_b, strict=True))
    only_a, only_b = both.count((True, False)) / len(both), both.count((False, True)) / len(both)
    needed = power.pairs_for_power(only_a, only_b)
    return needed if needed <= MOST_GAMES else None


def _with_holm(found: Sequence[Compared]) -> tuple[Compared, ...]:
    p = statistics.holm([comparison.test.p if comparison.test else None for comparison in found])
    return tuple(replace(comparison, p_holm=value) for comparison, value in zip(found, p, strict=True))


def _check(measure: str) -> None:
    numbers = measures_that_compare()
    if measure not in numbers:
        raise ConfigError(f"there is no measure {measure!r}: give one of {', '.join(numbers)}", source="--measure")


def measures_that_compare() -> tuple[str, ...]:
    """Return the names that `compare` takes: wins, and every column of numbers."""
    kinds: dict[str, Any] = {name: str(field.type) for name, field in Measures.__dataclass_fields__.items()}
    numbers = [name for name, kind in kinds.items() if kind.startswith(("int", "float"))]
    return (WIN, *(name for name in numbers if name not in ("episode", "seed")))
