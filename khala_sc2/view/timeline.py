"""The time line of an episode: every step, with its curves and marks; from the index alone.

Fights are made of losses: deaths that follow each other closely in time and place.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

from pydantic_core import from_json

from khala_protocol.keys import Topic
from khala_protocol.messages import LOOPS_PER_S
from khala_sc2.view.digest import count_kinds
from khala_sc2.view.wire import Curve, CurveName, Mark, Timeline

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_protocol.messages import Point
    from khala_sc2.view.index import Index

FIGHT_GAP_S = 6.0
"""A death so long after the last one begins another fight."""
FIGHT_CELLS = 14.0
"""So does one that is as far from its middle, in cells of the minimap: a screen of a map of 128 is 12 wide."""
SMALLEST_FIGHT = 150.0
"""Minerals and vespene; less is a skirmish, whose deaths have marks of their own."""


@dataclass(slots=True)
class _Fight:
    """Losses that belong together."""

    step: int
    """In which it began."""
    last_s: float = 0.0
    lost: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    """Minerals and vespene, by side."""
    _placed: float = 0.0
    _sum_x: float = 0.0
    _sum_y: float = 0.0

    @property
    def value(self) -> float:
        return sum(self.lost.values())

    @property
    def at(self) -> Point | None:
        """Its middle, as the places of larger losses count for more."""
        return (self._sum_x / self._placed, self._sum_y / self._placed) if self._placed else None

    def takes(self, time_s: float, at: Point | None) -> bool:
        """Return whether a loss belongs to it."""
        middle = self.at
        near = at is None or middle is None or max(abs(at[0] - middle[0]), abs(at[1] - middle[1])) <= FIGHT_CELLS
        return time_s - self.last_s <= FIGHT_GAP_S and near

    def add(self, time_s: float, side: str, value: float, at: Point | None) -> None:
        """Take a loss in."""
        self.last_s = time_s
        self.lost[side] += value
        if at is not None:
            weight = value or 1.0
            self._placed += weight
            self._sum_x += weight * at[0]
            self._sum_y += weight * at[1]

    def mark(self) -> Mark:
        """Return the mark: of the side that lost most, with what each of them lost."""
        text = ", ".join(f"{side} lost {value:g}" for side, value in sorted(self.lost.items()))
        most = max(self.lost, key=lambda side: self.lost[side])
        return Mark(step=self.step, kind="fight", side=most, text=text, weight=self.value, at=_round(self.at))


def timeline(index: Index, episode: int) -> Timeline:
    """Return the time line of an episode, as far as it is indexed."""
    found = index.rows("select step, data from step where episode = ? order by step", episode)
    steps = [step for step, _ in found]
    rows: list[dict[str, Any]] = from_json(f"[{','.join(data for _, data in found)}]")
    loops = _loops(rows)
    times_s = {step: loop / LOOPS_PER_S for step, loop in zip(steps, loops, strict=True)}
    asked: dict[str, list[int]] = defaultdict(list)
    for side, agent, step in index.rows(
        "select distinct side, agent, step from sample where topic = ? and episode = ? order by side, agent, step",
        Topic.OBSERVATION, episode,
    ):  # fmt: skip
        asked[f"{side}/{agent}"].append(step)
    return Timeline(
        episode=episode,
        steps=tuple(steps),
        time_s=tuple(round(time_s, 3) for time_s in times_s.values()),
        loops=tuple(loops),
        asked={who: tuple(those) for who, those in asked.items()},
        curves=tuple(_curves(rows)),
        marks=tuple(sorted(_marks(index, episode, times_s), key=lambda mark: mark.step)),
    )


def _loops(rows: Sequence[dict[str, Any]]) -> list[int]:
    """Return the game loop at which each step begins: that of its observations, or where the step before ended."""
    loops: list[int] = []
    before = 0
    for row in rows:
        loops.append(loop_of(row, before))
        before = whole_number(row.get("after"), loops[-1])
    return loops


def loop_of(row: dict[str, Any], before: int) -> int:
    """Return the game loop at which a step begins; where no message says it, that at which the step before ended."""
    return whole_number(row.get("loop"), before)


def whole_number(value: float | None, otherwise: int) -> int:
    """Return a number of the index as a whole one; anybody may have written null or a fraction into a recording."""
    return otherwise if value is None else int(value)


def _curves(rows: Sequence[dict[str, Any]]) -> Iterator[Curve]:
    order = {name: number for number, name in enumerate(get_args(CurveName))}
    keys = {key: key.partition("/") for key in set().union(*rows)}
    known = {key: (name, side) for key, (name, _, side) in keys.items() if name in order}
    for key in sorted(known, key=lambda key: (order[known[key][0]], known[key][1])):
        values = [row.get(key) for row in rows]
        if any(value is not None for value in values):
            yield Curve(name=known[key][0], side=known[key][1], values=tuple(values))


def _marks(index: Index, episode: int, times_s: dict[int, float]) -> Iterator[Mark]:
    for step, kind, side, agent, text in index.rows(
        "select step, kind, side, agent, text from mark where episode = ? order by step, rowid", episode
    ):
        yield Mark(step=step, kind=kind, side=side, agent=agent, text=text)
    losses = [
        (step, side, kind, value, None if x is None else (x, y))
        for step, side, kind, value, x, y in index.rows(
            "select step, side, type, value, x, y from loss where episode = ? order by step, rowid", episode
        )
    ]
    yield from _deaths(losses)
    yield from _fights(losses, times_s)


def _deaths(losses: Iterable[tuple[int, str, str, float, Point | None]]) -> Iterator[Mark]:
    groups: dict[tuple[int, str], list[tuple[str, Point | None]]] = defaultdict(list)
    for step, side, kind, _, at in losses:
        groups[step, side].append((kind, at))
    for (step, side), those in groups.items():
        at = _round(_middle([place for _, place in those if place is not None]))
        text = f"{count_kinds(kind for kind, _ in those)} died"
        yield Mark(step=step, kind="death", side=side, text=text, weight=len(those), at=at)


def _fights(losses: Iterable[tuple[int, str, str, float, Point | None]], times_s: dict[int, float]) -> Iterator[Mark]:
    open_: list[_Fight] = []
    over: list[_Fight] = []
    for step, side, _, value, at in losses:
        time_s = times_s.get(step, 0.0)
        over += [fight for fight in open_ if time_s - fight.last_s > FIGHT_GAP_S]
        open_ = [fight for fight in open_ if time_s - fight.last_s <= FIGHT_GAP_S]
        fight = next((fight for fight in open_ if fight.takes(time_s, at)), None)
        if fight is None:
            open_.append(fight := _Fight(step))
        fight.add(time_s, side, value, at)
    yield from (fight.mark() for fight in (*over, *open_) if fight.value >= SMALLEST_FIGHT)


def _middle(places: Sequence[Point]) -> Point | None:
    if not places:
        return None
    return sum(x for x, _ in places) / len(places), sum(y for _, y in places) / len(places)


def _round(at: Point | None) -> Point | None:
    return None if at is None else (round(at[0], 1), round(at[1], 1))
