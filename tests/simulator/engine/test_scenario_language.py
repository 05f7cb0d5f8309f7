"""The parts of the scenario language: places, conditions, actions, and files that extend each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import MapError, map_from
from khala_simulator.maps.nodes import ScenarioError
from khala_simulator.maps.places import PlaceGrid, Region, Span
from khala_simulator.maps.scenario_file import parse_scenario, sheets
from khala_simulator.maps.script import NumberCondition
from khala_simulator.tick import advance, new_game
from khala_simulator.world.orders import OrderKind
from khala_simulator.world.players import GameResult

if TYPE_CHECKING:
    from khala_simulator.world.world import World

HEAD = """\
name: try_out
family: test
title: To try things
terrain: {flat: [48, 48]}
visibility: {fog: false, black_mask: false}
players:
  1: {race: terran, control: agent}
  2: {race: zerg, control: computer}
points: {west: [10, 24], east: [38, 24]}
regions:
  middle: {circle: [24, 24, 6]}
  ring: [{rect: [4, 4, 44, 44]}, {circle: [24, 24, 15], minus: true}]
"""


def world_of(text: str, *, seed: int = 0) -> World:
    text = HEAD + text
    return new_game(map_from(parse_scenario(text, "try_out.yaml"), text), seed=seed)


def names(world: World, player: int) -> list[str]:
    return [world.unit_type(slot).name for slot in world.units_of(player).tolist()]


def places(world: World, player: int) -> list[tuple[float, ...]]:
    return [tuple(world.pos[slot].tolist()) for slot in world.units_of(player).tolist()]


# places ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "expected"),
    [
        ("west", [(10, 24)]),
        ("[12, 20]", [(12, 20)]),
        ("[[12, 20], [14, 20]]", [(12, 20), (14, 20)]),
        ("{x: [12, 14], y: 20}", [(12, 20), (14, 20)]),
        ("{x: 12, y: {from: 20, to: 23, step: 1.5}}", [(12, 20), (12, 21.5), (12, 23)]),
        ("{around: west, x: [-1, 1], y: 0}", [(9, 24), (11, 24)]),
    ],
)
def test_units_stand_where_the_file_says(at: str, expected: list[tuple[float, float]]) -> None:
    world = world_of(f"units:\n  - {{player: 1, unit: Marine, at: {at}}}\n")
    assert places(world, 1) == expected


def test_a_placed_unit_stands_on_its_point_and_a_created_one_makes_room() -> None:
    world = world_of(
        "units:\n  - {player: 1, unit: Marine, at: west}\n  - {player: 1, unit: Marine, at: [10.1, 24]}\n"
        "triggers:\n  - name: go\n    when: [start]\n    do: [{create: {player: 1, unit: Marine, at: west}}]\n"
    )
    assert places(world, 1)[:2] == [(10, 24), (10.1, 24)]
    x, y = places(world, 1)[2]
    assert np.hypot(x - 10, y - 24) >= 0.75


def test_a_column_goes_up_and_down_in_turn() -> None:
    world = world_of("units:\n  - {player: 1, unit: Marine, count: 5, at: {column: west}}\n")
    assert places(world, 1) == [(10, 24), (10, 25), (10, 23), (10, 26), (10, 22)]


def test_a_place_may_say_the_facing() -> None:
    world = world_of("units:\n  - {player: 1, unit: Marine, facing: 1, at: [[12, 20], [14, 20, 3.1]]}\n")
    assert world.facing()[world.units_of(1)].tolist() == pytest.approx([1, 3.1])


@pytest.mark.parametrize("seed", range(8))
def test_random_places_are_in_the_region_and_far_enough(seed: int) -> None:
    world = world_of(
        "units:\n"
        "  - {player: 1, unit: Marine, at: [8, 24]}\n"
        "  - {player: 2, unit: Zergling, count: 12, at: {random_in: ring, away_from: {Marine: 5, Zergling: 3}}}\n",
        seed=seed,
    )
    at = np.array(places(world, 2))
    assert ((at - 24) ** 2).sum(axis=1).min() >= 15**2 - 1e-6
    assert np.abs(at - 24).max() <= 20
    apart = np.sqrt(((at[:, None] - at) ** 2).sum(axis=2)) + np.eye(12) * 99
    assert apart.min() >= 3
    assert np.sqrt(((at - (8, 24)) ** 2).sum(axis=1)).min() >= 5


def test_a_region_is_what_its_shapes_cover_and_none_takes_out() -> None:
    region = Region.model_validate([{"rect": [0, 0, 10, 10]}, {"circle": [5, 5, 2], "minus": True}])
    points = np.array([[0.0, 0.0], [10.0, 10.0], [10.1, 5.0], [5.0, 5.0], [5.0, 7.0], [5.0, 7.1]])
    assert region.covers(points).tolist() == [True, True, False, False, False, True]
    assert region.box == (0, 0, 10, 10)


def test_a_span_has_both_its_ends() -> None:
    assert Span.model_validate({"from": 40.5, "to": 55.5}).values()[::15] == (40.5, 55.5)
    assert PlaceGrid.model_validate({"x": 3, "y": [1, 2]}).x == (3,)


# conditions -----------------------------------------------------------------------------------------------------------

THREE_MARINES = "units:\n  - {player: 1, unit: Marine, at: {x: 10, y: [20, 22, 24]}}\n"


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("{alive: {1: some}}", True),
        ("{alive: {1: some, 2: some}}", False),
        ("{count: {1: {Marine: 3}}}", True),
        ('{count: {1: {Marine: "> 3"}}}', False),
        ('{count: {1: {Marine: ">= 3", SCV: 0}}}', True),
        ('{count: {1: {Marine: "< 4"}, 2: {Zergling: "> 0"}}}', False),
        ("{any: [{count: {1: {Marine: 9}}}, {alive: {2: none}}]}", True),
        ("{any: [{count: {1: {Marine: 9}}}, {alive: {2: some}}]}", False),
        ('{alive: {1: some}, any: [{score: {1: ">= 1"}}]}', False),
        ("{score: {1: 0}}", True),
    ],
)
def test_a_condition_holds_when_all_of_it_does(condition: str, holds: bool) -> None:
    world = world_of(
        THREE_MARINES
        + f"triggers:\n  - name: t\n    when: [start]\n    if: {condition}\n    do: [{{result: {{1: tie}}}}]\n"
    )
    assert world.ended == holds


def test_units_in_the_making_count_only_where_it_is_said_and_passengers_always() -> None:
    text = (
        "units:\n  - {player: 1, unit: Medivac, at: west, cargo: {Marine: 2}}\n"
        "triggers:\n"
        "  - name: finished\n    when: [{at_loop: 1}]\n    if: {count: {1: {Marine: 2}}}\n"
        "    do: [{score: {1: 1}}]\n"
        "  - name: any\n    when: [{at_loop: 2}]\n    if: {count_unfinished: {1: {Marine: 3}}}\n"
        "    do: [{score: {1: 10}}]\n"
    )
    world = world_of(text)
    assert names(world, 1) == ["Medivac"]
    slot = lifecycle.spawn(world, world.catalog.unit("Marine"), 1, (20, 20))
    world.build_progress[slot] = 0.4
    advance(world, 2)
    assert world.players[1].score.curriculum == 11


@pytest.mark.parametrize(
    ("text", "value", "holds"), [("< 6", 5, True), ("<=6", 6, True), ("> 6", 6, False), ("== 2", 2, True)]
)
def test_a_comparison_is_an_operator_and_a_number(text: str, value: int, holds: bool) -> None:
    operator, number = text.rstrip("0123456789 "), text.lstrip("<>= ")
    assert NumberCondition(operator, int(number)).holds(value) == holds


# actions --------------------------------------------------------------------------------------------------------------


def test_an_order_goes_to_those_it_is_for() -> None:
    world = world_of(
        "units:\n"
        "  - {player: 2, unit: Zergling, at: [24, 24]}\n"
        "  - {player: 2, unit: Zergling, at: [8, 8]}\n"
        "  - {player: 2, unit: Drone, at: [24, 26]}\n"
        "  - {player: 2, unit: Queen, at: [24, 22]}\n"
        "  - {player: 2, unit: Mutalisk, at: [26, 24]}\n"
        "triggers:\n  - name: go\n    when: [start]\n    do:\n"
        "      - order: {player: 2, inside: middle, unless: [worker, caster, flyer], attack_move: west}\n"
    )
    ordered = [world.unit_type(s).name for s in world.units_of(2).tolist() if world.orders_of(s)]
    assert ordered == ["Zergling"]
    assert [o.point for s in world.units_of(2).tolist() for o in world.orders_of(s)] == [(10, 24)]


def test_an_order_to_a_group_is_for_those_who_were_made_as_it_last() -> None:
    world = world_of(
        "groups:\n  wave: [{player: 2, unit: Zergling, at: east}]\n"
        "triggers:\n  - name: go\n    when: [start, {at_loop: 2}]\n    do:\n"
        "      - spawn: [wave]\n      - order: {player: 2, group: wave, move: west}\n"
        "  - name: back\n    when: [{at_loop: 2}]\n    do: [{order: {player: 2, group: wave, move: east}}]\n"
    )
    advance(world, 2)
    orders = {int(world.born_loop[s]): world.orders_of(s)[0].point for s in world.units_of(2).tolist()}
    assert orders == {0: (10, 24), 2: (38, 24)}


@pytest.mark.parametrize(
    ("queue", "points"),
    [("replace", [(38, 24)]), ("append", [(10, 24), (38, 24)]), ("front", [(38, 24), (10, 24)])],
)
def test_an_order_replaces_follows_or_goes_before(queue: str, points: list[tuple[float, float]]) -> None:
    world = world_of(
        "units:\n  - {player: 1, unit: Marine, at: [20, 10]}\n"
        "triggers:\n  - name: go\n    when: [start]\n    do:\n"
        "      - order: {player: 1, move: west}\n"
        f"      - order: {{player: 1, move: east, queue: {queue}}}\n"
    )
    (marine,) = world.units_of(1).tolist()
    assert [order.point for order in world.orders_of(marine)] == points


def test_an_entry_is_noticed_once_and_again_after_leaving() -> None:
    world = world_of(
        "units:\n  - {player: 1, unit: Marine, at: [24, 24]}\n  - {player: 2, unit: Zergling, at: [8, 8]}\n"
        "triggers:\n  - name: in\n    when: [{enters: {region: middle, player: 1}}]\n    do: [{score: {1: 1}}]\n"
    )
    marine, zergling = world.units_of(1)[0], world.units_of(2)[0]
    scores = []
    for x in (24, 8, 24, 24, 8, 25):
        world.pos[marine] = (x, 24)
        world.pos[zergling] = (24, 20)
        world.life[:] = 35.0
        advance(world, 1)
        scores.append(world.players[1].score.curriculum)
    assert scores == [0, 0, 1, 1, 1, 2]


def test_a_draw_takes_one_of_its_options_by_chance() -> None:
    text = (
        "triggers:\n  - name: go\n    when: [start]\n    do:\n"
        "      - draw: [{mine: west, theirs: east}, {mine: east, theirs: west}]\n"
        "      - create: {player: 1, unit: Marine, at: mine}\n"
        "      - create: {player: 2, unit: Zergling, at: theirs}\n"
    )
    drawn = {(places(w, 1)[0], places(w, 2)[0]) for w in (world_of(text, seed=seed) for seed in range(12))}
    assert drawn == {((10, 24), (38, 24)), ((38, 24), (10, 24))}


def test_what_is_given_and_removed_is_there_and_gone() -> None:
    world = world_of(
        THREE_MARINES + "triggers:\n  - name: go\n    when: [{at_loop: 3}]\n    do:\n"
        "      - give: {1: {minerals: 75, vespene: 25}}\n"
        "      - remove: {player: 1, unit: Marine}\n"
    )
    advance(world, 5)
    assert (world.players[1].minerals, world.players[1].vespene) == (75, 25)
    assert names(world, 1) == []
    assert world.deaths == []


def test_an_attack_on_the_units_of_a_player_is_queued_for_each() -> None:
    world = world_of(
        THREE_MARINES + "  - {player: 2, unit: Zergling, at: east}\n"
        "triggers:\n  - name: go\n    when: [start]\n    do: [{order: {player: 2, attack_units_of: 1}}]\n"
    )
    (zergling,) = world.units_of(2).tolist()
    assert [order.kind for order in world.orders_of(zergling)] == [OrderKind.ATTACK_UNIT] * 3


def test_an_idle_unit_is_sent_against_the_nearest_and_a_busy_one_goes_on() -> None:
    world = world_of(
        THREE_MARINES + "  - {player: 2, unit: Zergling, count: 2, at: east}\n"
        "triggers:\n  - name: go\n    when: [{at_loop: 2}]\n"
        "    do: [{order: {player: 2, attack_nearest_of: 1, idle: true}}]\n"
    )
    idle, busy = world.units_of(2).tolist()
    commands.move(world, [busy], (40.0, 40.0))
    advance(world, 2)
    away = np.linalg.norm(world.pos[world.units_of(1)] - world.pos[idle], axis=1)
    nearest = world.tag_of(int(world.units_of(1)[away.argmin()]))
    assert [(order.kind, order.target) for order in world.orders_of(idle)] == [(OrderKind.ATTACK_UNIT, nearest)]
    assert [order.kind for order in world.orders_of(busy)] == [OrderKind.MOVE]


def test_a_trigger_after_the_end_is_not_looked_at() -> None:
    world = world_of(
        "triggers:\n"
        "  - name: first\n    when: [{at_loop: 2}]\n    do: [{result: {1: defeat}}]\n"
        "  - name: second\n    when: [{at_loop: 2}]\n    do: [{result: {1: victory}}, {score: {1: 5}}]\n"
    )
    advance(world, 9)
    assert (world.loop, world.players[1].result) == (2, GameResult.DEFEAT)
    assert world.players[1].score.curriculum == 0


# melee ----------------------------------------------------------------------------------------------------------------

MELEE = """\
melee: true
start_locations: [[10.5, 36.5], [36.5, 10.5]]
units:
  - {player: 0, unit: MineralField, at: [[4, 36.5], [4, 38.5], [5, 40.5]]}
