"""A leaderboard for people: its tables in a terminal, and the words that they share with the site and the docs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from khala_sc2.arena.spec import OVERALL

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_sc2.arena.ratings import Leaderboard, Rating


def basis_of(board: Leaderboard, column: str) -> str:
    """Return what the ratings of a column are of: its tasks, or the groups whose mean they are."""
    return f"The mean of {', '.join(board.groups)}" if column == OVERALL else f"Tasks: {', '.join(board.tasks[column])}"


def table_of(board: Leaderboard, column: str) -> Table:
    """Return the table of a column for a terminal; that of the means has the ratings of the groups, too."""
    table = Table(box=None, pad_edge=False)
    table.add_column("player", no_wrap=True)
    for name in (*columns_of(board, column), *detail_names(board, column)):
        table.add_column(name, min_width=max(map(len, name.split())))
    for line in board.standings(column):
        name = f"{line.player}\nanchor" if line.is_anchor else line.player
        words = [_rating_words(line.ratings[shown]) for shown in columns_of(board, column)]
        table.add_row(name, *words, *details_of(board, column, line.ratings[column]))
    return table


def columns_of(board: Leaderboard, column: str) -> tuple[str, ...]:
    """Return the columns of ratings that the table of a column has."""
    return board.columns if column == OVERALL else (column,)


def _rating_words(rating: Rating) -> str:
    return f"{rating.value:.0f}\n{interval_of(rating)}"


def interval_of(rating: Rating) -> str:
    """Return the interval of a rating in words."""
    return "fixed" if rating.is_fixed else f"{rating.low:.0f} to {rating.high:.0f}"


def detail_names(board: Leaderboard, column: str) -> tuple[str, ...]:
    """Return the columns of `details_of`."""
    endings = () if column == OVERALL else ("won", "drawn", "lost")
    costs = ("USD a game", "tokens a game") if _has_costs(board) else ()
    return (*endings, *costs, "clock", "variant")


def details_of(board: Leaderboard, column: str, rating: Rating) -> tuple[str, ...]:
    """Return how the games of a rating ended, what one cost on average, and how they were played.

    Money and tokens are there if a model has played; counts of wins only within a group, as a sum over groups would say
    which of them was played most.
    """
    endings = () if column == OVERALL else (str(rating.won), str(rating.drawn), str(rating.lost))
    money = "" if rating.cost_usd is None else f"{rating.cost_usd:.4f}"
    costs = (money, f"{rating.tokens:.0f}" if rating.tokens else "") if _has_costs(board) else ()
    return (*endings, *costs, ", ".join(rating.clocks), ", ".join(rating.variants))


def _has_costs(board: Leaderboard) -> bool:
    ratings = (rating for line in board.players for rating in line.ratings.values())
    return any(rating.tokens or rating.cost_usd for rating in ratings)


def remarks_of(board: Leaderboard, remarks: Sequence[str]) -> list[str]:
    """Return what a reader of the ratings must know."""
    lines = [
        "A player that is 400 points better wins ten games for each that it loses.",
        "The intervals of 95 % are about other seeds of the same tasks, not about other tasks.",
        "An interval is about the difference to the anchors. To compare two other players, make one an anchor.",
    ]
    if OVERALL in board.columns:
        lines.append(
            f"{OVERALL} is the mean of {', '.join(board.groups)}, each with the same weight; a player without a rating "
            "in one of them has none."
        )
    elif len(board.groups) > 1:
        lines.append(f"There is no {OVERALL} rating: no two players have one in each of {', '.join(board.groups)}.")
    return [*lines, *board.remarks, *remarks]
