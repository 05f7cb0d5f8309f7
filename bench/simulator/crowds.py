"""Measure how crowds move and fight in the simulator: who reaches whom, how soon, and that no side is favoured.

    python -m bench crowds                      every experiment
    python -m bench crowds --picture FILE       three moments of the first one instead, as a picture
    python -m bench crowds --mirrors 500        fights of equal armies instead: who wins, by side, owner and order

What must come out follows from perimeters. A melee unit of radius r and range R reaches a target of radius t when their
centres are r + t + R apart, and stands s, its separation radius, away from others: round one target fit
pi / asin(s / (r + t + R)) of them. Round a group it is the perimeter of the hull of its centres plus the circle's,
divided by 2 s. `fit` is that bound, for Zerglings taken at every loop for the Zealots that live then and at most the
number of Zerglings.

Ranged units that come as far as their range and stop there stand in one row, on a circle: `fit deg` is the angle of it
that all of them cover shoulder to shoulder. Units that walk in single file at speed v pass a point every 2 s / v:
`file s` is how long the last one comes after the first, through a gap in one file, round a target in one to each side.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np
from rich.console import Console

from bench.command_line import make_parser
from bench.tables import WIDEST
from khala_sc2.experiment.statistics import wilson
from khala_simulator.abilities import commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.maps.game_map import map_from
from khala_simulator.maps.scenario_file import parse_scenario
from khala_simulator.tick import advance
from khala_simulator.world.players import PlayerSetup
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import GameMap

Place = tuple[float, float]

PLAIN: Final = """
name: crowds
family: bench
title: Open ground, no script
terrain: debug_plain
visibility: {fog: false, black_mask: false}
players:
  1: {race: zerg, control: agent}
  2: {race: protoss, control: agent}
"""
PLAYERS: Final = (PlayerSetup(1, "zerg", "agent"), PlayerSetup(2, "protoss", "agent"))
MIDDLE: Final = (25.0, 25.0)
WALLS: Final = 9999
"""A slot that no unit has, for cells that are blocked."""
FOREVER: Final = 1e6
MOST_LOOPS: Final = 1600
AGAIN_LOOPS: Final = 400
ARC_LOOPS: Final = 300
SECOND: Final = 22.4
EDGE: Final = 1e-9
BATTLES: Final[dict[str, dict[str, int]]] = {
    "Zerglings": {"Zergling": 16},
    "Zealots and Stalkers": {"Zealot": 5, "Stalker": 4},
    "Marines and Marauders": {"Marine": 8, "Marauder": 3},
    "Roaches, Zerglings, Banelings": {"Roach": 4, "Zergling": 10, "Baneling": 3},
    "Hellbats and Marines": {"HellionTank": 4, "Marine": 6},
}


@lru_cache(maxsize=1)
def plain() -> GameMap:
    """Return an open map without a script."""
    return map_from(parse_scenario(PLAIN, "crowds.yaml"), PLAIN)


def fresh(seed: int) -> World:
    """Return an empty world."""
    return World(plain(), PLAYERS, seed=seed)


def put(world: World, name: str, owner: int, places: Iterable[Place]) -> list[int]:
    """Put units of a type on places; return their slots."""
    kind = world.catalog.unit(name)
    return [lifecycle.spawn(world, kind, owner, place) for place in places]


def block(count: int, columns: int, centre: Place, gap: float) -> list[Place]:
    """Return places in rows of so many columns, ``gap`` apart, around a centre."""
    rows = math.ceil(count / columns)
    x0, y0 = centre[0] - (columns - 1) * gap / 2, centre[1] - (rows - 1) * gap / 2
    return [(x0 + i % columns * gap, y0 + i // columns * gap) for i in range(count)]


def still(world: World, slots: Sequence[int]) -> None:
    """Make units stand, not fight and not die."""
    for slot in slots:
        buffs.apply(world, slot, "LurkerHoldFireB")
        world.life[slot] = world.life_max[slot] = FOREVER
    commands.hold(world, list(slots))


def alive(world: World, slots: Sequence[int]) -> list[int]:
    """Return those of units (slots, none used again) that live."""
    return [slot for slot in slots if world.alive[slot] and world.life[slot] > 0.0]


# who fits where -------------------------------------------------------------------------------------------------------


def fits_around(world: World, attacker: str, target: str) -> float:
    """Return how many of one type fit round one target of another, as the perimeter has it."""
    fighter, other = world.catalog.unit(attacker), world.catalog.unit(target)
    reach = max(fighter.radius + other.radius + fighter.weapons[0].range, fighter.separation + other.separation)
    return math.pi / math.asin(min(fighter.separation / reach, 1.0))


def fits_around_group(world: World, attacker: str, targets: Sequence[int]) -> float:
    """Return how many of one type fit round several targets: groups that touch have one hull, others one each."""
    kind = world.catalog.unit(attacker)
    left = set(targets)
    places = 0.0
    while left:
        group = _touching(world, left, 2 * kind.separation)
        left -= group
        radius = kind.radius + float(world.radius[min(group)]) + kind.weapons[0].range
        hull = cv2.convexHull(world.pos[sorted(group)].astype(np.float32))
        around = 2 * math.dist(*hull[:, 0]) if len(hull) == 2 else cv2.arcLength(hull, closed=True)
        places += (around + 2 * math.pi * radius) / (2 * kind.separation)
    return places


def _touching(world: World, slots: set[int], room: float) -> set[int]:
    """Return one of the groups in which no attacker fits between neighbours."""
    group = set()
    edge = {min(slots)}
    while edge:
        group |= edge
        edge = {
            s
            for s in slots - group
            if any(
                math.dist(world.pos[s], world.pos[o]) < world.separation[s] + world.separation[o] + room for o in edge
            )
        }
    return group


def arc_of(world: World, attacker: str, target: str, count: int) -> float:
    """Return the angle in degrees that a row of units covers at the distance at which they reach a target."""
    fighter, other = world.catalog.unit(attacker), world.catalog.unit(target)
    return math.degrees(
        2.0 * count * math.asin(fighter.separation / (fighter.radius + other.radius + fighter.weapons[0].range))
    )


def file_of(world: World, slots: list[int]) -> float:
    """Return how many seconds the last of units of one type in single file comes after the first."""
    return (len(slots) - 1) * 2.0 * float(world.separation[slots[0]]) / float(world.step_max[slots[0]]) / SECOND


# experiments ----------------------------------------------------------------------------------------------------------


@dataclass
class Shares:
    """How many of one side's melee units are in reach, loop by loop from the first blow on."""

    reached: list[int] = field(default_factory=list)
    living: list[int] = field(default_factory=list)
    fit: list[float] = field(default_factory=list)

    def note(self, world: World, attackers: list[int], targets: list[int], name: str) -> None:
        reached = int(world.in_reach[attackers].sum())
        if self.reached or reached:
            self.reached.append(reached)
            self.living.append(len(attackers))
            self.fit.append(min(fits_around_group(world, name, targets), len(attackers)))

    def at(self, second: float) -> float:
        """Return the share in reach of those that live, so long after the first blow."""
        loop = min(int(second * SECOND), len(self.reached) - 1)
        return self.reached[loop] / max(self.living[loop], 1)

    @property
    def of_living(self) -> float:
        return sum(self.reached) / max(sum(self.living), 1)

    @property
    def of_fit(self) -> float:
        return sum(self.reached) / max(sum(self.fit), 1e-9)


