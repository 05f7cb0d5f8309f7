"""The map for those who watch, from the snapshots of all sides: who knows what, and that positions stay the same."""

from __future__ import annotations

import base64
import math
import random
import zlib
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.overview import Watched, scene_of, terrain_of
from khala_protocol.codec import decode_as, encode
from khala_protocol.messages import Frames, Scene, Terrain, UnitFlag, UnitMark

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.state import Snapshot

    MakeUnit = Callable[..., raw_pb2.Unit]
    MakeSnapshot = Callable[..., Snapshot]

FRAMES = Frames()
BLUE, RED = {"player_id": 1}, {"player_id": 2}
OWN, OTHER = {"owner": 1}, {"alliance": "enemy", "owner": 2}
REMEMBERED = {"display_type": raw_pb2.Snapshot}
NEUTRAL = {"alliance": "neutral", "owner": 16}


def shown(
    *sides: Snapshot,
    before: Sequence[Snapshot] = (),
    whole: Snapshot | None = None,
    first: Sequence[Snapshot] = (),
) -> Scene:
    """Return the scene of what blue, and red if there are two, see; the episode began with `first`, or now."""
    terrain = terrain_of(first or sides, whole, FRAMES, run="r", episode=0)
    earlier: Sequence[Snapshot | None] = before or [None] * len(sides)
    watched = [Watched(*one) for one in zip(("blue", "red"), sides, earlier, strict=False)]
    return scene_of(watched, whole, terrain, FRAMES, step=3)


def marks(scene: Scene) -> dict[int, UnitMark]:
    return {mark.tag: mark for mark in scene.units}


def cells(view: Any) -> list[list[int]]:
    data = zlib.decompress(base64.b64decode(view.data))
    return [list(data[row * view.width : (row + 1) * view.width]) for row in range(view.height)]


