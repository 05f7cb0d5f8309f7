"""Construction: unfinished structures progress, by themselves or while a builder works on them.

A Terran builder has the order to follow its site, under the id of what it builds, and works when it is beside it; so
any builder that is sent to an unfinished structure continues it. One without further orders begins to gather from the
gas structure that it has finished. Life and shields grow evenly with the progress.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import commands
from khala_simulator.economy import construction
from khala_simulator.numeric.arrays import some, which
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

WHOLE: Final = 1.0 - 1e-9
FOLLOW, IDLE = int(OrderKind.FOLLOW), int(OrderKind.IDLE)
BESIDE: Final = 2.0  # from edge to edge: a builder works on its site from as far as it places one on a geyser


def run(world: World) -> None:
    """Advance everything that is being built by one loop."""
    n = world.top
    unfinished = world.build_progress[:n] < 1.0
    if not some(unfinished):
        return
    sites = which(unfinished)
    waiting = sites[~world.self_made[sites]]
    if waiting.size:
        _note_builders(world, waiting)
    going = sites[world.self_made[sites] | (world.worked[sites] == world.loop)]
    going = going[world.build_loops[going] > 0.0]
    if going.size:
        _grow(world, going)


def _note_builders(world: World, sites: Ints) -> None:
    """Write which sites have a builder at work, and which one."""
    n = world.top
    world.site[:n] = -1
    is_site = np.zeros(world.capacity, dtype=np.bool_)
    is_site[sites] = True
    following = (world.order_kind[:n] == FOLLOW) & (world.order_target[:n] >= 0) & world.can_act[:n]
    following &= is_site.take(world.order_target[:n], mode="clip")
    for slot in which(following).tolist():
        site = int(world.order_target[slot])
        if not is_work(world, slot) or world.worked[site] == world.loop:
            continue
        offset = world.pos[site] - world.pos[slot]
        if float(np.hypot(*offset)) <= world.unit_type(site).radius_shown + world.radius[slot] + BESIDE:
            world.worked[site] = world.loop
            world.site[slot] = site


def is_work(world: World, slot: int) -> bool:
    """Return whether a unit's order is to build."""
    ability = world.catalog.ability_of_id.get(int(world.order_ability[slot]))
    return ability is not None and ability.effect == "build"


def _grow(world: World, sites: Ints) -> None:
    share = 1.0 / world.build_loops[sites]
    quick = [p.id for p in world.players if "fast_build" in p.cheats]
    if quick:
        share = np.where(np.isin(world.owner[sites], quick), 1.0, share)
    share = np.minimum(share, 1.0 - world.build_progress[sites])
    world.build_progress[sites] += share
    is_stone = np.array([world.unit_type(s).structure for s in sites.tolist()])
    stone = sites[is_stone]
    if stone.size:
        grown = (1.0 - construction.START_SHARE) * share[is_stone]
        world.life[stone] = np.minimum(world.life[stone] + grown * world.life_max[stone], world.life_max[stone])
        most = world.shields_max[stone]
        world.shields[stone] = np.minimum(world.shields[stone] + grown * most, most)
    for slot in sites[world.build_progress[sites] >= WHOLE].tolist():
        builder = construction.builder_of(world, slot)
        construction.finish(world, slot)
        if builder >= 0:
            world.site[builder] = -1
            commands.begin_next(world, builder)
            if world.order_kind[builder] == IDLE:
                commands.gather(world, [builder], world.tag_of(slot))  # if it is a gas structure
