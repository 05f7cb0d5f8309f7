"""Rendered images: what is on them, what must not be, and clicks on them."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from s2clientprotocol import common_pb2, raw_pb2, spatial_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.painting import palette, sprites
from khala_simulator.api.painting.silhouettes import CODES, OUTLINES, code_of, outline_of
from khala_simulator.api.sight import OBSERVER, Alliance
from khala_simulator.api.viewer import Viewer
from khala_simulator.combat import buffs
from khala_simulator.process.client import Client, command, interface
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import VERSION_OF_BUILD
from khala_simulator.world.area_effects import AreaEffect

Image = NDArray[Any]


def setup(screen: tuple[int, int], minimap: tuple[int, int], width: float = 0) -> sc.SpatialCameraSetup:
    message = sc.SpatialCameraSetup(
        resolution=common_pb2.Size2DI(x=screen[0], y=screen[1]),
        minimap_resolution=common_pb2.Size2DI(x=minimap[0], y=minimap[1]),
    )
    if width:
        message.width = width
    return message


def options(
    screen: tuple[int, int] = (192, 192), minimap: tuple[int, int] = (64, 64), *, layers: int = 0
) -> sc.InterfaceOptions:
    """Return an interface with rendered images: 8 pixels per cell on the screen, 2 on the minimap of a 32 x 32 map."""
    asked = interface(screen=layers)
    asked.render.CopyFrom(setup(screen, minimap))
    return asked


def near(image: Image, colour: tuple[int, int, int], within: float = 60.0) -> int:
    """Return how many pixels are about this colour."""
    distance = np.linalg.norm(image.astype(float) - colour, axis=-1)
    return int(np.count_nonzero(distance < within))


BODY = {side: livery.body for side, livery in palette.LIVERIES.items()}


# form -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("screen", "minimap"), [((128, 128), (64, 64)), ((160, 90), (32, 48)), ((1, 1), (1, 1))])
def test_images_are_24_bit_in_the_size_that_was_asked_for(
    make_table: Any, screen: tuple[int, int], minimap: tuple[int, int]
) -> None:
    table = make_table(options(screen, minimap))
    table.put("Stalker", 1, 16, 16)
    sent = table.observe().render_data
    for image, (columns, rows) in ((sent.map, screen), (sent.minimap, minimap)):
        assert (image.bits_per_pixel, image.size.x, image.size.y) == (24, columns, rows)
        assert len(image.data) == columns * rows * 3
        assert any(image.data)


@pytest.mark.parametrize("layers", [0, 64])
def test_what_was_asked_for_is_told_back_and_no_more_is_sent(layers: int) -> None:
    client = Client()
    asked = options(layers=layers)
    seen = client.play(options=asked)
    told = client.ask(game_info=sc.RequestGameInfo()).game_info.options
    assert told == asked
    assert seen.observation.HasField("render_data")
    assert seen.observation.HasField("feature_layer_data") is bool(layers)


def test_a_game_without_rendered_images_does_not_load_opencv() -> None:
    code = (
        "import sys; from khala_simulator.process.client import Client; Client().play(); sys.exit('cv2' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_same_moment_is_painted_the_same(make_table: Any) -> None:
    one, other = (make_table(options()) for _ in range(2))
    for table in (one, other):
        table.put("Colossus", 1, 14, 16)
        table.put("Roach", 2, 19, 16)
    one.picture()
    for table in (one, other):
        table.game.step(40)
    assert (one.picture() == other.picture()).all()
    assert (one.overview() == other.overview()).all()


@given(
    screen=st.tuples(st.integers(1, 90), st.integers(1, 90)),
    minimap=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    width=st.floats(1.0, 300.0),
    camera=st.tuples(st.floats(-60, 100), st.floats(-60, 100)),
)
def test_images_of_every_size_can_be_painted_from_everywhere(
    make_table: Any, screen: tuple[int, int], minimap: tuple[int, int], width: float, camera: tuple[float, float]
) -> None:
    table = make_table(sc.InterfaceOptions(render=setup(screen, minimap, width)), "braxis_ledge")
    for k, name in enumerate(("Nexus", "Zergling", "Carrier", "ForceField", "MineralField", "Larva")):
        table.put(name, k % 3, 5.0 * k + 1, 16.0)
    table.world.area_effects += [
        AreaEffect("any", 2, [(9.0, 9.0), (40.0, 9.0)], 2.0, 0, 9, effect=k) for k in range(1, 14)
    ]
    table.seat.hands.camera = camera  # farther off than a client can point it
    sent = table.observe().render_data
    assert len(sent.map.data) == 3 * screen[0] * screen[1]
    assert len(sent.minimap.data) == 3 * minimap[0] * minimap[1]


# what is on them ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("owner", "side"), [(1, Alliance.SELF), (2, Alliance.ENEMY)])
@pytest.mark.parametrize("name", ["Zealot", "Colossus", "VoidRay", "Overlord", "Pylon", "Hatchery"])
def test_a_unit_has_the_colour_of_its_side_where_it_stands(make_table: Any, name: str, owner: int, side: int) -> None:
    table = make_table(options())
    table.put(name, owner, 10, 20)
    there = (slice(64 - 28, 64 + 28), slice(48 - 28, 48 + 28))
    picture = table.picture()
    assert near(picture[there], BODY[side]) > 8
    assert near(picture, BODY[side]) == near(picture[there], BODY[side])
    other = Alliance.ENEMY if side == Alliance.SELF else Alliance.SELF
    assert near(picture, BODY[other], 40) == 0
    overview = table.overview()
    assert near(overview[24 - 6 : 24 + 6, 20 - 6 : 20 + 6], palette.LIVERIES[side].dot, 30) > 0


@pytest.mark.parametrize(("facing", "axis", "ahead"), [(0.0, 1, 1), (np.pi / 2, 0, -1), (np.pi, 1, -1), (4.7124, 0, 1)])
def test_units_face_where_they_face(make_table: Any, facing: float, axis: int, ahead: int) -> None:
    table = make_table(options((384, 384)))
    table.put("SiegeTank", 1, 16, 16, facing=facing)  # its gun is longer than it is
    picture = table.picture().astype(int)
    blue = np.argwhere(picture[..., 2] - picture[..., 0] > 40)[:, axis] - 191.5
    behind, before = sorted((blue.min(), blue.max()), key=lambda end: end * ahead)
    assert abs(before) > abs(behind) + 4


def test_bars_tell_life_and_shields(make_table: Any) -> None:
    table = make_table(options((384, 384)))
    slot = table.put("Zealot", 1, 16, 16)
    assert near(table.picture(), palette.HEALTH[2], 5) > 4
    full = near(table.picture(), palette.SHIELD, 5)
    table.world.life[slot], table.world.shields[slot] = 10.0, table.world.shields_max[slot] / 2
    hurt = table.picture()
    assert near(hurt, palette.HEALTH[2], 5) == 0
    assert near(hurt, palette.HEALTH[0], 5) > 0
    assert 0 < near(hurt, palette.SHIELD, 5) < full


def test_small_units_have_bars_only_when_hurt(make_table: Any) -> None:
    table = make_table(options((96, 96)))
    slot = table.put("Zealot", 1, 16, 16)
    assert near(table.picture(), palette.HEALTH[2], 5) == 0
    table.world.life[slot] *= 0.9
    assert near(table.picture(), palette.HEALTH[2], 5) > 2


def test_a_selected_unit_has_a_ring(make_table: Any) -> None:
    table = make_table(options())
    slot = table.put("Zealot", 1, 16, 16)
    bare = table.picture()
    table.seat.selection.choose([table.world.tag_of(slot)])
    rows, columns = np.nonzero((table.picture() != bare).any(axis=2))
    distance = np.hypot(rows + 0.5 - 96, columns + 0.5 - 96)
    assert len(distance) > 20
    assert 3.5 < distance.min() < distance.max() < 8
    assert table.picture()[rows, columns, 1].mean() > bare[rows, columns, 1].mean() + 40


def test_an_attack_is_a_line_between_the_two(make_table: Any) -> None:
    table = make_table(options())
    marine, pool = (table.world.tag_of(table.put(*unit)) for unit in (("Marine", 1, 14, 16), ("Pylon", 2, 18, 16)))
    table.game.act(1, command(3674, [marine], target=pool))
    bright = []
    for _ in range(40):
        table.game.step(1)
        between = table.picture()[93:100, 88:98].astype(int)
        bright.append(int((between.sum(axis=2) > 400).sum()))
    assert max(bright) > 4
    assert min(bright) == 0


@pytest.mark.parametrize(("caster", "colour"), [(1, palette.BOON), (2, palette.BANE)])
def test_a_buff_is_a_pip_below_its_bearer(make_table: Any, caster: int, colour: tuple[int, int, int]) -> None:
    table = make_table(options())
    marine = table.put("Marine", 1, 16, 16)
    assert near(table.picture(), colour, 10) == 0
    buffs.apply(table.world, marine, "Stimpack", owner=caster)
    rows, columns = np.nonzero((table.picture() == colour).all(axis=2))
    assert len(rows) == 4
    assert rows.min() > 96
    assert abs(columns.mean() - 95.5) < 3


def test_an_effect_is_painted_in_its_radius(make_table: Any) -> None:
    table = make_table(options())
    bare = table.picture()
    table.world.area_effects.append(AreaEffect("storm", 2, [(16.0, 16.0)], 1.5, 0, 100, effect=1))
    rows, columns = np.nonzero((table.picture() != bare).any(axis=2))
    for changed in (rows, columns):
        assert changed.min() == pytest.approx(96 - 12, abs=2)
        assert changed.max() == pytest.approx(96 + 12, abs=2)


def test_terrain_tells_walkable_ground_from_cliffs(make_table: Any) -> None:
    table = make_table(options((256, 256)), "braxis_ledge")
    picture = table.picture().astype(int).sum(axis=2)
    seat, terrain = table.seat, table.world.map.terrain
    rows, columns = np.mgrid[0:256, 0:256]
    x, y = seat.view.screen.to_world(columns.astype(float), rows.astype(float), seat.camera)
    cell = (y.astype(int), x.astype(int))
    walk, high = terrain.walk[cell], terrain.cliff[cell] >= 128
    assert np.median(picture[walk]) > 1.5 * np.median(picture[~walk])
    assert np.median(picture[walk & high]) > 1.2 * np.median(picture[walk & ~high])


def test_creep_is_violet(make_table: Any) -> None:
    table = make_table(options((256, 256), (32, 32)), "char_pit")
    overview = table.overview().astype(int)
    violet = overview[..., 0] + overview[..., 2] - 2 * overview[..., 1]
    creep = table.world.creep[::-1]
    assert creep.any()
    assert np.median(violet[creep]) > np.median(violet[~creep & table.world.map.terrain.walk[::-1]]) + 20


def test_the_minimap_shows_where_the_camera_looks(make_table: Any) -> None:
    table = make_table(options())
    white = (table.overview() == 255).all(axis=2)
    assert white[8, 8:56].all()
    assert white[55, 8:56].all()
    table.seat.move_camera(12, 16)
    assert (table.overview()[8, 0:48] == 255).all()


def test_an_observer_tells_players_apart_by_colour(make_table: Any) -> None:
    table = make_table(options())
    table.put("Nexus", 1, 8, 16)
    table.put("Nexus", 2, 24, 16)
    table.seat = Viewer(table.game, OBSERVER, options())
    picture = table.picture()
    assert near(picture[:, :96], BODY[Alliance.SELF]) > 50
    assert near(picture[:, 96:], BODY[Alliance.ENEMY]) > 50
    assert near(picture[:, :96], BODY[Alliance.ENEMY], 40) == 0


# what must not be on them ---------------------------------------------------------------------------------------------


def test_what_a_player_does_not_see_leaves_no_trace(make_table: Any) -> None:
    pictures = []
    for enemies in (False, True):
        table = make_table(options(), fog=True)
        table.put("Zealot", 1, 6, 6)
        if enemies:
            for x in (22.0, 24.0):
                table.put("Marine", 2, x, 24)
            table.world.area_effects.append(AreaEffect("storm", 2, [(22.0, 22.0)], 1.5, 0, 100, effect=1))
            table.put("DarkTemplar", 2, 8, 6)
        table.game.step(1)
        pictures += [table.picture(), table.overview()]
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[1] == pictures[3]).all()


def test_unseen_ground_is_black_and_seen_before_is_dark(make_table: Any) -> None:
    table = make_table(options(), fog=True)
    slot = table.put("Zealot", 1, 8, 16)
    table.game.step(8)
    lit = table.picture()
    assert not lit[96, 160].any()
    table.world.pos[slot] = (24, 16)
    table.game.step(8)
    dark = table.picture()
    assert dark[96, 160].any()
    assert 0 < dark[80, 36].sum() < lit[80, 36].sum() * 0.7


def test_cloaked_enemies_show_as_shades_to_those_who_asked_only(make_table: Any) -> None:
    red = []
    for shown in (False, True):
        asked = options()
        asked.show_cloaked = shown
        table = make_table(asked, fog=True)
        table.put("Zealot", 1, 12, 16)
        table.put("DarkTemplar", 2, 16, 16)
        table.game.step(1)
        red.append(near(table.picture(), BODY[Alliance.ENEMY], 110))
    assert red[0] == 0
    assert red[1] > 0


# the looks of all types -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", sorted(set(VERSION_OF_BUILD.values())))
@pytest.mark.parametrize("pixels_per_cell", [1.5, 10.0, pytest.param(30.0, marks=pytest.mark.slow)])
def test_every_type_can_be_painted(version: str, pixels_per_cell: float) -> None:
    units = load_catalog(version).units
    wardrobe = sprites.Wardrobe(units, pixels_per_cell)
    for unit in units:
        for unfinished in (False, unit.structure):
            look = sprites.SpriteLook(unit.row, Alliance.ENEMY, 5, veiled=False, unfinished=unfinished)
            sprite = wardrobe.sprite(look)
            assert sprite.paint.any(), unit.name
            assert (sprite.paint.astype(int) + sprite.keep <= 255).all(), unit.name


def test_sprites_are_kept_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    units = load_catalog().units
    wardrobe = sprites.Wardrobe(units, 10.0)
    look = sprites.SpriteLook(load_catalog().unit("Zealot").row, Alliance.SELF, 3, veiled=False, unfinished=False)
    first = wardrobe.sprite(look)
    assert wardrobe.sprite(look) is first
    monkeypatch.setattr(sprites, "MAX_BYTES", 1)
    wardrobe.sprite(look._replace(direction=4))
    again = wardrobe.sprite(look)
    assert again is not first
    assert (again.paint == first.paint).all()


def test_outlines_and_codes_are_of_types_that_exist() -> None:
    names = {unit.name for version in VERSION_OF_BUILD.values() for unit in load_catalog(version).units}
    assert OUTLINES.keys() | CODES.keys() <= names


def test_letters_tell_the_types_of_a_race_apart() -> None:
    forms = {"TH", "VI"}  # the same machine in another mode
    for race in ("protoss", "terran", "zerg"):
        named = [CODES[unit.name] for unit in load_catalog().units if unit.race == race and unit.name in CODES]
        assert len(set(named)) == len(named) - sum(named.count(code) - 1 for code in forms & set(named))


def test_every_army_type_has_letters_and_an_outline() -> None:
    for unit in load_catalog().units:
        if unit.army and unit.weapons:
            assert 2 <= len(code_of(unit)) <= 3, unit.name
            assert len(outline_of(unit)) >= 3, unit.name


# Transformations of linear RGB that show what people without red or green cones see (Vienot, Brettel, Mollon 1999).
CONE_LOSS = {
    "protanopia": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "deuteranopia": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}


@pytest.mark.parametrize("loss", CONE_LOSS)
def test_own_and_enemy_colours_differ_for_the_colour_blind(loss: str) -> None:
    own, enemy = (np.array(BODY[side]) / 255 for side in (Alliance.SELF, Alliance.ENEMY))
    seen = [np.clip(np.array(CONE_LOSS[loss]) @ colour**2.2, 0, 1) ** (1 / 2.2) for colour in (own, enemy)]
    assert np.linalg.norm(seen[0] - seen[1]) > 0.5


# clicks ---------------------------------------------------------------------------------------------------------------


def click(kind: str, **spatial: Any) -> sc.Action:
    action = sc.Action()
    getattr(action, kind).CopyFrom(spatial_pb2.ActionSpatial(**spatial))
    return action


def point(x: int, y: int) -> dict[str, Any]:
    select = spatial_pb2.ActionSpatialUnitSelectionPoint
    return {
        "unit_selection_point": select(type=select.Select, selection_screen_coord=common_pb2.PointI(x=x, y=y)),
    }


@pytest.mark.parametrize(
    ("kinds", "clicked"),
    [
        (["action_render"], "action_render"),
        (["action_feature_layer", "action_render"], "action_render"),
        (["action_feature_layer", "action_render"], "action_feature_layer"),
    ],
)
def test_clicks_count_in_the_pixels_of_their_image_and_are_reported_in_each(kinds: list[str], clicked: str) -> None:
    client = Client()
    first = client.play("2s3z", options((240, 240), (60, 60), layers=96 if len(kinds) > 1 else 0))
    unit = next(u for u in first.observation.raw_data.units if u.alliance == raw_pb2.Self)
    size = {"action_render": 240, "action_feature_layer": 96}
    pixel = {
        kind: (int((unit.pos.x - 16 + 12) / 24 * n), int((16 + 12 - unit.pos.y) / 24 * n)) for kind, n in size.items()
    }
    client.act(click(clicked, **point(*pixel[clicked])))
    seen = client.step()
    assert [u.tag for u in seen.observation.raw_data.units if u.is_selected] == [unit.tag]
    (report,) = seen.actions
    assert {field.name for field, _ in report.ListFields()} == {"game_loop", *kinds}
    for kind in kinds:
        told = getattr(report, kind).unit_selection_point.selection_screen_coord
        assert abs(told.x - pixel[kind][0]) <= size[kind] // size[clicked], kind
        assert abs(told.y - pixel[kind][1]) <= size[kind] // size[clicked], kind


def test_a_command_and_a_camera_move_are_reported_in_the_pixels_of_each_image() -> None:
    client = Client()
    first = client.play("2s3z", options((240, 120), (60, 60), layers=96))
    tags = [u.tag for u in first.observation.raw_data.units if u.alliance == raw_pb2.Self]
    client.act(command(3794, tags, point=(20.0, 18.0)))
    (report,) = client.step().actions
    rendered, layered = (
        image.unit_command.target_screen_coord for image in (report.action_render, report.action_feature_layer)
    )
    assert (rendered.x, rendered.y) == (120 + 4 * 5, 60 - 2 * 5)
    assert (layered.x, layered.y) == (48 + 4 * 4, 48 - 2 * 4)
    move = spatial_pb2.ActionSpatialCameraMove(center_minimap=common_pb2.PointI(x=20, y=20))
    client.act(click("action_render", camera_move=move))
    seen = client.step()
    (report,) = seen.actions
    assert (report.action_render.camera_move.center_minimap.x, report.action_render.camera_move.center_minimap.y) == (
        20, 20,
    )  # fmt: skip
    assert report.action_feature_layer.camera_move.center_minimap.x == int(20.5 / 60 * 64)
    assert seen.observation.raw_data.player.camera.x == pytest.approx(20.5 * 32 / 60)


def test_a_replay_shows_the_same_pictures() -> None:
    client = Client()
    first = client.play("2s3z", options((96, 96), (32, 32)))
    tags = [u.tag for u in first.observation.raw_data.units if u.alliance == raw_pb2.Self]
    client.act(command(3674, tags, point=(20.0, 16.0)))
    pictures = [client.step(20).observation.render_data for _ in range(4)]
    data = client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
    client.ask(
        start_replay=sc.RequestStartReplay(replay_data=data, observed_player_id=1, options=options((96, 96), (32, 32)))
    )
    assert [client.step(20).observation.render_data for _ in range(4)] == pictures


def test_a_replay_reports_clicks_in_the_pixels_of_its_viewer() -> None:
    client = Client()
    first = client.play("2s3z", interface(screen=96))
    tags = [u.tag for u in first.observation.raw_data.units if u.alliance == raw_pb2.Self]
    client.act(command(3794, tags, point=(20.0, 18.0)))
    unit = first.observation.raw_data.units[0]
    client.act(click("action_feature_layer", **point(int((unit.pos.x - 4) * 4), int((28 - unit.pos.y) * 4))))
    client.step(2)
    data = client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
    start = sc.RequestStartReplay(replay_data=data, observed_player_id=1, options=options((240, 240), (32, 32)))
    client.ask(start_replay=start)
    moved, selected = client.step().actions
    assert {field.name for field, _ in moved.ListFields()} == {"game_loop", "action_raw", "action_render"}
    target = moved.action_render.unit_command.target_screen_coord
    assert (target.x, target.y) == (160, 100)
    clicked = selected.action_render.unit_selection_point.selection_screen_coord
    assert clicked.x == pytest.approx((unit.pos.x - 4) * 10, abs=3)
    assert clicked.y == pytest.approx((28 - unit.pos.y) * 10, abs=3)


# raw data -------------------------------------------------------------------------------------------------------------


def test_effects_and_power_are_told_in_raw_data(make_table: Any) -> None:
    table = make_table(sc.InterfaceOptions(raw=True))
    pylon = table.put("Pylon", 1, 10, 12)
    table.put("Nexus", 1, 24, 12)  # hastens warping in, and powers nothing
    table.world.area_effects.append(AreaEffect("bile", 2, [(16.0, 18.0)], 0.5, 0, 100, effect=11))
    raw = table.observe().raw_data
    (effect,) = raw.effects
    assert (effect.effect_id, effect.owner, effect.alliance, effect.radius) == (11, 2, Alliance.ENEMY, 0.5)
    assert [(at.x, at.y) for at in effect.pos] == [(16.0, 18.0)]
    (source,) = raw.player.power_sources
    assert (source.tag, source.radius, source.pos.x, source.pos.y) == (table.world.tag_of(pylon), 6.5, 10.0, 12.0)
