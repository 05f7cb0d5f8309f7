"""Attackers at targets that do nothing, many at a time: the stage of most probes of weapons."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from khala_bridge.calibrate.cast import apart, armed_types, fact, known, reach, sturdy
from khala_bridge.calibrate.lab import ATTACK, Put

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_bridge.calibrate.lab import Lab

PAIR: Final = (12, 8)
"""World units that a pair takes: the widest are five wide, and splash reaches two."""
LONG_PAIR: Final = (30, 9)
"""The same for attackers from beyond their range."""
NOTICEABLE: Final = 0.4
"""A hit takes half a point of life at least, and a Zerg gains less in a loop."""


class Pair(NamedTuple):
    """An attacker and its target."""

    attacker: int
    target: int
    kind: str
    """Of the attacker."""
    against: str
    """Of the target."""


def stage(
    lab: Lab,
    wanted: Sequence[tuple[str, str]],
    *,
    gap: Callable[[str], float] = reach,
    place: tuple[int, int] = PAIR,
) -> Iterator[list[Pair]]:
    """Make attackers and targets of these types in batches, with the attacker to the east; clear after each.

    Args:
        lab: the game.
        wanted: types of attacker and target.
        gap: between their edges, by type of attacker.
        place: that each pair takes; its target is four and a half from its western end.
    """
    places = lab.ground.places(*place)
    west = place[0] / 2 - 4.5
    for start in range(0, len(wanted), len(places)):
        batch = list(zip(wanted[start : start + len(places)], places, strict=False))
        puts = []
        for (attacker, target), (x, y) in batch:
            at = x - west + apart(attacker, target, gap(attacker))
            puts += [Put(target, (x - west, y), lab.victim), Put(attacker, (at, y))]
        tags = lab.make(*puts)
        pairs = [
            Pair(tags[2 * i + 1], tags[2 * i], attacker, target)
            for i, ((attacker, target), _) in enumerate(batch)
            if tags[2 * i] and tags[2 * i + 1]
        ]
        yield pairs
        lab.clear()


def everyone(lab: Lab) -> list[tuple[str, str]]:
    """Return each armed type with a sturdy target."""
    return [(kind, sturdy(kind)) for kind in known(lab, armed_types())]


def period_loops(lab: Lab, kind: str) -> float:
    """Return the longest period of a type's weapons, as the game's own data has it."""
    periods = [weapon.speed * 16 for weapon in lab.types[kind].weapons]  # per second of the speed "normal"
    return max(periods) if periods else max(weapon.period_s for weapon in fact(kind).weapons) * 22.4


def attack(lab: Lab, pairs: Sequence[Pair]) -> list[Pair]:
    """Order each attacker at its target; return the pairs of which the game takes the order."""
    return [pair for pair in pairs if lab.order(ATTACK, pair.attacker, target=pair.target)]


def hits(lab: Lab, pairs: Sequence[Pair], loops: int, *, refill: bool = False) -> dict[Pair, list[tuple[int, float]]]:
    """Play, and return for each pair the loops, counted from now, at which its target lost life, and how much.

    Args:
        lab: the game.
        pairs: to be watched.
        loops: how long.
        refill: whether targets are given their life back, so that they last.
    """
    found: dict[Pair, list[tuple[int, float]]] = {pair: [] for pair in pairs}
    before = {pair: lab.life(pair.target) for pair in pairs}
    for loop in range(1, loops + 1):
        lab.step()
        for pair in pairs:
            now = lab.life(pair.target)
            if before[pair] - now > NOTICEABLE:
                found[pair].append((loop, before[pair] - now))
            before[pair] = now
        if refill and loop % 8 == 0:
            for pair in pairs:
                if pair.target in lab.units:
                    unit = lab.units[pair.target]
                    lab.set(pair.target, Life=unit.health_max)
                    before[pair] = unit.health_max + unit.shield
    return found


def shots(found: Sequence[tuple[int, float]], apart_loops: float) -> list[int]:
    """Return the loops at which shots took effect first; hits less than `apart_loops` later are of the same shot."""
    begun: list[int] = []
    for loop, _ in found:
        if not begun or loop - begun[-1] > apart_loops:
            begun.append(loop)
    return begun
