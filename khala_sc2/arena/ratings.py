"""From games to ratings, on Elo's scale: a strength for each player in each group of tasks, and their mean overall.

The anchors fix the scale: the mean of their ratings is what the file of the arena says, in every group. 400 points more
mean ten times as many wins for each loss. A player whom no games connect with an anchor has no rating.

A player can be strong in one group and weak in another, so games of several groups are never fitted with one strength:
who met whom in which group would then decide. `overall` is the mean over all groups, each with the same weight, of
players who have a rating in each of them.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from statistics import fmean
from typing import TYPE_CHECKING

from khala_sc2.arena.bradley_terry import RatedGame, fit_strengths
from khala_sc2.arena.misfit import CellOfGames, misfit_of
from khala_sc2.arena.spec import OVERALL

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from khala_sc2.arena.results import ArenaGame, GameSeat, PlayerPool

ELO = 400 / math.log(10)
"""Points for a natural unit of strength."""
UNLIKELY = 0.01
"""A group whose games fit their ratings with a smaller probability is remarked on."""


@dataclass(frozen=True, slots=True)
class Rating:
    """A rating with its interval of 95 %, the games that it comes from, and how they were played."""

    value: float
    low: float
    high: float
    won: int
    drawn: int
    lost: int
    cost_usd: float | None
    """Of a game, on average; None if no price is known. Overall: the mean of the groups."""
    tokens: float
    """Of a game, on average. Overall: the mean of the groups."""
    clocks: tuple[str, ...]
    """Rules of the clock."""
    variants: tuple[str, ...]
    """Of the tasks: `files`, `paper`."""

    @property
    def is_fixed(self) -> bool:
        """Whether it is that of an only anchor."""
        return self.low == self.high


@dataclass(frozen=True, slots=True)
class LeaderboardLine:
    """A player of a pool."""

    player: str
    kind: str
    about: str
    is_anchor: bool
    ratings: dict[str, Rating]
    """By column, as far as they are known."""


@dataclass(frozen=True, slots=True)
class Leaderboard:
    """The ratings of a pool."""

    columns: tuple[str, ...]
    """`overall`, if there are several groups and several players have a rating in all of them; then the groups."""
    tasks: dict[str, tuple[str, ...]]
    """The tasks of each group."""
    players: tuple[LeaderboardLine, ...]
    remarks: tuple[str, ...]
    """What a reader of these ratings must know."""

    @property
    def groups(self) -> tuple[str, ...]:
        """The columns of groups."""
        return tuple(column for column in self.columns if column != OVERALL)

    def standings(self, column: str) -> list[LeaderboardLine]:
        """Return the players who have a rating in a column, the best first."""
        rated = [line for line in self.players if column in line.ratings]
        return sorted(rated, key=lambda line: (-round(line.ratings[column].value), line.player))


def rate(pool: PlayerPool) -> Leaderboard:
    """Return the ratings of all players of a pool."""
    games = distinct_games(pool.games)
    by_group = _by_group(games)
    fits = {group: rate_games(found, pool.anchors) for group, found in by_group.items()}
    overall = _overall(games, fits)
    columns = {OVERALL: overall} | fits if overall else fits
    lines = [_line(name, pool, columns) for name in pool.players]
    remarks = [*_on_scale(pool, by_group, fits), *_on_fit(by_group, fits)]
    if without := [line.player for line in lines if not line.ratings]:
        remarks.append(f"No valid games connect {', '.join(without)} with an anchor: no rating.")
    if repeats := len(pool.games) - len(games):
        remarks.append(f"{repeats} games end like another seed of theirs in every measure, and are not counted.")
    tasks = {group: tuple(dict.fromkeys(game.task for game in found)) for group, found in by_group.items()}
    return Leaderboard(tuple(columns), tasks, tuple(lines), tuple(remarks))


def rate_games(games: Sequence[ArenaGame], anchors: Mapping[str, float]) -> dict[str, Rating]:
    """Return the rating of each player whom games of one group connect with an anchor."""
    strengths = fit_strengths([_outcome(game) for game in games], list(anchors))
    known = [rating for name, rating in anchors.items() if name in strengths]
    zero = fmean(known) if known else 0.0
    return {
        name: _rating(name, games, *(zero + ELO * found for found in (strength.value, strength.low, strength.high)))
        for name, strength in strengths.items()
    }


def rate_by_group(games: Iterable[ArenaGame], anchors: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the ratings of players by group, without intervals."""
    return {
        group: {name: rating.value for name, rating in rate_games(found, anchors).items()}
        for group, found in _by_group(distinct_games(games)).items()
    }


def distinct_games(games: Iterable[ArenaGame]) -> list[ArenaGame]:
    """Return the games without the repetitions of deterministic players.

    If all seeds of two players on a task, with the same sides, clock and variant, end alike in every measure, the seed
    makes no difference there: they are one game, and counting them all would make intervals too narrow.
    """
    same: dict[tuple[str, ...], list[ArenaGame]] = defaultdict(list)
    for game in games:
        same[game.group, game.task, game.variant, game.clock, game.first.player, game.second.player].append(game)
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


