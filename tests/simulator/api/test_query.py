"""Ways, places to build, abilities of units: one answer to each question."""

import math

import pytest
from s2clientprotocol import common_pb2, debug_pb2, error_pb2, query_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, interface

PYLON, GATEWAY, NEXUS, WARP_ZEALOT, REFINERY, SPAWNING_POOL = 881, 883, 880, 1413, 320, 1155
SPINE_CRAWLER = 1166


@pytest.fixture
def client() -> Client:
    client = Client()
    client.play("2c_vs_64zg", interface(screen=0))
    return client


def distance(client: Client, start: tuple[float, float] | int, end: tuple[float, float]) -> float:
    question = query_pb2.RequestQueryPathing(end_pos=common_pb2.Point2D(x=end[0], y=end[1]))
    if isinstance(start, int):
        question.unit_tag = start
    else:
        question.start_pos.x, question.start_pos.y = start
    return client.ask(query=query_pb2.RequestQuery(pathing=[question])).query.pathing[0].distance


def test_a_straight_way_is_as_long_as_the_line() -> None:
    client = Client()
    client.play("2s3z", interface(screen=0))
    assert distance(client, (9.0, 16.0), (23.0, 16.0)) == pytest.approx(14.0)


def test_a_way_round_a_cliff_is_longer_than_the_line(client: Client) -> None:
    ways = [
        (distance(client, (x, 16.0), (x + dx, 16.0 + dy)), math.hypot(dx, dy))
        for x in (9.0, 16.0, 23.0) for dx in (-6.0, 6.0) for dy in (-8.0, 8.0)
    ]  # fmt: skip
    walked = [(way, line) for way, line in ways if way > 0]
    assert all(way >= line - 0.01 for way, line in walked)
    assert any(way > line + 0.5 for way, line in walked)


@pytest.mark.parametrize("end", [(-5.0, 3.0), (float("nan"), 3.0), (1e30, -1e30), (float("inf"), 0.0)])
def test_a_way_to_nowhere_is_no_fault(client: Client, end: tuple[float, float]) -> None:
    assert distance(client, (9.0, 16.0), end) >= 0.0


def test_a_unit_that_is_not_there_has_no_way(client: Client) -> None:
    assert distance(client, 12345, (9.0, 16.0)) == 0.0


def test_the_way_of_a_unit_starts_where_it_stands(client: Client) -> None:
    unit = client.observe().observation.raw_data.units[0]
    at = distance(client, (unit.pos.x, unit.pos.y), (unit.pos.x + 1, unit.pos.y))
    assert distance(client, unit.tag, (unit.pos.x + 1, unit.pos.y)) == at


def place(client: Client, ability: int, x: float, y: float) -> str:
    question = query_pb2.RequestQueryBuildingPlacement(ability_id=ability, target_pos=common_pb2.Point2D(x=x, y=y))
    answer = client.ask(query=query_pb2.RequestQuery(placements=[question])).query.placements[0]
    return error_pb2.ActionResult.Name(answer.result)


@pytest.mark.parametrize(
    ("ability", "point", "result"),
    [
        (PYLON, (9.0, 16.0), "Success"),
        (GATEWAY, (9.5, 16.5), "CantBuildTooFarFromBuildPowerSource"),
        (NEXUS, (9.5, 16.5), "Success"),
        (WARP_ZEALOT, (9.5, 16.5), "CantBuildTooFarFromBuildPowerSource"),
        (REFINERY, (9.5, 16.5), "CantBuildLocationInvalid"),
        (SPAWNING_POOL, (9.5, 16.5), "CantBuildTooFarFromCreepSource"),
        (PYLON, (0.0, 0.0), "CantBuildLocationInvalid"),
        (PYLON, (-50.0, 900.0), "CantBuildLocationInvalid"),
        (PYLON, (float("nan"), 5.0), "CantBuildLocationInvalid"),
        (23, (9.0, 16.0), "NotSupported"),
        (0, (9.0, 16.0), "NotSupported"),
    ],
)
def test_places_to_build(ability: int, point: tuple[float, float], result: str) -> None:
    client = Client()
    client.play("2s3z", interface(screen=0))
    assert place(client, ability, *point) == result


def test_a_base_may_be_placed_where_nobody_has_looked_yet() -> None:
    client = Client()
    client.play("Simple64", interface(screen=0))
    observation = client.observe().observation.raw_data
    sight = observation.map_state.visibility
    (foe,) = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw.start_locations
    assert sight.data[int(foe.y) * sight.size.x + int(foe.x)] == 0
    fields = [unit.pos for unit in observation.units if unit.mineral_contents]
    unseen = (foe.x - 12.5, foe.y - 0.5) if foe.x > sight.size.x / 2 else (foe.x + 11.5, foe.y - 0.5)
    assert all(math.dist(unseen, (field.x, field.y)) > 6 for field in fields)
    assert place(client, PYLON, *unseen) != "CantSeeBuildLocation"
    assert place(client, SPINE_CRAWLER, *unseen) == "CantSeeBuildLocation"


def put(client: Client, unit_type: int, owner: int, x: float, y: float) -> None:
    made = debug_pb2.DebugCreateUnit(unit_type=unit_type, owner=owner, pos=common_pb2.Point2D(x=x, y=y), quantity=1)
    client.debug(debug_pb2.DebugCommand(create_unit=made))
    client.step(4)


