"""What workers earn: whole lines, single trips, fields that several share, gas, MULEs; and how larvae wander."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.lab import ME, NEUTRAL, SMART, Put
from khala_bridge.calibrate.probe import MELEE, Samples, probe

if TYPE_CHECKING:
    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

_MINUTE: Final = 1344
_WARM_UP: Final = 672
"""Half a minute, in which workers find their rhythm."""
_NEAR: Final = 10.0


def _hall(lab: Lab) -> tuple[int, Point]:
    tag = next(tag for tag in lab.first if tag in lab.units and lab.units[tag].owner == ME)
    return tag, lab.at(tag)


def _fields(lab: Lab, *, vespene: bool = False) -> list[int]:
    """Return the fields or geysers of the first base, nearest first, in an order that does not depend on tags."""
    _, home = _hall(lab)
    found = [
        tag
        for tag, unit in lab.units.items()
        if unit.owner == NEUTRAL and (unit.vespene_contents if vespene else unit.mineral_contents)
    ]
    near = [tag for tag in found if math.dist(lab.at(tag), home) < _NEAR]
    return sorted(near, key=lambda tag: (round(math.dist(lab.at(tag), home), 2), lab.at(tag)))


def _workers(lab: Lab, fields: list[int], kind: str = "SCV") -> list[int]:
    """Make a worker between the hall and each of these fields, and send it there."""
    _, (x, y) = _hall(lab)
    places = [((lab.at(tag)[0] + x) / 2, (lab.at(tag)[1] + y) / 2) for tag in fields]
    tags = lab.make(*(Put(kind, at) for at in places))
    for worker, field in zip(tags, fields, strict=True):
        lab.order(SMART, worker, target=field)
    return tags


def _bank(lab: Lab, *, vespene: bool = False) -> float:
    details = lab.observation.observation.score.score_details
    return float(details.collected_vespene if vespene else details.collected_minerals)


@probe(
    "harvest.line",
    measures="Minerals a minute of a base with 8, 16 and 24 workers.",
    settles="What a base earns, with all that workers do to each other on their way.",
    unit="minerals/min",
    exact=False,
    setting=MELEE,
)
def line(lab: Lab) -> Samples:
    """Measure eight half minutes each."""
    for count in (8, 16, 24):
        fields = _fields(lab)
        _workers(lab, [fields[i % len(fields)] for i in range(count)])
        lab.step(_WARM_UP)
        for _ in range(8):
            before = _bank(lab)
            lab.step(_MINUTE // 2)
            yield f"{count} workers", 2 * (_bank(lab) - before)
        lab.clear()


@probe(
    "harvest.trip",
    measures="Loops of one worker from one delivery to the next, at the nearest and the farthest field.",
    settles="Time at a field and on the way, how near to walls a worker walks, and how long it waits.",
    unit="loops",
    exact=False,
    setting=MELEE,
)
def trip(lab: Lab) -> Samples:
    """Watch the bank."""
    for name, rank in (("nearest", 0), ("farthest", -1)):
        _workers(lab, [_fields(lab)[rank]])
        yield from ((name, loops) for loops in _deliveries(lab, 8))
        lab.clear()


@probe(
    "harvest.shared",
    measures="Loops between deliveries from one field with two and with three workers.",
    settles="How long a field waits from one worker's end to the next one's beginning.",
    unit="loops",
    exact=False,
    setting=MELEE,
)
def share(lab: Lab) -> Samples:
    """Measure sixteen deliveries, two by two, so that unequal ones even out."""
    for count in (2, 3):
        _workers(lab, [_fields(lab)[0]] * count)
        lab.step(_WARM_UP)
        found = _deliveries(lab, 16)
        pairs = zip(found[::2], found[1::2], strict=True)
        yield from ((f"{count} workers", (first + second) / 2) for first, second in pairs)
        lab.clear()


def _deliveries(lab: Lab, count: int, *, vespene: bool = False) -> list[int]:
    """Return the loops between so many deliveries."""
    found: list[int] = []
    last = 0
    bank = _bank(lab, vespene=vespene)
    end = lab.loop + 300 * (count + 2)
    while len(found) < count and lab.loop < end:
        lab.step()
        if (now := _bank(lab, vespene=vespene)) > bank:
            if last:
                found.append(lab.loop - last)
            last = lab.loop
            bank = now
    return found


@probe(
    "harvest.gas",
    measures="Loops between two deliveries from a geyser with one and with three workers.",
    settles="How long a geyser waits from one worker's end to the next one's beginning.",
    unit="loops",
    exact=False,
    setting=MELEE,
)
def gas(lab: Lab) -> Samples:
    """Build a Refinery."""
    for count in (1, 3):
        geysers = _fields(lab, vespene=True)
        refinery, *_ = lab.make(Put("Refinery", lab.at(geysers[0])))
        _workers(lab, [refinery] * count)
        lab.step(_WARM_UP)
        found = _deliveries(lab, 16, vespene=True)
        yield from (
            (f"{count} workers", (first + second) / 2) for first, second in zip(found[::2], found[1::2], strict=False)
        )
        lab.clear()


@probe(
    "harvest.mule",
    measures="Loops of a MULE from one delivery to the next.",
    settles="What a MULE brings.",
    unit="loops",
    exact=False,
    setting=MELEE,
)
def mule(lab: Lab) -> Samples:
    """Make one without a call."""
    for name, rank in (("nearest", 0), ("farthest", -1)):
        _workers(lab, [_fields(lab)[rank]], "MULE")
        yield from ((name, loops) for loops in _deliveries(lab, 8))
        lab.clear()


@probe(
    "larva.wander",
    measures="World units between a larva and the middle of its Hatchery, and how far it goes in 64 loops.",
    settles="How far larvae wander, how far a step is, and which Hatchery takes a larva for its own.",
    unit="world units",
    exact=False,
)
def wander(lab: Lab) -> Samples:
    """Watch the larvae of a Hatchery, and of one that begins without."""
    places = lab.ground.places(24, 20)[:8]
    halls = lab.make(*(Put("Hatchery", (int(x) + 0.5, int(y) + 0.5)) for x, y in places))
    strays = lab.make(*(Put("Larva", (x, y - 8)) for x, y in places))
    lab.step(800)
    before = {tag: lab.at(tag) for tag in lab.of("Larva")}
    lab.step(64)
    for hall, stray in zip(halls, strays, strict=True):
        near = [tag for tag in before if tag in lab.units and math.dist(lab.at(hall), lab.at(tag)) < 6 and tag != stray]
        if near:
            yield "from the Hatchery", sum(math.dist(lab.at(hall), lab.at(tag)) for tag in near) / len(near)
            yield "in 64 loops", sum(math.dist(before[tag], lab.at(tag)) for tag in near) / len(near)
            yield "larvae", len(near)
        yield "made 8 south of it", math.dist(lab.at(hall), lab.at(stray)) if stray in lab.units else 0.0


PROBES = (line, trip, share, gas, mule, wander)
