"""The army: it waits at the front, defends the bases, attacks when large enough, and retreats from what is stronger."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import harvesting
from khala_simulator.opponent import bases, hands
from khala_simulator.opponent.enemy import WORKER_VALUE, value
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.opponent_memory import NEVER
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import Side
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Ints

RALLY_AHEAD: Final = 7.0
"""How far in front of its town hall the army waits."""
RALLY_NEAR: Final = 9.0
HOME: Final = 22.0
"""Enemies so near to an own town hall are a threat; HARM is for other structures."""
HARM: Final = 12.0
FIGHT: Final = 14.0
"""Units so near to each other take part in the same fight."""
SCOUTS: Final = 2
"""So few enemy workers at a base are scouts and no threat."""
FULL: Final = 188.0
"""With so much supply in use an army attacks whatever its size."""
FULL_ARMY: Final = 20.0
EASY: Final = 1.6
"""An army so many times the enemy's is an easy win, with at least so much supply."""
LEAST_EASY: Final = 16.0
REST_S: Final = 45.0
"""Between two attacks."""
NEXT_WAVE: Final = 1.25
"""Each attack that failed makes the next one larger by this factor, up to MOST_WAVE times the first."""
MOST_WAVE: Final = 3.0
SPENT: Final = 0.3
"""An attack is over when this share of its value is left."""
REINFORCE: Final = 0.15
"""Units that wait join an attack once they are worth this share of it."""
RECALL: Final = 0.3
"""An attack goes on while the enemies at home are worth less than this share of the army."""
SPREAD: Final = 11.0
"""An army whose head is so far before its middle waits for the others."""
WITH: Final = 4.0
"""So near to the middle of the army its unarmed units stay."""
SEEN_EMPTY: Final = 6.0


def lead(side: Side, enemy: Enemy) -> None:
    """Give the army its orders for this thought."""
    army = [slot for slot in side.army if side.world.can_act[slot] and side.world.carrier[slot] == NOBODY]
    threat = watch(side, enemy)
    if threat is not None:
        army = defend(side, army, threat)
    if side.mind.attacking:
        attack(side, enemy, army)
    elif threat is None:
        gather_up(side, army)
        _garrison(side, army)
        _set_out(side, enemy)


# defence --------------------------------------------------------------------------------------------------------------


def watch(side: Side, enemy: Enemy) -> Ints | None:
    """Return the enemies at the own bases once the level has reacted to them, None without any."""
    threat = threats(side, enemy)
    mind, world = side.mind, side.world
    if not threat.size:
        mind.alarm, mind.threat = NEVER, None
        _release(side)
        return None
    if mind.alarm == NEVER:
        mind.alarm = world.loop
    if world.loop - mind.alarm < side.level.reaction_s * FASTER_LOOPS:
        return None
    x, y = world.pos[_nearest_home(side, threat)].tolist()
    mind.threat = (x, y)
    return threat


def threats(side: Side, enemy: Enemy) -> Ints:
    """Return the enemies in sight that fight at an own structure."""
    world = side.world
    foes = enemy.fighters
    if not foes.size:
        return foes
    stone = np.array([s for s in side.slots.tolist() if world.unit_type(s).structure], dtype=np.int64)
    if not stone.size:
        return foes[:0]
    reach = np.where(harvesting.kinds(world.catalog)[2][world.type[stone]], HOME, HARM)
    offset = world.pos[foes][:, None, :] - world.pos[stone]
    near = (offset[..., 0] ** 2 + offset[..., 1] ** 2 <= reach**2).any(axis=1)
    found: Ints = foes[near]
    harmless = [s for s in found.tolist() if world.unit_type(s).worker]
    return found[:0] if len(harmless) == found.size <= SCOUTS else found


def _nearest_home(side: Side, threat: Ints) -> int:
    home = np.array([side.place(h) for h in side.halls] or [side.mind.bases[0]])
    offset = side.world.pos[threat][:, None, :] - home
    return int(threat[int(np.argmin((offset[..., 0] ** 2 + offset[..., 1] ** 2).min(axis=1)))])


def defend(side: Side, army: list[int], threat: Ints) -> list[int]:
    """Send the army at home against enemies at the bases, and workers; return who goes on with the attack.

    An attack is called off where the army at home is too weak, unless the threat is small beside the whole army.
    """
    world, mind = side.world, side.mind
    strength, at = value(world, threat), mind.threat or mind.bases[0]
    front = bases.front(side)
    home = [s for s in army if not mind.attacking or _nearer(side.place(s), front, mind.enemy_start)]
    if mind.attacking and strength > max(value(world, home), RECALL * value(world, army)):
        _call_off(side)
        home = army
    helpers = home + side.named("Queen")
    idle = [s for s in helpers if world.target[s] == NOBODY and not _bound_for(side, s, at, 6.0)]
    if idle:
        hands.attack(side, idle, at)
    _pull_workers(side, helpers, threat, strength)
    return [s for s in army if s not in set(home)]