ZERGLING, BURROWED_ZERGLING, DARK_TEMPLAR, OBSERVER, BARRACKS = 105, 119, 76, 82, 21


@pytest.mark.parametrize(
    ("unit_type", "owner", "result"),
    [
        (ZERGLING, 2, "CantBuildOnThat"), (BURROWED_ZERGLING, 2, "Success"), (DARK_TEMPLAR, 2, "Success"),
        (DARK_TEMPLAR, 1, "Success"), (BARRACKS, 2, "CantBuildOnThat"),
    ],
)  # fmt: skip
def test_a_place_is_not_refused_for_what_the_player_does_not_see(unit_type: int, owner: int, result: str) -> None:
    client = Client()
    client.play("2s3z", interface(screen=0))
    put(client, unit_type, owner, 9.5, 16.5)
    assert place(client, PYLON, 9.0, 16.0) == result


def foes_ground() -> tuple[Client, tuple[float, float]]:
    """Return a game with fog, and a place beside the enemy's base on which a structure may stand."""
    client = Client()
    client.play("Simple64", interface(screen=0))
    (foe,) = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw.start_locations
    return client, (foe.x - 12.5, foe.y - 0.5) if foe.x > 44 else (foe.x + 12.5, foe.y - 0.5)


@pytest.mark.parametrize("unit_type", [BARRACKS, ZERGLING])
def test_what_the_fog_covers_is_in_the_way_of_no_plan(unit_type: int) -> None:
    client, (x, y) = foes_ground()
    put(client, unit_type, 2, x, y)
    assert place(client, PYLON, x, y) == "Success"
    put(client, OBSERVER, 1, x, y - 4)  # comes to look
    assert place(client, PYLON, x, y) == "CantBuildOnThat"


def test_a_way_leads_through_structures_that_nobody_has_seen() -> None:
    client, (x, y) = foes_ground()
    start, end = (x - 4.0, y), (x + 4.0, y)
    before = distance(client, start, end)
    put(client, BARRACKS, 2, x, y)
    assert distance(client, start, end) == before
    put(client, OBSERVER, 1, x, y - 4)
    assert distance(client, start, end) > before


def test_a_way_that_starts_inside_the_town_hall_counts_from_beside_it() -> None:
    client = Client()
    client.play("Simple64", interface(screen=0))
    units = client.observe().observation.raw_data.units
    (hall,) = [unit for unit in units if unit.alliance == raw_pb2.Self and unit.radius > 2]
    (foe, *_) = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw.start_locations
    worker = next(unit for unit in units if unit.alliance == raw_pb2.Self and unit.radius < 1)
    goal = (foe.x - 6.0, foe.y) if foe.x > 44 else (foe.x + 6.0, foe.y)
    way = distance(client, (hall.pos.x, hall.pos.y), goal)
    assert way == pytest.approx(distance(client, worker.tag, goal), abs=6.0)
    assert way > math.dist((hall.pos.x, hall.pos.y), goal) - 6.0


def test_a_way_into_a_structure_or_a_cliff_is_none(client: Client) -> None:
    cliff = next(
        (x, y) for x in range(2, 30) for y in range(2, 30) if not distance(client, (x + 0.5, y + 0.5), (9.0, 16.0))
    )
    assert distance(client, (9.0, 16.0), (cliff[0] + 0.5, cliff[1] + 0.5)) == 0.0


def test_abilities_are_told_of_own_units_only(client: Client) -> None:
    units = client.observe().observation.raw_data.units
    own = next(unit for unit in units if unit.alliance == raw_pb2.Self)
    enemy = next(unit for unit in units if unit.alliance == raw_pb2.Enemy)
    questions = [query_pb2.RequestQueryAvailableAbilities(unit_tag=tag) for tag in (own.tag, enemy.tag, 99)]
    mine, theirs, nobody = client.ask(query=query_pb2.RequestQuery(abilities=questions)).query.abilities
    assert (mine.unit_tag, mine.unit_type_id) == (own.tag, own.unit_type)
    assert [ability.ability_id for ability in mine.abilities] == [1, 4, 16, 17, 18, 23]
    assert theirs.unit_type_id == enemy.unit_type
    assert not theirs.abilities
    assert (nobody.unit_tag, nobody.unit_type_id) == (99, 0)


def test_nothing_is_told_of_a_unit_that_the_player_does_not_know() -> None:
    client, (x, y) = foes_ground()
    world = client.session._process.table.game.world
    tag = world.tag_of(int(world.units_of(2)[-1]))
    question = query_pb2.RequestQueryAvailableAbilities(unit_tag=tag)
    for known in (False, True):
        (told,) = client.ask(query=query_pb2.RequestQuery(abilities=[question])).query.abilities
        assert (told.unit_type_id != 0) == known
        assert (distance(client, tag, (x, y)) > 0) == known
        client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
        client.step(4)


def test_many_questions_have_as_many_answers(client: Client) -> None:
    question = query_pb2.RequestQueryPathing(
        start_pos=common_pb2.Point2D(x=9, y=16), end_pos=common_pb2.Point2D(x=10, y=16)
    )
    assert len(client.ask(query=query_pb2.RequestQuery(pathing=[question] * 300)).query.pathing) == 300