"""


def test_a_melee_start_gives_a_town_hall_workers_and_a_camera() -> None:
    world = world_of(MELEE, seed=3)
    assert names(world, 1).count("SCV") == names(world, 2).count("Drone") == 12
    assert [player.minerals for player in world.players[1:]] == [50, 50]
    assert {player.start for player in world.players[1:]} == {(10.5, 36.5), (36.5, 10.5)}
    owner = next(player for player in world.players[1:] if player.start == (10.5, 36.5))
    assert owner.start is not None
    assert owner.camera is not None
    workers = [s for s in world.units_of(owner.id).tolist() if world.catalog.units[world.type[s]].worker]
    offset = np.abs(world.pos[workers] - owner.start)
    assert (offset.max(axis=1) == 3).all()
    assert owner.camera == pytest.approx(tuple(world.pos[workers].mean(axis=0)))
    assert owner.camera[0] < 10.5  # towards the minerals
    assert len({tuple(facing) for facing in world.heading[workers].tolist()}) == 12
    (hall,) = (s for s in world.units_of(owner.id).tolist() if world.unit_type(s).structure)
    assert {world.tag_of(s) for s in world.order_target[workers].tolist()} == {world.rallies[hall]["workers"].target}


def test_the_first_overlord_is_at_the_corner_of_the_ring_away_from_the_minerals() -> None:
    worlds = (world_of(MELEE, seed=seed) for seed in range(20))
    world = next(some for some in worlds if some.players[2].start == (10.5, 36.5))  # the base with minerals
    zerg = world.players[2]
    (overlord,) = (s for s in world.units_of(2).tolist() if world.unit_type(s).name == "Overlord")
    assert zerg.start is not None
    minerals = np.array([4.3, 38.3])
    away = np.where(minerals > np.array(zerg.start), -3.0, 3.0)
    assert world.pos[overlord].tolist() == (np.array(zerg.start) + away).tolist()


def test_a_new_worker_goes_to_the_first_field() -> None:
    world = world_of(MELEE, seed=3)
    player = next(player for player in world.players[1:] if player.start == (10.5, 36.5))
    (hall,) = (s for s in world.units_of(player.id).tolist() if world.unit_type(s).structure)
    (job,) = casting.use(world, [hall], world.catalog.ability(524))
    assert job == hall
    advance(world, 272)
    newest = max(world.units_of(player.id).tolist(), key=lambda s: int(world.born_loop[s]))
    assert world.order_target[newest] == world.slot_of(world.rallies[hall]["workers"].target)


def test_places_of_a_melee_game_are_given_by_chance() -> None:
    assert {world_of(MELEE, seed=seed).players[1].start for seed in range(12)} == {(10.5, 36.5), (36.5, 10.5)}


# files ----------------------------------------------------------------------------------------------------------------

LEVELS = """\
extends: bases/smac
family: test
players:
  1: {race: terran, control: agent}
  2: {race: terran, control: computer}
