"""Attack: when it begins, where it goes, which units wait for the others, and when it is called off."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.opponent import hands, stance
from khala_simulator.opponent.enemy import value
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.casts import Point

FIGHT: Final = 14.0
"""Units so near to each other take part in the same fight."""
FULL: Final = 188.0
"""With so much supply in use an army attacks whatever its size."""
FULL_ARMY: Final = 20.0
EASY: Final = 1.4
"""An army so many times the enemy's is an easy win, with at least so much supply."""
LEAST_EASY: Final = 16.0
LEAST: Final = 2.0
"""Supply of the smallest attack."""
READY: Final = 0.5
"""An attack begins with this share of the army that the level wants at that time."""
COUNTER_S: Final = 15.0
BATTLE: Final = 0.5
"""For so long after enemies were repelled that were worth this share of the own army there may be a counter-attack."""
SPENT: Final = 0.3
"""An attack is over when this share of its value is left, unless the enemy has even less."""
REINFORCE: Final = 0.15
"""Units that wait join an attack once they are worth this share of it."""
SPREAD: Final = 11.0
"""An army whose head is so far before its middle waits for the others."""
WITH: Final = 4.0
"""So near to the middle of the army its unarmed units stay."""
SEEN_EMPTY: Final = 6.0
SEARCH_S: Final = 60.0
SEARCH_STEP: Final = 12
"""With all bases empty, points so far apart all over the map are looked at, each for so many seconds at most."""


def set_out(side: OwnSide, enemy: Enemy) -> None:
    """Begin an attack when its time has come and the army is large enough.

    A level that adapts waits while it knows of a stronger army, and goes early against one that has just lost a battle
    at the own bases.
    """
    mind, own = side.mind, side.army_supply
    if side.world.loop < mind.attack_from:
        return
    known = enemy.army_supply() if "adapt" in side.level.skills else 0.0
    times = side.plan.attacks
    due = mind.waves >= len(times) or side.now_s >= side.due_s(times[mind.waves])
    on_time = due and own >= max(LEAST, READY * side.army_wanted, known)
    easy = _won(side) and own >= max(LEAST_EASY, EASY * known)
    if on_time or easy or (side.used >= FULL and own > FULL_ARMY):
        mind.attacking = True
        mind.searched_since = side.world.loop
        mind.wave_value = value(side.world, side.army)


def _won(side: OwnSide) -> bool:
    """Return whether an attack on the own bases that was worth something has just been repelled."""
    when, worth = side.mind.repelled
    recent = when >= 0 and side.world.loop - when < COUNTER_S * FASTER_LOOPS
    return recent and "adapt" in side.level.skills and worth > BATTLE * value(side.world, side.army)


def go_on(side: OwnSide, enemy: Enemy, army: list[int]) -> None:
    """Lead the attack: go on, wait for the others, or retreat."""
    world, mind = side.world, side.mind
    goal = _goal(side, enemy, army)
    home = stance.rally(side)
    waiting = [s for s in army if _waits(side, s, home, goal)]
    there = [s for s in army if s not in set(waiting)]
    worth = value(world, side.army)
    mind.wave_value = max(mind.wave_value, worth)
    spent = worth < SPENT * mind.wave_value and side.army_supply <= enemy.army_supply()
    if spent or _too_strong(side, enemy, there):
        stance.call_off(side)
        return
    fresh = waiting if not there or value(world, waiting) > REINFORCE * worth else []
    if not fresh:
        stance.gather_up(side, waiting)
    there = _support(side, there)
    if "regroup" in side.level.skills:
        ahead = _ahead_of_the_others(side, enemy, there, goal)
        there = [s for s in there if s not in ahead]
    idle = [s for s in there + fresh if world.target[s] == NOBODY and not stance.bound_for(side, s, goal, 4.0)]
    if idle:
        hands.attack(side, idle, goal)


