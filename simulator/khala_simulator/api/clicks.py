"""Selection by clicks, rectangles, hotkeys and panels, as actions of a client.

Each function returns whether the action did anything; if not, it is not reported back, as in the game. Above:
`actions.py`. Below: `selection.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import spatial_pb2, ui_pb2

from khala_simulator.abilities import casting
from khala_simulator.abilities.shared import production
from khala_simulator.api import selection as picking
from khala_simulator.api.abilities import meant
from khala_simulator.api.selection import GROUPS, panel_order
from khala_simulator.api.sight import Alliance
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.api.projection import ScreenView
    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.world.world import World

Point = spatial_pb2.ActionSpatialUnitSelectionPoint
Group = ui_pb2.ActionControlGroup
Panel = ui_pb2.ActionMultiPanel
IdleWorker = ui_pb2.ActionSelectIdleWorker


def select(seat: PlayerSeat, spatial: spatial_pb2.ActionSpatial, screen: ScreenView) -> bool:
    """Select by a click or a rectangle on the screen that the player looks at."""
    if spatial.HasField("unit_selection_point"):
        return _select_point(seat, spatial.unit_selection_point, screen)
    if spatial.HasField("unit_selection_rect"):
        return _select_rectangles(seat, spatial.unit_selection_rect, screen)
    return False


def press(seat: PlayerSeat, ui: ui_pb2.ActionUI) -> bool:
    """Apply a hotkey or a click on a panel; panels that are not there do nothing."""
    kind = ui.WhichOneof("action")
    sight = seat.look()
    types = seat.types
    match kind:
        case "control_group":
            done = _use_group(seat, ui.control_group)
        case "select_army":
            done = _choose(seat, sight.tag[picking.army(sight, types)], add=ui.select_army.selection_add)
        case "select_warp_gates":
            done = _choose(seat, sight.tag[picking.warp_gates(sight, types)], add=ui.select_warp_gates.selection_add)
        case "select_larva":
            done = _choose(seat, sight.tag[picking.larvae(sight, types)])
        case "select_idle_worker":
            done = _select_idle_worker(seat, ui.select_idle_worker.type)
        case "multi_panel":
            done = is_possible(seat, ui) and _use_panel(seat, ui.multi_panel)
        case "toggle_autocast":
            done = toggle_autocast(seat.world, seat.player, ui.toggle_autocast.ability_id, seat.selection.tags)
        case "cargo_panel":
            done = _unload(seat, ui.cargo_panel.unit_index)
        case "production_panel":
            done = is_possible(seat, ui) and production.cancel_at(
                seat.world, seat.selection.slots(seat.world)[0], ui.production_panel.unit_index
            )
        case _:
            done = False
    return done


def is_possible(seat: PlayerSeat, ui: ui_pb2.ActionUI) -> bool:
    """Return whether the panel or control group that an action names exists."""
    kind = ui.WhichOneof("action")
    if kind == "control_group":
        return ui.control_group.control_group_index < GROUPS
    if kind == "multi_panel":
        return 0 <= ui.multi_panel.unit_index < len(seat.selection.tags)
    if kind == "cargo_panel":
        return 0 <= ui.cargo_panel.unit_index < len(_cargo(seat))
    if kind == "toggle_autocast":
        return bool(_autocasters(seat.world, seat.player, ui.toggle_autocast.ability_id, seat.selection.tags))
    if kind == "production_panel":
        return 0 <= ui.production_panel.unit_index < _queue_length(seat)
    return True


def toggle_autocast(world: World, player: int, requested: int, tags: Iterable[int]) -> bool:
    """Switch whether units use an ability by themselves; on for all unless all of them do so already."""
    chosen = _autocasters(world, player, requested, tags)
    all_on = all(number in world.autocast.get(slot, ()) for slot, number in chosen)
    for slot, number in chosen:
        kept = tuple(n for n in world.autocast.get(slot, ()) if n != number)
        world.autocast[slot] = kept if all_on else (*kept, number)
    world.casters = None
    return bool(chosen)


def _autocasters(world: World, player: int, requested: int, tags: Iterable[int]) -> list[tuple[int, int]]:
    """Return the player's units among ``tags`` (slots) that could autocast an ability, with its specific id."""
    chosen: list[tuple[int, int]] = []
    for slot in map(world.slot_of, tags):
        ability = meant(world, slot, requested) if slot != NOBODY and world.owner[slot] == player else None
        if ability is not None and ability.autocast:
            chosen.append((slot, ability.id))
    return chosen


def _cargo(seat: PlayerSeat) -> list[int]:
    """Return the tags of the units inside the selected transport, in the order of the panel."""
    slots = seat.selection.slots(seat.world)
    return [seat.world.tag_of(s) for s in seat.world.passengers(slots[0])] if len(slots) == 1 else []


