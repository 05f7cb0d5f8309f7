"""Construction: unfinished structures progress, by themselves or while a builder works on them.

A Terran builder has the order to follow its site, under the id of what it builds, and works when it is beside it; so
any builder that is sent to an unfinished structure continues it. One without further orders begins to gather from the
gas structure that it has finished. Life and shields grow evenly with the progress.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.economy import construction
from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

WHOLE: Final = 1.0 - 1e-9
FOLLOW: Final = int(OrderKind.FOLLOW)
IDLE: Final = int(OrderKind.IDLE)
BESIDE: Final = 2.0  # from edge to edge: a builder works on its site from as far as it places one on a geyser
GROWN_SHARE: Final = 1.0 - construction.START_SHARE  # of life and shields that come with the work


def run(world: World) -> None:
    """Advance everything that is being built by one loop."""
    c = columns.columns_of(world)
    waits = False
    sites = []
    for slot in range(world.top):
        if c.build_progress[slot] < 1.0:
            waits |= not c.self_made[slot]
            sites.append(slot)
    if not sites:
        return
    if waits:
        _note_builders(world, c)
    growing = [slot for slot in sites if _is_worked(c, slot, world.loop)]
    quick = [player.id for player in world.players if "fast_build" in player.cheats]
    for slot in growing:
        _grow(c, slot, c.owner[slot] in quick, world.unit_type(slot).structure)
    finished = [slot for slot in growing if c.build_progress[slot] >= WHOLE]
    for slot in finished:
        _finish(world, slot)


def _is_worked(c: Columns, slot: int, loop: int) -> bool:
    """Return whether a site grows in this loop."""
    return bool(c.build_loops[slot] > 0.0) and (c.self_made[slot] or c.worked[slot] == loop)


def _note_builders(world: World, c: Columns) -> None:
    """Write which sites have a builder at work, and which one."""
    loop = world.loop
    for slot in range(world.top):
        c.site[slot] = NOBODY
    for slot in range(world.top):
        site = c.order_target[slot]
        if c.order_kind[slot] != FOLLOW or site < 0 or not c.can_act[slot]:
            continue
        if c.build_progress[site] >= 1.0 or c.self_made[site] or c.worked[site] == loop or not _is_work(world, slot):
            continue
        x = c.pos[site].x - c.pos[slot].x
        y = c.pos[site].y - c.pos[slot].y
        if memory.length(x, y) <= world.unit_type(site).radius_shown + c.radius[slot] + BESIDE:
            c.worked[site] = loop
            c.site[slot] = site


def _is_work(world: World, slot: int) -> bool:
    """Return whether a unit's order is to build."""
    ability = world.catalog.ability_of_id.get(int(world.order_ability[slot]))
    return ability is not None and ability.effect == "build"


def _grow(c: Columns, slot: int, at_once: bool, has_walls: bool) -> None:
    """Do one loop's work on a site; a structure gains life and shields with it."""
    share = 1.0 if at_once else 1.0 / c.build_loops[slot]
    share = min(share, 1.0 - c.build_progress[slot])
    c.build_progress[slot] += share
    if has_walls:
        c.life[slot] = min(c.life[slot] + GROWN_SHARE * share * c.life_max[slot], c.life_max[slot])
        c.shields[slot] = min(c.shields[slot] + GROWN_SHARE * share * c.shields_max[slot], c.shields_max[slot])


def _finish(world: World, slot: int) -> None:
    """Complete what is built, and send its builder on."""
    builder = construction.builder_of(world, slot)
    construction.finish(world, slot)
    if builder >= 0:
        world.site[builder] = NOBODY
        commands.begin_next(world, builder)
        if world.order_kind[builder] == IDLE:
            commands.gather(world, [builder], world.tag_of(slot))  # if it is a gas structure