Block = tuple[str, int, int]
"""A type, how many, and in how many columns."""


def meet(seed: int, attackers: Block, targets: Block) -> tuple[World, list[int], list[int]]:
    """Return a world with two blocks on attack-move to each other's place, and their slots."""
    world = fresh(seed)
    rng = np.random.default_rng(seed)
    x, y = MIDDLE
    mine = put(world, attackers[0], 1, _shaken(rng, block(*attackers[1:], (x - 8, y), 0.8)))
    theirs = put(world, targets[0], 2, _shaken(rng, block(*targets[1:], (x + 2, y), 0.9)))
    commands.attack_move(world, mine, (x + 12, y))
    commands.attack_move(world, theirs, (x - 8, y))
    return world, mine, theirs


def swarm(seed: int, attackers: Block, targets: Block) -> dict[str, float]:
    """Play a fight of two blocks; return the shares of the first that are in reach, and who lives."""
    world, mine, theirs = meet(seed, attackers, targets)
    shares = Shares()
    while (left := alive(world, mine)) and (foes := alive(world, theirs)) and world.loop < MOST_LOOPS:
        advance(world)
        shares.note(world, left, foes, attackers[0])
    return {
        "reach 1 s": shares.at(1.0),
        "2 s": shares.at(2.0),
        "4 s": shares.at(4.0),
        "reach": shares.of_living,
        "reach of fit": shares.of_fit,
        "left": len(alive(world, mine)),
        "foes left": len(alive(world, theirs)),
        "won": float(bool(alive(world, mine)) and not alive(world, theirs)),
    }


def _shaken(rng: np.random.Generator, places: list[Place]) -> list[Place]:
    return [
        (x + dx, y + dy) for (x, y), (dx, dy) in zip(places, rng.uniform(-0.03, 0.03, (len(places), 2)), strict=True)
    ]


