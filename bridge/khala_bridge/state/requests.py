"""Messages that go into the game: orders to units, switches, and moves of its own camera.

The counterpart of `khala_bridge.state.read`: values in, messages of the SC2 API out. `khala_bridge.act` decides on the
orders, and passes these messages on without reading them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.frames import WorldPoint


def unit_order(
    ability_id: int, units: Iterable[int], target: int | WorldPoint | None = None, *, queued: bool = False
) -> sc_pb.Action:
    """Return an order to units.

    Args:
        ability_id: the ability to use.
        units: their tags.
        target: tag of a unit, a place of the world, or None.
        queued: whether it comes after the orders that they have.
    """
    action = sc_pb.Action()
    order = action.action_raw.unit_command
    order.ability_id = ability_id
    order.unit_tags.extend(units)
    order.queue_command = queued
    if isinstance(target, int):
        order.target_unit_tag = target
    elif target is not None:
        order.target_world_space_pos.CopyFrom(common_pb2.Point2D(x=target.x, y=target.y))
    return action


def autocast_switch(ability_id: int, units: Iterable[int]) -> sc_pb.Action:
    """Return a switch of an autocast: on where it is off, off where it is on."""
    action = sc_pb.Action()
    action.action_raw.toggle_autocast.ability_id = ability_id
    action.action_raw.toggle_autocast.unit_tags.extend(units)
    return action


def camera_move(place: WorldPoint) -> sc_pb.Action:
    """Return a move of the game's camera to a place of the world."""
    action = sc_pb.Action()
    action.action_raw.camera_move.center_world_space.CopyFrom(common_pb2.Point(x=place.x, y=place.y, z=0))
    return action
