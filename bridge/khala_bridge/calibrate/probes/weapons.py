"""One attacker and one target: how long a shot takes, how often it comes, from how far."""

from __future__ import annotations

import math
from itertools import islice, pairwise
from typing import TYPE_CHECKING

from khala_bridge.calibrate.cast import apart, fact, known, sturdy
from khala_bridge.calibrate.lab import ATTACK, ENEMY, HOLD, MOVE, SMART, STOP, Put
from khala_bridge.calibrate.probe import Samples, probe
from khala_bridge.calibrate.probes.pairs import (
    LONG_PAIR,
    NOTICEABLE,
    Pair,
    attack,
    everyone,
    hits,
    period_loops,
    shots,
    stage,
)

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab

_SHOTS = 10
_APPROACH_LOOPS = 160
"""In which the slowest, a Queen, walks three world units and fires."""
_LEAVING_LOOPS = 80
_TENTHS = 8
_LONGEST_LOOPS = 70
"""The Tempest fires every 53 loops, and its missile flies."""
_MISSILES = (
    "Marauder", "Stalker", "Hydralisk", "Ghost", "Queen", "Adept", "Cyclone", "SpineCrawler", "Ravager",
    "VikingFighter", "Corruptor", "Phoenix", "Tempest", "HighTemplar", "Mutalisk", "Roach",
)  # fmt: skip


@probe(
    "weapon.period",
    measures="Loops between two shots of one unit, of each type.",
    settles="Periods of weapons, and what chance adds to each.",
    unit="loops",
    exact=False,
)
def period(lab: Lab) -> Samples:
    """Let each fire at a target that does not die."""
    for pairs in stage(lab, everyone(lab)):
        firing = attack(lab, pairs)
        for pair, found in hits(lab, firing, 14 * 40, refill=True).items():
            begun = shots(found, 0.5 * period_loops(lab, pair.kind))
            for shot, next_shot in islice(pairwise(begun[1:]), _SHOTS):
                yield pair.kind, next_shot - shot


@probe(
    "weapon.delay",
    measures="Loops from the order of a unit that faces its target, and is ready, to its first hit, of each type.",
    settles="Damage points, and whether missiles begin at the middle and end at the edge.",
    unit="loops",
    resolution=1.0,
)
def delay(lab: Lab) -> Samples:
    """Let each fire once, so that it faces its target, wait, and order it again."""
    for pairs in stage(lab, everyone(lab)):
        for pair, found in _second_shots(lab, pairs).items():
            if found:
                yield pair.kind, found[0][0]


@probe(
    "weapon.missile",
    measures="The same, of missiles that fly to a target at the end of the weapon's range.",
    settles="Speeds of missiles.",
    unit="loops",
    resolution=1.0,
)
def missile(lab: Lab) -> Samples:
    """Stage them at a distance."""
    wanted = [(kind, sturdy(kind)) for kind in known(lab, _MISSILES)]
    for pairs in stage(lab, wanted, gap=lambda kind: _longest(kind) - 0.5, place=LONG_PAIR):
        for pair, found in _second_shots(lab, pairs).items():
            if found:
                yield pair.kind, found[0][0]


def _longest(kind: str) -> float:
    plane = "air" if fact(sturdy(kind)).flying else "ground"
    return max(weapon.range for weapon in fact(kind).weapons if weapon.targets in {plane, "any"})


def _second_shots(lab: Lab, pairs: list[Pair]) -> dict[Pair, list[tuple[int, float]]]:
    firing = attack(lab, pairs)
    hits(lab, firing, 20)
    lab.order(STOP, [pair.attacker for pair in firing])
    hits(lab, firing, _LONGEST_LOOPS)
    return hits(lab, attack(lab, firing), _LONGEST_LOOPS)


