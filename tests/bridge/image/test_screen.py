"""The screen of a team: everything is where its screen coordinate says, in the colours that the title says."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from s2clientprotocol import raw_pb2

from khala_bridge.frames import Camera
from khala_bridge.observe.image import palette, screen
from khala_bridge.observe.image.canvas import margin_of
from khala_bridge.observe.image.moment import Moment
from khala_bridge.observe.image.palette import LIVERIES

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.observe.image.palette import Colour
    from khala_bridge.state import Snapshot

    Snap = Callable[..., Snapshot]
    Unit = Callable[..., raw_pb2.Unit]

SIZE = 512


def found(image: NDArray[np.uint8], colour: Colour, near: int = 6) -> NDArray[np.intp]:
    """Return the columns and rows, (n, 2), of the pixels of a colour."""
    off = np.abs(image.astype(np.int16) - np.array(colour)).max(axis=2)
    rows, columns = np.nonzero(off <= near)
    return np.stack([columns, rows], axis=1)


def pixel_of(x: float, y: float, size_px: int, extent: float = 24.0) -> tuple[float, float]:
    """Return the pixel of a point of the screen frame, worked out by hand."""
    margin = margin_of(size_px, extent)
    scale = (size_px - margin) / extent
    return margin + x * scale - 0.5, margin + y * scale - 0.5


@pytest.mark.parametrize("size_px", [256, 512, 768])
@pytest.mark.parametrize(("x", "y"), [(16, 16), (10.5, 20.25), (24.1, 9.7), (6.3, 6.3)])
def test_a_body_is_where_its_screen_coordinate_says(
    snapshot: Snap, unit: Unit, size_px: int, x: float, y: float
) -> None:
    camera = Camera(16.3, 15.9)
    moment = Moment(snapshot([unit(1, "Marine", x, y, alliance="enemy", radius=0.9, facing=0.0)]))
    image, _ = screen.draw(moment, camera, frozenset(), size_px, marks=False, grid=False)
    body = found(image, LIVERIES["enemy"].body)
    disc = body[:, 0].min(), body[:, 0].max(), body[:, 1].min(), body[:, 1].max()
    column, row = pixel_of(*camera.screen(x, y), size_px)
    assert (disc[2] + disc[3]) / 2 == pytest.approx(row, abs=1)  # its nose points to the right: rows are symmetric
    assert column == pytest.approx(disc[0] + (disc[3] - disc[2]) / 2, abs=1.5)


def test_frames_of_other_sizes_have_their_units_at_the_same_places(snapshot: Snap, unit: Unit) -> None:
    moment = Moment(snapshot([unit(1, "Marine", 12, 20, alliance="enemy", radius=0.9)]))
    middles = []
    for extent in (24.0, 128.0):
        camera = Camera(16, 16, extent)
        image, _ = screen.draw(moment, camera, frozenset(), SIZE, marks=False, grid=False)
        body = found(image, LIVERIES["enemy"].body)
        _, row = pixel_of(*camera.screen(12, 20), SIZE, extent)
        assert (body[:, 1].min() + body[:, 1].max()) / 2 == pytest.approx(row, abs=1)
        middles.append(row)
    assert middles[0] == pytest.approx(middles[1], abs=8)  # the labels of 128 take a little more room


def test_a_unit_that_faces_up_has_its_nose_above(snapshot: Snap, unit: Unit) -> None:
    moment = Moment(snapshot([unit(1, "Marine", 16, 16, alliance="enemy", radius=1.0, facing=math.pi / 2)]))
    image, _ = screen.draw(moment, Camera(16, 16), frozenset(), SIZE, marks=False, grid=False)
    body = found(image, LIVERIES["enemy"].body)
    _, row = pixel_of(12, 12, SIZE)
    assert row - body[:, 1].min() > 1.2 * (body[:, 1].max() - row)


@pytest.mark.parametrize(
    ("alliance", "own", "livery"),
    [("own", True, "team"), ("own", False, "own"), ("ally", False, "ally"), ("enemy", False, "enemy")],
)
def test_sides_have_their_colours(snapshot: Snap, unit: Unit, alliance: str, own: bool, livery: palette.Side) -> None:
    moment = Moment(snapshot([unit(1, "Stalker", 16, 16, alliance=alliance, radius=1.0)]))
    image, legend = screen.draw(moment, Camera(16, 16), frozenset([1] if own else []), SIZE, marks=False)
    column, row = (round(value) for value in pixel_of(12, 12, SIZE))
    assert tuple(image[row + 12, column].tolist()) == pytest.approx(LIVERIES[livery].body, abs=8)
    assert legend.sides == (livery,)


@pytest.mark.parametrize(("health", "colour"), [(80, "HEALTHY"), (50, "HURT"), (20, "DYING")])
def test_a_hurt_unit_has_a_bar_as_long_as_its_health(snapshot: Snap, unit: Unit, health: int, colour: str) -> None:
    one = unit(1, "Marine", 16, 16, alliance="enemy", radius=1.0, health=health, health_max=100)
    image, _ = screen.draw(Moment(snapshot([one])), Camera(16, 16), frozenset(), SIZE, marks=False, grid=False)
    bar = found(image, getattr(palette, colour), near=0)
    width = 2 * round(1.0 * (SIZE - margin_of(SIZE, 24)) / 24)
    assert np.ptp(bar[:, 0]) + 1 == pytest.approx(width * health / 100, abs=1)
    _, row = pixel_of(12, 12, SIZE)
    assert bar[:, 1].max() < row - width / 2


def test_a_unit_in_full_health_has_no_bar(snapshot: Snap, unit: Unit) -> None:
    moment = Moment(snapshot([unit(1, "Stalker", 16, 16, alliance="enemy", radius=1.0)]))
    image, _ = screen.draw(moment, Camera(16, 16), frozenset(), SIZE, marks=False)
    assert not len(found(image, palette.HEALTHY, near=0))


def test_what_is_cloaked_or_remembered_is_half_seen(snapshot: Snap, unit: Unit) -> None:
    plain = unit(1, "Stalker", 16, 16, alliance="enemy", radius=1.0)
    cloaked = unit(1, "Stalker", 16, 16, alliance="enemy", radius=1.0, cloak=raw_pb2.CloakedDetected)
    shown = [screen.draw(Moment(snapshot([one])), Camera(16, 16), frozenset(), SIZE)[0] for one in (plain, cloaked)]
    ground = screen.draw(Moment(snapshot([])), Camera(16, 16), frozenset(), SIZE)[0]
    column, row = (round(value) for value in pixel_of(12, 12, SIZE))
    part = np.s_[row + 12, column]
    assert shown[1][part] == pytest.approx((shown[0][part].astype(int) + ground[part]) / 2, abs=14)


def test_grid_lines_stand_every_three_units_and_can_be_left_out(snapshot: Snap) -> None:
    moment = Moment(snapshot([]))
    ruled, plain = (screen.draw(moment, Camera(16, 16), frozenset(), SIZE, grid=grid)[0] for grid in (True, False))
    margin, size = margin_of(SIZE, 24), SIZE - margin_of(SIZE, 24)
    lines = np.flatnonzero((ruled != plain).any(axis=(0, 2))) - margin
    between = np.flatnonzero((ruled[margin + 5] != plain[margin + 5]).any(axis=1)) - margin
    assert len(lines) == size  # horizontal lines touch every column
    assert between.tolist() == [round(k * size / 8) for k in range(1, 8)]


def test_an_effect_lies_at_its_place_with_its_radius(snapshot: Snap) -> None:
    def storm(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        effect = response.observation.raw_data.effects.add(effect_id=6, radius=3.0, alliance=raw_pb2.Self)
        effect.pos.add(x=14.0, y=19.0)

    shown = snapshot([], change=storm)
    image, _ = screen.draw(Moment(shown), Camera(16, 16), frozenset(), SIZE, grid=False)
    bare, _ = screen.draw(Moment(snapshot([])), Camera(16, 16), frozenset(), SIZE, grid=False)
    changed = np.argwhere((image != bare).any(axis=2))
    middle, (column, row) = changed.mean(axis=0), pixel_of(10, 9, SIZE)
    assert middle == pytest.approx((row, column), abs=2.5)  # its name stands in its upper half
    assert np.ptp(changed[:, 1]) == pytest.approx(6 * (SIZE - margin_of(SIZE, 24)) / 24, abs=4)


def test_nothing_is_drawn_on_the_margins(snapshot: Snap, unit: Unit) -> None:
    crowd = [unit(0x100000001 + (k << 18), "Zealot", 4 + k % 6, 20 + k // 6, radius=0.5) for k in range(36)]
    empty, full = (screen.draw(Moment(snapshot(units)), Camera(16, 16), frozenset(), SIZE)[0] for units in ([], crowd))
    margin = margin_of(SIZE, 24)
    assert (full != empty).any()
    assert (full[:margin] == empty[:margin]).all()
    assert (full[:, :margin] == empty[:, :margin]).all()


def test_labels_of_the_axes_are_written(snapshot: Snap) -> None:
    image, _ = screen.draw(Moment(snapshot([])), Camera(16, 16), frozenset(), SIZE)
    margin, size = margin_of(SIZE, 24), SIZE - margin_of(SIZE, 24)
    for k in range(9):
        at = min(margin + round(k * size / 8), SIZE - 8)
        assert image[: margin - 3, at - 8 : at + 8].max() > 150, k
        assert k == 0 or image[at - 8 : at + 8, : margin - 3].max() > 150, k


def test_a_camera_beyond_the_map_shows_void(snapshot: Snap) -> None:
    image, _ = screen.draw(Moment(snapshot([])), Camera(-20, 40), frozenset(), SIZE, grid=False)
    inner = image[margin_of(SIZE, 24) :, margin_of(SIZE, 24) :]
    assert (inner == np.array(palette.VOID)).all()


def test_creep_and_fog_lie_where_the_game_says(snapshot: Snap) -> None:
    creep, sight = np.zeros((32, 32), np.uint8), np.full((32, 32), 2, np.uint8)
    creep[20:, :] = 1  # y from 20 up, as raw grids begin at the bottom
    sight[:, :8] = 0

    def cover(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        state = response.observation.raw_data.map_state
        for image in (state.creep, state.visibility):
            image.size.x = image.size.y = 32
        state.creep.bits_per_pixel, state.visibility.bits_per_pixel = 1, 8
        state.creep.data, state.visibility.data = np.packbits(creep).tobytes(), sight.tobytes()

    plain, shown = snapshot([]), snapshot([], change=cover)
    images = [screen.draw(Moment(s), Camera(16, 16), frozenset(), SIZE, grid=False)[0] for s in (plain, shown)]
    for (x, y), is_dark, is_creep in (((12, 18), False, False), ((12, 3), False, True), ((1, 18), True, False)):
        column, row = (round(value) for value in pixel_of(x, y, SIZE))
        before, after = (image[row, column].astype(int) for image in images)
        assert (after.sum() < 0.5 * before.sum()) == is_dark, (x, y)
        assert (int(after[0]) - int(after[1]) > 20) == is_creep, (x, y)


def test_the_same_snapshot_gives_the_same_pixels(snapshot: Snap, battle: list[raw_pb2.Unit]) -> None:
    first, second = (screen.draw(Moment(snapshot(battle)), Camera(14, 16), frozenset(), SIZE)[0] for _ in range(2))
    assert np.array_equal(first, second)
