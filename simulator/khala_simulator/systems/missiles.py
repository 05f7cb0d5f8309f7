"""Missiles: they follow their target and hit when they reach its edge, or the last place of a target that died.

A missile that bounces goes on from its victim to the next enemy near it that it has not hit yet. One that returns, the
Spine Crawler's tentacle, has to be back before the next attack: its weapon's cooldown begins with the hit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.combat import damage
from khala_simulator.native import columns, memory
from khala_simulator.systems import weapons
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.stats import INSTANT_ACCELERATION_N
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import Missile, Shot

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.tables.records import Hit
    from khala_simulator.world.world import World

NO_DISTANCE: Final = 1e-12


def fly(world: World) -> None:
    """Move all missiles by one loop and carry out the hits of those that arrive."""
    if not world.missiles:
        return
    c = columns.columns_of(world)
    onward = []
    arrived = []
    for missile in world.missiles:
        if _step(c, missile):
            arrived.append(missile.shot)
        else:
            onward.append(missile)
    world.missiles = onward
    for shot in arrived:
        damage.hit_with(world, shot)
        hits = world.catalog.weapons[shot.weapon].hits
        if hits[shot.hit].returns and shot.source != NOBODY:
            _cool_down(world, shot)
        _bounce(world, shot, hits)


def _step(c: Columns, missile: Missile) -> bool:
    """Move a missile by one loop; return whether it arrives."""
    shot = missile.shot
    body = 0.0
    if shot.target != NOBODY:
        body = c.radius[shot.target]
        shot.goal_x = c.pos[shot.target].x
        shot.goal_y = c.pos[shot.target].y
    missile.step = min(missile.step + missile.gain, missile.top)
    x = shot.goal_x - missile.x
    y = shot.goal_y - missile.y
    distance = memory.length(x, y)
    share = missile.step / max(distance, NO_DISTANCE)
    missile.x += x * share
    missile.y += y * share
    return distance - body <= missile.step


def launch(world: World, shot: Shot, hit: Hit) -> None:
    """Send the missile of a hit on its way."""
    top = (hit.missile_speed_n or 0.0) / LOOPS_PER_NORMAL_SECOND
    step = top
    gain = math.inf
    gain_n = hit.missile_acceleration_n
    if gain_n is not None and gain_n < INSTANT_ACCELERATION_N:
        step = hit.missile_start_n / LOOPS_PER_NORMAL_SECOND
        gain = gain_n / LOOPS_PER_NORMAL_SECOND**2
    world.missiles.append(Missile(shot, shot.start_x, shot.start_y, step, top, gain))


def _cool_down(world: World, shot: Shot) -> None:
    """Begin the cooldown of the attacker's weapon anew, with its random delay."""
    c = columns.columns_of(world)
    stats = world.stats
    delay = weapons.draw_delay(world, memory.points(stats.jitter)[shot.weapon])
    c.cooldown[shot.source] = stats.period[shot.owner, shot.weapon] / c.attack_rate[shot.source] + delay


def _bounce(world: World, shot: Shot, hits: tuple[Hit, ...]) -> None:
    """Send on a missile that bounces; one whose target died on the way is lost."""
    if shot.target == NOBODY or shot.hit + 1 >= len(hits) or not hits[shot.hit + 1].bounce:
        return
    onward = hits[shot.hit + 1]
    if onward.search is None:
        return
    for slot in damage.found_by(world, onward.search, shot):
        after = shot.at(slot)
        after.prior = shot.target
        after.hit = shot.hit + 1
        after.start_x = shot.goal_x
        after.start_y = shot.goal_y
        after.goal_x, after.goal_y = world.pos[slot].tolist()
        launch(world, after, onward)