triggers:
  - name: respawn
    when: [start]
    do: [{spawn: [learner, enemy]}]
  - name: end
    when: [{at_loop: 9}]
    do: [{result: {1: tie}}]
variants:
  small:
    title: One each
    groups: {learner: [{player: 1, unit: Marine, at: team_1}], enemy: [{player: 2, unit: Marine, at: team_2}]}
  large:
    title: More
    points: {team_2: [20, 16]}
    groups:
      learner: [{player: 1, unit: Marine, count: 4, at: team_1}]
      enemy: [{player: 2, unit: Marinee, count: 5, at: team_2}]
"""


def test_variants_are_maps_that_share_what_they_share() -> None:
    text = LEVELS.replace("Marinee", "Marine")
    small, large = (sheet.scenario() for _, sheet in sheets(text, "levels.yaml"))
    assert [s.name for s in (small, large)] == ["small", "large"]
    assert [s.points["team_1"] for s in (small, large)] == [(9, 16), (9, 16)]  # of the base
    assert [s.points["team_2"] for s in (small, large)] == [(23, 16), (20, 16)]
    assert [t.name for t in small.triggers] == ["respawn", "end"]
    assert small.triggers[0].condition is None  # the file's own, in the place of the base's
    assert small.terrain == "braxis_strip"
    worlds = [new_game(map_from(s, s.name)) for s in (small, large)]
    assert [len(w.units_of(2)) for w in worlds] == [1, 5]


MISTAKES = [
    (LEVELS, "levels.yaml:22: groups.enemy[0].unit: there is no unit type Marinee; did you mean Marine?"),
    ("extends: bases/nothing\nname: a\n", "levels.yaml:1: extends: there is no shipped scenario bases/nothing"),
    ("extends: ../../etc/passwd\n", "levels.yaml:1: extends: there is no shipped scenario ../../etc/passwd"),
    ("variants: [a, b]\n", "levels.yaml:1: variants: give a name and what is its own for each"),
    ("variants:\n  a: 3\n", "levels.yaml:2: variants.a: give a mapping"),
    ("- a\n", "levels.yaml:1: the file: a scenario is a mapping of fields"),
    (HEAD + "melee: true\n", "levels.yaml:1: the file: a melee game needs a start location for player 1"),
    (
        HEAD.replace("{circle: [24, 24, 6]}", "{circle: [1, 1, 1], minus: true}"),
        "a region needs a shape that is not taken out of it",
    ),
    (
        HEAD.replace("{circle: [24, 24, 6]}", "{}"),
        "regions.middle: give either rect: [x0, y0, x1, y1] or circle",
    ),
    (
        HEAD + "units:\n  - {player: 1, unit: Marine, at: {random_in: nowhere}}\n",
        "there is no region nowhere; there are",
    ),
    (HEAD + "units:\n  - {player: 1, unit: Marine, at: {middle: 3}}\n", "give a point's name, [x, y], a list of them"),
    (
        HEAD + "triggers:\n  - {name: t, when: [start], do: [{spawn: [wave]}]}\n",
        "triggers[0].do[0].spawn[0]: there is no group wave; there are none",
    ),
    (
        HEAD
        + 'triggers:\n  - {name: t, when: [start], if: {count: {1: {Marine: "about 6"}}}, do: [{score: {1: 1}}]}\n',
        'triggers[0].if.count.1.Marine: give a number, or a comparison such as "< 6"',
    ),
    (
        HEAD.replace("race: terran", "race: terran, upgrades: [Blinktech]"),
        "there is no upgrade Blinktech; did you mean BlinkTech?",
    ),
]


@pytest.mark.parametrize(("text", "sentence"), MISTAKES)
def test_a_mistake_in_a_file_of_several_is_named_where_it_stands(text: str, sentence: str) -> None:
    with pytest.raises(ScenarioError) as error:
        [sheet.scenario() for _, sheet in sheets(text, "levels.yaml")]
    assert sentence in str(error.value)
    assert str(error.value).startswith("levels.yaml:")
    assert "\n" not in str(error.value)


def test_a_playable_area_off_the_terrain_is_refused() -> None:
    text = HEAD + "playable: [0, 0, 99, 10]\n"
    with pytest.raises(MapError, match=r"the playable area \[0, 0, 99, 10\] is not within the terrain's 48 x 48 cells"):
        map_from(parse_scenario(text, "try_out.yaml"), text)


def test_a_narrow_playable_area_closes_the_rest() -> None:
    text = HEAD + "playable: [10, 12, 30, 40]\n"
    terrain = map_from(parse_scenario(text, "try_out.yaml"), text).terrain
    assert terrain.playable == (10, 12, 30, 40)
    assert terrain.walk.sum() == terrain.build.sum() == 20 * 28
    assert (terrain.height > 0).sum() == 20 * 28
