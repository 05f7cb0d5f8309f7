"""Whole fights, and whole opponents: what all rules come to."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.cast import fact
from khala_bridge.calibrate.lab import ATTACK, ENEMY, GameOver, Put
from khala_bridge.calibrate.probe import MELEE, Samples, probe
from khala_bridge.knowledge.load import is_worker

if TYPE_CHECKING:
    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

DUELS: Final = (
    ("Marine", "Zergling"), ("Marine", "Zealot"), ("Marine", "Roach"), ("Marauder", "Stalker"), ("Marauder", "Roach"),
    ("Hellbat", "Zergling"), ("Hellion", "Zealot"), ("SiegeTank", "Stalker"), ("Thor", "Ultralisk"),
    ("Banshee", "Hydralisk"), ("VikingFighter", "Corruptor"), ("Battlecruiser", "VoidRay"), ("Zealot", "Zergling"),
    ("Zealot", "Roach"), ("Stalker", "Hydralisk"), ("Immortal", "Roach"), ("Archon", "Mutalisk"),
    ("Colossus", "Hydralisk"), ("Adept", "Zergling"), ("Phoenix", "Mutalisk"),
)  # fmt: skip
REPEATS: Final = 10
_VALUE: Final = 900
"""Minerals and vespene of each side; counts are rounded."""
_PLACE: Final = (26, 20)
_MOST_LOOPS: Final = 900

_GAMES: Final = 8
_MINUTE: Final = 1344


@probe(
    "fight.duel",
    measures="Share of its value that the first type has left, minus that of the second, after a fight of equal cost.",
    settles="What all rules of movement and combat come to.",
    unit="share",
    exact=False,
)
def duel(lab: Lab) -> Samples:
    """Fight each duel ten times, with the sides swapped every second time."""
    fights = [pair for pair in DUELS if lab.has(*pair) for _ in range(REPEATS)]
    places = lab.ground.places(*_PLACE)
    for start in range(0, len(fights), len(places)):
        batch = list(zip(fights[start : start + len(places)], places, strict=False))
        puts: list[Put] = []
        sides: list[tuple[range, range]] = []
        for index, (pair, at) in enumerate(batch):
            mine = pair if (start + index) % 2 else pair[::-1]
            begun = len(puts)
            puts += _rows(mine[0], at, -8.0)
            middle = len(puts)
            puts += _rows(mine[1], at, 8.0, ENEMY)
            sides.append((range(begun, middle), range(middle, len(puts))))
        tags = lab.make(*puts)
        for (ours, theirs), (_, (x, y)) in zip(sides, batch, strict=True):
            lab.order(ATTACK, [tags[i] for i in ours], point=(x + 4, y))
            lab.order(ATTACK, [tags[i] for i in theirs], point=(x - 4, y))
        left: dict[int, list[float]] = {}
        begun = lab.loop
        while lab.loop < begun + _MOST_LOOPS and len(left) < len(batch):
            lab.step(8)
            for index, armies in enumerate(sides):
                alive = [[tags[i] for i in side if tags[i] in lab.units] for side in armies]
                over = not all(alive) or lab.loop >= begun + _MOST_LOOPS
                if over and index not in left:
                    left[index] = [len(some) / len(side) for some, side in zip(alive, armies, strict=True)]
                    lab.kill(*alive[0], *alive[1])  # or they would join another fight
        for index, (kinds, _) in enumerate(batch):
            first, second = left[index] if (start + index) % 2 else left[index][::-1]
            yield f"{kinds[0]} against {kinds[1]}", first - second
        lab.clear()


def _rows(kind: str, at: Point, side: float, owner: int = 1) -> list[Put]:
    count = max(1, round(_VALUE / fact(kind).value))
    step = max(2.2 * fact(kind).radius, 0.8)
    outwards = 1 if side > 0 else -1
    return [
        Put(kind, (at[0] + side + outwards * step * (i // 8), at[1] + step * (i % 8 - min(count, 8) / 2 + 0.5)), owner)
        for i in range(count)
    ]


@probe(
    "opponent.growth",
    measures="Workers, army (value) and structures (value) of a computer player of each level after 3 minutes.",
    settles="What the levels of computer players mean.",
    unit="units, resources",
    exact=False,
    setting=MELEE,
)
def growth(lab: Lab) -> Samples:
    """Play eight games of each level, and do nothing."""
    for level in range(1, 11):
        for game in range(_GAMES):
            setting = replace(MELEE, level=level, peaceful=False)
            lab.begin(setting, lab.seed * 1000 + level * 100 + game)
            try:
                for _ in range(3):
                    lab.step(_MINUTE)
            except GameOver:
                continue
            theirs = [lab.name_of.get(unit.unit_type, "") for unit in lab.units.values() if unit.owner == ENEMY]
            army = [kind for kind in theirs if kind and not fact(kind).structure and not is_worker(kind)]
            yield f"level {level}: workers", sum(map(is_worker, theirs))
            yield f"level {level}: army", sum(fact(kind).value for kind in army)
            yield (
                f"level {level}: structures",
                sum(fact(kind).value for kind in theirs if kind and fact(kind).structure),
            )


PROBES = (duel, growth)
