"""Feature layers: values drawn from raw data or taken from the game, and the colours that the legend says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from s2clientprotocol import spatial_pb2

from khala_bridge.frames import Camera
from khala_bridge.observe.image import features, own
from khala_bridge.observe.image.layers import LAYERS, FeatureLayer, colour, explain
from khala_bridge.observe.image.moment import Moment
from khala_bridge.observe.image.palette import LIVERIES
from khala_bridge.task.images import DRAWN_LAYERS, GAME_LAYERS, MINIMAP_LAYERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.state import Snapshot

    Snap = Callable[..., Snapshot]
    Change = Callable[[sc_pb.ResponseObservation, sc_pb.ResponseGameInfo], None]
    Unit = Callable[..., raw_pb2.Unit]

SIZE = 240  # ten pixels a world unit


def values(layer: str, shown: Snapshot, camera: Camera) -> np.ndarray:
    draw = LAYERS[layer].values
    assert draw is not None
    return draw(Moment(shown), camera, SIZE)


def grid_of(name: str, cells: np.ndarray, bits: int = 1) -> Change:
    """Give a map a grid, `[y, x]` from the bottom left."""

    def change(_: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
        image = getattr(info.start_raw, name)
        image.size.x, image.size.y, image.bits_per_pixel = cells.shape[1], cells.shape[0], bits
        image.data = np.packbits(cells).tobytes() if bits == 1 else cells.astype(np.uint8).tobytes()

    return change


def test_every_layer_that_may_be_asked_for_is_there_and_no_other() -> None:
    assert set(DRAWN_LAYERS) == {name for name, layer in LAYERS.items() if layer.values is not None}
    assert set(LAYERS) == {*DRAWN_LAYERS, *GAME_LAYERS, *MINIMAP_LAYERS}
    assert set(features.SHOWN) <= set(DRAWN_LAYERS)


def test_they_are_those_of_the_game() -> None:
    screen = {field.name for field in spatial_pb2.FeatureLayers.DESCRIPTOR.fields}
    assert {*DRAWN_LAYERS, *GAME_LAYERS} == screen
    assert set(MINIMAP_LAYERS) == {field.name for field in spatial_pb2.FeatureLayersMinimap.DESCRIPTOR.fields}


@pytest.mark.parametrize(("layer", "grid"), [("buildable", "placement_grid"), ("pathable", "pathing_grid")])
def test_a_grid_of_the_map_is_seen_through_the_camera(snapshot: Snap, layer: str, grid: str) -> None:
    cells = np.zeros((32, 32), np.uint8)
    cells[20, 10] = 1  # world cell x 10 to 11, y 20 to 21
    shown = snapshot([], change=grid_of(grid, cells))
    seen = values(layer, shown, Camera(12.5, 16.0))
    rows, columns = np.nonzero(seen)
    # on the screen x 9.5 to 10.5, y 7 to 8
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (95, 104, 70, 79)


def test_heights_are_those_of_the_game(snapshot: Snap) -> None:
    heights = np.repeat(np.arange(32)[:, None] * 8, 32, axis=1)
    shown = snapshot([], change=grid_of("terrain_height", heights, bits=8))
    seen = values("height_map", shown, Camera(16, 16))
    assert [int(seen[row, 100]) for row in (5, 125, 235)] == pytest.approx([27 * 8, 15 * 8, 4 * 8], abs=1)


@pytest.mark.parametrize(
    ("layer", "value"),
    [("player_relative", 4), ("unit_hit_points_ratio", 128), ("unit_shields_ratio", 51), ("build_progress", 255)],
)
def test_a_units_body_has_its_value(snapshot: Snap, unit: Unit, layer: str, value: int) -> None:
    one = unit(1, "Zealot", 16, 16, alliance="enemy", radius=1.0, health=50, health_max=100, shield=10, shield_max=50)
    seen = values(layer, snapshot([one]), Camera(16, 16))
    assert seen[120, 120] == pytest.approx(value, abs=1)
    assert int((seen > 0).sum()) == pytest.approx(np.pi * 100, rel=0.12)


def test_units_on_one_point_are_counted(snapshot: Snap, unit: Unit) -> None:
    shown = snapshot([unit(tag, "Overlord", 16, 16, alliance="enemy", radius=1.0) for tag in (1, 2, 3)])
    assert values("unit_density", shown, Camera(16, 16))[120, 120] == 3


@pytest.mark.parametrize("layer", [layer for layer in LAYERS.values() if layer.colours], ids=lambda layer: layer.name)
def test_values_have_the_colours_of_the_legend(layer: FeatureLayer) -> None:
    cells = np.array([[value for value, _, _ in layer.colours]], np.uint8)
    assert colour(layer, cells)[0].tolist() == [list(colour) for _, _, colour in layer.colours]


def test_scalars_grow_lighter(snapshot: Snap) -> None:
    ramp = colour(LAYERS["unit_hit_points_ratio"], np.arange(1, 256, dtype=np.uint8)[None])
    grey = ramp[0] @ np.array([0.114, 0.587, 0.299])
    assert (np.diff(grey) > -1).all()
    assert grey[-1] - grey[0] > 120


def test_the_legend_is_written_into_the_picture() -> None:
    image = colour(LAYERS["player_relative"], np.zeros((SIZE, SIZE), np.uint8))
    explain(image, LAYERS["player_relative"])
    for name in ("team", "enemy"):
        assert (image == np.array(LIVERIES[name].body)).all(axis=2).sum() == 8 * 7


# --- the game's own -----------------------------------------------------------------------------------------


def real_layer(name: str, pixels: np.ndarray, bits: int = 8) -> Change:
    """Give a snapshot a feature layer of the game's own."""

    def change(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        image = getattr(response.observation.feature_layer_data.renders, name)
        image.size.x = image.size.y = len(pixels)
        image.bits_per_pixel = bits
        kinds = {1: None, 8: np.uint8, 32: "<i4"}
        image.data = np.packbits(pixels).tobytes() if bits == 1 else pixels.astype(kinds[bits]).tobytes()

    return change


@pytest.mark.parametrize("bits", [8, 32])
@pytest.mark.parametrize(("shift_x", "shift_y"), [(0.0, 0.0), (2.0, -1.5)])
def test_the_games_own_layer_is_moved_to_where_the_team_is(
    snapshot: Snap, bits: int, shift_x: float, shift_y: float
) -> None:
    pixels = np.zeros((48, 48), np.int64)
    pixels[10, 20] = 77  # screen x 10 to 10.5, y 5 to 5.5 of the game's camera
    shown = snapshot([], camera=(16, 16), change=real_layer("unit_type", pixels, bits))
    seen = own.layer(shown, "unit_type", Camera(16 + shift_x, 16 + shift_y), SIZE)
    assert seen is not None
    rows, columns = np.nonzero(seen == 77)
    assert (columns.min(), columns.max() + 1) == (10 * (10 - shift_x), 10 * (10.5 - shift_x))
    assert (rows.min(), rows.max() + 1) == (10 * (5 + shift_y), 10 * (5.5 + shift_y))


def test_one_bit_layers_are_unpacked(snapshot: Snap) -> None:
    pixels = np.zeros((24, 24), np.uint8)
    pixels[3, 4] = 1
    shown = snapshot([], camera=(16, 16), change=real_layer("creep", pixels, 1))
    seen = own.layer(shown, "creep", Camera(16, 16), 24)
    assert seen is not None
    assert np.argwhere(seen).tolist() == [[3, 4]]


@pytest.mark.parametrize(("x", "y", "is_there"), [(16, 16, True), (19, 13, True), (19.1, 16, False), (16, 12.9, False)])
def test_a_camera_elsewhere_has_no_pixels_of_the_game(snapshot: Snap, x: float, y: float, is_there: bool) -> None:
    shown = snapshot([], camera=(16, 16), change=real_layer("creep", np.zeros((24, 24), np.uint8)))
    assert (own.layer(shown, "creep", Camera(x, y), SIZE) is not None) == is_there


def test_what_was_not_sent_is_not_there(snapshot: Snap) -> None:
    shown = snapshot([], camera=(16, 16))
    assert own.layer(shown, "creep", Camera(16, 16), SIZE) is None
    assert own.minimap_layer(shown, "creep", SIZE) is None
    assert own.screen(shown, Camera(16, 16), SIZE) is None
    assert own.minimap(shown, SIZE) is None


def test_rendered_images_keep_their_colours(snapshot: Snap) -> None:
    def render(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        for image in (response.observation.render_data.map, response.observation.render_data.minimap):
            image.size.x = image.size.y = 24
            image.bits_per_pixel = 24
            image.data = np.tile(np.array([200, 100, 50], np.uint8), 24 * 24).tobytes()  # red, green, blue

    shown = snapshot([], camera=(16, 16), change=render)
    for seen in (own.screen(shown, Camera(16, 16), SIZE), own.minimap(shown, SIZE)):
        assert seen is not None
        assert (seen[8:-8, 8:-8] == np.array([50, 100, 200])).all()  # towards its edge it fades into black