def _too_strong(side: OwnSide, enemy: Enemy, there: list[int]) -> bool:
    """Return whether the enemies near the attackers are too strong for them."""
    world = side.world
    fighting = [s for s in there if world.target[s] != NOBODY]
    if not fighting or not side.level.retreat or side.used >= FULL:
        return False
    x, y = world.pos[fighting].mean(axis=0).tolist()
    foes = enemy.near((x, y), FIGHT)
    near = [s for s in there if math.dist(side.place(s), (x, y)) <= FIGHT]
    return value(world, near) < side.level.retreat * value(world, foes)


def _goal(side: OwnSide, enemy: Enemy, army: list[int]) -> Point:
    """Return what to attack: the nearest enemy structure that is known, else where one may be."""
    world, mind = side.world, side.mind
    known = enemy.places()
    if len(known):
        middle = np.median(world.pos[army], axis=0) if army else np.array(mind.bases[0])
        offset = known - middle
        x, y = known[int(np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2))].tolist()
        return x, y
    places = [mind.enemy_start, *reversed(mind.bases), *_everywhere(world.map)]
    point = places[mind.searched % len(places)]
    late = world.loop - mind.searched_since > SEARCH_S * FASTER_LOOPS
    if late or any(math.dist(side.place(s), point) < SEEN_EMPTY for s in army):
        mind.searched, mind.searched_since = mind.searched + 1, world.loop
        point = places[mind.searched % len(places)]
    return point


@lru_cache(maxsize=4)
def _everywhere(game_map: GameMap) -> tuple[Point, ...]:
    """Return walkable points all over a map, row by row to and fro."""
    y, x = np.nonzero(game_map.terrain.walk)
    half = SEARCH_STEP // 2
    on_grid = (x % SEARCH_STEP == half) & (y % SEARCH_STEP == half)
    points = [(px + 0.5, py + 0.5) for px, py in zip(x[on_grid].tolist(), y[on_grid].tolist(), strict=True)]
    return tuple(sorted(points, key=lambda p: (p[1], p[0] if p[1] // SEARCH_STEP % 2 else -p[0])))


def _support(side: OwnSide, there: list[int]) -> list[int]:
    """Keep units without a weapon with the others; return those that fight."""
    world = side.world
    unarmed = [s for s in there if world.ground_weapon[s] < 0 and world.air_weapon[s] < 0 and not world.channels[s]]
    armed = [s for s in there if s not in set(unarmed)]
    if not armed or not unarmed:
        return armed
    x, y = np.median(world.pos[armed], axis=0).tolist()
    away = [
        s for s in unarmed if math.dist(side.place(s), (x, y)) > WITH and not stance.bound_for(side, s, (x, y), WITH)
    ]
    if away:
        hands.attack(side, away, (x, y))
    return armed


def _ahead_of_the_others(side: OwnSide, enemy: Enemy, there: list[int], goal: Point) -> set[int]:
    """Stop the head of a long column until the others are near; return it."""
    world = side.world
    if len(there) < 4 or any(world.target[s] != NOBODY for s in there):
        return set()
    away = np.hypot(*(world.pos[there] - np.array(goal)).T)
    middle = float(np.median(away))
    ahead = [s for s, d in zip(there, away.tolist(), strict=True) if middle - d > SPREAD]
    if not ahead or enemy.near(side.place(ahead[0]), FIGHT).size:
        return set()
    centre = world.pos[there][away >= middle].mean(axis=0).tolist()
    running = [s for s in ahead if int(world.order_kind[s]) != OrderKind.MOVE]
    if running:
        hands.move(side, running, (centre[0], centre[1]))
    return set(ahead)


def _waits(side: OwnSide, slot: int, home: Point, goal: Point) -> bool:
    """Return whether a unit has not set out yet: it does nothing, nearer to home than to the goal, or gathers."""
    at = side.place(slot)
    if stance.bound_for(side, slot, home, 2.0):
        return True
    return stance.idle(side, slot) and stance.nearer(at, home, goal)
