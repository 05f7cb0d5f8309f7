"""Defence: enemies that threaten the own bases, and the units sent against them: the army, workers if it is weak."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import harvesting
from khala_simulator.opponent import bases, hands, stance
from khala_simulator.opponent.enemy import WORKER_VALUE, value
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.opponent_memory import NEVER

if TYPE_CHECKING:
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Ints

HOME: Final = 16.0
"""Enemies so near to an own town hall are a threat; HARM is for other structures."""
HARM: Final = 9.0
AT_WORK: Final = 11.0
"""Workers help, and a weak army fights, only against enemies so near to a town hall."""
HOPELESS: Final = 2.0
"""Workers don't fight what is worth so many times more than all of them."""
WOUNDED: Final = 0.4
SCOUTS: Final = 2
"""So few enemy workers that attack nothing are scouts and no threat."""
RECALL: Final = 0.3
"""An attack goes on while the enemies at home are worth less than this share of the army."""


def watch(side: OwnSide, enemy: Enemy) -> Ints | None:
    """Return the enemies at the own bases once the level has reacted to them, None without any."""
    threat = threats(side, enemy)
    mind, world = side.mind, side.world
    if not threat.size:
        if mind.threat is not None:
            mind.repelled = world.loop, mind.worst
        mind.alarm = NEVER
        mind.threat = None
        mind.worst = 0.0
        _release(side)
        return None
    mind.worst = max(mind.worst, value(world, threat))
    if mind.alarm == NEVER:
        mind.alarm = world.loop
    if world.loop - mind.alarm < side.level.reaction_s * FASTER_LOOPS:
        return None
    x, y = world.pos[_nearest_home(side, threat)].tolist()
    mind.threat = (x, y)
    return threat


def threats(side: OwnSide, enemy: Enemy) -> Ints:
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
    harmless = [s for s in found.tolist() if world.unit_type(s).worker and world.target[s] == NOBODY]
    return found[:0] if len(harmless) == found.size <= SCOUTS else found


def _nearest_home(side: OwnSide, threat: Ints) -> int:
    home = np.array([side.place(h) for h in side.halls] or [side.mind.bases[0]])
    offset = side.world.pos[threat][:, None, :] - home
    return int(threat[int(np.argmin((offset[..., 0] ** 2 + offset[..., 1] ** 2).min(axis=1)))])


def defend(side: OwnSide, army: list[int], threat: Ints) -> list[int]:
    """Send the army at home against enemies at the bases, and workers; return the units that go on with the attack.

    An attack is called off where the army at home is too weak, unless the threat is small beside the whole army. An
    army that is too weak alone waits at its front until the enemies are between its workers.
    """
    world, mind = side.world, side.mind
    strength = value(world, threat)
    at = mind.threat or mind.bases[0]
    front = bases.front(side)
    home = [s for s in army if not mind.attacking or stance.nearer(side.place(s), front, mind.enemy_start)]
    if mind.attacking and strength > max(value(world, home), RECALL * value(world, army)):
        stance.call_off(side)
        home = army
    helpers = home + side.of_type("Queen")
    if _waits(side, helpers, at, strength):
        stance.gather_up(side, home)
        return [s for s in army if s not in set(home)]
    idle = [s for s in helpers if world.target[s] == NOBODY and not stance.bound_for(side, s, at, 6.0)]
    if idle:
        hands.attack(side, idle, at)
    _pull_workers(side, helpers, threat, strength)
    return [s for s in army if s not in set(home)]


def _waits(side: OwnSide, helpers: list[int], at: Point, strength: float) -> bool:
    """Return whether the army at home should not go to the enemies yet."""
    weak = value(side.world, helpers) < side.level.retreat * strength
    return weak and not _at_work(side, at)


def _at_work(side: OwnSide, at: Point) -> bool:
    return any(math.dist(side.place(hall), at) < AT_WORK for hall in side.halls)


def _pull_workers(side: OwnSide, army: list[int], threat: Ints, strength: float) -> None:
    """Make workers fight while the army at home is weaker than the threat."""
    world, mind = side.world, side.mind
    at = mind.threat or mind.bases[0]
    lacking = 1.15 * strength - value(world, army) - value(world, _static(side))
    most = int(side.level.pull * len(side.workers))
    hopeless = lacking > HOPELESS * most * WORKER_VALUE
    if lacking <= 0.0 or hopeless or not _at_work(side, at):
        _release(side)
        return
    wanted = min(most, math.ceil(lacking / WORKER_VALUE))
    mind.pulled = [tag for tag in mind.pulled if world.slot_of(tag) != NOBODY]
    candidates = [w for w in side.workers if world.carrier[w] == NOBODY and not world.casts[w]]
    candidates.sort(
        key=lambda w: (_is_wounded(side, w), world.tag_of(w) not in mind.pulled, math.dist(side.place(w), at), w)
    )
    called = candidates[:wanted]
    back = [s for tag in mind.pulled if (s := world.slot_of(tag)) not in called]
    mind.pulled = [world.tag_of(w) for w in called]
    _to_work(side, back)
    idle = [w for w in called if world.target[w] == NOBODY and not stance.bound_for(side, w, at, 3.0)]
    if idle and any(not world.unit_type(s).flying for s in threat.tolist()):
        hands.attack(side, idle, at)


def _is_wounded(side: OwnSide, slot: int) -> bool:
    """Return whether a worker fights only after all others."""
    world = side.world
    whole = float(world.life_max[slot] + world.shields_max[slot])
    return bool(world.life[slot] + world.shields[slot] < WOUNDED * whole)


def _release(side: OwnSide) -> None:
    """Send workers that have defended back to their work."""
    back = [s for tag in side.mind.pulled if (s := side.world.slot_of(tag)) != NOBODY]
    side.mind.pulled = []
    _to_work(side, back)


def _to_work(side: OwnSide, workers: list[int]) -> None:
    """Send workers to a field of the first base."""
    fields = [f for hall in side.halls[:1] for f in bases.fields_near(side.world, side.place(hall))]
    if workers and fields:
        hands.gather(side, workers, side.world.tag_of(fields[0]))


def _static(side: OwnSide) -> list[int]:
    return side.of_type("Bunker", "PhotonCannon", "ShieldBattery", "SpineCrawler", "PlanetaryFortress")
