"""Where things of the world are on the screen and on the minimap."""

import pytest

from khala_simulator.api.projection import Minimap, Rect, ScreenView

SQUARE = ScreenView(128, 128, 24.0)
WIDE = ScreenView(84, 64, 24.0)
MAP = Minimap(64, 64, Rect(0, 0, 32, 32))


def test_the_camera_is_the_middle_of_the_screen() -> None:
    assert SQUARE.to_pixels(16.0, 16.0, (16.0, 16.0)) == (64.0, 64.0)


def test_north_is_up_and_east_is_right() -> None:
    x, y = SQUARE.to_pixels(19.0, 22.0, (16.0, 16.0))
    assert (x, y) == (80.0, 32.0)


def test_pixels_are_square_in_the_world_on_an_oblong_screen() -> None:
    x, y = WIDE.to_pixels(17.0, 15.0, (16.0, 16.0))
    assert x - 42 == pytest.approx(y - 32)
    assert WIDE.view((16.0, 16.0)).y0 == 4.0  # the shorter side shows 24 world units
    assert WIDE.view((16.0, 16.0)).x0 == 16 - 84 * 24 / 64 / 2


@pytest.mark.parametrize("pixel", [(0, 0), (127, 0), (63, 64), (127, 127)])
def test_a_pixel_of_the_screen_means_its_own_centre(pixel: tuple[int, int]) -> None:
    world = SQUARE.to_world(*pixel, camera=(20.0, 9.0))
    x, y = SQUARE.to_pixels(*world, camera=(20.0, 9.0))
    assert (x, y) == (pixel[0] + 0.5, pixel[1] + 0.5)


def test_the_minimap_has_the_north_west_corner_of_the_map_at_its_origin() -> None:
    assert MAP.to_pixels(0.0, 32.0) == (0.0, 0.0)
    assert MAP.to_pixels(32.0, 0.0) == (64.0, 64.0)


def test_the_longer_side_of_the_map_fills_the_minimap() -> None:
    oblong = Minimap(64, 64, Rect(0, 0, 96, 48))
    assert oblong.scale == 1.5
    assert oblong.to_pixels(96.0, 0.0) == (64.0, 32.0)


def test_a_cropped_minimap_shows_the_playable_area_alone() -> None:
    cropped = Minimap(64, 64, Rect(0, 23, 96, 74))
    assert cropped.to_pixels(0.0, 74.0) == (0.0, 0.0)
    assert cropped.to_world(0, 0) == (0.75, 73.25)


@pytest.mark.parametrize(
    ("point", "clamped"), [((5.0, 5.0), (5.0, 5.0)), ((-3.0, 40.0), (0.0, 32.0)), ((99.0, 8.0), (32.0, 8.0))]
)
def test_points_off_the_map_are_clamped_to_it(point: tuple[float, float], clamped: tuple[float, float]) -> None:
    assert MAP.area.clamp(*point) == clamped