@probe(
    "weapon.range",
    measures="World units between the edges of a unit and a target that it was sent at, once it fires, of each type.",
    settles="Ranges, and how far inside of them a pursuer stops.",
    unit="world units",
    resolution=0.15,
)
def reach(lab: Lab) -> Samples:
    """Send each from beyond its range."""
    wanted = [(kind, target) for kind, target in everyone(lab) if fact(kind).speed]
    for pairs in stage(lab, wanted, gap=lambda kind: _longest(kind) + 3, place=LONG_PAIR):
        waiting = {pair: lab.life(pair.target) for pair in attack(lab, pairs)}
        for _ in range(_APPROACH_LOOPS):
            lab.step()
            for pair in [pair for pair, life in waiting.items() if lab.life(pair.target) < life - NOTICEABLE]:
                del waiting[pair]
                distance = math.dist(lab.at(pair.attacker), lab.at(pair.target))
                yield pair.kind, distance - apart(pair.kind, sturdy(pair.kind), 0)


@probe(
    "weapon.slop",
    measures="World units between the edges of a Marine that holds and an Overlord that flies away, at its last shot.",
    settles="How far beyond its range a unit fires on at a target that it has had in range.",
    unit="world units",
    resolution=0.15,
)
def slop(lab: Lab) -> Samples:
    """Let Overlords leave from starts one tenth apart, so that some shot falls on every tenth of the way."""
    x, y = lab.ground.places(30, 6)[0]
    last = 0.0
    for tenth in range(_TENTHS):
        gap = 4 + tenth / 10
        marine, overlord = lab.make(
            Put("Marine", (x - 8, y)), Put("Overlord", (x - 8 + apart("Marine", "Overlord", gap), y), ENEMY)
        )
        lab.order(HOLD, marine)
        lab.order(MOVE, overlord, point=(x + 7, y))
        life = lab.life(overlord)
        for _ in range(_LEAVING_LOOPS):
            lab.step()
            if lab.life(overlord) < life - NOTICEABLE:
                life = lab.life(overlord)
                last = max(last, math.dist(lab.at(marine), lab.at(overlord)) - apart("Marine", "Overlord", 0))
        lab.clear()
    yield "Marine", last


def _until_hit(lab: Lab, victim: int) -> bool:
    """Play until a unit loses life; False if it does not."""
    before = lab.life(victim)
    for _ in range(2 * _LONGEST_LOOPS):
        lab.step()
        if lab.life(victim) < before - NOTICEABLE:
            return True
    return False


@probe(
    "weapon.interrupted",
    measures="Loops from the first order to the first hit of a unit that was stopped in its attack and ordered again.",
    settles="Whether an attack that is dropped before its damage point leaves a cooldown.",
    unit="loops",
    resolution=1.0,
)
def interrupt(lab: Lab) -> Samples:
    """Use types with a late damage point."""
    kinds = [kind for kind in ("Zealot", "Stalker", "Ultralisk", "Thor", "Roach") if lab.has(kind)]
    for pairs in stage(lab, [(kind, sturdy(kind)) for kind in kinds]):
        firing = attack(lab, pairs)
        hits(lab, firing, 12)
        lab.order(STOP, [pair.attacker for pair in firing])
        hits(lab, firing, _LONGEST_LOOPS)
        firing = attack(lab, firing)
        lab.step(2)
        lab.order(STOP, [pair.attacker for pair in firing])
        lab.step()
        for pair, found in hits(lab, attack(lab, firing), _LONGEST_LOOPS).items():
            if found:
                yield pair.kind, found[0][0] + 3


