"""The numbers of one cell of the grid: what its matches were like, and how sure that is."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from statistics import median
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError
from khala_sc2.experiment import statistics
from khala_sc2.experiment.selection import SIDE, Row, factor, factors_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_sc2.experiment.played import PlayedMatch
    from khala_sc2.experiment.statistics import Interval

FATES = ("fresh", "stale", "adapted", "refused", "dropped")
HALLUCINATIONS = ("input_conflicting", "fact_conflicting", "context_conflicting")
MESSAGES = (
    "messages_sent",
    "messages_undeliverable",
    "messages_unfounded",
    "messages_read",
    "messages_answered",
    "messages_acted_on",
)


@dataclass(frozen=True, slots=True)
class Cell:
    """Matches that are played in the same way."""

    where: dict[str, str]
    """Names of the factors' values."""
    rows: list[Row] = field(default_factory=list)
    """Of matches that count."""
    others: list[PlayedMatch] = field(default_factory=list)
    """Matches that are not valid or crashed."""


@dataclass(frozen=True, slots=True)
class CellSummary:
    """One cell in numbers. Without any game, and where nothing is known, they are None."""

    where: dict[str, str]
    games: int
    won: Interval
    """Share of games won."""
    draws: int
    """Games without a winner, those cut at their limit of steps among them."""
    decided: float | None
    """Share of decisions that the agents made themselves."""
    kd: Interval
    """Value killed in all games / value lost in all games."""
    kd_variation: float | None
    """How much the logarithm of K/D varies from game to game."""
    length_s: float | None
    """Median of the games, in seconds of the game."""
    accepted: float | None
    """Actions per game that were carried out."""
    refused: float | None
    """Calls per game that were not."""
    hallucinations: dict[str, float | None]
    """Per 100 calls."""
    fates: dict[str, float | None]
    """Shares of decisions."""
    latency_p50_s: float | None
    """Median of the games."""
    latency_p95_s: float | None
    age_p50_loops: float | None
    age_p95_loops: float | None
    tokens: float | None
    """Per game, read and written."""
    usd: float | None
    """Per game."""
    usd_per_win: float | None
    """All games / games won."""
    messages: dict[str, float | None]
    """Per game."""
    supply_blocked_s: float | None
    """Per game."""
    minerals: float | None
    """Unspent, mean over time."""
    vespene: float | None
    expansion_s: float | None
    """Median of the games that expanded."""
    expanded: int
    """Games that expanded."""
    not_counted: dict[str, int]
    """Matches that are not valid or crashed, by cause."""


def cells(played: Iterable[PlayedMatch], rows: Sequence[Row], by: Sequence[str] = ()) -> list[Cell]:
    """Return the cells in the order in which their first match was played, by all factors unless some are named.

    Raises:
        ConfigError: there is no such factor.
    """
    played = list(played)
    names = _names(factors_of(played), rows, by)
    found: dict[tuple[str, ...], Cell] = {}
    done = {match.key for match in played if match.state == "done"}
    sides = sorted({row[SIDE] for row in rows}) if SIDE in names else [""]
    for match in played:
        for side in sides:
            where = {name: side if name == SIDE else match.cell.get(name, "") for name in names}
            cell = found.setdefault(tuple(where.values()), Cell(where))
            if match.state != "done":
                cell.others.append(match)
    for row in rows:
        if row["match"] in done:
            found[tuple(factor(row, name) for name in names)].rows.append(row)
    return _in_order(list(found.values()), names)


def _names(factors: tuple[str, ...], rows: Sequence[Row], by: Sequence[str]) -> list[str]:
    duels = len({row[SIDE] for row in rows}) > 1
    known = [*factors, SIDE] if duels else list(factors)
    for name in by:
        if name not in known:
            raise ConfigError(f"there is no factor {name!r}: there are {', '.join(known)}", source="--by")
    return list(by) or known or ["task"]  # recordings that no experiment has labelled have no factors


def _in_order(found: list[Cell], names: Sequence[str]) -> list[Cell]:
    """Return cells so that those with the same first values stand together, each value where it was first seen."""
    seen = [[*dict.fromkeys(cell.where[name] for cell in found)] for name in names]
    return sorted(found, key=lambda cell: [seen[i].index(cell.where[name]) for i, name in enumerate(names)])


def _decided_share(rows: Sequence[Row]) -> float | None:
    asked = sum(row["decisions"] for row in rows)
    return 1 - sum(row["undecided"] for row in rows) / asked if asked else None


def summary(cell: Cell) -> CellSummary:
    """Return the numbers of a cell."""
    rows = cell.rows
    games = len(cell.rows)
    wins = sum(row["outcome"] == "win" for row in rows)
    costs = [cost for row in rows if (cost := _usd(row)) is not None]
    expansions = _known(rows, "expansion_s")
    values = [row["killed_value"] for row in rows], [row["lost_value"] for row in rows]
    return CellSummary(
        where=cell.where,
        games=games,
        won=statistics.wilson(wins, games),
        draws=sum(row["outcome"] in ("draw", "cut") for row in rows),
        decided=_decided_share(rows),
        kd=statistics.ratio_of_sums(*values),
        kd_variation=statistics.variation_of_ratio(*values),
        length_s=_median(rows, "game_s"),
        accepted=_mean(rows, "accepted"),
        refused=_mean(rows, "rejected"),
        hallucinations={name: _share(rows, name, ("calls",), 100) for name in HALLUCINATIONS},
        fates={name: _share(rows, name, FATES) for name in FATES},
        latency_p50_s=_median(rows, "latency_p50_s"),
        latency_p95_s=_median(rows, "latency_p95_s"),
        age_p50_loops=_median(rows, "age_p50_loops"),
        age_p95_loops=_median(rows, "age_p95_loops"),
        tokens=sum(row["prompt_tokens"] + row["completion_tokens"] for row in rows) / games if games else None,
        usd=sum(costs) / len(costs) if costs else None,
        usd_per_win=sum(costs) / wins if wins and len(costs) == games else None,
        messages={name: _mean(rows, name) for name in MESSAGES},
        supply_blocked_s=_mean(rows, "supply_blocked_s"),
        minerals=_mean(rows, "minerals_mean"),
        vespene=_mean(rows, "vespene_mean"),
        expansion_s=median(expansions) if expansions else None,
        expanded=len(expansions),
        not_counted=dict(Counter(f"{match.state}: {match.cause}" for match in cell.others)),
    )


def _usd(row: Row) -> float | None:
    """Return what a game cost: what was paid, or what its result says if no request was recorded."""
    paid: float | None = row["paid_usd"]
    return paid if paid is not None else row["cost_usd"]


def _known(rows: Iterable[Row], name: str) -> list[float]:
    return [row[name] for row in rows if row[name] is not None]


def _median(rows: Iterable[Row], name: str) -> float | None:
    return median(known) if (known := _known(rows, name)) else None


def _mean(rows: Iterable[Row], name: str) -> float | None:
    return sum(known) / len(known) if (known := _known(rows, name)) else None


def _share(rows: Sequence[Row], name: str, of: Sequence[str], times: int = 1) -> float | None:
    """Return a sum over games as a share of other sums, because games with few calls say little."""
    total = sum(row[other] for row in rows for other in of)
    return times * sum(row[name] for row in rows) / total if total else None