def _nearer(at: Point, here: Point, there: Point) -> bool:
    return math.dist(at, here) < math.dist(at, there)


def _pull_workers(side: Side, army: list[int], threat: Ints, strength: float) -> None:
    """Make workers fight while the army at home is weaker than the threat."""
    world, mind = side.world, side.mind
    threat_at = mind.threat or mind.bases[0]
    lacking = 1.15 * strength - value(world, army) - value(world, _static(side))
    near = any(math.dist(side.place(h), threat_at) < HOME - 6.0 for h in side.halls)
    if lacking <= 0.0 or not near or not side.level.pull:
        _release(side)
        return
    most = int(side.level.pull * len(side.workers))
    wanted = min(most, math.ceil(lacking / WORKER_VALUE))
    mind.pulled = [tag for tag in mind.pulled if world.slot_of(tag) != NOBODY]
    candidates = [w for w in side.workers if world.carrier[w] == NOBODY and not world.casts[w]]
    candidates.sort(key=lambda w: (world.tag_of(w) not in mind.pulled, math.dist(side.place(w), threat_at), w))
    mind.pulled = [world.tag_of(w) for w in candidates[:wanted]]
    idle = [w for w in candidates[:wanted] if world.order_kind[w] != OrderKind.ATTACK_UNIT]
    ground = [s for s in threat.tolist() if not world.unit_type(s).flying]
    groups: dict[int, list[int]] = {}
    for worker in idle if ground else ():
        offset = world.pos[ground] - world.pos[worker]
        groups.setdefault(ground[int(np.argmin((offset**2).sum(axis=1)))], []).append(worker)
    for target, group in groups.items():
        hands.attack_unit(side, group, world.tag_of(target))


def _release(side: Side) -> None:
    """Send workers that have defended back to their work."""
    world, mind = side.world, side.mind
    fighting = [s for tag in mind.pulled if (s := world.slot_of(tag)) != NOBODY]
    mind.pulled = []
    for hall in side.halls[:1]:
        fields = bases.fields_near(world, side.place(hall))
        if fighting and fields:
            hands.gather(side, fighting, world.tag_of(fields[0]))


def _static(side: Side) -> list[int]:
    return side.named("Bunker", "PhotonCannon", "ShieldBattery", "SpineCrawler", "PlanetaryFortress")


# waiting --------------------------------------------------------------------------------------------------------------


def rally(side: Side) -> Point:
    """Return where the army waits: in front of the base nearest to the enemy."""
    (x, y), (ex, ey) = bases.front(side), side.mind.enemy_start
    length = max(math.dist((x, y), (ex, ey)), 1.0)
    return x + (ex - x) / length * RALLY_AHEAD, y + (ey - y) / length * RALLY_AHEAD


def gather_up(side: Side, army: list[int]) -> None:
    """Send units that do nothing elsewhere to where the army waits."""
    point = rally(side)
    lost = [s for s in army if _idle(side, s) and math.dist(side.place(s), point) > RALLY_NEAR]
    if lost:
        hands.attack(side, lost, point)


def _garrison(side: Side, army: list[int]) -> None:
    """Send Marines into Bunkers with room."""
    world = side.world
    marines = [s for s in army if world.unit_type(s).name == "Marine" and _idle(side, s)]
    for bunker in side.named("Bunker"):
        room = world.unit_type(bunker).cargo_space - len(world.passengers(bunker))
        marines.sort(key=lambda s: (math.dist(side.place(s), side.place(bunker)), s))
        if room > 0 and marines and hands.smart(side, marines[:room], world.tag_of(bunker)):
            del marines[:room]


def _set_out(side: Side, enemy: Enemy) -> None:
    """Begin an attack when its time has come and the army is large enough.

    A level that adapts waits while it knows of a stronger army; one that sees everything goes early against a weak one.
    """
    mind, first, own = side.mind, side.build.attack, side.army_supply
    if side.world.loop < mind.attack_from:
        return
    known = enemy.army_supply() if "adapt" in side.level.skills else 0.0
    enough = max(first.supply * side.level.wave * mind.wave, 2.0)
    on_time = side.clock_s >= first.from_s and own >= max(enough, known)
    easy = side.level.vision and own >= max(LEAST_EASY, EASY * known)
    if on_time or easy or (side.used >= FULL and own > FULL_ARMY):
        mind.attacking = True
        mind.wave_value = value(side.world, side.army)


# attack ---------------------------------------------------------------------------------------------------------------


