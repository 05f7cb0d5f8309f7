"""From games to ratings: one fit for each group of tasks and one over all games, on Elo's scale.

The anchors fix the scale: the mean of their ratings is what the file of the arena says, in every group. 400 points more
mean ten times as many wins for each loss. A player whom no games connect with an anchor has no rating.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING

from khala_sc2.arena.bradley_terry import RatedGame, fit_strengths
from khala_sc2.arena.spec import OVERALL

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_sc2.arena.results import ArenaGame, GameSeat, PlayerPool

ELO = 400 / math.log(10)
"""Points for a natural unit of strength."""


@dataclass(frozen=True, slots=True)
class Rating:
    """A rating with its interval of 95 %, and the games that it comes from."""

    value: float
    low: float
    high: float
    won: int
    drawn: int
    lost: int


@dataclass(frozen=True, slots=True)
class LeaderboardLine:
    """A player's line on a leaderboard."""

    player: str
    kind: str
    about: str
    is_anchor: bool
    ratings: dict[str, Rating]
    """By group, and `overall`, as far as it is known."""
    games: int
    cost_usd: float | None
    """Of a game, on average; None if no price is known."""
    tokens: float
    """Of a game, on average."""
    clocks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Leaderboard:
    """The ratings of a pool."""

    columns: tuple[str, ...]
    """`overall`, and the groups."""
    standings: tuple[LeaderboardLine, ...]
    """The best first."""
    repeats: int
    """Games that were left out because they are repetitions of another one."""


def rate(pool: PlayerPool) -> Leaderboard:
    """Return the ratings of all players of a pool."""
    games = distinct_games(pool.games)
    groups = tuple(dict.fromkeys(game.group for game in games))
    fits = {OVERALL: rate_games(games, pool.anchors)}
    fits |= {group: rate_games([game for game in games if game.group == group], pool.anchors) for group in groups}
    standings = [_standing(name, pool, fits) for name in pool.players]
    standings.sort(key=lambda line: -line.ratings[OVERALL].value if OVERALL in line.ratings else math.inf)
    return Leaderboard((OVERALL, *groups), tuple(standings), len(pool.games) - len(games))


def rate_games(games: Sequence[ArenaGame], anchors: Mapping[str, float]) -> dict[str, Rating]:
    """Return the rating of each player whom games connect with an anchor."""
    outcomes = [RatedGame(game.first.player, game.second.player, game.score) for game in games]
    strengths = fit_strengths(outcomes, list(anchors))
    known = [rating for name, rating in anchors.items() if name in strengths]
    zero = fmean(known) if known else 0.0
    counts = _count(games)
    return {
        name: Rating(zero + ELO * found.value, zero + ELO * found.low, zero + ELO * found.high, *counts[name])
        for name, found in strengths.items()
    }


def distinct_games(games: Iterable[ArenaGame]) -> list[ArenaGame]:
    """Return the games without the repetitions of deterministic players.

    If all seeds of two players on a task, with the same sides, end alike in every measure, the seed makes no difference
    there: they are one game, and counting them all would make intervals too narrow.
    """
    same: dict[tuple[str, str, str], list[ArenaGame]] = defaultdict(list)
    for game in games:
        same[game.task, game.first.player, game.second.player].append(game)
    kept = []
    for found in same.values():
        endings = {(game.outcome, game.steps, game.game_s, game.killed, game.lost) for game in found}
        kept += found[:1] if len(endings) == 1 else found
    return kept


def games_of(games: Iterable[ArenaGame], player: str, group: str) -> list[ArenaGame]:
    """Return the games of a player in a group, or in all of them."""
    return [game for game in games if seat_of(game, player) and group in (OVERALL, game.group)]


def seat_of(game: ArenaGame, player: str) -> GameSeat | None:
    """Return a player's side of a game; None if it did not play."""
    return next((seat for seat in (game.first, game.second) if seat.player == player), None)


def outcome_for(game: ArenaGame, player: str) -> str:
    """Return how a game ended for one of its players."""
    if game.first.player == player:
        return game.outcome
    return {"win": "loss", "draw": "draw", "loss": "win"}[game.outcome]


def _count(games: Iterable[ArenaGame]) -> dict[str, tuple[int, int, int]]:
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for game in games:
        for seat in (game.first, game.second):
            counts[seat.player][outcome_for(game, seat.player)] += 1
    return {name: (count["win"], count["draw"], count["loss"]) for name, count in counts.items()}


def _standing(name: str, pool: PlayerPool, fits: Mapping[str, Mapping[str, Rating]]) -> LeaderboardLine:
    games = games_of(pool.games, name, OVERALL)
    seats = [seat for game in games if (seat := seat_of(game, name))]
    costs = [seat.cost_usd for seat in seats if seat.cost_usd is not None]
    player = pool.players[name]
    return LeaderboardLine(
        player=name, kind=player.kind, about=player.about, is_anchor=name in pool.anchors,
        ratings={column: fit[name] for column, fit in fits.items() if name in fit},
        games=len(games),
        cost_usd=fmean(costs) if costs else None,
        tokens=fmean(seat.tokens for seat in seats) if seats else 0.0,
        clocks=tuple(sorted({game.clock for game in games})),
    )  # fmt: skip