def _queue_length(seat: PlayerSeat) -> int:
    """Return the number of jobs in the selected structure's queue."""
    slots = seat.selection.slots(seat.world)
    own = len(slots) == 1 and seat.world.owner[slots[0]] == seat.player
    return len(seat.world.jobs.get(slots[0], ())) if own else 0


def _unload(seat: PlayerSeat, index: int) -> bool:
    """Make the selected transport unload one of its passengers."""
    cargo = _cargo(seat)
    if not 0 <= index < len(cargo):
        return False
    (carrier,) = seat.selection.slots(seat.world)
    card = seat.world.catalog.abilities_of(int(seat.world.type[carrier]))
    unload = next((a for a in card if a.effect == "unload_unit"), None)
    if unload is None:
        return False
    return bool(casting.use(seat.world, [carrier], unload, target=cargo[index]))


def _choose(seat: PlayerSeat, tags: Iterable[int], *, add: bool = False) -> bool:
    """Select own units in the order of the panel; if there are none, the selection stays as it is."""
    chosen = [int(tag) for tag in tags]
    if not chosen:
        return False
    own = [tag for tag in seat.selection.tags if add and _is_own(seat, tag)]
    seat.selection.choose(panel_order(seat.world, seat.types, [*own, *chosen]))
    return True


def _is_own(seat: PlayerSeat, tag: int) -> bool:
    slot = seat.world.slot_of(tag)
    return slot >= 0 and bool(seat.world.owner[slot] == seat.player)


def _select_point(seat: PlayerSeat, click: Point, screen: ScreenView) -> bool:
    pixel = click.selection_screen_coord
    sight = seat.look()
    types = seat.types
    world_point = screen.to_world(float(pixel.x), float(pixel.y), seat.camera)
    row = picking.at_point(sight, types, world_point, screen.scale / 2)
    if row is None:
        return False
    tag = int(sight.tag[row])
    if int(sight.alliance[row]) != Alliance.SELF:
        seat.selection.choose([tag])
        return True
    if click.type == Point.Toggle and tag in seat.selection.tags:
        seat.selection.remove([tag])
        return True
    if click.type in {Point.AllType, Point.AddAllType}:
        same = (sight.type_id == sight.type_id[row]) & (sight.alliance == Alliance.SELF) & seat.on_screen(sight)
        return _choose(seat, sight.tag[same], add=click.type == Point.AddAllType)
    return _choose(seat, [tag], add=click.type == Point.Toggle)


def _select_rectangles(seat: PlayerSeat, drag: spatial_pb2.ActionSpatialUnitSelectionRect, screen: ScreenView) -> bool:
    sight = seat.look()
    types = seat.types
    rows = [np.zeros(0, np.intp)]
    for rectangle in drag.selection_screen_coord:
        corners = (
            screen.to_world(float(pixel.x), float(pixel.y), seat.camera) for pixel in (rectangle.p0, rectangle.p1)
        )
        rows.append(picking.in_rectangle(sight, types, *corners))
    return _choose(seat, sight.tag[np.unique(np.concatenate(rows))], add=drag.selection_add)


def _select_idle_worker(seat: PlayerSeat, how: IdleWorker.Type.ValueType) -> bool:
    sight = seat.look()
    idle: list[int] = sight.tag[picking.idle_workers(seat.world, sight, seat.types)].tolist()
    if how in {IdleWorker.All, IdleWorker.AddAll}:
        return _choose(seat, idle, add=how == IdleWorker.AddAll)
    fresh = [tag for tag in idle if tag not in seat.selection.tags]
    return _choose(seat, (fresh or idle)[:1], add=how == IdleWorker.Add)


def _use_group(seat: PlayerSeat, message: Group) -> bool:
    index, action = message.control_group_index, message.action
    if index >= GROUPS:
        return False
    groups = seat.selection.groups
    tags = [tag for tag in seat.selection.tags if _is_own(seat, tag)]
    if action == Group.Recall:
        return _choose(seat, groups[index])
    if not tags:
        return False
    if action in {Group.SetAndSteal, Group.AppendAndSteal}:
        for group in groups:
            group[:] = [tag for tag in group if tag not in tags]
    kept = groups[index] if action in {Group.Append, Group.AppendAndSteal} else []
    groups[index] = panel_order(seat.world, seat.types, dict.fromkeys([*kept, *tags]))
    return True


def _use_panel(seat: PlayerSeat, message: Panel) -> bool:
    world, tags = seat.world, seat.selection.tags
    tag = tags[message.unit_index]
    row = world.type[world.slot_of(tag)]
    same = [t for t in tags if world.type[world.slot_of(t)] == row]
    match message.type:
        case Panel.SingleSelect:
            seat.selection.choose([tag])
        case Panel.DeselectUnit:
            seat.selection.remove([tag])
        case Panel.SelectAllOfType:
            seat.selection.choose(same)
        case Panel.DeselectAllOfType:
            seat.selection.remove(same)
    return True
