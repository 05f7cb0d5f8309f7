"""What units do by themselves: when they see a target, which one they take, how far they go."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_bridge.calibrate.cast import known
from khala_bridge.calibrate.lab import ATTACK, ENEMY, MOVE, STOP, Put
from khala_bridge.calibrate.probe import Samples, probe

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab

_PLACE = (24, 16)
_TRIALS = 16
_BODIES = 0.375 + 1.125  # radii of a Marine and a Pylon
_CANDIDATES = (
    ("Zealot", "Pylon"), ("Zealot", "Probe"), ("Zealot", "HighTemplar"), ("Zealot", "Immortal"), ("Zealot", "Overlord"),
    ("Zealot", "Observer"), ("Zealot", "PhotonCannon"), ("Zealot", "Larva"), ("Marine", "Medivac"), ("Marine", "SCV"),
    ("Marine", "Bunker"), ("Marine", "SupplyDepot"), ("Zergling", "Baneling"), ("Zergling", "Queen"),
    ("Zergling", "SpineCrawler"), ("Probe", "Pylon"), ("Medivac", "SupplyDepot"),
)  # fmt: skip
"""Two types in reach of a Marine, the second one 0.5 nearer."""


@probe(
    "target.choice",
    measures="1 if an idle Marine shoots at the first of two types in reach, 0 if at the second, which is nearer.",
    settles="Which targets of equal priority come first, and what counts as a threat.",
    unit="share",
)
def choice(lab: Lab) -> Samples:
    """Offer each pair once; nobody shoots back, because all hold and the Marine is out of their sight for a loop."""
    places = lab.ground.places(*_PLACE)
    cases = [case for case in _CANDIDATES if lab.has(*case)]
    for start in range(0, len(cases), len(places)):
        batch = list(zip(cases[start : start + len(places)], places, strict=False))
        puts = []
        for (far, near), (x, y) in batch:
            puts += [Put(far, (x, y + 4), ENEMY), Put(near, (x, y - 3.5), ENEMY), Put("Marine", (x, y))]
        tags = lab.make(*puts)
        before = {tag: lab.life(tag) for tag in tags}
        lab.hold(tag for tag in tags if lab.units[tag].owner == ENEMY)
        shot: dict[int, float] = {}
        for _ in range(30):
            lab.step()
            for i in range(len(batch)):
                first, second, _ = tags[3 * i : 3 * i + 3]
                for tag, value in ((first, 1.0), (second, 0.0)):
                    if lab.life(tag) < before[tag] - 0.4:
                        shot.setdefault(i, value)
        for i, ((far, near), _) in enumerate(batch):
            if i in shot:
                yield f"{far} or {near}", shot[i]
        lab.clear()


@probe(
    "target.scan",
    measures="Loops from when an enemy is made in reach of an idle Marine to the order of its attack.",
    settles="How often units look for targets.",
    unit="loops",
    exact=False,
)
def scan(lab: Lab) -> Samples:
    """Make enemies at different moments."""
    places = lab.ground.places(*_PLACE)[:8]
    for trial in range(2):
        marines = lab.make(*(Put("Marine", place) for place in places))
        lab.step(40)
        for i, (marine, (x, y)) in enumerate(zip(marines, places, strict=True)):
            lab.step(1 + (3 * i + trial) % 5)
            lab.make(Put("Pylon", (x, y + 4), ENEMY))
            begun = lab.loop
            while lab.loop < begun + 40 and not _attacks(lab, marine):
                lab.step()
            yield "Marine", lab.loop - begun
        lab.clear()


def _attacks(lab: Lab, tag: int) -> bool:
    return bool(lab.units[tag].orders or lab.units[tag].engaged_target_tag)


@probe(
    "target.look_up",
    measures="Loops from when an enemy that fights comes, to the first hit on it by a Marine that shot at a structure.",
    settles="When a unit that fires turns to a better target.",
    unit="loops",
    exact=False,
)
def look_up(lab: Lab) -> Samples:
    """Let it acquire the structure by itself first."""
    places = lab.ground.places(*_PLACE)[:_TRIALS]
    lab.make(*(put for x, y in places for put in (Put("Marine", (x, y)), Put("Pylon", (x, y + 4), ENEMY))))
    lab.step(50)
    for i, (x, y) in enumerate(places):
        lab.step(1 + (5 * i) % 7)
        (enemy,) = lab.make(Put("Zealot", (x, y - 4), ENEMY))
        lab.hold([enemy])
        begun = lab.loop
        before = lab.life(enemy)
        while lab.loop < begun + 80 and lab.life(enemy) > before - 0.4:
            lab.step()
        yield "Marine", lab.loop - begun


@probe(
    "target.switch",
    measures="1 if a Zealot on its way to a target changes to an equal one that is nearer, 0 if it goes on.",
    settles="Whether a pursuer that nothing stops changes to a nearer target.",
    unit="share",
)
def switch(lab: Lab) -> Samples:
    """Offer second targets that are nearer by more and more."""
    places = lab.ground.places(30, 14)
    gains = [0.25 * i for i in range(14)]
    for start in range(0, len(gains), len(places)):
        batch = list(zip(gains[start : start + len(places)], places, strict=False))
        tags = lab.make(
            *(put for _, (x, y) in batch for put in (Put("Zealot", (x, y)), Put("Pylon", (x + 9, y), ENEMY)))
        )
        for zealot, pylon in zip(tags[::2], tags[1::2], strict=True):
            lab.order(ATTACK, zealot, point=(lab.at(pylon)[0] + 3, lab.at(pylon)[1]))
        lab.step(12)
        extra = []
        for (gain, _), zealot, pylon in zip(batch, tags[::2], tags[1::2], strict=True):
            (zx, zy), (px, _) = lab.at(zealot), lab.at(pylon)
            away = px - zx - gain
            extra.append(Put("Pylon", (zx + 0.5 * away, zy + math.sqrt(0.75) * away), ENEMY))
        second = lab.make(*extra)
        lab.step(16)
        for zealot, other in zip(tags[::2], second, strict=True):
            if other:
                yield "Zealot", float(lab.units[zealot].engaged_target_tag == other)
        lab.clear()


@probe(
    "target.guard",
    measures="Farthest gap at which a Marine that has attacked its way to a point notices an enemy.",
    settles="How much farther a unit looks at the end of an attack-move.",
    unit="world units",
    resolution=0.26,
)
def guard(lab: Lab) -> Samples:
    """Make structures at growing distances from Marines that have arrived, and take the farthest that is attacked."""
    places = lab.ground.places(*_PLACE)
    gaps = [4.5 + 0.25 * i for i in range(16)]
    farthest = 0.0
    for start in range(0, len(gaps), len(places)):
        batch = list(zip(gaps[start : start + len(places)], places, strict=False))
        marines = lab.make(*(Put("Marine", (x, y)) for _, (x, y) in batch))
        for marine, (_, (x, y)) in zip(marines, batch, strict=True):
            lab.order(ATTACK, marine, point=(x + 1, y))
        lab.step(40)
        tried = [(marine, gap) for marine, (gap, _) in zip(marines, batch, strict=True)]
        lab.make(*(Put("Pylon", (lab.at(m)[0] + gap + _BODIES, lab.at(m)[1]), ENEMY) for m, gap in tried))
        lab.step(16)
        farthest = max([farthest, *(gap for marine, gap in tried if _attacks(lab, marine))])
        lab.clear()
    yield "Marine", farthest


@probe(
    "target.flee",
    measures="World units that a unit which does not fight has run 60 loops after a Marine shot at it from 4 away.",
    settles="Which types flee, and how far.",
    unit="world units",
    resolution=0.5,
)
def flee(lab: Lab) -> Samples:
    """Hit each, and send the Marine away."""
    kinds = known(
        lab, ("Probe", "SCV", "Drone", "Overlord", "Medivac", "HighTemplar", "Observer", "WarpPrism", "Infestor")
    )
    for kind, (x, y) in zip(kinds, lab.ground.places(30, 16), strict=False):
        victim, attacker = lab.make(Put(kind, (x, y)), Put("Marine", (x + 4, y), ENEMY))
        lab.order(ATTACK, attacker, target=victim)
        before = lab.at(victim)
        life = lab.life(victim)
        for _ in range(30):
            lab.step()
            if lab.life(victim) < life - 0.4:
                break
        lab.order(MOVE, attacker, point=(x + 14, y))  # it lives: nobody flees from the dead
        lab.step(60)
        yield kind, math.dist(before, lab.at(victim))
        lab.clear()


@probe(
    "target.leash",
    measures="How far an idle Zealot follows an enemy, and how far from its place it stands in the end.",
    settles="How far idle units give chase, and how exactly they return.",
    unit="world units",
    resolution=0.3,
)
def leash(lab: Lab) -> Samples:
    """Let an enemy that is as fast walk past it, and vanish."""
    x, y = lab.ground.places(60, 8)[0]
    zealot, lure = lab.make(Put("Zealot", (x - 27, y)), Put("Stalker", (x - 23, y), ENEMY))
    home = lab.at(zealot)
    lab.order(MOVE, lure, point=(x + 28, y))
    farthest = 0.0
    for _ in range(300):
        lab.step()
        distance = math.dist(home, lab.at(zealot))
        if distance < farthest - 0.5:
            break
        farthest = max(farthest, distance)
    lab.kill(lure)
    lab.step(260)
    yield "chase", farthest
    yield "return", math.dist(home, lab.at(zealot))


@probe(
    "target.turret",
    measures="Loops to the first hit by a turret on a target behind it, after it had shot ahead and waited.",
    settles="Whether a turret without a target keeps its direction.",
    unit="loops",
    resolution=1.0,
)
def turret(lab: Lab) -> Samples:
    """Shoot east, wait, then shoot west; and once more to the east, where the turret may still point."""
    for kind in known(lab, ("Immortal", "SiegeTank", "Thor", "Hellion", "Cyclone")):
        x, y = lab.ground.places(30, 10)[0]
        unit, east, west = lab.make(
            Put(kind, (x, y)), Put("Nexus", (x + 6, y), lab.victim), Put("Nexus", (x - 6, y), lab.victim)
        )
        for side, victim in (("first", east), ("behind", west), ("back", east)):
            lab.order(ATTACK, unit, target=victim)
            begun = lab.loop
            before = lab.life(victim)
            while lab.loop < begun + 90 and lab.life(victim) > before - 0.4:
                lab.step()
            if side != "first":
                yield f"{kind}, {side}", lab.loop - begun
            lab.order(STOP, unit)
            lab.step(90)
        lab.clear()


@probe(
    "target.structure",
    measures="1 if a unit that idles 3 away from an enemy's structure goes for it within 60 loops.",
    settles="Who acquires structures.",
    unit="share",
)
def structure(lab: Lab) -> Samples:
    """Wait."""
    kinds = known(lab, ("Baneling", "Zergling", "Marine", "Raven", "Disruptor", "Probe", "Queen", "Banshee"))
    places = lab.ground.places(*_PLACE)
    tags = lab.make(
        *(
            put
            for kind, (x, y) in zip(kinds, places, strict=False)
            for put in (Put(kind, (x, y)), Put("Pylon", (x + 4.5, y), ENEMY))
        )
    )
    gone: set[int] = set()
    for _ in range(60):
        lab.step()
        gone |= {tag for tag in tags[::2] if tag not in lab.units or _attacks(lab, tag)}
    yield from ((kind, float(tag in gone)) for kind, tag in zip(kinds, tags[::2], strict=False))


PROBES = (choice, scan, look_up, switch, guard, flee, leash, turret, structure)