def attack(side: Side, enemy: Enemy, army: list[int]) -> None:
    """Lead the attack: go on, wait for the others, or retreat."""
    world, mind = side.world, side.mind
    goal = _goal(side, enemy, army)
    home = rally(side)
    waiting = [s for s in army if _waits(side, s, home, goal)]
    there = [s for s in army if s not in set(waiting)]
    worth = value(world, side.army)
    mind.wave_value = max(mind.wave_value, worth)
    if worth < SPENT * mind.wave_value or _too_strong(side, enemy, there):
        _call_off(side)
        return
    fresh = waiting if not there or value(world, waiting) > REINFORCE * worth else []
    if not fresh:
        gather_up(side, waiting)
    there = _support(side, there)
    if "regroup" in side.level.skills:
        ahead = _ahead_of_the_others(side, enemy, there, goal)
        there = [s for s in there if s not in ahead]
    idle = [s for s in there + fresh if world.target[s] == NOBODY and not _bound_for(side, s, goal, 4.0)]
    if idle:
        hands.attack(side, idle, goal)


def _too_strong(side: Side, enemy: Enemy, there: list[int]) -> bool:
    """Return whether the enemies near the attackers are too strong for them."""
    world = side.world
    fighting = [s for s in there if world.target[s] != NOBODY]
    if not fighting or not side.level.retreat or side.used >= FULL:
        return False
    x, y = world.pos[fighting].mean(axis=0).tolist()
    foes = enemy.near((x, y), FIGHT)
    near = [s for s in there if math.dist(side.place(s), (x, y)) <= FIGHT]
    return value(world, near) < side.level.retreat * value(world, foes)


def _call_off(side: Side) -> None:
    """End the attack; the army goes home and the next attack is larger."""
    mind = side.mind
    mind.attacking = False
    mind.wave = min(MOST_WAVE, mind.wave * NEXT_WAVE)
    mind.attack_from = side.world.loop + round(REST_S * FASTER_LOOPS * side.level.tempo)
    point = rally(side)
    away = [s for s in side.army if math.dist(side.place(s), point) > RALLY_NEAR]
    if away:
        (hands.move if side.level.retreat else hands.attack)(side, away, point)


def _goal(side: Side, enemy: Enemy, army: list[int]) -> Point:
    """Return what to attack: the nearest enemy structure that is known, else where one may be."""
    world, mind = side.world, side.mind
    known = enemy.places()
    if len(known):
        middle = np.median(world.pos[army], axis=0) if army else np.array(mind.bases[0])
        offset = known - middle
        x, y = known[int(np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2))].tolist()
        return x, y
    places = [mind.enemy_start, *reversed(mind.bases)]
    point = places[mind.searched % len(places)]
    if any(math.dist(side.place(s), point) < SEEN_EMPTY for s in army):
        mind.searched += 1
        point = places[mind.searched % len(places)]
    return point


def _support(side: Side, there: list[int]) -> list[int]:
    """Keep units without a weapon with the others; return those that fight."""
    world = side.world
    unarmed = [s for s in there if world.ground_weapon[s] < 0 and world.air_weapon[s] < 0 and not world.channels[s]]
    armed = [s for s in there if s not in set(unarmed)]
    if not armed or not unarmed:
        return armed
    x, y = np.median(world.pos[armed], axis=0).tolist()
    away = [s for s in unarmed if math.dist(side.place(s), (x, y)) > WITH and not _bound_for(side, s, (x, y), WITH)]
    if away:
        hands.attack(side, away, (x, y))
    return armed


def _ahead_of_the_others(side: Side, enemy: Enemy, there: list[int], goal: Point) -> set[int]:
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
    running = [s for s in ahead if world.order_kind[s] != OrderKind.MOVE]
    if running:
        hands.move(side, running, (centre[0], centre[1]))
    return set(ahead)


def _waits(side: Side, slot: int, home: Point, goal: Point) -> bool:
    """Return whether a unit has not set out yet: it does nothing, nearer to home than to the goal, or gathers."""
    at = side.place(slot)
    if _bound_for(side, slot, home, 2.0):
        return True
    return _idle(side, slot) and _nearer(at, home, goal)


def _idle(side: Side, slot: int) -> bool:
    return bool(side.world.order_kind[slot] == OrderKind.IDLE and side.world.target[slot] == NOBODY)


def _bound_for(side: Side, slot: int, point: Point, slack: float) -> bool:
    """Return whether a unit is on its way to a point already."""
    world = side.world
    walks = world.order_kind[slot] in (OrderKind.ATTACK_MOVE, OrderKind.SCAN_MOVE)
    x, y = world.order_point[slot].tolist()
    return bool(walks) and math.dist((x, y), point) <= slack
