"""Building: the game accepts the places that rules find, and the structure comes to stand there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.auto.places import front
from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import knowledge
from khala_bridge.names import unit_name
from khala_bridge.state.ground import footprint_of, land_of, sites

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.auto import RuleOrder
    from khala_bridge.state import Unit
    from tests.bridge.auto.conftest import Game

MAPS = ("Simple64", "Flat48", "Flat64", "Simple96")
RACES = ("protoss", "terran", "zerg")
WORKER = {"protoss": "Probe", "terran": "SCV", "zerg": "Drone"}
FREE = (debug_pb2.all_resources, debug_pb2.tech_tree, debug_pb2.food)
ON_GROUND = [name for name, site in sites().items() if site.ground != "geyser" and not site.clear]


def built(orders: list[RuleOrder]) -> WorldPoint | int:
    """Return where the structure is going to stand."""
    (target,) = (order.target for order in orders if order.function.name.startswith("Build"))
    assert target is not None
    return target


def race_of(structure: str) -> str:
    return knowledge()[structure].race


@pytest.fixture(scope="module")
def rich(make_game: Callable[..., Game]) -> Callable[[str, str], Game]:
    """Return read-only games in which everything is allowed and paid for, one for each map and race."""
    games: dict[tuple[str, str], Game] = {}

    def get(name: str, race: str) -> Game:
        if (name, race) not in games:
            game = games[name, race] = make_game(name, race)
            game.cheat(*FREE)
            if race == "protoss":
                place = built(game.say("Build_Pylon"))
                assert isinstance(place, WorldPoint)
                game.put("Pylon", *place)
        games[name, race].see()
        return games[name, race]

    return get


# everything can be built ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("structure", ON_GROUND)
def test_the_game_accepts_the_place_that_is_found(rich: Callable[..., Game], name: str, structure: str) -> None:
    game = rich(name, race_of(structure))
    place = built(game.say(f"Build_{structure}"))
    assert isinstance(place, WorldPoint)
    assert game.may_stand(f"Build_{structure}_screen", place) == "Success"
    land, footprint = land_of(game.snapshot), footprint_of(structure)
    assert footprint is not None
    x, y = footprint.cell(*place)
    assert not any(land.kept[x + dx, y + dy] for dx, dy in footprint.cells)
    assert min(math.dist(place, (hall.pos.x, hall.pos.y)) for hall in land.own_halls) < 16


@pytest.mark.parametrize("race", [r if r != "zerg" else pytest.param(r, marks=pytest.mark.slow) for r in RACES])
@pytest.mark.parametrize("name", ["Simple64", pytest.param("Flat64", marks=pytest.mark.slow)])
def test_a_whole_base_can_be_built_and_nobody_is_walled_in(
    make_game: Callable[..., Game], name: str, race: str
) -> None:
    game = make_game(name, race)
    game.cheat(*FREE, debug_pb2.fast_build)
    game.client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.god))
    wanted = [s for s in sites() if race_of(s) == race and not sites()[s].clear]
    if race == "protoss":
        wanted = ["Pylon", *wanted, "Gateway", "Pylon", "Gateway", "Gateway"]
    if race == "terran":
        wanted += ["Barracks", "SupplyDepot", "Factory"]
    game.put("Marine", *land_of(game.snapshot).bases[0].place)
    ways = walkable_pieces(game)
    for structure in wanted:
        before = len(standing(game, structure))
        assert set(game.do(game.say(f"Build_{structure}"))) == {"Success"}
        for _ in range(20):
            game.play(32)
            if len(standing(game, structure)) > before:
                break
        assert len(standing(game, structure)) > before, structure
        if race == "zerg":
            game.put("Drone", *(getattr(game.own("Drone")[0].pos, axis) for axis in "xy"))
    assert walkable_pieces(game) == ways
    for unit in game.own("Barracks") + game.own("Factory") + game.own("Starport"):
        x, y = int(unit.pos.x), int(unit.pos.y)
        taken = land_of(game.snapshot).taken
        assert not any(taken[x + dx, y + dy] for dx in (2, 3) for dy in (-1, 0))


def standing(game: Game, structure: str) -> list[Unit]:
    """Return finished own structures of a type; a Gateway may be a WarpGate by now."""
    found = game.own(structure) + (game.own("WarpGate") if structure == "Gateway" else [])
    return [unit for unit in found if unit.build_progress >= 1]


def walkable_pieces(game: Game) -> int:
    """Return the number of connected pieces of walkable ground, without tiny pockets."""
    count, _, stats, _ = cv2.connectedComponentsWithStats(
        np.ascontiguousarray(land_of(game.snapshot).open, np.uint8), connectivity=4
    )
    return int((stats[1:count, cv2.CC_STAT_AREA] > 0).sum())


def test_the_same_words_find_the_same_place(rich: Callable[..., Game]) -> None:
    game = rich("Simple64", "protoss")
    found = []
    for _ in range(2):
        game.see()
        found.append([built(game.say(f"Build_{structure}")) for structure in ("Pylon", "Gateway", "Forge", "Pylon")])
    first, second = found
    assert first == second


def test_two_calls_of_a_turn_do_not_want_the_same_place_worker_or_money(rich: Callable[..., Game]) -> None:
    game = rich("Simple64", "protoss")
    minerals = game.ledger.minerals
    orders = [game.say("Build_Gateway"), game.say("Build_Gateway"), game.say("Build_Pylon"), game.say("Build_Pylon")]
    assert len({built(order) for order in orders}) == 4
    assert len({order[0].units for order in orders}) == 4
    assert game.ledger.minerals == minerals - 500
    boxes = [(target.x, target.y) for target in map(built, orders) if isinstance(target, WorldPoint)]
    assert all(max(abs(a[0] - b[0]), abs(a[1] - b[1])) >= 2.5 for a in boxes for b in boxes if a != b)


# where ----------------------------------------------------------------------------------------------------------------


def test_pylons_stand_apart_so_that_each_powers_new_ground(rich: Callable[..., Game]) -> None:
    game = rich("Flat64", "protoss")
    old = [(unit.pos.x, unit.pos.y) for unit in game.own("Pylon")]
    for _ in range(3):
        place = built(game.say("Build_Pylon"))
        assert isinstance(place, WorldPoint)
        assert min(math.dist(place, other) for other in old) >= 5
        old.append((place.x, place.y))


@pytest.mark.parametrize(("race", "structure"), [("terran", "Bunker"), ("zerg", "SpineCrawler")])
def test_defence_stands_where_the_enemy_comes_from(rich: Callable[..., Game], race: str, structure: str) -> None:
    game = rich("Flat64", race)
    land = land_of(game.snapshot)
    hall = WorldPoint(land.own_halls[0].pos.x, land.own_halls[0].pos.y)
    place, enemy = built(game.say(f"Build_{structure}")), land.ground.starts[0]
    assert isinstance(place, WorldPoint)
    assert math.dist(place, enemy) < math.dist(hall, enemy)
    assert math.dist(place, front(land, hall)) < 4


def test_a_new_base_is_the_nearest_free_one(make_game: Callable[..., Game]) -> None:
    game = make_game(seed=1)
    game.cheat(*FREE)
    land = land_of(game.snapshot)
    hall = WorldPoint(land.own_halls[0].pos.x, land.own_halls[0].pos.y)
    ways = land.ground.ways_from(hall)
    place = built(game.say("Build_Nexus"))
    others = [b.place for b in land.bases if math.dist(b.place, hall) > 5]
    assert place == min(others, key=lambda p: ways[int(p.x), int(p.y)])
    other = built(game.say("Build_Nexus"))
    assert other != place


@pytest.mark.parametrize("race", RACES)
@pytest.mark.parametrize("name", MAPS)
def test_a_base_is_founded_where_nobody_looked_yet(make_game: Callable[..., Game], name: str, race: str) -> None:
    hall = {"protoss": "Nexus", "terran": "CommandCenter", "zerg": "Hatchery"}[race]
    game = make_game(name, race)
    game.cheat(*FREE)
    land = land_of(game.snapshot)
    if len(land.bases) == 2:
        said = "every place for a town hall that can be walked to is taken."  # one own, one where the enemy begins
        assert game.refusal(f"Build_{hall}").message == f"Build_{hall} is not possible now: {said}"
        return
    orders = game.say(f"Build_{hall}")
    place = built(orders)
    assert isinstance(place, WorldPoint)
    assert place not in land.ground.starts
    assert game.may_stand(f"Build_{hall}_screen", place) == "Success"
    assert set(game.do(orders)) == {"Success"}


def test_a_founded_base_comes_to_stand(make_game: Callable[..., Game]) -> None:
    game = make_game()
    game.cheat(*FREE)
    orders = game.say("Build_Nexus")
    game.do(orders)
    for _ in range(40):
        game.play(32)
        if len(game.own("Nexus")) > 1:
            break
    assert built(orders) in {(unit.pos.x, unit.pos.y) for unit in game.own("Nexus")}


@pytest.mark.parametrize("race", RACES)
def test_gas_is_built_on_a_geyser_of_the_own_base(make_game: Callable[..., Game], race: str) -> None:
    structure = {"protoss": "Assimilator", "terran": "Refinery", "zerg": "Extractor"}[race]
    game = make_game("Simple64", race)
    game.cheat(debug_pb2.all_resources)
    first, second = built(game.say(f"Build_{structure}")), built(game.say(f"Build_{structure}"))
    hall = land_of(game.snapshot).own_halls[0]
    geysers = {u.tag: math.dist((u.pos.x, u.pos.y), (hall.pos.x, hall.pos.y)) for u in game.units("VespeneGeyser")}
    assert {first, second} == {tag for tag, away in geysers.items() if away < 10}
    assert "free geyser" in game.refusal(f"Build_{structure}").message
    game.see()
    assert set(game.do(game.say(f"Build_{structure}"))) == {"Success"}
    game.play(200)
    assert len(game.own(structure)) == 1
    assert built(game.say(f"Build_{structure}")) == second


# who ------------------------------------------------------------------------------------------------------------------


def test_the_worker_gathers_minerals_and_carries_nothing_and_goes_back(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(debug_pb2.all_resources)
    game.play(160)
    build, back = game.say("Build_Pylon")
    probe = game.snapshot.units[build.units[0]]
    assert not probe.buff_ids
    assert back.function.name == "Harvest_Gather_screen"
    assert back.queued
    empty = [unit for unit in game.own("Probe") if not unit.buff_ids]
    assert isinstance(build.target, WorldPoint)
    goal = build.target
    assert probe.tag == min(empty, key=lambda u: math.dist((u.pos.x, u.pos.y), goal)).tag
    game.do([build, back])
    for _ in range(20):
        game.play(16)
        if game.own("Pylon"):
            break
    game.play(40)
    (order, *_) = game.snapshot.units[probe.tag].orders
    assert unit_name(game.snapshot.units[order.target_unit_tag].unit_type).startswith("MineralField")


def test_a_worker_that_was_ordered_in_this_turn_is_left_alone(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(debug_pb2.all_resources)
    first = game.say("Build_Pylon")[0].units
    game.see()
    game.ledger.take(*first)
    assert game.say("Build_Pylon")[0].units != first


def test_a_team_builds_one_after_the_other(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(debug_pb2.all_resources)
    team = (game.own("Probe")[0].tag,)
    (first,) = game.say("Build_Pylon_Screen", units=team, point=WorldPoint(45, 20))
    (second,) = game.say("Build_Pylon_Screen", units=team, point=WorldPoint(44, 14))
    assert (first.units, first.queued) == (team, False)
    assert (second.units, second.queued) == (team, True)
    assert game.do([first, second]) == ["Success", "Success"]
    game.play(400)
    assert {(unit.pos.x, unit.pos.y) for unit in game.own("Pylon")} == {(45, 20), (44, 14)}


# at and near ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("said", "stands"), [((45.3, 19.8), (45.0, 20.0)), ((45.5, 20.5), (45.0, 20.0)), ((44.6, 20.9), (45.0, 21.0))]
)
def test_a_point_means_the_nearest_cells(
    rich: Callable[..., Game], said: tuple[float, float], stands: tuple[float, float]
) -> None:
    game = rich("Flat64", "protoss")
    assert built(game.say("Build_Pylon_Screen", units=(game.own("Probe")[0].tag,), point=WorldPoint(*said))) == stands


def test_near_a_unit_is_as_near_as_there_is_room(rich: Callable[..., Game]) -> None:
    game = rich("Flat64", "protoss")
    pylon, probe = game.own("Pylon")[0], game.own("Probe")[0]
    place = built(game.say("Build_Gateway_Near", units=(probe.tag,), tag=pylon.tag))
    assert isinstance(place, WorldPoint)
    assert math.dist(place, (pylon.pos.x, pylon.pos.y)) < 4
    assert game.may_stand("Build_Gateway_screen", place) == "Success"


@pytest.mark.parametrize("resource", ["MineralField", "VespeneGeyser"])
def test_a_nexus_near_a_resource_stands_on_the_base_place(make_game: Callable[..., Game], resource: str) -> None:
    game = make_game()
    game.cheat(debug_pb2.all_resources)
    remembered = [u for u in game.snapshot.known.values() if u.name == resource]
    unit = max(remembered, key=lambda u: u.pos.x)  # of a base that was not seen yet
    assert unit.is_remembered
    probe = (game.own("Probe")[0].tag,)
    base = min(land_of(game.snapshot).bases, key=lambda b: math.dist(b.place, (unit.pos.x, unit.pos.y))).place
    assert built(game.say("Build_Nexus_Near", units=probe, tag=unit.tag)) == base
    game.see()
    lock = built(game.say("Lock_Nexus_Near", units=probe, tag=unit.tag))
    assert isinstance(lock, WorldPoint)
    assert math.dist(lock, base) < 1


def test_gas_near_a_tag_is_that_geyser_or_the_next(make_game: Callable[..., Game]) -> None:
    game = make_game()
    game.cheat(debug_pb2.all_resources)
    probe, nexus = (game.own("Probe")[0].tag,), game.own("Nexus")[0]
    geyser = min(game.units("VespeneGeyser"), key=lambda u: u.pos.x)
    assert built(game.say("Build_Assimilator_Near", units=probe, tag=geyser.tag)) == geyser.tag
    other = built(game.say("Build_Assimilator_Near", units=probe, tag=nexus.tag))
    assert isinstance(other, int)
    assert other != geyser.tag
    game.see()
    point = WorldPoint(geyser.pos.x + 0.7, geyser.pos.y - 0.7)
    assert built(game.say("Build_Assimilator_Screen", units=probe, point=point)) == geyser.tag
