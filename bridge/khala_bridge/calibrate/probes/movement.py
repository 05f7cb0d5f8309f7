"""Single units on their way: speed, acceleration, braking, turning."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_bridge.calibrate.cast import fact, known, mobile
from khala_bridge.calibrate.lab import LOOPS_PER_SECOND, MOVE, STOP, Put
from khala_bridge.calibrate.probe import Samples, probe

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

_LANE = (26, 3)
_RUN = 20.0
"""World units that a unit is sent; it does not get there while it is measured."""
_START_LOOPS = 12
_MEASURED_LOOPS = 32
_MOST_LOOPS = 40
"""Within which a unit with a slow acceleration stands again."""


def _lanes(lab: Lab) -> Iterator[list[tuple[str, int, Point]]]:
    """Make one unit of each type, each with a lane to its east, in batches; yield type, tag and goal."""
    lanes = lab.ground.places(*_LANE)
    kinds = known(lab, mobile())
    for start in range(0, len(kinds), len(lanes)):
        batch = kinds[start : start + len(lanes)]
        starts = [(x - _RUN / 2 - 1, y) for x, y in lanes]
        tags = lab.make(*(Put(kind, at) for kind, at in zip(batch, starts, strict=False)))
        yield [
            (kind, tag, (at[0] + _RUN, at[1]))
            for kind, tag, at in zip(batch, tags, starts, strict=False)
            if tag and lab.order(MOVE, tag, point=(at[0] + _RUN, at[1]))
        ]
        lab.clear()


@probe(
    "move.speed",
    measures="World units a second, once a unit is at its speed, of each type.",
    settles="Top speeds.",
    unit="world units/s",
    resolution=0.005,
)
def speed(lab: Lab) -> Samples:
    """Measure between two loops of a straight way."""
    for runners in _lanes(lab):
        lab.step(_START_LOOPS)
        slow = {tag for kind, tag, _ in runners if fact(kind).flying}
        before = {tag: lab.at(tag) for _, tag, _ in runners}
        lab.step(_MEASURED_LOOPS // 2)
        middle = {tag: lab.at(tag) for _, tag, _ in runners}
        lab.step(_MEASURED_LOOPS // 2)
        for kind, tag, _ in runners:
            since, loops = (middle, _MEASURED_LOOPS // 2) if tag in slow else (before, _MEASURED_LOOPS)
            yield kind, math.dist(since[tag], lab.at(tag)) / loops * LOOPS_PER_SECOND


@probe(
    "move.start",
    measures="World units that a unit at rest makes in its first 8 loops straight ahead, of each type.",
    settles="Accelerations.",
    unit="world units",
    resolution=0.01,
)
def start(lab: Lab) -> Samples:
    """Turn each unit first, so that only the acceleration is left."""
    for runners in _lanes(lab):
        _stand(lab, runners)
        before = {tag: lab.at(tag) for _, tag, _ in runners}
        _send(lab, runners)
        lab.step(8)
        for kind, tag, _ in runners:
            yield kind, math.dist(before[tag], lab.at(tag))


@probe(
    "move.stop",
    measures="World units between the loop of the order to stop at full speed, and where a unit stands, of each type.",
    settles="Whether units brake at the rate of their acceleration, at one of their own, or at once.",
    unit="world units",
    resolution=0.02,
)
def stop(lab: Lab) -> Samples:
    """Stop all at their speed."""
    for runners in _lanes(lab):
        lab.step(_MOST_LOOPS)
        before = {tag: lab.at(tag) for _, tag, _ in runners}
        lab.order(STOP, [tag for _, tag, _ in runners])
        lab.step(_MOST_LOOPS)
        for kind, tag, _ in runners:
            yield kind, math.dist(before[tag], lab.at(tag))


@probe(
    "move.turn",
    measures="The largest angle between two loops of a unit at rest that is sent the other way, of each type.",
    settles="Turning rates.",
    unit="degrees/loop",
    resolution=0.1,
)
def turn(lab: Lab) -> Samples:
    """Send each unit back, and look at its facing in every loop."""
    for runners in _lanes(lab):
        _stand(lab, runners)
        largest = dict.fromkeys((tag for _, tag, _ in runners), 0.0)
        facing = {tag: lab.units[tag].facing for tag in largest}
        _send(lab, runners, back=True)
        for _ in range(24):
            lab.step()
            for tag in largest:
                turned = abs(math.remainder(lab.units[tag].facing - facing[tag], math.tau))
                largest[tag] = max(largest[tag], turned)
                facing[tag] = lab.units[tag].facing
        for kind, tag, _ in runners:
            yield kind, math.degrees(largest[tag])


@probe(
    "move.reverse",
    measures="World units that a unit at rest has made 8 loops after it was sent the other way, of each type.",
    settles="Whether units make headway while they turn.",
    unit="world units",
    resolution=0.02,
)
def reverse(lab: Lab) -> Samples:
    """Send each unit back."""
    for runners in _lanes(lab):
        _stand(lab, runners)
        before = {tag: lab.at(tag) for _, tag, _ in runners}
        _send(lab, runners, back=True)
        lab.step(8)
        for kind, tag, _ in runners:
            yield kind, math.dist(before[tag], lab.at(tag))


def _stand(lab: Lab, runners: list[tuple[str, int, Point]]) -> None:
    """Let all go ahead for a while, then stand, with their faces to the east."""
    lab.step(_START_LOOPS)
    lab.order(STOP, [tag for _, tag, _ in runners])
    lab.step(_MOST_LOOPS)


def _send(lab: Lab, runners: list[tuple[str, int, Point]], *, back: bool = False) -> None:
    for _, tag, goal in runners:
        x, y = lab.at(tag)
        lab.order(MOVE, tag, point=(x - _RUN, y) if back else (x + _RUN, goal[1]))


PROBES = (speed, start, stop, turn, reverse)