def _by_group(games: Iterable[ArenaGame]) -> dict[str, list[ArenaGame]]:
    found: dict[str, list[ArenaGame]] = defaultdict(list)
    for game in games:
        found[game.group].append(game)
    return dict(found)


def _outcome(game: ArenaGame) -> RatedGame:
    return RatedGame(game.first.player, game.second.player, game.score)


def _line(name: str, pool: PlayerPool, columns: Mapping[str, Mapping[str, Rating]]) -> LeaderboardLine:
    player = pool.players[name]
    return LeaderboardLine(
        player=name, kind=player.kind, about=player.about, is_anchor=name in pool.anchors,
        ratings={column: ratings[name] for column, ratings in columns.items() if name in ratings},
    )  # fmt: skip


def _rating(name: str, games: Iterable[ArenaGame], value: float, low: float, high: float) -> Rating:
    """Return the rating of a player with what its games say: outcomes, costs, clocks and variants."""
    own = games_of(games, name, OVERALL)
    ends = Counter(outcome_for(game, name) for game in own)
    seats = [seat for game in own if (seat := seat_of(game, name))]
    costs = [seat.cost_usd for seat in seats if seat.cost_usd is not None]
    return Rating(
        value, low, high, ends["win"], ends["draw"], ends["loss"],
        cost_usd=fmean(costs) if costs else None,
        tokens=fmean(seat.tokens for seat in seats),
        clocks=tuple(sorted({game.clock for game in own})),
        variants=tuple(sorted({game.variant for game in own})),
    )  # fmt: skip


# --- overall -----------------------------------------------------------------------------------------


def _overall(games: Sequence[ArenaGame], fits: Mapping[str, Mapping[str, Rating]]) -> dict[str, Rating]:
    """Return the means of the players who have a rating in every group; none if that compares nobody.

    No game belongs to two groups, so the ratings of a player in them are independent. The interval of their mean is
    MOVER's (Zou and Donner, Statistics in Medicine 27, 2008): it keeps that those of the groups are not symmetric.
    """
    everywhere = [name for name in next(iter(fits.values()), {}) if all(name in fit for fit in fits.values())]
    if len(fits) < 2 or len(everywhere) < 2:
        return {}
    return {name: _mean(name, games, [fit[name] for fit in fits.values()]) for name in everywhere}


def _mean(name: str, games: Sequence[ArenaGame], ratings: Sequence[Rating]) -> Rating:
    value = fmean(rating.value for rating in ratings)
    below = math.hypot(*(rating.value - rating.low for rating in ratings)) / len(ratings)
    above = math.hypot(*(rating.high - rating.value for rating in ratings)) / len(ratings)
    costs = [rating.cost_usd for rating in ratings if rating.cost_usd is not None]
    return replace(
        _rating(name, games, value, value - below, value + above),
        cost_usd=fmean(costs) if len(costs) == len(ratings) else None,
        tokens=fmean(rating.tokens for rating in ratings),
    )


# --- what a reader must know -------------------------------------------------------------------------


def _on_scale(pool: PlayerPool, by_group: Mapping[str, Sequence[ArenaGame]],
              fits: Mapping[str, Mapping[str, Rating]]) -> Iterator[str]:  # fmt: skip
    """Yield where ratings of one column are of unlike games, or of fewer anchors than those of another."""
    for group, games in by_group.items():
        for what, found in (("clocks", {game.clock for game in games}), ("variants", {game.variant for game in games})):
            if len(found) > 1:
                yield f"The games of {group} have several {what}, {', '.join(sorted(found))}: see the column."
        if not fits[group]:
            yield f"No anchor has played {group}: it has no ratings."
        elif missing := [name for name in pool.anchors if name not in fits[group]]:
            yield f"No games connect {', '.join(missing)} with the other anchors in {group}: its scale is theirs alone."


def _on_fit(by_group: Mapping[str, Sequence[ArenaGame]], fits: Mapping[str, Mapping[str, Rating]]) -> Iterator[str]:
    """Yield in which groups tasks differ more than one rating of a player can say, with the strangest pair."""
    for group, games in by_group.items():
        cells: dict[tuple[str, str, str], list[float]] = defaultdict(list)
        for game in games:
            if game.first.player in fits[group]:
                cells[game.task, game.first.player, game.second.player].append(game.score)
        found = misfit_of([_cell(fits[group], key, scores) for key, scores in cells.items()])
        if found and found.probability < UNLIKELY:
            task, first, second = list(cells)[found.strangest]
            scores = cells[task, first, second]
            expected = _cell(fits[group], (task, first, second), scores)
            yield (
                f"The tasks of {group} differ more than one rating for all of them can say: on {task}, {first} has "
                f"{sum(scores):g} points in {len(scores)} games against {second}, where its rating expects "
                f"{expected.chance * len(scores):.1f}. Look at the games."
            )


def _cell(ratings: Mapping[str, Rating], key: tuple[str, str, str], scores: Sequence[float]) -> CellOfGames:
    _, first, second = key
    chance = 1 / (1 + 10 ** ((ratings[second].value - ratings[first].value) / 400))
    return CellOfGames(len(scores), sum(scores), chance)