def ring(seed: int, attacker: str, target: str, count: int = 20) -> dict[str, float]:
    """Send a block of one type to one target that stands; return how many reach it, and when the last came."""
    world = fresh(seed)
    rng = np.random.default_rng(seed)
    x, y = MIDDLE
    mine = put(
        world, attacker, 1, _shaken(rng, block(count, 5, (x - 7, y), 2.1 * world.catalog.unit(attacker).separation))
    )
    foe = put(world, target, 2, [MIDDLE])
    still(world, foe)
    commands.attack_unit(world, mine, world.tag_of(foe[0]))
    reached = []
    for _ in range(320):
        advance(world)
        reached.append(int(world.in_reach[mine].sum()))
    most = max(reached)
    return {
        "reach": float(np.mean(reached[-40:])),
        "most": most,
        "after s": (reached.index(most) - next(i for i, n in enumerate(reached) if n)) / SECOND,
        "fit": fits_around(world, attacker, target),
    }


def choke(seed: int, cells: int) -> dict[str, float]:
    """Send 12 Marines through a gap to a target behind it; return when the first, half and all of them reach it."""
    world = fresh(seed)
    x, y = (int(v) for v in MIDDLE)
    height = world.map.terrain.size[1]
    low = y - cells // 2
    wall = [(wx, wy) for wy in range(height) for wx in (x, x + 1) if not low <= wy < low + cells]
    world.ground.block(WALLS, np.array(wall))
    mine = put(world, "Marine", 1, _shaken(np.random.default_rng(seed), block(12, 3, (x - 6.0, y + 0.5), 0.8)))
    foe = put(world, "Ultralisk", 2, [(x + 13.0, float(y))])
    still(world, foe)
    commands.attack_move(world, mine, (x + 13.0, float(y)))
    when: list[float] = []
    while len(when) < len(mine) and world.loop < MOST_LOOPS:
        advance(world)
        when += [world.loop / SECOND] * (int(world.in_reach[mine].sum()) - len(when))
    when += [math.nan] * (len(mine) - len(when))
    first, half, last = when[0], when[len(mine) // 2 - 1], when[-1]
    return {"first s": first, "half s": half, "all s": last, "file s": file_of(world, mine)}


def arc(seed: int, attacker: str = "Marine", count: int = 24) -> dict[str, float]:
    """Send a column of ranged units to one target; return when they fire, and how wide an arc they form."""
    world = fresh(seed)
    x, y = MIDDLE
    kind = world.catalog.unit(attacker)
    mine = put(
        world, attacker, 1, _shaken(np.random.default_rng(seed), block(count, 6, (x - 16, y), 2.1 * kind.separation))
    )
    foe = put(world, "Ultralisk", 2, [MIDDLE])
    still(world, foe)
    commands.attack_move(world, mine, MIDDLE)
    reached: list[int] = []
    covered: list[float] = []
    while len(reached) < ARC_LOOPS:
        advance(world)
        firing = world.pos[mine][world.in_reach[mine]] - world.pos[foe[0]]
        if len(firing) or reached:
            reached.append(len(firing))
            covered.append(float(np.degrees(np.ptp(np.arctan2(firing[:, 1], -firing[:, 0])))))
    share = {f"reach {second} s": reached[int(second * SECOND)] / count for second in (1, 2, 4, 8)}
    angle = {f"deg {second} s": covered[int(second * SECOND)] for second in (1, 2, 4, 8)}
    all_in = next((loop / SECOND for loop, n in enumerate(reached) if n == count), math.nan)
    end = {"end": reached[-1] / count, "deg": covered[-1], "fit deg": arc_of(world, attacker, "Ultralisk", count)}
    return share | angle | {"all s": all_in, "file s": file_of(world, mine[: count // 2])} | end


def second_row(seed: int) -> dict[str, float]:
    """Send 8 Zerglings and 8 Banelings behind them at 20 Marines in two rows."""
    world = fresh(seed)
    rng = np.random.default_rng(seed)
    x, y = MIDDLE
    mine = put(world, "Zergling", 1, _shaken(rng, block(8, 2, (x - 8, y), 0.8)))
    burst = put(world, "Baneling", 1, _shaken(rng, block(8, 2, (x - 10, y), 0.8)))
    theirs = put(world, "Marine", 2, _shaken(rng, block(20, 2, (x + 2, y), 0.8)))
    commands.attack_move(world, mine + burst, (x + 12, y))
    while alive(world, mine + burst) and alive(world, theirs) and world.loop < MOST_LOOPS:
        advance(world)
    return {"Marines left": len(alive(world, theirs)), "left": len(alive(world, mine + burst))}


def walls(name: str, cells: int) -> bool:
    """Return whether a unit gets through a gap of so many cells between structures."""
    world = fresh(0)
    x, y = (int(v) for v in MIDDLE)
    height = world.map.terrain.size[1]
    wall = [(x, wy) for wy in range(height) if not y <= wy < y + cells]
    world.ground.block(WALLS, np.array(wall))
    (slot,) = put(world, name, 1, [(x - 5.0, y + cells / 2)])
    commands.move(world, [slot], (x + 6.0, y + cells / 2))
    for _ in range(400):
        advance(world)
    return bool(world.pos[slot, 0] > x + 1)


# mirrors --------------------------------------------------------------------------------------------------------------


def mirror(seed: int, army: dict[str, int]) -> dict[str, bool] | None:
    """Play one fight of equal armies at mirrored places; return whose it was by each factor, None for a draw.

    The owner on the left, of the units made first, of the lower slots and of the first order are drawn independently.
    """
    rng = np.random.default_rng(seed)
    left, first, lower, ordered = (int(v) for v in rng.integers(1, 3, 4))
    world = fresh(seed)
    x, y = MIDDLE
    names = [name for name, count in army.items() for _ in range(count)]
    places = rng.uniform((-9.0, -3.5), (-4.5, 3.5), (len(names), 2)).tolist()
    turned = bool(rng.integers(2))  # mirrored at a line, or turned by half a circle
    jobs = [(owner, i) for owner in (first, 3 - first) for i in range(len(names))]
    fillers = [] if lower == first else put(world, "Marine", 0, [MIDDLE] * len(names))
    if not fillers and rng.integers(2):  # one by one
        jobs.sort(key=lambda job: job[1])
    for number, (owner, i) in enumerate(jobs):
        if number == len(names):
            for slot in fillers:  # their slots are taken by the units made last
                lifecycle.remove(world, slot)
        dx, dy = places[i]
        place = (x + dx, y + dy) if owner == left else (x - dx, y - dy if turned else y + dy)
        put(world, names[i], owner, [place])
    goals = {left: (x + 8, y), 3 - left: (x - 8, y)}
    while len(world.units_of(1)) and len(world.units_of(2)) and world.loop < 2 * MOST_LOOPS:
        if world.loop % AGAIN_LOOPS == 0:  # those who passed each other out of sight meet in the middle
            for owner in (ordered, 3 - ordered):
                commands.attack_move(world, world.units_of(owner).tolist(), MIDDLE if world.loop else goals[owner])
        advance(world)
    if bool(len(world.units_of(1))) == bool(len(world.units_of(2))):
        return None
    winner = 1 if len(world.units_of(1)) else 2
    return {
        "left side": winner == left,
        "player 1": winner == 1,
        "made first": winner == first,
        "lower slots": winner == lower,
        "ordered first": winner == ordered,
    }


def binomial(wins: int, games: int) -> float:
    """Return how probable a result at least as uneven is for a fair coin."""
    odd = abs(2 * wins - games)
    tail = sum(math.comb(games, k) for k in range(games + 1) if abs(2 * k - games) >= odd)
    return float(tail / 2**games)


def mirrors(games: int, console: Console) -> None:
    """Play so many fights, the same number of each kind; print the shares won by each factor."""
    each = games // len(BATTLES)
    total = []
    for number, (kind, army) in enumerate(BATTLES.items()):
        played = [mirror(seed, army) for seed in range(number * each, (number + 1) * each)]
        decided = [fight for fight in played if fight is not None]
        total += decided
        console.print(f"{kind:32} {each - len(decided):3} draws", _odds(decided), soft_wrap=True)
    console.print(f"{'all':32} {each * len(BATTLES) - len(total):3} draws", _odds(total), soft_wrap=True)


def _odds(decided: list[dict[str, bool]]) -> str:
    """Return the share won by each factor with the interval in which it lies with 95 %, and the odds of a fair coin."""
    texts = []
    for factor in decided[0] if decided else ():
        wins = sum(fight[factor] for fight in decided)
        share = wilson(wins, len(decided))
        odds = binomial(wins, len(decided))
        texts.append(
            f"{factor} {wins} of {len(decided)} = {share.value:.0%} ({share.low:.0%} to {share.high:.0%}, p {odds:.2f})"
        )
    return "  ".join(texts)


# pictures -------------------------------------------------------------------------------------------------------------


COLOURS: Final = {1: (60, 60, 220), 2: (200, 130, 30)}
SCALE: Final = 36
SWARM: Final = ("Zergling", 24, 4)
HOLDERS: Final = ("Zealot", 6, 2)


def moments(path: Path, seconds: Sequence[float] = (0.0, 1.0, 3.0)) -> None:
    """Play the first experiment and write some moments after the first blow side by side into one picture."""
    world, mine, _ = meet(0, SWARM, HOLDERS)
    while not world.in_reach[mine].any():
        advance(world)
    first = world.loop
    images = []
    for second in seconds:
        advance(world, first + int(second * SECOND) - world.loop)
        images.append(picture(world))
    cv2.imwrite(str(path), np.hstack(images))


def picture(world: World, half: Place = (4.5, 5.0)) -> NDArray[np.uint8]:
    """Draw a fight: bodies and where they face, filled where they are in reach of their target."""
    around = world.pos[world.live].mean(axis=0)
    image = np.full((int(2 * half[1] * SCALE), int(2 * half[0] * SCALE), 3), 245, dtype=np.uint8)

    def pixel(point: Any) -> tuple[int, int]:
        x, y = (point - around) * SCALE
        return int(x + half[0] * SCALE), int(half[1] * SCALE - y)

    for slot in world.live.tolist():
        colour = COLOURS[int(world.owner[slot])]
        radius = float(world.radius[slot])
        at, front = pixel(world.pos[slot]), pixel(world.pos[slot] + world.heading[slot] * radius)
        if world.in_reach[slot]:
            cv2.circle(image, at, int(radius * SCALE), colour, -1, cv2.LINE_AA)
        cv2.circle(image, at, int(radius * SCALE), colour, 2, cv2.LINE_AA)
        cv2.line(image, at, front, (30, 30, 30), 2, cv2.LINE_AA)
    image[:, -3:] = 255  # between two moments
    return image


# the report -----------------------------------------------------------------------------------------------------------


def report(title: str, runs: list[dict[str, float]], console: Console) -> None:
    """Print the means over the runs."""
    means = {key: float(np.nanmean([run[key] for run in runs])) for key in runs[0]}
    console.print(f"{title:44}", "  ".join(f"{key} {value:.2f}" for key, value in means.items()), soft_wrap=True)


def main() -> None:
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--runs", type=int, default=10, help="seeds of each experiment")
    parser.add_argument("--mirrors", type=int, default=0, help="play so many fights of equal armies instead")
    parser.add_argument("--picture", type=Path, help="write three moments of the first experiment to this file instead")
    parser.add_argument("--only", default="", help="experiments whose title contains this")
    options = parser.parse_args()
    console = Console(width=None if sys.stdout.isatty() else WIDEST)
    if options.mirrors:
        mirrors(options.mirrors, console)
        return
    if options.picture is not None:
        moments(options.picture)
        return

    experiments: dict[str, Callable[[int], dict[str, float]]] = {
        "24 Zerglings, 6 Zealots": lambda seed: swarm(seed, SWARM, HOLDERS),
        "24 Zerglings, 6 Zealots in a line": lambda seed: swarm(seed, SWARM, ("Zealot", 6, 1)),
        "8 Zealots, 8 Stalkers": lambda seed: swarm(seed, ("Zealot", 8, 2), ("Stalker", 8, 2)),
        "24 Zerglings, 6 Hellbats": lambda seed: swarm(seed, SWARM, ("HellionTank", 6, 2)),
        "24 Zerglings, 12 Marines": lambda seed: swarm(seed, SWARM, ("Marine", 12, 2)),
        "20 Zerglings round a Zealot": lambda seed: ring(seed, "Zergling", "Zealot"),
        "20 Zerglings round a Marine": lambda seed: ring(seed, "Zergling", "Marine"),
        "20 Zerglings round an Ultralisk": lambda seed: ring(seed, "Zergling", "Ultralisk"),
        "20 Zealots round an Ultralisk": lambda seed: ring(seed, "Zealot", "Ultralisk"),
        "12 Marines, choke of 1": lambda seed: choke(seed, 1),
        "12 Marines, choke of 2": lambda seed: choke(seed, 2),
        "24 Marines, arc": arc,
        "16 Stalkers, arc": lambda seed: arc(seed, "Stalker", 16),
        "8 Zerglings, 8 Banelings, 20 Marines": second_row,
    }
    for title, play in experiments.items():
        if options.only in title:
            report(title, [play(seed) for seed in range(options.runs)], console)
    for name in () if options.only else ("Zergling", "Immortal", "Roach", "Archon", "Ultralisk", "SiegeTank", "Thor"):
        gaps = [cells for cells in (1, 2, 3) if walls(name, cells)]
        console.print(f"{name:20} passes gaps of {gaps} cells")
