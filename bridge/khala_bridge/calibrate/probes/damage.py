"""What a shot takes from whom: every pair of types, splash, bounces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.cast import apart, armed_types, fact, known, targets
from khala_bridge.calibrate.lab import ATTACK, ENEMY, Put
from khala_bridge.calibrate.probe import Samples, probe
from khala_bridge.calibrate.probes.pairs import attack, hits, period_loops, stage

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab

_WAIT_LOOPS = 40
"""Within which the first shot takes effect."""
_SPLASHERS: Final = (
    "SiegeTankSieged", "SiegeTank", "Colossus", "Archon", "Hellion", "Hellbat", "Ultralisk", "PlanetaryFortress",
    "LurkerBurrowed", "Thor", "Liberator", "Tempest",
)  # fmt: skip
_STEP = 0.25
_RINGS = 14
_PLACE = (26, 22)


@probe(
    "damage.pair",
    measures="Life and shields that one shot takes, of each armed type from each other type.",
    settles="Damage, bonuses, armor, and how many times a shot hits.",
    unit="life",
    resolution=0.3,
)
def pair(lab: Lab) -> Samples:
    """Let each fire, and count until half a period after the first hit."""
    wanted = [
        (attacker, target)
        for attacker in known(lab, armed_types())
        for target in known(lab, targets())
        if fact(attacker).hits(fact(target).planes)
    ]
    for pairs in stage(lab, wanted):
        firing = attack(lab, pairs)
        for pair, found in hits(lab, firing, _WAIT_LOOPS).items():
            if found:
                end = found[0][0] + 0.5 * period_loops(lab, pair.kind)
                yield f"{pair.kind} > {pair.against}", sum(lost for loop, lost in found if loop <= end)


@probe(
    "damage.splash",
    measures="Life that a shot takes from a Widow Mine, or a Medivac, so far behind or beside its target.",
    settles="Shapes of splash: which part of a unit must be within a radius, and where cones and lines begin.",
    unit="life",
    resolution=0.3,
)
def splash(lab: Lab) -> Samples:
    """Put one bystander for each shot, at growing distances, and count until half a period after the shot."""
    places = lab.ground.places(20, 10)
    for kind in known(lab, _SPLASHERS):
        air = all(weapon.targets == "air" for weapon in fact(kind).weapons)
        target, other = ("Overlord", "Medivac") if air else ("SupplyDepot", "WidowMine")
        cases = [(side, ring) for side in ("behind", "beside") for ring in range(_RINGS)]
        for start in range(0, len(cases), len(places)):
            batch = list(zip(cases[start : start + len(places)], places, strict=False))
            puts = []
            for (side, ring), (x, y) in batch:
                near = apart(kind, target, 2.5 if kind == "SiegeTankSieged" else 0.1)
                far = apart(target, other, ring * _STEP)
                at = (x - far, y) if side == "behind" else (x, y - far)
                puts += [Put(target, (x, y), ENEMY), Put(kind, (x + near, y)), Put(other, at, ENEMY)]
            tags = lab.make(*puts)
            half = 0.5 * period_loops(lab, kind)
            victims, others = tags[::3], tags[2::3]
            whole, before = [[lab.life(tag) for tag in some] for some in (victims, others)]
            lab.hold([*victims, *others])
            for victim, attacker in zip(victims, tags[1::3], strict=True):
                lab.order(ATTACK, attacker, target=victim)
            lost = [0.0] * len(batch)
            left = [_WAIT_LOOPS + half] * len(batch)  # the attacker may have turned on the bystander first
            for loop in range(int(_WAIT_LOOPS + half)):
                lab.step()
                for i, (victim, bystander) in enumerate(zip(victims, others, strict=True)):
                    if loop <= left[i]:
                        lost[i] = max(lost[i], before[i] - lab.life(bystander))
                    if lab.life(victim) < whole[i]:
                        left[i] = min(left[i], loop + half)
            for ((side, ring), _), life in zip(batch, lost, strict=True):
                yield f"{kind} {side} {ring * _STEP:.2f}", life
            lab.clear()


@probe(
    "damage.bounce",
    measures="Life that a Mutalisk's glaive takes from each of four Marauders in a row, from the one it is shot at on.",
    settles="To whom a glaive bounces, and what is left of its damage.",
    unit="life",
    resolution=0.3,
)
def bounce(lab: Lab) -> Samples:
    """Put two of them nearer to the first one than the third."""
    x, y = lab.ground.places(*_PLACE)[0]
    offsets = (0.0, 1.5, -2.0, 3.5)
    puts = [Put("Marauder", (x + dx, y), ENEMY) for dx in offsets]
    *victims, attacker = lab.make(*puts, Put("Mutalisk", (x, y + 2)))
    before = [lab.life(tag) for tag in victims]
    lab.hold(victims)
    lab.order(ATTACK, attacker, target=victims[0])
    for _ in range(int(period_loops(lab, "Mutalisk"))):
        lab.step()
        if lab.life(victims[0]) < before[0]:
            break
    lab.step(16)
    for name, tag, life in zip(("target", "1.5 east", "2 west", "3.5 east"), victims, before, strict=True):
        yield name, life - lab.life(tag)


PROBES = (pair, splash, bounce)
