"""What an observation holds: presence of fields, counters, images and where units are on them."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from s2clientprotocol import common_pb2, debug_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.layers import MINIMAP_BITS, SCREEN_BITS
from khala_simulator.process.client import Client, command, interface

STALKER, ZEALOT, NEXUS, OBSERVER, DARK_TEMPLAR, MINERALS = 74, 73, 59, 82, 76, 341
DTYPES: dict[int, np.dtype[Any]] = {8: np.dtype(np.uint8), 32: np.dtype("<i4")}


def create(unit_type: int, owner: int, point: tuple[float, float], quantity: int = 1) -> debug_pb2.DebugCommand:
    return debug_pb2.DebugCommand(
        create_unit=debug_pb2.DebugCreateUnit(
            unit_type=unit_type, owner=owner, pos=common_pb2.Point2D(x=point[0], y=point[1]), quantity=quantity
        )
    )


def kill(tags: list[int]) -> debug_pb2.DebugCommand:
    return debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags))


def stage(*units: debug_pb2.DebugCommand, options: sc.InterfaceOptions | None = None) -> Client:
    """Return a game in which only these units are left, one loop after they were made."""
    client = Client()
    first = client.play(options=options)
    client.debug(*units)
    client.debug(kill([unit.tag for unit in first.observation.raw_data.units]))
    client.step()
    return client


def of_type(seen: sc.ResponseObservation, unit_type: int) -> raw_pb2.Unit:
    (unit,) = (unit for unit in seen.observation.raw_data.units if unit.unit_type == unit_type)
    return unit


def image(data: common_pb2.ImageData) -> NDArray[Any]:
    """Return an image as PySC2 unpacks it."""
    if data.bits_per_pixel == 1:
        pixels = np.unpackbits(np.frombuffer(data.data, np.uint8))[: data.size.x * data.size.y]
    else:
        pixels = np.frombuffer(data.data, DTYPES[data.bits_per_pixel])
    return pixels.reshape(data.size.y, data.size.x)


def screen(seen: sc.ResponseObservation, name: str) -> NDArray[Any]:
    return image(getattr(seen.observation.feature_layer_data.renders, name))


def minimap(seen: sc.ResponseObservation, name: str) -> NDArray[Any]:
    return image(getattr(seen.observation.feature_layer_data.minimap_renders, name))


# presence -------------------------------------------------------------------------------------------------------------

ALWAYS = {
    "display_type", "alliance", "tag", "unit_type", "owner", "pos", "facing", "radius", "build_progress", "cloak",
    "is_on_screen", "is_blip",
}  # fmt: skip
SEEN = {
    "is_selected", "health", "health_max", "shield", "shield_max", "energy", "energy_max", "is_flying", "is_burrowed",
    "is_hallucination", "is_active", "armor_upgrade_level", "shield_upgrade_level",
}  # fmt: skip
ARMED = {"attack_upgrade_level", "weapon_cooldown"}
HARVEST = {"assigned_harvesters", "ideal_harvesters"}


@pytest.mark.parametrize(
    ("unit_type", "owner", "fields"),
    [
        (STALKER, 1, ALWAYS | SEEN | ARMED | HARVEST),
        (NEXUS, 1, ALWAYS | SEEN | HARVEST | {"is_powered"}),
        (STALKER, 2, ALWAYS | SEEN | {"attack_upgrade_level"}),
        (NEXUS, 2, ALWAYS | SEEN | {"is_powered"}),
        (MINERALS, 16, ALWAYS | SEEN | {"is_powered", "mineral_contents"}),
    ],
    ids=["own mobile", "own structure", "enemy mobile", "enemy structure", "minerals"],
)
def test_a_unit_has_the_fields_that_the_game_sends(unit_type: int, owner: int, fields: set[str]) -> None:
    seen = stage(create(unit_type, owner, (16.5, 16.5)), options=interface(screen=0)).observe()
    unit = of_type(seen, unit_type)
    assert {field.name for field, _ in unit.ListFields()} == fields


def test_a_unit_with_orders_and_a_target_tells_them_to_its_owner_only() -> None:
    client = Client()
    first = client.play("3s_vs_3z")
    tags = [unit.tag for unit in first.observation.raw_data.units if unit.alliance == raw_pb2.Self]
    client.act(command(3674, tags, point=(20.0, 16.0)), command(16, tags, point=(9.0, 16.0), queue=True))
    seen = client.step().observation.raw_data.units
    own = [unit.orders for unit in seen if unit.alliance == raw_pb2.Self]
    enemy = [unit.orders for unit in seen if unit.alliance == raw_pb2.Enemy]
    for some in own:
        assert [order.ability_id for order in some] == [23, 16]
        assert (some[0].target_world_space_pos.x, some[0].target_world_space_pos.y) == (20.0, 16.0)
        assert some[0].target_world_space_pos.z > 0
    assert not any(enemy)
    engaged = client.step(60).observation.raw_data.units
    assert any(unit.engaged_target_tag for unit in engaged if unit.alliance == raw_pb2.Self)


def test_cloaked_enemies_are_hidden_or_absent_as_the_client_asked() -> None:
    shown = interface()
    shown.show_cloaked = True
    units = (create(DARK_TEMPLAR, 2, (16.0, 16.0)), create(STALKER, 1, (12.0, 16.0)))
    seen = stage(*units, options=shown).observe()
    templar = of_type(seen, DARK_TEMPLAR)
    assert (templar.display_type, templar.cloak) == (raw_pb2.Hidden, raw_pb2.Cloaked)
    assert (templar.health, templar.shield, templar.health_max) == (0, 0, 0)
    assert screen(seen, "cloaked")[64, 64] == 1
    assert screen(seen, "unit_type")[64, 64] == DARK_TEMPLAR
    assert screen(seen, "unit_hit_points")[64, 64] == 0
    unseen = stage(*units).observe()
    assert [unit.unit_type for unit in unseen.observation.raw_data.units] == [STALKER]
    assert not screen(unseen, "cloaked").any()


def test_an_own_cloaked_unit_is_known_as_such() -> None:
    seen = stage(create(DARK_TEMPLAR, 1, (16.0, 16.0))).observe()
    assert of_type(seen, DARK_TEMPLAR).cloak == raw_pb2.CloakedAllied
    assert screen(seen, "cloaked")[64, 64] == 1
    assert screen(seen, "unit_hit_points")[64, 64] == 40


def test_the_dead_are_told_once() -> None:
    client = Client()
    first = client.play()
    victim = first.observation.raw_data.units[0].tag
    client.debug(kill([victim]))
    assert list(client.step(2).observation.raw_data.event.dead_units) == [victim]
    assert not client.step().observation.raw_data.event.dead_units


def test_flying_units_are_higher_and_neutral_ones_belong_to_16() -> None:
    seen = stage(create(OBSERVER, 1, (16, 16)), create(STALKER, 1, (16, 16)), create(MINERALS, 0, (20, 20.5))).observe()
    assert of_type(seen, OBSERVER).pos.z > of_type(seen, STALKER).pos.z
    minerals = of_type(seen, MINERALS)
    assert (minerals.owner, minerals.alliance, minerals.mineral_contents) == (16, raw_pb2.Neutral, 1800)


# counters -------------------------------------------------------------------------------------------------------------


def test_supply_is_counted_as_in_the_examples_of_the_api() -> None:
    probe, pylon = 84, 60
    client = stage(create(ZEALOT, 1, (12, 16), 10), create(probe, 1, (12, 12), 10), create(pylon, 1, (20, 20), 2))
    common = client.observe().observation.player_common
    assert (common.army_count, common.food_army, common.food_used, common.food_cap) == (10, 20, 30, 16)
    assert (common.food_workers, common.idle_worker_count, common.warp_gate_count) == (10, 10, 0)
    assert not common.HasField("larva_count")


def test_the_score_follows_what_is_made_and_killed() -> None:
    client = Client()
    before = client.play("3s_vs_3z").observation.score
    assert before.score_type == before.Melee
    assert before.score_details.used_minerals.army == 3 * 125
    seen = client.step(1440)
    after = seen.observation.score.score_details
    own = [unit for unit in seen.observation.raw_data.units if unit.alliance == raw_pb2.Self]
    assert after.used_minerals.army == len(own) * 125
    assert after.lost_minerals.army == (3 - len(own)) * 125
    assert after.total_used_minerals.army == 3 * 125
    assert after.total_damage_taken.life > 0


def test_a_protoss_starts_with_a_score_of_1050_and_fields_as_wide_as_the_game_reports_them() -> None:
    seen = Client().play("Simple64").observation
    assert seen.score.score == 12 * 50 + 400 + 50
    assert {unit.radius for unit in seen.raw_data.units if unit.mineral_contents} == {1.125}


@pytest.mark.parametrize(("loop", "window"), [(160, 160), (320, 240)])
def test_the_rate_of_collection_is_that_of_the_last_240_loops(loop: int, window: int) -> None:
    client = Client()
    client.play("Simple64")
    before = client.step(loop - window).observation.score.score_details.collected_minerals if loop > window else 0.0
    details = client.step(window).observation.score.score_details
    assert details.collection_rate_minerals == pytest.approx((details.collected_minerals - before) * 1344 / window)


def test_an_attack_raises_one_alarm() -> None:
    client = Client()
    client.play("3s_vs_3z")
    alarms = [client.step(8) for _ in range(24)]
    raised = [seen for seen in alarms if sc.UnitUnderAttack in seen.observation.alerts]
    assert len(raised) == 1
    assert minimap(raised[0], "alerts").any()
    assert not any(minimap(seen, "alerts").any() for seen in alarms if seen is not raised[0])


# what is asked for ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (sc.InterfaceOptions(raw=True), {"raw_data"}),
        (sc.InterfaceOptions(score=True), {"score"}),
        (interface(raw=False), {"score", "feature_layer_data"}),
        (interface(), {"score", "feature_layer_data", "raw_data"}),
    ],
)
def test_only_what_was_asked_for_is_observed(options: sc.InterfaceOptions, parts: set[str]) -> None:
    client = Client()
    observation = client.play(options=options).observation
    assert {field.name for field, _ in observation.ListFields()} - {"game_loop", "player_common", "ui_data"} == parts
    assert observation.game_loop == 0


def test_raw_coordinates_move_to_the_playable_area_when_asked() -> None:
    whole, cropped = interface(screen=0), interface(screen=0)
    cropped.raw_crop_to_playable_area = True
    areas, points = [], []
    for options in (whole, cropped):
        client = Client()
        units = client.play(options=options).observation.raw_data.units
        start = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw
        area = start.playable_area
        areas.append((area.p0.x, area.p0.y, area.p1.x - start.map_size.x, area.p1.y - start.map_size.y))
        points.append((units[0].pos.x - area.p0.x, units[0].pos.y - area.p0.y))
    assert areas[1] == (0, 0, 0, 0)
    assert points[0] == points[1]


# images ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(128, 64), (84, 67), (32, 32)])
def test_layers_have_the_depth_and_the_length_of_the_api(size: tuple[int, int]) -> None:
    client = Client()
    layers = client.play(options=interface(screen=size[0], minimap=size[1])).observation.feature_layer_data
    for message, bits, side in (
        (layers.renders, SCREEN_BITS, size[0]),
        (layers.minimap_renders, MINIMAP_BITS, size[1]),
    ):
        told = {field.name: data for field, data in message.ListFields()}
        assert set(told) == set(bits) - ({"unit_type"} if message is layers.minimap_renders else set())
        for name, data in told.items():
            assert (data.bits_per_pixel, data.size.x, data.size.y) == (bits[name], side, side), name
            assert len(data.data) == (side * side * bits[name] + 7) // 8, name


def test_every_layer_of_the_api_is_drawn() -> None:
    from s2clientprotocol import spatial_pb2

    assert set(SCREEN_BITS) == set(spatial_pb2.FeatureLayers.DESCRIPTOR.fields_by_name)
    assert set(MINIMAP_BITS) == set(spatial_pb2.FeatureLayersMinimap.DESCRIPTOR.fields_by_name)


@pytest.mark.parametrize(
    ("point", "pixel", "dot"),
    [
        ((16.0, 16.0), (64, 64), (32, 32)),  # in the middle of the camera and of the map
        ((19.0, 16.0), (80, 64), (38, 32)),  # east is right
        ((16.0, 22.0), (64, 32), (32, 20)),  # north is up
        ((8.0, 9.0), (21, 101), (16, 46)),
    ],
)
def test_a_unit_lights_its_pixel(point: tuple[float, float], pixel: tuple[int, int], dot: tuple[int, int]) -> None:
    seen = stage(create(STALKER, 1, point)).observe()
    for name, value in (
        ("unit_type", STALKER),
        ("player_relative", raw_pb2.Self),
        ("player_id", 1),
        ("unit_hit_points", 80),
        ("unit_hit_points_ratio", 255),
        ("unit_shields", 80),
        ("unit_shields_ratio", 255),
        ("unit_density", 1),
        ("unit_density_aa", 16),
        ("unit_energy", 0),
        ("selected", 0),
        ("build_progress", 0),
    ):
        assert screen(seen, name)[pixel[1], pixel[0]] == value, name
    assert minimap(seen, "player_relative")[dot[1], dot[0]] == raw_pb2.Self
    lit = np.argwhere(screen(seen, "unit_type"))
    centre = lit.mean(axis=0)
    assert abs(centre - (pixel[1], pixel[0])).max() < 1
    assert len(lit) == pytest.approx(np.pi * (0.625 * 128 / 24) ** 2, rel=0.2)  # a disc of the unit's radius


def test_terrain_is_upright_and_black_outside_of_the_map() -> None:
    client = Client()
    client.play("2c_vs_64zg")
    seen = client.step()
    size = 32
    terrain = np.array([[client_pixel(seen, x, y) for x in range(size)] for y in range(size)])
    start = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw
    heights = np.frombuffer(start.terrain_height.data, np.uint8).reshape(size, size)
    paths = np.unpackbits(np.frombuffer(start.pathing_grid.data, np.uint8)).reshape(size, size)
    assert (terrain[..., 0] == heights).all()
    assert (terrain[..., 1] == paths).all()
    move_camera(client, (0.0, 0.0))
    corner = client.step()
    assert not screen(corner, "height_map")[65:, :64].any()
    assert screen(corner, "height_map")[:63, 65:].any()


def client_pixel(seen: sc.ResponseObservation, x: int, y: int) -> tuple[int, int]:
    """Return height and path of a cell as the minimap (64 pixels for 32 cells, from the top) shows them."""
    row = 63 - (2 * y + 1)
    return minimap(seen, "height_map")[row, 2 * x], minimap(seen, "pathable")[row, 2 * x]


def move_camera(client: Client, point: tuple[float, float]) -> None:
    action = sc.Action()
    centre = action.action_raw.camera_move.center_world_space
    centre.x, centre.y = point
    client.act(action)


def test_the_camera_is_a_box_on_the_minimap_and_says_who_is_on_screen() -> None:
    client = stage(create(STALKER, 1, (4.5, 27.5)), create(ZEALOT, 1, (27.0, 5.0)))
    move_camera(client, (10.0, 22.0))
    seen = client.step()
    box = np.argwhere(minimap(seen, "camera"))
    assert box.min(axis=0).tolist() == [0, 0]  # 24 units are 48 pixels; west and north stick out of the map
    assert box.max(axis=0).tolist() == [43, 43]
    assert of_type(seen, STALKER).is_on_screen
    assert not of_type(seen, ZEALOT).is_on_screen
    camera = seen.observation.raw_data.player.camera
    assert (camera.x, camera.y) == (10.0, 22.0)
    assert camera.z > 0


def test_flying_units_are_drawn_above_the_others() -> None:
    seen = stage(create(OBSERVER, 1, (16, 16)), create(STALKER, 1, (16, 16))).observe()
    assert screen(seen, "unit_type")[64, 64] == OBSERVER
    assert screen(seen, "unit_density")[64, 64] == 2


def test_unit_types_are_on_the_minimap_for_cheaters_only() -> None:
    cheating = interface()
    cheating.feature_layer.allow_cheating_layers = True
    seen = stage(create(STALKER, 2, (16.0, 16.0)), options=cheating).observe()
    assert minimap(seen, "unit_type")[32, 32] == STALKER
    fair = stage(create(STALKER, 2, (16.0, 16.0))).observe()
    assert not fair.observation.feature_layer_data.minimap_renders.HasField("unit_type")


def test_raw_map_images_start_at_the_bottom() -> None:
    client = Client()
    state = client.play().observation.raw_data.map_state
    assert (state.visibility.bits_per_pixel, state.creep.bits_per_pixel) == (8, 1)
    assert set(state.visibility.data) == {2}  # the map takes the fog away
    assert len(state.visibility.data) == 32 * 32
    assert len(state.creep.data) == 32 * 32 // 8
