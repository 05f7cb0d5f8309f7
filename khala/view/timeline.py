"""The time line of an episode: every step, with its curves and marks; from the index alone.

Fights are made of losses: deaths that follow each other closely in time and place.
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

from khala.view.digest import centre, counted, pairs
from khala.view.wire import Curve, CurveName, Mark, Timeline
from khala_protocol.keys import Topic
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala.view.index import Index
    from khala_protocol.messages import Point

FIGHT_GAP_S = 6.0
"""A death so long after the last one begins another fight."""
FIGHT_CELLS = 14.0
"""So does one that is as far from its middle, in cells of the minimap: a screen of a map of 128 is 12 wide."""
SMALLEST_FIGHT = 150.0
"""Minerals and vespene; less is a skirmish, whose deaths have marks of their own."""


@dataclass(slots=True)
class _Fight:
    """Losses that belong together."""

    losses: list[tuple[int, str, float, Point | None]] = field(default_factory=list)
    last_s: float = 0.0

    @property
    def value(self) -> float:
        return sum(value for _, _, value, _ in self.losses)

    @property
    def at(self) -> Point | None:
        return centre((*at, value) for _, _, value, at in self.losses if at is not None)

    def takes(self, time_s: float, at: Point | None) -> bool:
        """Return whether a loss belongs to it."""
        middle = self.at
        near = at is None or middle is None or max(abs(at[0] - middle[0]), abs(at[1] - middle[1])) <= FIGHT_CELLS
        return time_s - self.last_s <= FIGHT_GAP_S and near

    def mark(self) -> Mark:
        """Return the mark: of the side that lost most, with what each of them lost."""
        lost: dict[str, float] = defaultdict(float)
        for _, side, value, _ in self.losses:
            lost[side] += value
        text = ", ".join(f"{side} lost {value:g}" for side, value in sorted(lost.items()))
        most = max(lost, key=lambda side: lost[side])
        return Mark(step=self.losses[0][0], kind="fight", side=most, text=text, weight=self.value, at=_rounded(self.at))


def timeline(index: Index, episode: int) -> Timeline:
    """Return the time line of an episode, as far as it is indexed."""
    found = index.rows("select step, data from step where episode = ? order by step", episode)
    steps = [step for step, _ in found]
    rows = [json.loads(data) for _, data in found]
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
        loops.append(row.get("loop", before))
        before = row.get("after", loops[-1])
    return loops


def _curves(rows: Sequence[dict[str, Any]]) -> Iterator[Curve]:
    values: dict[tuple[str, str], list[float | None]] = {}
    for number, row in enumerate(rows):
        for name, side, value in pairs(row):
            values.setdefault((name, side), [None] * len(rows))[number] = value
    order = {name: number for number, name in enumerate(get_args(CurveName))}
    for name, side in sorted((one for one in values if one[0] in order), key=lambda one: (order[one[0]], one[1])):
        column = values[name, side]
        if any(value is not None for value in column):
            yield Curve(name=name, side=side, values=tuple(column))  # type: ignore[arg-type]  # one of its names


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
        at = _rounded(centre((*place, 1.0) for _, place in those if place is not None))
        text = f"{counted(kind for kind, _ in those)} died"
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
            open_.append(fight := _Fight())
        fight.losses.append((step, side, value, at))
        fight.last_s = time_s
    yield from (fight.mark() for fight in (*over, *open_) if fight.value >= SMALLEST_FIGHT)


def _rounded(at: Point | None) -> Point | None:
    return None if at is None else (round(at[0], 1), round(at[1], 1))
