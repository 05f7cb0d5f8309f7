"""A leaderboard for people: its table in a terminal, and the words that the table and the site share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_sc2.arena.ratings import Leaderboard, LeaderboardLine, Rating


def table_of(board: Leaderboard) -> Table:
    """Return the table for a terminal; columns of money and tokens are there if a model has played."""
    table = Table(box=None, pad_edge=False)
    costs = ("USD a game", "tokens a game") if has_costs(board) else ()
    for column in ("player", *board.columns, "games", *costs, "clock"):
        table.add_column(column, no_wrap=column in ("player", "clock"))
    for line in board.standings:
        ratings = [_rating_words(line.ratings.get(column)) for column in board.columns]
        name = f"{line.player}\nanchor" if line.is_anchor else line.player
        table.add_row(name, *ratings, str(line.games), *(costs_of(line) if costs else ()), ", ".join(line.clocks))
    return table


def _rating_words(rating: Rating | None) -> str:
    if rating is None:
        return ""
    bounds = "fixed" if rating.low == rating.high else f"{rating.low:.0f} to {rating.high:.0f}"
    return f"{rating.value:.0f}\n{bounds}"


def has_costs(board: Leaderboard) -> bool:
    """Return whether a model has played, so that games have cost tokens or money."""
    return any(line.tokens or line.cost_usd for line in board.standings)


def costs_of(line: LeaderboardLine) -> tuple[str, str]:
    """Return the money and the tokens of a player's game."""
    return "" if line.cost_usd is None else f"{line.cost_usd:.4f}", f"{line.tokens:.0f}" if line.tokens else ""


def remarks_of(board: Leaderboard, remarks: Sequence[str]) -> list[str]:
    """Return what a reader of the ratings must know."""
    lines = [
        "A player that is 400 points better wins ten games for each that it loses.",
        "The intervals of 95 % are about other seeds of the same tasks, not about other tasks.",
    ]
    if board.repeats:
        lines.append(f"{board.repeats} games end like another seed of theirs in every measure, and are not counted.")
    return lines + list(remarks)
