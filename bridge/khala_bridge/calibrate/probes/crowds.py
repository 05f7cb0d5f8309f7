"""Units in each other's way: pushing, going round, gaps, arriving together, surrounding."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_bridge.calibrate.cast import fact, known
from khala_bridge.calibrate.lab import ATTACK, HOLD, MOVE, Put
from khala_bridge.calibrate.probe import Samples, probe

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

_HALL = (30, 22)
_GAP_KINDS = (
    "Zergling",
    "Marine",
    "Zealot",
    "Roach",
    "Stalker",
    "Immortal",
    "Archon",
    "Ultralisk",
    "Thor",
    "SiegeTank",
)
_TOO_LONG = 999


@probe(
    "crowd.idle",
    measures="World units that an idle unit has been pushed when another has walked through its place.",
    settles="How easily friends push an idle unit aside.",
    unit="world units",
    exact=False,
)
def idle(lab: Lab) -> Samples:
    """Send one of each kind through one of its own kind that idles, and one that holds its position."""
    cases = [(kind, holds) for kind in known(lab, ("Marine", "Zealot", "Ultralisk")) for holds in (False, True)]
    places = lab.ground.places(16, 8)
    for trial in range(8):
        batch = list(zip(cases, places, strict=False))
        puts = []
        for (kind, _), (x, y) in batch:
            puts += [Put(kind, (x, y + 0.1 * (trial - 4))), Put(kind, (x - 6, y))]
        tags = lab.make(*puts)
        lab.order(HOLD, [tag for tag, ((_, holds), _) in zip(tags[::2], batch, strict=True) if holds])
        before = [lab.at(tag) for tag in tags[::2]]
        for walker, (_, (x, y)) in zip(tags[1::2], batch, strict=True):
            lab.order(MOVE, walker, point=(x + 6, y))
        lab.step(100)
        for ((kind, holds), _), tag, was in zip(batch, tags[::2], before, strict=True):
            yield f"{kind}, {'holding' if holds else 'idle'}", math.dist(was, lab.at(tag))
        lab.clear()


@probe(
    "crowd.engaged",
    measures="World units that a unit which attacks has been pushed when others have walked through its place.",
    settles="How firmly units stand that attack.",
    unit="world units",
    exact=False,
)
def engage(lab: Lab) -> Samples:
    """Let a Marine fire at a structure, and six Marines walk through it."""
    places = lab.ground.places(24, 10)[:8]
    puts = []
    for x, y in places:
        puts += [Put("SupplyDepot", (x - 5, y), lab.victim), Put("Marine", (x, y))]
        puts += [Put("Marine", (x + 7 + 0.8 * (i % 2), y - 0.8 + 0.8 * (i // 2))) for i in range(6)]
    tags = lab.make(*puts)
    for i, (x, y) in enumerate(places):
        victim, attacker, *walkers = tags[8 * i : 8 * i + 8]
        lab.order(ATTACK, attacker, target=victim)
        lab.order(MOVE, walkers, point=(x - 1.5, y + 3))
    before = [lab.at(tag) for tag in tags[1::8]]
    lab.step(80)
    for tag, was in zip(tags[1::8], before, strict=True):
        yield "Marine", math.dist(was, lab.at(tag))


@probe(
    "crowd.crossing",
    measures="Loops until 12 of two groups of eight that walk through one another are within 3 of their goals.",
    settles="How units that block each other turn aside, and who gives way.",
    unit="loops",
    exact=False,
)
def crossing(lab: Lab) -> Samples:
    """Send both at once."""
    for kind in known(lab, ("Marine", "Zealot", "Roach")):
        places = lab.ground.places(*_HALL)[:8]
        puts = []
        for trial, (x, y) in enumerate(places):
            for side in (-9, 9):
                puts += [Put(kind, (x + side + 1.3 * (i % 2), y - 2 + 1.3 * (i // 2) + 0.05 * trial)) for i in range(8)]
        tags = lab.make(*puts)
        goals: dict[int, Point] = {}
        for index, (x, y) in enumerate(places):
            for half, side in enumerate((9, -9)):
                group = tags[16 * index + 8 * half : 16 * index + 8 * half + 8]
                lab.order(MOVE, group, point=(x + side, y))
                goals |= dict.fromkeys(group, (x + side, y))
        arrived = _arrivals(lab, goals, 300)
        for index in range(len(places)):
            yield kind, sorted(arrived[tag] for tag in tags[16 * index : 16 * index + 16])[11]
        lab.clear()


def _arrivals(lab: Lab, goals: dict[int, Point], most: int, near: float = 3.0) -> dict[int, float]:
    arrived: dict[int, float] = dict.fromkeys(goals, float(most))
    for loop in range(1, most):
        lab.step()
        for tag, goal in goals.items():
            if arrived[tag] == most and tag in lab.units and math.dist(lab.at(tag), goal) < near:
                arrived[tag] = loop
        if max(arrived.values()) < most:
            break
    return arrived


@probe(
    "crowd.arrival",
    measures="Mean distance from the goal, and loops until all idle, of 16 units that were sent to one point.",
    settles="When units of a crowd take themselves for arrived.",
    unit="world units, loops",
    exact=False,
)
def arrival(lab: Lab) -> Samples:
    """Send groups from a line."""
    for kind in known(lab, ("Marine", "Zergling", "Stalker")):
        places = lab.ground.places(26, 12)[:8]
        puts = [
            Put(kind, (x - 8 + 0.05 * trial + 1.5 * (i % 2), y - 4.5 + 1.2 * (i // 2)))
            for trial, (x, y) in enumerate(places)
            for i in range(16)
        ]
        tags = lab.make(*puts)
        groups = [tags[16 * i : 16 * i + 16] for i in range(len(places))]
        for group, (x, y) in zip(groups, places, strict=True):
            lab.order(MOVE, group, point=(x + 8, y))
        still = [0.0] * len(groups)
        for loop in range(1, 400):
            lab.step()
            for i, group in enumerate(groups):
                if not still[i] and not any(lab.units[tag].orders for tag in group):
                    still[i] = loop
            if all(still):
                break
        for i, (group, (x, y)) in enumerate(zip(groups, places, strict=True)):
            yield f"{kind}: distance", sum(math.dist(lab.at(tag), (x + 8, y)) for tag in group) / len(group)
            yield f"{kind}: loops", still[i] or float(_TOO_LONG)
        lab.clear()


@probe(
    "crowd.hover",
    measures="World units between two flyers that were made on one point, after 8, 32 and 128 loops.",
    settles="How fast flyers part that hover over each other.",
    unit="world units",
    exact=False,
)
def hover(lab: Lab) -> Samples:
    """Let them be."""
    for kind in known(lab, ("Mutalisk", "VoidRay", "Battlecruiser")):
        places = lab.ground.places(8, 8)[:8]
        tags = lab.make(*(Put(kind, place) for place in places for _ in range(2)))
        for loops, since in ((8, 8), (32, 24), (128, 96)):
            lab.step(since)
            for left, right in zip(tags[::2], tags[1::2], strict=True):
                yield f"{kind} after {loops}", math.dist(lab.at(left), lab.at(right))
        lab.clear()


@probe(
    "crowd.gap",
    measures="Loops until a unit has gone through a gap of one or two cells between structures; 999: it has not.",
    settles="Which gaps units pass, and how far around they look for a way.",
    unit="loops",
    resolution=4.0,
)
def gap(lab: Lab) -> Samples:
    """Build a wall of Supply Depots with a gap in it across the way."""
    x, y = (round(part) for part in lab.ground.places(*_HALL)[0])
    for kind in known(lab, _GAP_KINDS):
        for cells in (1, 2):
            upper = [Put("SupplyDepot", (x, y + 1 + cells + 2 * i), lab.victim) for i in range(4)]
            lower = [Put("SupplyDepot", (x, y - 1 - 2 * i), lab.victim) for i in range(5)]
            *_, walker = lab.make(*upper, *lower, Put(kind, (x - 5, y + cells / 2)))
            lab.order(MOVE, walker, point=(x + 5, y + cells / 2))
            passed = _arrivals(lab, {walker: (x + 5, y + cells / 2)}, 70, near=3.5)[walker]
            yield f"{kind}, {cells}", passed if passed < 70 else _TOO_LONG
            lab.clear()


@probe(
    "crowd.surround",
    measures="How many of 12 units sent from one side hit a target at once, 60 and 120 loops after their order.",
    settles="How units find their ways round others to a target.",
    unit="units",
    exact=False,
)
def surround(lab: Lab) -> Samples:
    """Count who is in reach."""
    for kind, target in (("Zergling", "Ultralisk"), ("Zealot", "Immortal"), ("Zergling", "Nexus"), ("Zealot", "Nexus")):
        if not lab.has(kind, target):
            continue
        places = lab.ground.places(30, 14)[:8]
        tags: list[list[int]] = []
        puts: list[Put] = []
        for trial, (x, y) in enumerate(places):
            puts.append(Put(target, (x - 5, y), lab.victim))
            puts += [Put(kind, (x + 4 + 1.1 * (i % 3), y - 2 + 1.1 * (i // 3) + 0.05 * trial)) for i in range(12)]
        made = lab.make(*puts)
        tags = [made[13 * i : 13 * i + 13] for i in range(len(places))]
        for victim, *group in tags:
            lab.order(ATTACK, group, target=victim)
        for loops in (60, 120):
            for _ in range(4):
                lab.step(15)
                _refill(lab, [group[0] for group in tags])
            for _, *group in tags:
                yield f"{kind} at {target} after {loops}", sum(lab.units[tag].weapon_cooldown > 0 for tag in group)
        lab.clear()


def _refill(lab: Lab, victims: Sequence[int]) -> None:
    for tag in victims:
        lab.set(tag, Life=fact("Nexus").health)  # the game takes as much of it as the type can have


@probe(
    "crowd.firing_line",
    measures="Life that 16 units with a range, sent from one side, have taken from a structure in 100 loops.",
    settles="How many of a crowd come into range, and how they spread.",
    unit="life",
    exact=False,
)
def firing_line(lab: Lab) -> Samples:
    """Shoot at a Nexus."""
    for kind in known(lab, ("Marine", "Roach", "Stalker", "Hydralisk")):
        places = lab.ground.places(32, 16)[:8]
        puts = []
        for trial, (x, y) in enumerate(places):
            puts.append(Put("Nexus", (x - 8, y), lab.victim))
            puts += [Put(kind, (x + 4 + 1.3 * (i % 4), y - 2 + 1.3 * (i // 4) + 0.05 * trial)) for i in range(16)]
        tags = lab.make(*puts)
        for start in range(0, len(tags), 17):
            lab.order(ATTACK, tags[start + 1 : start + 17], target=tags[start])
        lab.step(100)
        for victim in tags[::17]:
            yield kind, fact("Nexus").health + fact("Nexus").shield - lab.life(victim)
        lab.clear()


PROBES = (idle, engage, crossing, arrival, hover, gap, surround, firing_line)
