"""The ground as arrays: the API's images, footprints, ways, and the land at a moment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import knowledge
from khala_bridge.state.ground import MapGround, footprint_of, land_of, sites
from khala_bridge.state.ground.land import built_by
from khala_bridge.state.ground.resources import base_places
from khala_bridge.state.ground.terrain import SEED_REACH
from khala_simulator.maps.game_map import find_map, load_map
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.state import Snapshot
    from tests.bridge.auto.conftest import Game

MELEE = ("Simple64", "Simple96", "Simple128", "Flat32", "Flat48", "Flat64", "Flat96", "Flat128")
CATALOG = load_catalog("4.10")
GROUND_OF = {  # what the game's catalogue calls it, and what it is called in sites.yaml
    (False, False): "bare",
    (True, False): "powered",
    (False, True): "creep",
}


# grids ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Simple64", "Flat64"])
def test_the_ground_is_that_of_the_map(make_game: Callable[..., Game], name: str) -> None:
    terrain = load_map(find_map(name)).terrain
    ground = MapGround.of(make_game(name).info)
    assert (ground.buildable == terrain.build.T).all()
    assert not (ground.walkable & ~terrain.walk.T).any()
    assert (terrain.walk.T & ~ground.walkable).sum() <= 40  # under rocks and the like that stand off building ground
    assert ground.level(28.5, 60.5) == pytest.approx(float(terrain.ground_z(np.array([[28.5, 60.5]]))[0]), abs=0.1)


def test_the_ground_of_a_map_is_one_object(make_game: Callable[..., Game]) -> None:
    assert MapGround.of(make_game(seed=1).info) is not MapGround.of(make_game("Flat64").info)
    assert MapGround.of(make_game(seed=1).info) is MapGround.of(make_game(seed=1).info)


def test_on_level_ground_a_way_is_a_ninth_shorter_than_the_line_at_most(make_game: Callable[..., Game]) -> None:
    ground = MapGround.of(make_game("Flat64").info)
    far = ground.ways_from(WorldPoint(12.5, 12.5))
    x, y = np.nonzero(np.isfinite(far) & (far > 0))
    line = np.hypot(x - 12, y - 12)
    assert (far[x, y] <= line + 1).all()
    assert (far[x, y] >= line * 8 / 9 - SEED_REACH * 2**0.5).all()


def test_a_way_round_a_cliff_is_longer_than_the_line(make_game: Callable[..., Game]) -> None:
    land = land_of(make_game().snapshot)
    start, goal = land.bases[0].place, land.bases[1].place
    assert float(land.ground.ways_from(start)[int(goal.x), int(goal.y)]) > 1.5 * math.dist(start, goal)
    assert np.isinf(land.ground.ways_from(start)[~land.ground.walkable]).all()


# footprints -----------------------------------------------------------------------------------------------------------


def test_every_footprint_is_the_games(subtests: pytest.Subtests) -> None:
    for unit in (unit for unit in CATALOG.units if CATALOG.footprints.get(unit.footprint)):
        with subtests.test(unit.name):
            mask = CATALOG.footprints[unit.footprint]
            name = next((n for n, known in knowledge().items() if known.id == unit.id), f"Unit{unit.id}")
            footprint = footprint_of(name)
            if not mask.cells:
                assert footprint is None
                continue
            assert footprint is not None
            assert sorted(footprint.cells) == sorted(mask.cells)
            if unit.resource:
                assert sorted(footprint.near) == sorted({*mask.cells, *mask.around})


def test_every_structure_asks_what_the_game_asks(subtests: pytest.Subtests) -> None:
    for structure, site in sites().items():
        with subtests.test(structure):
            unit = next(u for u in CATALOG.units if u.id == knowledge()[structure].id)
            if "Capped" in unit.placement:
                assert site.ground == "geyser"
                continue
            rule = CATALOG.footprints[unit.placement or unit.footprint]
            assert site.clear == ("NearResources" in rule.forbids)
            assert site.seen == ("Fogged" in rule.forbids)
            anywhere = "Creep" not in rule.forbids | rule.requires
            assert site.ground == ("any" if anywhere else GROUND_OF[unit.needs_power, "Creep" in rule.requires])


def test_everything_that_workers_build_has_a_site() -> None:
    workers = {"Probe", "SCV", "Drone"}
    built = {
        name for name, kind in knowledge().items() if kind.melee and kind.structure and workers & {*kind.producers}
    }
    assert built - {"AssimilatorRich", "RefineryRich", "ExtractorRich"} == set(sites())


@pytest.mark.parametrize(
    ("structure", "point", "middle"),
    [
        ("Gateway", (10.2, 10.9), (10.5, 10.5)),
        ("Gateway", (11.0, 9.99), (10.5, 9.5)),
        ("Pylon", (10.4, 10.6), (10.0, 11.0)),
        ("Pylon", (10.5, 11.5), (10.0, 11.0)),
        ("Nexus", (28.9, 60.1), (28.5, 60.5)),
        ("SensorTower", (3.3, 4.7), (3.5, 4.5)),
    ],
)
def test_a_point_is_put_on_the_grid(structure: str, point: tuple[float, float], middle: tuple[float, float]) -> None:
    footprint = footprint_of(structure)
    assert footprint is not None
    assert footprint.middle(footprint.cell(*point)) == middle


@pytest.mark.parametrize(
    ("ability", "structure"), [(881, "Pylon"), (1152, "Hatchery"), (320, "Refinery"), (23, None), (421, None)]
)
def test_abilities_that_place_structures_are_known(ability: int, structure: str | None) -> None:
    assert built_by(ability) == structure


# bases ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MELEE)
def test_players_begin_at_the_places_that_are_computed(make_game: Callable[..., Game], name: str) -> None:
    game = make_game(name)
    land = land_of(game.snapshot)
    starts = load_map(find_map(name)).scenario.start_locations
    assert {tuple(base.place) for base in land.bases} >= {*starts}
    fields, geysers = (
        tuple(sorted((u.pos.x, u.pos.y) for u in land.standing(kind))) for kind in ("mineral_field", "geyser")
    )
    assert base_places(land.ground, fields, geysers) == land.bases  # found without knowing where players begin


def test_the_four_bases_of_simple64_have_all_resources_between_them(make_game: Callable[..., Game]) -> None:
    bases = land_of(make_game().snapshot).bases
    assert [tuple(base.place) for base in bases] == [(25.5, 23.5), (28.5, 60.5), (59.5, 27.5), (62.5, 64.5)]
    assert [(len(base.fields), len(base.geysers)) for base in bases] == [(8, 2)] * 4


@pytest.mark.parametrize("name", MELEE)
def test_a_town_hall_may_stand_on_every_base_place_and_no_step_nearer(
    make_game: Callable[..., Game], name: str
) -> None:
    game = make_game(name)
    game.client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
    game.play(2)
    land = land_of(game.snapshot)
    free = [
        base
        for base in land.bases
        if not land.halls or all(math.dist(base.place, (h.pos.x, h.pos.y)) > 5 for h in land.halls)
    ]
    for base in free:
        assert game.may_stand("Build_CommandCenter_screen", base.place) == "Success"
        total = sum(math.dist(base.place, resource) for resource in (*base.fields, *base.geysers))
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            other = WorldPoint(base.place.x + dx, base.place.y + dy)
            longer = sum(math.dist(other, resource) for resource in (*base.fields, *base.geysers)) >= total - 1e-6
            assert longer or game.may_stand("Build_CommandCenter_screen", other) != "Success"


# a moment -------------------------------------------------------------------------------------------------------------


def test_what_stands_is_taken_and_what_is_planned_is_not_free(make_game: Callable[..., Game]) -> None:
    game = make_game()
    probe = game.own("Probe")[0]
    land = land_of(game.snapshot)
    assert land.taken[28, 60]
    assert not land.free[28, 60]
    assert land.free[34, 60]
    game.cheat()
    game.do(game.say("Build_Pylon_Screen", units=(probe.tag,), point=WorldPoint(34, 60)))
    game.play(1)
    land = land_of(game.snapshot)
    planned = {tuple(cell) for cell in np.argwhere(land.planned).tolist()}
    assert planned == {(33, 59), (34, 59), (33, 60), (34, 60)} or land.taken[34, 60]
    assert not land.free[34, 60]
    assert probe.tag in game.snapshot.units


def test_a_pylon_powers_its_circle_and_a_nexus_powers_nothing(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    assert not land_of(game.snapshot).power_cells(corner=True).any()
    tag = game.put("Pylon", 30, 30)
    land = land_of(game.snapshot)
    x, y = np.argwhere(land.power_cells(corner=False)).T
    assert np.hypot(x + 0.5 - 30, y + 0.5 - 30).max() <= 6.5
    assert land.power_cells(corner=False).sum() == sum(
        math.hypot(i + 0.5, j + 0.5) <= 6.5 for i in range(-8, 8) for j in range(-8, 8)
    )
    assert (land.power_cells(corner=True, by=tag) == land.power_cells(corner=True)).all()
    assert not land.power_cells(corner=True, by=1).any()


def test_ways_of_workers_and_places_of_town_halls_are_kept_free(make_game: Callable[..., Game]) -> None:
    land = land_of(make_game().snapshot)
    for base in land.bases:
        assert land.kept[int(base.place.x), int(base.place.y)]
        for resource in (*base.fields, *base.geysers):
            middle = ((base.place.x + resource.x) / 2, (base.place.y + resource.y) / 2)
            assert land.kept[int(middle[0]), int(middle[1])]


def test_a_barracks_without_an_add_on_keeps_the_room_for_it(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "terran")
    game.put("Barracks", 30.5, 30.5)
    land = land_of(game.snapshot)
    assert all(land.kept[x, y] for x in (32, 33) for y in (29, 30))
    assert not land.kept[34, 29]


def test_the_land_of_a_moment_is_made_once(make_game: Callable[..., Game]) -> None:
    game = make_game()
    assert land_of(game.snapshot) is land_of(game.snapshot)


def test_without_grids_nothing_can_be_built_and_nothing_fails(snapshot: Callable[..., Snapshot]) -> None:
    land = land_of(snapshot([]))
    assert not land.free.any()
    assert not land.creep.any()
    assert land.bases == ()