@probe(
    "weapon.backswing",
    measures="World units that a unit has gone 6 loops after it killed its target, its next order being to move.",
    settles="Whether a unit ends its backswing before it walks on.",
    unit="world units",
    resolution=0.3,
)
def backswing(lab: Lab) -> Samples:
    """Queue a move behind the attack."""
    kinds = [kind for kind in ("Marine", "Zealot", "Zergling", "Hellion", "Roach", "Immortal") if lab.has(kind)]
    for pairs in stage(lab, [(kind, "SCV") for kind in kinds]):
        for pair in pairs:
            lab.set(pair.target, Life=1.0)
            x, y = lab.at(pair.attacker)
            lab.order(ATTACK, pair.attacker, target=pair.target)
            lab.order(MOVE, pair.attacker, point=(x + 4, y), queue=True)
        after: dict[Pair, int] = {}
        where = {pair: lab.at(pair.attacker) for pair in pairs}
        for _ in range(60):
            lab.step()
            for pair in pairs:
                if pair.target not in lab.units:
                    after[pair] = after.get(pair, 0) + 1
                    if after[pair] == 6:
                        yield pair.kind, math.dist(where[pair], lab.at(pair.attacker))


@probe(
    "weapon.dead_attacker",
    measures="Life that a target loses to an attacker that dies between its shot and the hit, or between two hits.",
    settles="Whether missiles fly on, and later hits still come, when the attacker is dead.",
    unit="life",
    resolution=0.5,
)
def dead_attacker(lab: Lab) -> Samples:
    """Kill a Marauder and a Tempest whose shot is in the air, and a Zealot after its first hit."""
    for kind in known(lab, ("Marauder", "Tempest", "Zealot")):
        for (pair,) in stage(lab, [(kind, sturdy(kind))], gap=lambda kind: 0.05 if kind == "Zealot" else 5.0):
            (first,) = _second_shots(lab, [pair]).values()
            if not first:
                continue
            lab.order(STOP, pair.attacker)
            lab.step(_LONGEST_LOOPS)
            attack(lab, [pair])
            flown = first[0][0] - (kind != "Zealot")
            before = lab.life(pair.target)
            lab.step(flown)
            lab.kill(pair.attacker)
            lab.step(40)
            yield kind, before - lab.life(pair.target)


@probe(
    "weapon.shared",
    measures="Loops from a unit's shot at something on the ground to one at something in the air, ordered at once.",
    settles="Whether the weapons of one unit share a cooldown.",
    unit="loops",
    exact=False,
)
def share(lab: Lab) -> Samples:
    """Have each fire at one, then at the other."""
    for kind in (kind for kind in ("Thor", "Queen", "Tempest", "Cyclone") if lab.has(kind)):
        for place in lab.ground.places(16, 16)[:8]:
            x, y = place
            near = apart(kind, "Nexus", 1.0)
            victim, attacker, flyer = lab.make(
                Put("Nexus", (x - 4, y), lab.victim),
                Put(kind, (x - 4 + near, y)),
                Put("Battlecruiser", (x + 4, y), lab.victim),
            )
            lab.order(ATTACK, attacker, target=victim)
            if not _until_hit(lab, victim):
                continue
            lab.order(ATTACK, attacker, target=flyer)
            begun = lab.loop
            if _until_hit(lab, flyer):
                yield kind, lab.loop - begun
            lab.clear()


@probe(
    "weapon.bunker",
    measures="World units between the edges of a Bunker with a Marine in it and the farthest target that it hits.",
    settles="Which range units in a Bunker gain, and from where it counts.",
    unit="world units",
    resolution=0.26,
)
def bunker(lab: Lab) -> Samples:
    """Offer targets at growing distances."""
    x, y = (int(part) + 0.5 for part in lab.ground.places(30, 16)[0])
    house, marine = lab.make(Put("Bunker", (x - 8, y)), Put("Marine", (x - 8, y + 3)))
    lab.order(SMART, marine, target=house)
    lab.step(60)
    farthest = 0.0
    for quarter in range(16, 34):
        (victim,) = lab.make(Put("Marauder", (x - 8 + apart("Bunker", "Marauder", quarter / 4), y), lab.victim))
        before = lab.life(victim)
        lab.order(ATTACK, house, target=victim)
        lab.step(40)
        if lab.life(victim) < before - NOTICEABLE:
            farthest = quarter / 4
        lab.kill(victim)
        lab.step()
    yield "Marine", farthest


PROBES = (period, delay, missile, reach, slop, interrupt, backswing, dead_attacker, share, bunker)
