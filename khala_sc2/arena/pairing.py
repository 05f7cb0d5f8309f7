"""Who meets whom in a round: everybody, or by the Swiss system opponents of about the same rating.

Pure functions of names and numbers. The same results give the same pairs, so an interrupted round is found again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

Pair = tuple[str, str]


def pair_swiss(pairs: Sequence[Pair], met: Mapping[frozenset[str], int], ratings: Mapping[str, float],
               seats: Iterable[str]) -> list[Pair]:  # fmt: skip
    """Return pairs for a Swiss round, in which as many players as possible have one game each.

    Pairs that have met least come first, and of these the pairs whose ratings differ least.

    Args:
        pairs: who can meet whom on a task.
        met: how often two players have met there.
        ratings: as far as they are known; a player without one is taken for an average one.
        seats: players of whom each has one game; the others (levels of the computer, maps) may have several.
    """
    average = sum(ratings.values()) / len(ratings) if ratings else 0.0
    single = frozenset(seats)

    def order(pair: Pair) -> tuple[int, float, Pair]:
        first, second = (ratings.get(name, average) for name in pair)
        return met.get(frozenset(pair), 0), abs(first - second), pair

    chosen: list[Pair] = []
    free = set(single)
    for pair in sorted(pairs, key=order):
        needed = single & set(pair)
        if needed <= free:
            chosen.append(pair)
            free -= needed
    return chosen