def grid(name: str, bits: int, width: int, data: bytes) -> Callable[..., None]:
    """Return a change of a snapshot that gives a grid of the map's state."""

    def change(response: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
        del info
        size = common_pb2.Size2DI(x=width, y=len(data) * 8 // bits // width)
        image = common_pb2.ImageData(bits_per_pixel=bits, size=size, data=data)
        getattr(response.observation.raw_data.map_state, name).CopyFrom(image)

    return change


@pytest.mark.parametrize("size", [(32, 32), (88, 96), (200, 176)])
def test_every_position_and_every_value_is_that_of_the_snapshot(
    size: tuple[int, int], unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    dice = random.Random(size[0])
    places = [(dice.uniform(0, size[0]), dice.uniform(0, size[1])) for _ in range(100)]
    anybody = [unit(tag, "Stalker", *place, health=dice.uniform(0, 80), **OWN) for tag, place in enumerate(places, 1)]
    now = snapshot(anybody, size=size)
    frame, found = now.info.frame(FRAMES), marks(shown(now))
    assert len(found) == len(places)
    for tag, mark in found.items():
        known = now.known[tag]
        assert math.dist((mark.x, mark.y), frame.minimap(*known.pos)) < 0.001
        assert (mark.type, mark.health_max, mark.shield_max) == (known.name, known.health_max, known.shield_max)
        assert (mark.health, mark.shield) == (round(known.health, 1), round(known.shield, 1))


def test_it_is_read_back_as_it_was_made(battle: list[raw_pb2.Unit], snapshot: MakeSnapshot) -> None:
    scene = shown(snapshot(battle))
    assert decode_as(Scene, encode(scene)) == scene
    assert Scene.model_validate(scene.model_dump()) == scene


def test_an_own_unit_has_its_order_and_another_has_none(unit: MakeUnit, snapshot: MakeSnapshot) -> None:
    attacks = unit(1, "Stalker", 8, 8, facing=1.0, engaged_target_tag=3, **OWN)
    attacks.orders.add(ability_id=3674, target_unit_tag=3)
    moves = unit(2, "Stalker", 8, 10, **OWN)
    moves.orders.add(ability_id=3794).target_world_space_pos.x = 16
    found = marks(shown(snapshot([attacks, moves, unit(3, "Zealot", 16, 8, orders=(3674,), **OTHER)])))
    assert (found[1].order, found[1].target, found[1].to_x, found[1].to_y) == ("Attack", 3, 32.0, 48.0)
    assert (found[2].order, found[2].target, found[2].to_x, found[2].to_y) == ("Move", 0, 32.0, 64.0)
    assert (found[3].order, found[3].target, found[3].to_x) == ("", 0, -1.0)
    assert found[1].facing == pytest.approx(2 * math.pi - 1, abs=0.01)


@pytest.mark.parametrize(
    ("before", "now", "fires"),
    [(0.0, 14.0, True), (14.0, 6.0, False), (6.0, 18.0, True), (10.0, 8.0, True), (0.0, 0.0, False)],
)
def test_a_unit_fires_whose_cooldown_is_longer_than_what_was_left_of_it(
    before: float, now: float, fires: bool, unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    then = snapshot([unit(1, "Stalker", 8, 8, weapon_cooldown=before, **OWN)], loop=8)
    later = snapshot([unit(1, "Stalker", 8, 8, weapon_cooldown=now, **OWN)], loop=16)
    assert bool(marks(shown(later, before=[then]))[1].flags & UnitFlag.FIRES) is fires
    assert not marks(shown(later))[1].flags & UnitFlag.FIRES


def test_flags_say_what_a_unit_is(unit: MakeUnit, snapshot: MakeSnapshot) -> None:
    found = marks(
        shown(
            snapshot(
                [
                    unit(1, "Probe", 8, 8, **OWN),
                    unit(2, "Gateway", 9, 8, **OWN),
                    unit(3, "VoidRay", 9, 9, is_flying=True, **OWN),
                    unit(4, "Stalker", 9, 9, is_hallucination=True, **OTHER),
                    unit(5, "DarkTemplar", 9, 9, cloak=raw_pb2.CloakedDetected, **OTHER),
                    unit(6, "Roach", 9, 9, is_burrowed=True, **OTHER),
                ]
            )
        )
    )
    assert {tag: UnitFlag(mark.flags) for tag, mark in found.items()} == {
        1: UnitFlag.WORKER,
        2: UnitFlag.STRUCTURE | UnitFlag.UNPOWERED,
        3: UnitFlag.ARMY | UnitFlag.FLYING,
        4: UnitFlag.HALLUCINATION,
        5: UnitFlag.ARMY | UnitFlag.CLOAKED,
        6: UnitFlag.ARMY | UnitFlag.BURROWED,
    }


def test_the_whole_map_adds_what_no_side_sees_and_takes_what_one_only_remembers(
    unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    seen, own = unit(2, "Zealot", 9, 8, health=31, **OTHER), unit(1, "Stalker", 8, 8, orders=(3674,), **OWN)
    memory = unit(3, "Gateway", 20, 20, **OTHER, **REMEMBERED)
    hidden = unit(4, "Probe", 25, 25, **OTHER)
    hidden.display_type, hidden.health, hidden.health_max = raw_pb2.Hidden, 0, 0
    now = snapshot([own, seen, memory])
    whole = snapshot([unit(1, "Stalker", 8, 8, **OWN), unit(2, "Zealot", 9, 8, **OTHER), hidden], through_fog=True)
    fogged, lifted = shown(now), shown(now, whole=whole)
    assert (fogged.whole, lifted.whole) == (False, True)
    assert {mark.tag: mark.seen_by for mark in fogged.units} == {1: 1, 2: 1, 3: 0}
    assert {mark.tag: mark.seen_by for mark in lifted.units} == {1: 1, 2: 1, 4: 0}
    assert marks(fogged)[3].flags == UnitFlag.STRUCTURE | UnitFlag.REMEMBERED
    assert (marks(lifted)[1].order, marks(lifted)[2].health) == ("Attack", 31)


def test_two_sides_know_all_units_together_and_each_its_own_best(unit: MakeUnit, snapshot: MakeSnapshot) -> None:
    lost = unit(9, "Gateway", 20, 20, **OTHER, **REMEMBERED)
    blue = snapshot([unit(1, "Stalker", 8, 8, **OWN), lost], player=BLUE)
    red = snapshot(
        [
            unit(1, "Stalker", 8, 8, alliance="enemy", owner=1),
            unit(2, "Zealot", 20, 8, owner=2, orders=(3674,)),
        ],
        player=RED,
    )
    scene = shown(blue, red)
    assert (scene.sides, scene.whole) == (("blue", "red"), True)
    assert {mark.tag: (mark.player, mark.seen_by, mark.order) for mark in scene.units} == {
        1: (1, 3, ""),
        2: (2, 2, "Attack"),
    }
    assert [(player.player, player.side) for player in scene.players] == [(1, "blue"), (2, "red")]


def test_players_have_what_stands_on_the_map_and_a_side_also_what_it_owns(
    unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    means = {"player_id": 1, "minerals": 50, "vespene": 25, "food_used": 14, "food_cap": 15}
    own = [unit(1, "Probe", 8, 8, **OWN), unit(2, "Stalker", 8, 9, **OWN)]
    blue, computer = shown(snapshot([*own, unit(3, "Zergling", 9, 9, **OTHER)], player=means, upgrades=[84])).players
    assert (blue.side, blue.race, blue.units, blue.workers, blue.army_value) == ("blue", "protoss", 2, 1, 175)
    assert (blue.minerals, blue.vespene, blue.supply_used, blue.supply_cap) == (50, 25, 14, 15)
    assert blue.upgrades == ("WarpGateResearch",)
    assert (computer.player, computer.side, computer.race, computer.minerals) == (2, "", "zerg", None)


def test_what_belongs_to_nobody_and_moves_is_a_unit_and_the_rest_is_terrain(
    unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    field, rock = unit(1, "MineralField", 4, 28, **NEUTRAL), unit(2, "DestructibleRock6x6", 9, 9, **NEUTRAL)
    dog, tumbled = unit(3, "Dog", 5, 5, **NEUTRAL), unit(4, "CollapsibleRockTowerDebris", 20, 20, **NEUTRAL)
    first = snapshot([field, rock, dog])
    terrain = terrain_of([first], None, FRAMES, run="r", episode=0)
    assert [(mark.type, mark.x, mark.y) for mark in sorted(terrain.resources)] == [
        ("MineralField", 8.0, 8.0),
        ("DestructibleRock6x6", 18.0, 46.0),
    ]
    assert {mark.type for mark in shown(snapshot([field, rock, dog, tumbled]), first=[first]).units} == {
        "Dog",
        "CollapsibleRockTowerDebris",
    }


def test_a_resource_is_gone_when_somebody_was_there_and_does_not_find_it(
    unit: MakeUnit, snapshot: MakeSnapshot
) -> None:
    far, near = unit(1, "MineralField", 4.5, 2.5, **NEUTRAL), unit(2, "MineralField", 20.5, 2.5, **NEUTRAL)
    first = snapshot([far, near])
    sight = bytearray(32 * 32)
    sight[2 * 32 + 20] = 2
    now = snapshot([], change=grid("visibility", 8, 32, bytes(sight)))
    assert shown(now, first=[first]).gone == (2,)
    assert shown(now, whole=snapshot([]), first=[first]).gone == ()  # the terrain of this scene has none
    memory = unit(7, "MineralField", 20.5, 2.5, **NEUTRAL, **REMEMBERED)
    assert shown(snapshot([memory], change=grid("visibility", 8, 32, bytes(sight))), first=[first]).gone == ()


def test_creep_and_fog_lie_as_one_sees_them_from_above(snapshot: MakeSnapshot) -> None:
    south_west = bytes([0x80, 0, 0, 0]) + bytes(4 * 31)
    sight = bytes([2, 1]) + bytes(32 * 32 - 2)

    def change(*given: Any) -> None:
        grid("creep", 1, 32, south_west)(*given)
        grid("visibility", 8, 32, sight)(*given)

    scene = shown(snapshot([], change=change))
    assert scene.creep is not None
    assert cells(scene.creep)[31][:3] == [1, 0, 0]
    assert cells(scene.fog["blue"])[31][:3] == [2, 1, 0]
    assert sum(map(sum, cells(scene.creep))) == 1


def test_creep_is_what_any_side_knows_and_on_the_whole_map_all_there_is(snapshot: MakeSnapshot) -> None:
    def creep(first: int, seen: int, **fields: Any) -> Snapshot:
        def change(*given: Any) -> None:
            grid("creep", 1, 8, bytes([first]))(*given)
            grid("visibility", 8, 8, bytes([seen] * 8))(*given)

        return snapshot([], change=change, **fields)

    together = shown(creep(0x80, 2), creep(0x40, 2)).creep
    assert together is not None
    assert cells(together) == [[1, 1, 0, 0, 0, 0, 0, 0]]
    assert shown(creep(0xFF, 0)).creep is None
    lifted = shown(creep(0xFF, 0), whole=creep(0xFF, 0, through_fog=True)).creep
    assert lifted is not None
    assert cells(lifted) == [[1] * 8]


def test_effects_and_power_are_there_once_each(snapshot: MakeSnapshot) -> None:
    def change(response: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
        del info
        raw = response.observation.raw_data
        storm = raw.effects.add(effect_id=1, radius=1.5, alliance=raw_pb2.Enemy, owner=2)
        storm.pos.add(x=8, y=8)
        field = raw.player.power_sources.add(radius=6.5, tag=5)
        field.pos.x, field.pos.y = 16, 16

    now = snapshot([], change=change)
    scene = shown(now, whole=now)
    assert scene.effects == (("PsiStorm", 2, 16.0, 48.0, 3.0),)
    assert scene.power == ((1, 32.0, 32.0, 13.0),)


def test_the_terrain_has_the_ground_and_the_starts_of_all_players(
    unit: MakeUnit, snapshot: MakeSnapshot, plain: Callable[..., None]
) -> None:
    def change(response: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
        plain(response, info)
        info.start_raw.start_locations.add(x=28, y=28)

    first = snapshot([unit(1, "Nexus", 4, 4, **OWN), unit(2, "Probe", 5, 5, **OWN)], change=change)
    terrain = terrain_of([first], None, FRAMES, run="r", episode=2)
    assert (terrain.episode, terrain.size, terrain.bounds) == (2, (32, 32), (0.0, 0.0, 64.0, 64.0))
    assert terrain.starts == ((8.0, 56.0), (56.0, 8.0))
    assert cells(terrain.height) == [[0x80] * 32] * 32
    assert cells(terrain.walkable) == [[1] * 32] * 32
    assert decode_as(Terrain, encode(terrain)) == terrain
