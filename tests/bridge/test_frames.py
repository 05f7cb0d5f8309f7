"""World, screen and minimap: the ways between them are each other's inverse, and PySC2's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_bridge.compat import features, point
from khala_bridge.frames import Camera, MapFrame, MinimapPoint, ScreenPoint, WorldPoint, sees

WORLD = st.floats(0, 200, allow_nan=False)
MAPS = (MapFrame(32, 32, (0, 0, 32, 32)), MapFrame(96, 60, (0, 23, 96, 52)), MapFrame(88, 96, (10, 8, 80, 90)))


@given(WORLD, WORLD, WORLD, WORLD, st.sampled_from([24.0, 128.0]))
def test_screen_and_back_is_the_same_place(cx: float, cy: float, x: float, y: float, size: float) -> None:
    camera = Camera(cx, cy, size)
    assert camera.world(camera.screen(x, y)) == pytest.approx(WorldPoint(x, y), abs=1e-9)


@given(WORLD, WORLD, st.sampled_from(MAPS))
def test_minimap_and_back_is_the_same_place(x: float, y: float, frame: MapFrame) -> None:
    assert frame.world(frame.minimap(x, y)) == pytest.approx(WorldPoint(x, y), abs=1e-9)


@given(WORLD, WORLD, WORLD, WORLD)
def test_a_camera_sees_what_is_inside_of_its_frame(cx: float, cy: float, x: float, y: float) -> None:
    camera = Camera(cx, cy)
    screen = camera.screen(x, y)
    if all(abs(value - edge) > 1e-9 for value in screen for edge in (0, 24)):
        shown = sees(np.array([[cx, cy]]), np.array([[x, y]]))
        assert shown.tolist() == [[0 <= screen.x < 24 and 0 <= screen.y < 24]]


def test_the_screen_has_y_down_and_its_centre_in_the_middle() -> None:
    camera = Camera(16, 20)
    assert camera.screen(16, 20) == ScreenPoint(12, 12)
    assert camera.screen(17, 22) == ScreenPoint(13, 10)


def test_the_minimap_has_y_down_and_one_scale_for_both_axes() -> None:
    frame = MapFrame(96, 60, (0, 0, 96, 60))
    assert frame.minimap(96, 60) == MinimapPoint(64, 0)
    assert frame.minimap(0, 0) == MinimapPoint(0, 40)


@pytest.mark.parametrize(
    ("camera", "bounds"),
    [
        (Camera(16, 16), (0, 0, 24, 24)),
        (Camera(3, 16), (9, 0, 24, 24)),
        (Camera(29, 2), (0, 0, 15, 14)),
        (Camera(16, 31, 128), (0, pytest.approx(58.667, abs=1e-3), 128, 128)),
    ],
)
def test_bounds_are_the_part_of_the_screen_that_is_on_the_map(camera: Camera, bounds: tuple[float, ...]) -> None:
    assert camera.bounds(MAPS[0]) == bounds


@pytest.mark.parametrize("size", [(32, 32), (96, 60), (88, 96)])
def test_both_frames_agree_with_those_of_pysc2(size: tuple[int, int]) -> None:
    reference = features.Features(
        features.AgentInterfaceFormat(
            feature_dimensions=features.Dimensions(screen=128, minimap=64), use_feature_units=True
        ),
        map_size=point.Point(*size),
    )
    centre, place = point.Point(20, 30), point.Point(14.3, 33.9)
    reference._update_camera(centre)
    theirs = reference._world_to_feature_screen_px.fwd_pt(place)
    ours = Camera(20, 30, 128).screen(14.3, 33.9)
    assert (math.floor(ours.x), math.floor(ours.y)) == (theirs.x, theirs.y)
    minimap = MapFrame(*size, (0, 0, *size)).minimap(14.3, 33.9)
    scale = 64 / max(size)
    assert minimap == pytest.approx((14.3 * scale, (size[1] - 33.9) * scale))
