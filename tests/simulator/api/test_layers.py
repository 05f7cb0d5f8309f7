"""The feature layers against the contract of the API: which there are, their depth and length, and what they show."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from s2clientprotocol import common_pb2, spatial_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import layers
from khala_simulator.api.layer_values import VALUES
from khala_simulator.api.layers import Frame
from khala_simulator.api.sight import Display
from khala_simulator.combat import buffs
from khala_simulator.world.area_effects import AreaEffect

SCREEN = {
    1: "creep power selected hallucinations cloaked blip active buildable pathable placeholder",
    8: "height_map visibility_map player_id player_relative unit_hit_points_ratio unit_energy_ratio "
    "unit_shields_ratio unit_density unit_density_aa effects buff_duration build_progress",
    32: "unit_type unit_hit_points unit_energy unit_shields buffs",
}
MINIMAP = {
    1: "creep camera selected alerts buildable pathable",
    8: "height_map visibility_map player_id player_relative",
    32: "unit_type",
}


def options(
    screen: tuple[int, int] = (64, 64), minimap: tuple[int, int] = (32, 32), **setup: Any
) -> sc.InterfaceOptions:
    """Return an interface with feature layers alone; one pixel of the minimap is one cell of a map of 32 x 32."""
    layers = sc.SpatialCameraSetup(
        width=setup.pop("width", 32),
        resolution=common_pb2.Size2DI(x=screen[0], y=screen[1]),
        minimap_resolution=common_pb2.Size2DI(x=minimap[0], y=minimap[1]),
        **setup,
    )
    return sc.InterfaceOptions(raw=True, feature_layer=layers)


def cells(image: NDArray[Any], value: int) -> set[tuple[int, int]]:
    """Return the pixels (column, row) that hold a value."""
    return {(int(x), int(y)) for y, x in np.argwhere(image == value)}


@pytest.mark.parametrize("size", [(64, 64), (84, 63), (17, 33), (1, 1)])
@pytest.mark.parametrize(("kind", "depths"), [("renders", SCREEN), ("minimap_renders", MINIMAP)])
def test_every_layer_has_its_depth_and_its_exact_length(
    make_table: Any, kind: str, depths: dict[int, str], size: tuple[int, int]
) -> None:
    table = make_table(options(size, size, allow_cheating_layers=True))
    table.put("Stalker", 1, 16, 16)
    sent = getattr(table.observe().feature_layer_data, kind)
    bits = {name: depth for depth, names in depths.items() for name in names.split()}
    assert {field.name for field, _ in sent.ListFields()} == set(bits)
    for name, depth in bits.items():
        image = getattr(sent, name)
        assert (image.bits_per_pixel, image.size.x, image.size.y) == (depth, *size), name
        assert len(image.data) == (size[0] * size[1] * depth + 7) // 8, name


def test_the_tables_of_layers_are_those_of_the_api() -> None:
    assert set(layers.SCREEN_BITS) == {field.name for field in spatial_pb2.FeatureLayers.DESCRIPTOR.fields}
    assert set(layers.MINIMAP_BITS) == {field.name for field in spatial_pb2.FeatureLayersMinimap.DESCRIPTOR.fields}


def test_the_minimap_tells_unit_types_to_cheaters_only(make_table: Any) -> None:
    for allowed in (False, True):
        table = make_table(options(allow_cheating_layers=allowed))
        assert table.observe().feature_layer_data.minimap_renders.HasField("unit_type") is allowed


@pytest.mark.parametrize(("point", "corner"), [((1, 31), (0, 0)), ((31, 31), (1, 0)), ((1, 1), (0, 1))])
def test_images_begin_in_the_north_west(make_table: Any, point: tuple[float, float], corner: tuple[int, int]) -> None:
    table = make_table(options())
    table.put("Stalker", 1, *point)
    for image in (table.screen("unit_type") > 0, table.minimap("player_relative") > 0):
        rows, columns = np.nonzero(image)
        assert {(x >= image.shape[1] / 2, y >= image.shape[0] / 2) for x, y in zip(columns, rows, strict=True)} == {
            (bool(corner[0]), bool(corner[1]))
        }


@pytest.mark.parametrize(
    ("size", "seen"), [((64, 64), (32.0, 32.0)), ((128, 64), (64.0, 32.0)), ((64, 96), (32.0, 48.0))]
)
def test_the_shorter_side_of_the_screen_shows_the_width_and_pixels_are_square(
    make_table: Any, size: tuple[int, int], seen: tuple[float, float]
) -> None:
    table = make_table(options(size))
    scale = 64 / 32
    for x, y in ((10.0, 16.0), (16.0, 25.0)):
        table.put("Nexus", 1, x, y)
    rows, columns = np.nonzero(table.screen("unit_type"))
    left, top = 16 - seen[0] / 2, 16 + seen[1] / 2
    assert columns.min() == pytest.approx((10 - 2.75 - left) * scale, abs=1)
    assert rows.min() == pytest.approx((top - 25 - 2.75) * scale, abs=1)
    assert rows.max() == pytest.approx((top - 16 + 2.75) * scale - 1, abs=1)


def test_a_minimap_of_the_playable_area_begins_at_its_corner(make_table: Any) -> None:
    whole = make_table(options(minimap=(96, 96)), "simple64")
    x0, y0, x1, y1 = whole.world.map.terrain.playable
    assert (x0, y0) != (0, 0)
    cropped = make_table(options(minimap=(x1 - x0, y1 - y0), crop_to_playable_area=True), "simple64")
    for table in (whole, cropped):
        table.put("Stalker", 1, x0 + 10.5, y1 - 5.5)
    height = whole.world.map.terrain.size[1]
    assert (x0 + 10, height - y1 + 5) in cells(whole.minimap("player_relative"), 1)
    assert (10, 5) in cells(cropped.minimap("player_relative"), 1)
    terrain = whole.world.map.terrain
    assert (cropped.minimap("pathable") == terrain.walk[y0:y1, x0:x1][::-1]).all()
    assert (cropped.minimap("buildable") == terrain.build[y0:y1, x0:x1][::-1]).all()
    assert (cropped.minimap("height_map") == terrain.height[y0:y1, x0:x1][::-1]).all()


def test_density_counts_the_units_on_a_pixel(make_table: Any) -> None:
    table = make_table(options((128, 128)))
    for name in ("Marine", "Marine", "Marine", "Medivac"):
        table.put(name, 1, 16, 16)
    assert table.screen("unit_density")[64, 64] == 4
    assert table.screen("unit_density_aa")[64, 64] == 4 * 16
    alone = {name: make_table(options((128, 128))) for name in ("Marine", "Medivac")}
    for name, other in alone.items():
        other.put(name, 1, 16, 16)
    together = 3 * alone["Marine"].screen("unit_density") + alone["Medivac"].screen("unit_density")
    assert (table.screen("unit_density") == together).all()


# what lies on ground and units ----------------------------------------------------------------------------------------


def field(owner: int, x: float, y: float, *, radius: float = 2.0, effect: int = 1) -> AreaEffect:
    return AreaEffect("storm", owner, [(x, y)], radius, 0, 100, effect=effect)


def test_an_effect_is_a_disc_of_its_id_and_radius(make_table: Any) -> None:
    table = make_table(options((128, 128)))
    table.world.area_effects += [field(2, 16, 16), field(1, 24, 8, radius=1.0, effect=11), field(1, 4, 4, effect=0)]
    image = table.screen("effects")
    assert set(np.unique(image)) == {0, 1, 11}
    assert np.count_nonzero(image == 1) == pytest.approx(np.pi * (2 * 4) ** 2, rel=0.05)
    assert np.argwhere(image == 11).mean(axis=0) == pytest.approx((128 - 8 * 4 - 0.5, 24 * 4 - 0.5))


def test_effects_in_the_fog_are_told_to_their_owner_alone(make_table: Any) -> None:
    table = make_table(options(), fog=True)
    table.world.area_effects += [field(2, 8, 8), field(1, 24, 24, effect=6)]
    assert set(np.unique(table.screen("effects"))) == {0, 6}
    table.put("Stalker", 1, 8, 12)
    table.game.step(8)
    assert set(np.unique(table.screen("effects"))) == {0, 1, 6}


def test_a_buff_shows_its_id_and_what_remains_of_it(make_table: Any) -> None:
    table = make_table(options())
    marine = table.put("Marine", 1, 16, 16)
    stimpack = table.world.catalog.buff("Stimpack")
    assert not table.screen("buffs").any()
    buffs.apply(table.world, marine, "Stimpack", source=marine)
    assert table.screen("buffs")[32, 32] == stimpack.id
    assert table.screen("buff_duration")[32, 32] == 255
    table.game.step(int(stimpack.loops) // 4)
    assert table.screen("buff_duration")[32, 32] == int(255 * 0.75)
    table.game.step(int(stimpack.loops))
    assert not table.screen("buffs").any()


def test_power_surrounds_a_finished_pylon(make_table: Any) -> None:
    table = make_table(options((128, 128)))
    pylon = table.put("Pylon", 1, 16, 16)
    table.put("Pylon", 2, 4, 4)
    assert np.count_nonzero(table.screen("power")) == pytest.approx(np.pi * (6.5 * 4) ** 2, rel=0.02)
    table.world.build_progress[pylon] = 0.5
    assert not table.screen("power").any()
    assert table.screen("build_progress")[64, 64] == 127


def test_radar_tells_where_unseen_units_are_and_nothing_else(make_table: Any) -> None:
    table = make_table(options((128, 128)), fog=True)
    tower = table.put("SensorTower", 1, 4, 4)
    table.put("Roach", 2, 24, 20)
    table.put("SpawningPool", 2, 28, 28)
    table.game.step(8)
    assert np.argwhere(table.screen("blip")).mean(axis=0) == pytest.approx((128 - 20 * 4 - 0.5, 24 * 4 - 0.5), abs=2)
    assert not table.screen("unit_type")[30:60, 80:110].any()
    (ring,) = table.observe().raw_data.radar
    assert (ring.pos.x, ring.pos.y, ring.radius) == (4, 4, 30)
    table.world.build_progress[tower] = 0.5
    assert not table.screen("blip").any()
    assert not table.observe().raw_data.radar


def test_a_placeholder_is_a_unit_that_is_to_be_built(make_table: Any) -> None:
    table = make_table(options())
    table.put("Pylon", 1, 16, 16)
    sight = table.seat.look()
    planned = dataclasses.replace(sight, display=np.full(len(sight), Display.PLACEHOLDER.value))
    frame = Frame(
        table.world, table.game.types, 1, planned, np.zeros(1, np.bool_), (16, 16), np.zeros((0, 2)), fogged=False
    )
    values = dict(zip(VALUES, layers.unit_values(frame)[:, 0].tolist(), strict=True))
    assert (values["placeholder"], values["unit_type"]) == (1, table.world.catalog.unit("Pylon").id)
    assert not table.screen("placeholder").any()
