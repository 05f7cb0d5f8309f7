"""The page of ratings, from the results that are in the repository."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from docs.pages.markdown import code, head, join, table
from khala_sc2.arena.leaderboard import (
    basis_of,
    columns_of,
    detail_names,
    details_of,
    interval_of,
    remarks_of,
)
from khala_sc2.arena.ratings import rate
from khala_sc2.arena.results import pool_results

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_sc2.arena.ratings import Leaderboard, LeaderboardLine, Rating

RESULTS = Path(__file__).parents[2] / "results"


def page() -> str:
    """Return the leaderboard of all files of results together."""
    paths = sorted(RESULTS.glob("*.json"))
    pool = pool_results(paths)
    board = rate(pool)
    files = ", ".join(code(path.name) for path in paths)
    return join(
        head("Ratings", "`results/*.json`"),
        f"{len(pool.games)} games of {len(board.players)} players, from {files}. [Rate players](../how-to/arena.md) "
        "says what a rating means, how to play an arena, and how to send results. `khala arena export results/*.json` "
        "makes a site of them.",
        *_tables(board),
        "## What these numbers say",
        "\n".join(f"* {remark}" for remark in remarks_of(board, pool.remarks)),
    )


def _tables(board: Leaderboard) -> Iterator[str]:
    for column in board.columns:
        columns = columns_of(board, column)
        header = ("player", "is", *columns, *detail_names(board, column))
        yield f"## {column.capitalize()}"
        yield f"{basis_of(board, column)}."
        yield table(header, [_line(line, column, board) for line in board.standings(column)])


def _line(line: LeaderboardLine, column: str, board: Leaderboard) -> list[str]:
    kind = f"{line.about}, anchor" if line.is_anchor else line.about
    words = [_words(line.ratings[shown]) for shown in columns_of(board, column)]
    return [line.player, kind, *words, *details_of(board, column, line.ratings[column])]


def _words(rating: Rating) -> str:
    return f"{rating.value:.0f} ({interval_of(rating)})"
