"""What a client's actions do, and how they are reported back.

An action is judged when it arrives, which gives the result code of the response, and takes effect when the game next
advances: as it was judged, or judged again if something else has taken effect since. The next observation then reports
it in every form that the client's interface has: a raw command also as the equivalent click, a click also as the
equivalent raw command. Nothing in an action is a usage error.

Above: `game.py`. Below: `clicks.py` (selection and panels), `abilities.py` and `giving.py` (commands).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from s2clientprotocol import error_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.abilities import casting
from khala_simulator.api import abilities, clicks, pixels
from khala_simulator.api.abilities import OrderPlan, UnitCommand
from khala_simulator.api.giving import CommandOutcome, carry_out
from khala_simulator.api.selection import at_point, panel_order
from khala_simulator.tables.abilities import AbilityAim

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from s2clientprotocol import common_pb2, raw_pb2, spatial_pb2, ui_pb2

    from khala_simulator.api.projection import ImagePair
    from khala_simulator.api.seat import PlayerSeat

    Result: TypeAlias = error_pb2.ActionResult.ValueType


ON_MINIMAP = casting.ORDINARY | {"rally"}
"""Commands that a click on the minimap can give, to any unit; PySC2 has no such function for most others."""


class ActionJudgement(NamedTuple):
    """The result code for an action at present, and the plan of its first command, None without one."""

    result: Result
    plan: OrderPlan | None = None


def judge(seat: PlayerSeat, action: sc.Action) -> ActionJudgement:
    """Judge how an action would go at present; an empty one succeeds."""
    plans = list[OrderPlan]()
    for plan in _plans(seat, action):
        plans.append(plan)
        if plan.result != error_pb2.Success:
            return ActionJudgement(plan.result, plans[0])
    return ActionJudgement(_beside_commands(seat, action), plans[0] if plans else None)


def _beside_commands(seat: PlayerSeat, action: sc.Action) -> Result:
    if action.action_raw.HasField("camera_move") and not _finite(action.action_raw.camera_move.center_world_space):
        return error_pb2.MustTargetVisibleLocation
    if action.HasField("action_ui") and not clicks.is_possible(seat, action.action_ui):
        return error_pb2.Error
    return error_pb2.Success


def perform(seat: PlayerSeat, action: sc.Action, loop: int, plan: OrderPlan | None = None) -> None:
    """Carry out an action, and note what the next observation reports of it.

    Args:
        seat: Whose action it is.
        action: The action.
        loop: The loop in which it takes effect.
        plan: The plan of its first command, if it was judged in the present world.
    """
    for planned in _plans(seat, action, plan):
        _give(seat, planned, loop, by_tags=action.action_raw.HasField("unit_command"))
    if action.action_raw.HasField("toggle_autocast"):
        toggle = action.action_raw.toggle_autocast
        if clicks.toggle_autocast(seat.world, seat.player, toggle.ability_id, toggle.unit_tags):
            _report_autocast(seat, toggle.ability_id, toggle.unit_tags, loop)
    if action.action_raw.HasField("camera_move"):
        point = action.action_raw.camera_move.center_world_space
        if _finite(point):
            _move_camera(seat, (point.x + seat.origin[0], point.y + seat.origin[1]), loop)
    spatial, view = _spatial(seat, action)
    if spatial.HasField("camera_move"):
        pixel = spatial.camera_move.center_minimap
        _move_camera(seat, view.minimap.to_world(float(pixel.x), float(pixel.y)), loop)
    if clicks.select(seat, spatial, view.screen):
        report = seat.report(loop)
        for message, shown in _images(seat, report):
            pixels.write_selection(message, shown, spatial, view)
    if action.HasField("action_ui"):
        _press(seat, action.action_ui, loop)


def _spatial(seat: PlayerSeat, action: sc.Action) -> tuple[spatial_pb2.ActionSpatial, ImagePair]:
    """Return the click, and the images that it was on."""
    kind = "action_feature_layer" if action.HasField("action_feature_layer") else "action_render"
    return getattr(action, kind), seat.views.get(kind, seat.view)


def _images(seat: PlayerSeat, action: sc.Action) -> Iterator[tuple[spatial_pb2.ActionSpatial, ImagePair]]:
    """Return the part of a report for each kind of images that its reader has, with these images."""
    return ((getattr(action, kind), view) for kind, view in seat.reported.items())


def _finite(point: common_pb2.Point) -> bool:
    return math.isfinite(point.x) and math.isfinite(point.y)


# commands -------------------------------------------------------------------------------------------------------------


def _plans(seat: PlayerSeat, action: sc.Action, first: OrderPlan | None = None) -> Iterator[OrderPlan]:
    """Yield the plans of an action's commands, each judged when its turn comes; ``first`` is already known."""
    if action.action_raw.HasField("unit_command"):
        command = _from_tags(seat, action.action_raw.unit_command)
        yield first or abilities.judge(seat.world, seat.player, command)
        first = None
    spatial, view = _spatial(seat, action)
    if spatial.HasField("unit_command"):
        command = _from_click(seat, spatial.unit_command, view)
        yield first or abilities.judge(seat.world, seat.player, command)


