"""Abilities that do something to a target: when it comes, what it takes, how far it reaches."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from khala_bridge.calibrate.cast import fact
from khala_bridge.calibrate.lab import ENEMY, HOLD, MOVE, SMART, Put
from khala_bridge.calibrate.probe import Samples, probe

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab


class Spell(NamedTuple):
    """One ability, and at whom it is tried; ids are those of the API."""

    name: str
    caster: str
    ability: int
    target: str
    at_point: bool = False


SPELLS: Final = (
    Spell("EMP", "Ghost", 1628, "Immortal", at_point=True),
    Spell("Steady Targeting", "Ghost", 2714, "SwarmHost"),
    Spell("Yamato Cannon", "Battlecruiser", 401, "Thor"),
    Spell("Fungal Growth", "Infestor", 74, "Roach", at_point=True),
    Spell("Neural Parasite", "Infestor", 249, "Stalker"),
    Spell("Psionic Storm", "HighTemplar", 1036, "Roach", at_point=True),
    Spell("Feedback", "HighTemplar", 140, "HighTemplar"),
    Spell("Interference Matrix", "Raven", 3747, "Immortal"),
    Spell("Anti-Armor Missile", "Raven", 3753, "Roach"),
    Spell("Abduct", "Viper", 2067, "Roach"),
    Spell("Blinding Cloud", "Viper", 2063, "Roach", at_point=True),
    Spell("Parasitic Bomb", "Viper", 2542, "VoidRay"),
    Spell("Caustic Spray", "Corruptor", 2324, "SupplyDepot"),
    Spell("Corrosive Bile", "Ravager", 2338, "SupplyDepot", at_point=True),
    Spell("Revelation", "Oracle", 2146, "Roach", at_point=True),
    Spell("Purification Nova", "Disruptor", 2346, "Roach", at_point=True),
    Spell("Widow Mine", "WidowMineBurrowed", 2099, "Roach"),
    Spell("Lock On", "Cyclone", 2350, "Roach"),
    Spell("Graviton Beam", "Phoenix", 173, "Roach"),
)
_AREAS: Final = ("EMP", "Fungal Growth", "Psionic Storm", "Corrosive Bile", "Blinding Cloud", "Purification Nova")
_CHANNELS: Final = ("Lock On", "Caustic Spray", "Neural Parasite", "Graviton Beam")
"""What ends with its caster."""
_PLACE: Final = (26, 14)
_WAIT_LOOPS: Final = 200


class _Cast(NamedTuple):
    spell: Spell
    caster: int
    target: int
    others: tuple[int, ...]


def _mark(lab: Lab, tag: int) -> tuple[object, ...]:
    """Return what a spell may change of a unit."""
    unit = lab.units.get(tag)
    if unit is None:
        return ()
    return round(unit.health + unit.shield), tuple(sorted(unit.buff_ids)), unit.owner, unit.is_flying


def _cast(
    lab: Lab, distance: float, *, names: tuple[str, ...] = (), around: tuple[float, ...] = ()
) -> Iterator[list[_Cast]]:
    """Cast every spell of these names, all if there is none, at a target so far away; yield once they are ordered.

    Args:
        lab: the game.
        distance: between the middles of caster and target.
        names: of spells.
        around: distances from the target at which there are others of its type, one in each direction.
    """
    spells = [spell for spell in SPELLS if lab.has(spell.caster, spell.target) and (not names or spell.name in names)]
    places = lab.ground.places(*_PLACE)
    for start in range(0, len(spells), len(places)):
        batch = list(zip(spells[start : start + len(places)], places, strict=False))
        puts: list[Put] = []
        for spell, (x, y) in batch:
            goal = (x - 4, y)
            puts += [Put(spell.caster, (x - 4 + distance, y)), Put(spell.target, goal, ENEMY)]
            puts += [Put(spell.target, _round(goal, i, len(around), away), ENEMY) for i, away in enumerate(around)]
        lab.cheat("tech_tree")
        tags = lab.make(*puts)
        size = 2 + len(around)
        casts = [
            _Cast(spell, tags[size * i], tags[size * i + 1], tuple(tags[size * i + 2 : size * i + size]))
            for i, (spell, _) in enumerate(batch)
        ]
        lab.hold(tag for tag in tags if tag in lab.units and lab.units[tag].owner == ENEMY)
        for cast in casts:
            if fact(cast.spell.caster).energy:
                lab.set(cast.caster, Energy=200.0)
            lab.set(cast.target, Energy=150.0)
        lab.step()
        yield [cast for cast in casts if _order(lab, cast)]
        lab.clear()


def _round(goal: Point, index: int, count: int, away: float) -> Point:
    angle = math.pi / 2 + math.tau * index / count / 2  # in the half that is away from the caster
    return goal[0] + away * math.cos(angle), goal[1] + away * math.sin(angle)


def _order(lab: Lab, cast: _Cast) -> bool:
    if cast.caster not in lab.units or cast.target not in lab.units:  # burrowed mines fire by themselves
        return False
    if cast.spell.at_point:
        return lab.order(cast.spell.ability, cast.caster, point=lab.at(cast.target))
    return lab.order(cast.spell.ability, cast.caster, target=cast.target)


@probe(
    "spell.delay",
    measures="Loops from the order of an ability to its first effect, on a target 4 and 6.5 away.",
    settles="How long casters prepare, and how fast what they send flies.",
    unit="loops",
    resolution=1.0,
)
def delay(lab: Lab) -> Samples:
    """Watch life, buffs and owner of each target."""
    for distance in (4.0, 6.5):
        for casts in _cast(lab, distance):
            before = {cast: _mark(lab, cast.target) for cast in casts}
            begun = lab.loop
            for _ in range(_WAIT_LOOPS):
                lab.step()
                for cast in [cast for cast, mark in before.items() if _mark(lab, cast.target) != mark]:
                    del before[cast]
                    yield f"{cast.spell.name} at {distance:g}", lab.loop - begun


@probe(
    "spell.damage",
    measures="Life and shields that a target has lost 200 loops after the order.",
    settles="What abilities take.",
    unit="life",
    resolution=1.0,
)
def damage(lab: Lab) -> Samples:
    """Remove the caster once its ability has come, so that it does not shoot as well."""
    for casts in _cast(lab, 5.0):
        before = {cast: lab.life(cast.target) for cast in casts}
        least = dict(before)
        for _ in range(_WAIT_LOOPS):
            lab.step()
            least = {cast: min(life, lab.life(cast.target)) for cast, life in least.items()}
            done = [cast for cast, life in least.items() if life < before[cast]]
            lab.kill(*(cast.caster for cast in done if cast.spell.name not in _CHANNELS))
        for cast, life in before.items():
            yield cast.spell.name, life - least[cast]


@probe(
    "spell.area",
    measures="World units between the middles of an ability's area and of the farthest unit that it touches.",
    settles="Which part of a unit must be within the area of an ability.",
    unit="world units",
    resolution=0.3,
)
def area(lab: Lab) -> Samples:
    """Have units stand at growing distances; the answer is between the farthest touched and the nearest other one."""
    touched: dict[str, float] = {}
    spared: dict[str, float] = {}
    for first in (1.0, 1.8, 2.6):
        around = tuple(first + 0.2 * i for i in range(4))
        for casts in _cast(lab, 7.0, names=_AREAS, around=around):
            goal = {cast: lab.at(cast.target) for cast in casts}
            before = {
                (cast, tag): (_mark(lab, tag), math.dist(goal[cast], lab.at(tag)))
                for cast in casts
                for tag in cast.others
            }
            for _ in range(90):
                lab.step()
                for (cast, tag), (mark, away) in list(before.items()):
                    name = cast.spell.name
                    if _mark(lab, tag) != mark:
                        touched[name] = max(touched.get(name, 0.0), away)
                        del before[cast, tag]
            for (cast, _), (_, away) in before.items():
                spared[cast.spell.name] = min(spared.get(cast.spell.name, math.inf), away)
    yield from ((name, (touched[name] + spared[name]) / 2) for name in touched.keys() & spared.keys())


@probe(
    "spell.knockback",
    measures="World units that a KD8 charge throws a Marine, and in how many loops.",
    settles="How long and how far units are thrown.",
    unit="world units, loops",
    resolution=1.0,
)
def knockback(lab: Lab) -> Samples:
    """Throw at its side."""
    x, y = lab.ground.places(*_PLACE)[0]
    reaper, marine = lab.make(Put("Reaper", (x + 4, y)), Put("Marine", (x, y), ENEMY))
    lab.order(HOLD, marine)
    lab.order(2588, reaper, point=(x + 0.6, y))
    home = lab.at(marine)
    moved = 0
    lab.step()
    lab.order(MOVE, reaper, point=(x + 11, y), queue=True)
    for _ in range(120):
        was = lab.at(marine)
        lab.step()
        if marine not in lab.units:
            return
        moved += math.dist(was, lab.at(marine)) > 0.01
        if moved and math.dist(was, lab.at(marine)) <= 0.01:
            break
    yield "distance", math.dist(home, lab.at(marine))
    yield "loops", moved


@probe(
    "spell.swoop",
    measures="Loops until a locust that swoops to a place 3 and 5.5 away has landed.",
    settles="How fast a locust swoops down.",
    unit="loops",
    resolution=1.0,
)
def swoop(lab: Lab) -> Samples:
    """Count flying locusts."""
    x, y = lab.ground.places(*_PLACE)[0]
    for distance in (3.0, 5.5):
        (locust,) = lab.make(Put("LocustFlying", (x - 5, y)))
        lab.order(2387, locust, point=(x - 5 + distance, y))
        begun = lab.loop
        lab.step(2)
        while lab.loop < begun + 150 and (lab.of("LocustFlying") or _is_far(lab, (x - 5 + distance, y))):
            lab.step()
        yield f"{distance:g}", lab.loop - begun
        lab.clear()


def _is_far(lab: Lab, goal: Point) -> bool:
    return all(math.dist(lab.at(tag), goal) > 0.3 for tag in lab.of("Locust"))


@probe(
    "spell.tumor",
    measures="Loops from the order of a tumor to plant another one 4 and 9 away, to its end.",
    settles="How fast tumors are thrown, and how long they grow.",
    unit="loops",
    resolution=3.0,
)
def tumor(lab: Lab) -> Samples:
    """Use the creep of a Hatchery."""
    x, y = (int(part) + 0.5 for part in lab.ground.places(34, 30)[0])
    lab.make(Put("Hatchery", (x, y)))
    lab.step(900)
    tumors = lab.make(Put("CreepTumorBurrowed", (x - 5.5, y - 4.5)), Put("CreepTumorBurrowed", (x - 5.5, y + 4.5)))
    lab.step(400)
    begun = lab.loop
    left = {}
    for distance, tag, side in ((4, tumors[0], -4.5), (9, tumors[1], 4.5)):
        if lab.order(1733, tag, point=(x - 5.5 + distance, y + side)):
            left[distance] = (x - 5.5 + distance, y + side)
    while left and lab.loop < begun + 500:
        lab.step()
        grown = [lab.at(tag) for kind in ("CreepTumorBurrowed", "CreepTumor") for tag in lab.of(kind)
                 if lab.units[tag].build_progress >= 1]  # fmt: skip
        reached = (distance for distance, at in left.items() if any(math.dist(at, other) < 1.5 for other in grown))
        for distance in list(reached):
            del left[distance]
            yield str(distance), lab.loop - begun
    lab.clear()
    lab.step(900)


@probe(
    "spell.load",
    measures="Loops until a Medivac has let eight Marines out, and a Bunker four; and until it has taken them in.",
    settles="How fast transports load and unload.",
    unit="loops",
    resolution=2.0,
)
def load(lab: Lab) -> Samples:
    """Order all at once."""
    for kind, count, out in (("Medivac", 8, 396), ("Bunker", 4, 408)):
        x, y = (int(part) + 0.5 for part in lab.ground.places(*_PLACE)[0])
        ship, *marines = lab.make(Put(kind, (x, y)), *(Put("Marine", (x - 3 + 0.9 * i, y - 3)) for i in range(count)))
        lab.order(SMART, marines, target=ship)
        begun = lab.loop
        while lab.loop < begun + 200 and any(tag in lab.units for tag in marines):
            lab.step()
        yield f"{kind} takes in", lab.loop - begun
        begun = lab.loop
        lab.order(out, ship, point=lab.at(ship) if kind == "Medivac" else None)
        while lab.loop < begun + 300 and not all(tag in lab.units for tag in marines):
            lab.step()
        yield f"{kind} lets out", lab.loop - begun
        lab.clear()


PROBES = (delay, damage, area, knockback, swoop, tumor, load)
