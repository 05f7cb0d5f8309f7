"""Where on a client's images a click would have caused an action.

A client may look at feature layers, at rendered images or at both, each in its own size; what a player did is reported
in the pixels of each. Writes messages, knows no rules. Above: `actions.py`. Below: `projection.py`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from s2clientprotocol import common_pb2, spatial_pb2

    from khala_simulator.api.projection import ImagePair, ScreenView

    Point = tuple[float, float]


def write_target(
    message: spatial_pb2.ActionSpatialUnitCommand,
    view: ImagePair,
    camera: Point,
    point: tuple[float, float],
    *,
    minimap: bool,
) -> None:
    """Write the click at a world point: on the screen, else on the minimap, else at the screen's edge."""
    column, row = (math.floor(v) for v in view.screen.to_pixels(*point, camera))
    inside = 0 <= column < view.screen.columns and 0 <= row < view.screen.rows
    if minimap and not inside:
        _write_on_minimap(message.target_minimap_coord, view, point)
        return
    message.target_screen_coord.x = min(max(column, 0), view.screen.columns - 1)
    message.target_screen_coord.y = min(max(row, 0), view.screen.rows - 1)


def write_camera(message: spatial_pb2.ActionSpatialCameraMove, view: ImagePair, camera: Point) -> None:
    """Write the click on the minimap that moves the camera here."""
    _write_on_minimap(message.center_minimap, view, camera)


def write_selection(
    message: spatial_pb2.ActionSpatial, view: ImagePair, clicked: spatial_pb2.ActionSpatial, on: ImagePair
) -> None:
    """Write a click or a rectangle on the screen of one view, in the pixels of another one."""
    message.CopyFrom(clicked)
    if view is on:
        return
    if message.HasField("unit_selection_point"):
        _translate(message.unit_selection_point.selection_screen_coord, on.screen, view.screen)
    for rectangle in message.unit_selection_rect.selection_screen_coord:
        _translate(rectangle.p0, on.screen, view.screen)
        _translate(rectangle.p1, on.screen, view.screen)


def _write_on_minimap(pixel: common_pb2.PointI, view: ImagePair, point: Point) -> None:
    column, row = (math.floor(v) for v in view.minimap.to_pixels(*point))
    pixel.x = min(max(column, 0), view.minimap.columns - 1)
    pixel.y = min(max(row, 0), view.minimap.rows - 1)


def _translate(pixel: common_pb2.PointI, source: ScreenView, target: ScreenView) -> None:
    centre = (0.0, 0.0)  # both screens look through the same camera
    column, row = target.to_pixels(*source.to_world(float(pixel.x), float(pixel.y), centre), centre)
    pixel.x = min(max(math.floor(column), 0), target.columns - 1)
    pixel.y = min(max(math.floor(row), 0), target.rows - 1)
