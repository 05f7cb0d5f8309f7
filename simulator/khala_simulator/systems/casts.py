"""Casts: units come into reach, prepare, carry out their ability, and hold the channel that follows.

A unit with an ability as its order walks until it is near enough (``engagement`` says where to), stands while it
prepares, pays when the ability takes effect, and is then free again or holds a channel until the skill, a new order
or its death ends it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities import casting, commands
from khala_simulator.movement import arrival
from khala_simulator.native import columns
from khala_simulator.numeric import geometry
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World

NOT_BEGUN = -1.0


def carry_on(world: World) -> None:
    """Advance every cast by one loop, in the order of slots."""
    if world.channelling:
        _end_dropped(world)
    c = columns.columns_of(world)
    casters = [slot for slot in range(world.top) if c.casts[slot]]
    for slot in casters:
        if world.casts[slot] and world.carrier[slot] == NOBODY:
            _advance(world, slot)


def current(world: World, slot: int) -> Cast:
    """Return the cast of a unit's current order."""
    ability = casting.as_is(world, slot, world.catalog.ability(int(world.order_ability[slot])))
    x, y = world.order_point[slot].tolist()
    point = (x, y) if world.order_aimed[slot] else None
    return Cast(slot, ability, int(world.order_target[slot]), point, world.loop, int(world.type[slot]))


def _advance(world: World, slot: int) -> None:
    if world.channels[slot]:
        cast = world.channelling[slot]
        hold = casting.skill_of(cast.ability).hold
        if hold is None or not hold(world, cast):
            finish(world, slot)
        return
    cast = current(world, slot)
    if world.cast_at[slot] <= NOT_BEGUN:
        if not casting.in_range(world, cast, slop=0.0):
            if _is_stuck(world, slot):
                _give_up_in_vain(world, cast)
            return
        _begin(world, cast)
    if world.casts[slot] and NOT_BEGUN < world.cast_at[slot] <= world.loop:
        _take_effect(world, cast)


def _is_stuck(world: World, slot: int) -> bool:
    """Return whether a unit has come as near to its aim as it can."""
    c = columns.columns_of(world)
    return c.nav_end[slot] or arrival.has_stalled(c, slot, world.loop)


def _give_up_in_vain(world: World, cast: Cast) -> None:
    """Give up if the aim has become impossible, such as a place on which something else stands by now."""
    why = casting.aim_refusal(world, cast)
    if why is not ActionResult.SUCCESS:
        _give_up(world, cast, why)


def _begin(world: World, cast: Cast) -> None:
    """Start preparing, or give up when it is not possible any more."""
    slot = cast.slot
    why = casting.refusal(world, slot, cast.ability)
    if why is ActionResult.SUCCESS:
        why = casting.aim_refusal(world, cast)
    if why is not ActionResult.SUCCESS:
        _give_up(world, cast, why)
        return
    _face(world, cast)
    world.cast_begun[slot] = world.loop
    world.cast_at[slot] = world.loop + casting.prep_loops(world, slot, cast.ability)
    skill = casting.skill_of(cast.ability)
    world.bound[slot] = skill.binds
    if skill.prepare is not None:
        skill.prepare(world, cast)


def _take_effect(world: World, cast: Cast) -> None:
    slot = cast.slot
    skill = casting.skill_of(cast.ability)
    why = ActionResult.SUCCESS
    if world.cast_begun[slot] < world.loop and not world.bound[slot]:  # it took time to prepare: look again
        why = casting.refusal(world, slot, cast.ability)
        if why is ActionResult.SUCCESS and not casting.in_range(world, cast):
            why = ActionResult.TARGET_IS_OUT_OF_RANGE
    if why is not ActionResult.SUCCESS:
        _give_up(world, cast, why)
        return
    casting.perform(world, cast)
    if not world.casts[slot] or world.order_ability[slot] != cast.ability.id:
        return  # the effect gave the unit other orders, or ended it
    if skill.hold is None:
        finish(world, slot)
    else:
        world.channels[slot] = True
        world.channelling[slot] = cast


def finish(world: World, slot: int) -> None:
    """End a unit's cast and begin the next order."""
    _end_channel(world, slot)
    commands.begin_next(world, slot)


def _give_up(world: World, cast: Cast, why: ActionResult) -> None:
    casting.fail(world, cast, why)
    commands.begin_next(world, cast.slot)


def _end_dropped(world: World) -> None:
    """End the channels of units that got another order or died."""
    for slot in list(world.channelling):
        if not world.channels[slot]:
            _end_channel(world, slot)


def _end_channel(world: World, slot: int) -> None:
    cast = world.channelling.pop(slot, None)
    if cast is not None:
        end = casting.skill_of(cast.ability).end
        if end is not None:
            end(world, cast)


def _face(world: World, cast: Cast) -> None:
    """Turn to the ability's target; how long that takes in the game is not known."""
    goal = world.pos[cast.target] if cast.target != NOBODY else cast.point
    if goal is None or world.unit_type(cast.slot).unturnable:
        return
    offset = world.order_point[cast.slot] * 0.0 + goal - world.pos[cast.slot]
    length = float(geometry.length(offset[None])[0])
    if length > 0.0:
        world.heading[cast.slot] = offset / length