def _from_tags(seat: PlayerSeat, message: raw_pb2.ActionRawUnitCommand) -> UnitCommand:
    point = None
    if message.HasField("target_world_space_pos"):
        x, y = message.target_world_space_pos.x, message.target_world_space_pos.y
        point = (x + seat.origin[0], y + seat.origin[1])
    return UnitCommand(
        ability=message.ability_id,
        tags=tuple(message.unit_tags),
        target=message.target_unit_tag,
        point=point,
        queue=message.queue_command,
    )


def _from_click(seat: PlayerSeat, message: spatial_pb2.ActionSpatialUnitCommand, view: ImagePair) -> UnitCommand:
    """Return the command that a click on the screen or the minimap gives to the selected units."""
    target = 0
    point = None
    clicked = None
    if message.HasField("target_screen_coord"):
        pixel = message.target_screen_coord
        point = clicked = view.screen.to_world(float(pixel.x), float(pixel.y), seat.camera)
        if _takes_units(seat, message.ability_id):
            sight = seat.look()
            row = at_point(sight, seat.types, point, view.screen.scale / 2)
            if row is not None:
                target = int(sight.tag[row])
                point = None
    elif message.HasField("target_minimap_coord"):
        pixel = message.target_minimap_coord
        point = view.minimap.to_world(float(pixel.x), float(pixel.y))
    tags = tuple(seat.selection.tags)
    return UnitCommand(message.ability_id, tags, target, point, queue=message.queue_command, clicked=clicked)


def _takes_units(seat: PlayerSeat, requested: int) -> bool:
    """Return whether a click can mean a unit: the selected units' form of a general ability may take points only."""
    meant = (abilities.meant(seat.world, slot, requested) for slot in seat.selection.slots(seat.world))
    return any(AbilityAim.UNIT in ability.aim for ability in meant if ability is not None)


def _give(seat: PlayerSeat, plan: OrderPlan, loop: int, *, by_tags: bool) -> None:
    command = plan.asked
    outcome = carry_out(seat.world, plan)
    if outcome.result != error_pb2.Success:
        tag = command.tags[0] if command.tags else 0
        seat.hands.errors.append(
            sc.ActionError(unit_tag=tag, ability_id=max(0, command.ability), result=outcome.result)
        )
        return
    tags = panel_order(seat.world, seat.types, map(seat.world.tag_of, outcome.slots))
    if by_tags and seat.options.raw_affects_selection:
        seat.selection.choose(tags)
    _report_command(seat, command, outcome, tags, loop)


def _report_command(
    seat: PlayerSeat, command: UnitCommand, outcome: CommandOutcome, tags: list[int], loop: int
) -> None:
    action = seat.report(loop)
    if seat.options.raw:
        raw = action.action_raw.unit_command
        raw.ability_id, raw.queue_command = outcome.ability, command.queue
        raw.unit_tags.extend(tags)
        if command.target:
            raw.target_unit_tag = command.target
        elif command.point is not None:
            raw.target_world_space_pos.x = command.point[0] - seat.origin[0]
            raw.target_world_space_pos.y = command.point[1] - seat.origin[1]
    point = command.clicked or command.point
    if command.target and point is None:
        x, y = seat.world.pos[seat.world.slot_of(command.target)].tolist()
        point = x, y
    effect = seat.world.catalog.ability(outcome.ability).effect
    for spatial, view in _images(seat, action):
        spatial.unit_command.ability_id = outcome.ability
        spatial.unit_command.queue_command = command.queue
        if point is not None:
            pixels.write_target(spatial.unit_command, view, seat.camera, point, minimap=effect in ON_MINIMAP)


def _press(seat: PlayerSeat, ui: ui_pb2.ActionUI, loop: int) -> None:
    if not clicks.press(seat, ui):
        return
    if ui.HasField("toggle_autocast"):
        _report_autocast(seat, ui.toggle_autocast.ability_id, seat.selection.tags, loop)
    else:
        seat.report(loop).action_ui.CopyFrom(ui)


def _report_autocast(seat: PlayerSeat, ability: int, tags: Iterable[int], loop: int) -> None:
    """Report a switch of autocast, as a raw action and as a click on the panel."""
    action = seat.report(loop)
    action.action_ui.toggle_autocast.ability_id = ability
    if seat.options.raw:
        action.action_raw.toggle_autocast.ability_id = ability
        action.action_raw.toggle_autocast.unit_tags.extend(tags)


# camera and clicks ----------------------------------------------------------------------------------------------------


def _move_camera(seat: PlayerSeat, point: tuple[float, float], loop: int) -> None:
    seat.move_camera(*point)
    x, y = seat.camera
    action = seat.report(loop)
    if seat.options.raw:
        centre = action.action_raw.camera_move.center_world_space
        centre.x, centre.y = x - seat.origin[0], y - seat.origin[1]
        centre.z = seat.hands.camera_z
    for spatial, view in _images(seat, action):
        pixels.write_camera(spatial.camera_move, view, seat.camera)
