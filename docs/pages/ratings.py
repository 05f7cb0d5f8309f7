"""The page of ratings, from the results that are in the repository."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from docs.pages.markdown import code, head, join, table
from khala_sc2.arena.leaderboard import costs_of, remarks_of
from khala_sc2.arena.ratings import rate
from khala_sc2.arena.results import pool_results

if TYPE_CHECKING:
    from khala_sc2.arena.ratings import LeaderboardLine, Rating

RESULTS = Path(__file__).parents[2] / "results"


def page() -> str:
    """Return the leaderboard of all files of results together."""
    paths = sorted(RESULTS.glob("*.json"))
    pool = pool_results(paths)
    board = rate(pool)
    header = ("player", "is", *board.columns, "won", "drawn", "lost", "USD a game", "tokens a game", "clock")
    files = ", ".join(code(path.name) for path in paths)
    return join(
        head("Ratings", "`results/*.json`"),
        f"{len(pool.games)} games of {len(board.standings)} players, from {files}. [Rate players](../how-to/arena.md) "
        "says what a rating means, how to play an arena, and how to send results. `khala arena export results/*.json` "
        "makes a site of them.",
        table(header, [_line(line, board.columns) for line in board.standings]),
        "\n".join(f"* {remark}" for remark in remarks_of(board, pool.remarks)),
    )


def _line(line: LeaderboardLine, columns: tuple[str, ...]) -> list[str]:
    overall = line.ratings.get(columns[0])
    counts = (overall.won, overall.drawn, overall.lost) if overall else ("", "", "")
    kind = f"{line.about}, anchor" if line.is_anchor else line.about
    ratings = [_words(line.ratings.get(column)) for column in columns]
    return [line.player, kind, *ratings, *map(str, counts), *costs_of(line), ", ".join(line.clocks)]


def _words(rating: Rating | None) -> str:
    if rating is None:
        return ""
    bounds = "fixed" if rating.low == rating.high else f"{rating.low:.0f} to {rating.high:.0f}"
    return f"{rating.value:.0f} ({bounds})"
