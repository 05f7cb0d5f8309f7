from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.tick import advance
from khala_simulator.world.orders import Order, OrderKind
from khala_simulator.world.players import GameResult


def test_smart_attacks_enemies_follows_friends_and_walks_to_points(field: Any) -> None:
    world = field.world
    unit, friend = field.put("Zealot", 1, 10, 16), field.put("Zealot", 1, 4, 4)
    foe, mineral = field.put("SpineCrawler", 2, 25, 16), field.put("MineralField", 0, 20, 4.5)
    for target, point, kind in (
        (world.tag_of(foe), None, OrderKind.ATTACK_UNIT),
        (world.tag_of(friend), None, OrderKind.FOLLOW),
        (world.tag_of(mineral), None, OrderKind.FOLLOW),
        (0, (12.0, 12.0), OrderKind.MOVE),
    ):
        assert commands.smart(world, [unit], point=point, target=target) == [unit]
        assert world.orders_of(unit)[0].kind is kind


def test_a_unit_without_a_weapon_scan_moves(field: Any) -> None:
    world = field.world
    observer, zealot = field.put("Observer", 1, 10, 16), field.put("Zealot", 1, 11, 16)
    assert commands.attack_move(world, [observer, zealot], (20, 16)) == [observer, zealot]
    assert [world.orders_of(s)[0].ability for s in (observer, zealot)] == [19, 23]


@pytest.mark.parametrize(
    ("give", "ability"),
    [
        (lambda w, s: commands.move(w, s, (20, 20)), 16),
        (lambda w, s: commands.patrol(w, s, (20, 20)), 17),
        (commands.hold, 18),
        (lambda w, s: commands.attack_move(w, s, (20, 20)), 23),
    ],
)
def test_orders_carry_the_specific_ability_ids(field: Any, give: Any, ability: int) -> None:
    world = field.world
    unit = field.put("Zealot", 1, 10, 16)
    give(world, [unit])
    assert world.orders_of(unit)[0].ability == ability


def test_a_new_order_clears_the_queue(field: Any) -> None:
    world = field.world
    unit = field.put("Zealot", 1, 10, 16)
    for x in (12, 14, 16):
        commands.move(world, [unit], (x, 16), queue=True)
    assert len(world.orders_of(unit)) == 3
    commands.move(world, [unit], (5, 5))
    assert world.orders_of(unit) == [Order(OrderKind.MOVE, 16, point=(5.0, 5.0))]


def test_points_outside_the_map_are_taken_to_its_edge(field: Any) -> None:
    world = field.world
    unit = field.put("Zealot", 1, 10, 16)
    commands.move(world, [unit], (-50, 999))
    assert world.orders_of(unit)[0].point == (0, 32)
    field.play(300)
    x, y = world.pos[unit]
    assert x < 1
    assert y > 31


def test_orders_on_the_dead_and_on_oneself_are_not_taken(field: Any) -> None:
    world = field.world
    unit, foe = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 20, 16)
    tag = world.tag_of(foe)
    commands.debug_kill(world, [tag, 12345])
    field.play(1)
    assert commands.attack_unit(world, [unit], tag) == []
    assert commands.attack_unit(world, [unit], world.tag_of(unit)) == []
    assert commands.follow(world, [unit], world.tag_of(unit)) == []
    assert commands.smart(world, [unit], target=tag) == []


def test_a_ground_weapon_does_not_take_an_order_against_a_flyer(field: Any) -> None:
    world = field.world
    zealot, overlord = field.put("Zealot", 1, 10, 16), field.put("Overlord", 2, 12, 16)
    assert commands.attack_unit(world, [zealot], world.tag_of(overlord)) == []


def test_tags_are_stable_for_life_and_not_given_twice(field: Any) -> None:
    world = field.world
    seen = set()
    for _ in range(5):
        slot = field.put("Zergling", 2, 16, 16)
        tag = world.tag_of(slot)
        assert tag >> 32 == 1
        assert tag not in seen
        assert world.slot_of(tag) == slot
        seen.add(tag)
        commands.debug_kill(world, [tag])
        field.play(1)
        assert world.slot_of(tag) == -1


def test_created_units_stand_exactly_where_they_are_wanted_and_part_then(field: Any) -> None:
    world = field.world
    slots = commands.debug_create(world, 73, 1, (16.0, 16.0), 4)
    assert world.pos[slots].tolist() == [[16, 16]] * 4
    field.play(60)
    assert len({tuple(p) for p in world.pos[slots].tolist()}) == 4


def test_the_world_grows_beyond_its_first_capacity(field: Any) -> None:
    world = field.world
    commands.debug_create(world, 105, 2, (16.0, 16.0), 150)
    assert len(world.units_of(2)) == 150
    assert len({int(t) for t in world.tag[world.live]}) == 150
    field.play(2)
    assert len(world.units_of(2)) == 150


def test_giving_up_is_defeat_and_victory_for_the_other(field: Any) -> None:
    world = field.world
    commands.surrender(world, 1)
    assert world.ended
    assert [p.result for p in world.players[1:]] == [GameResult.DEFEAT, GameResult.VICTORY]


def test_values_are_set_within_what_the_type_can_have(field: Any) -> None:
    world = field.world
    slot = field.put("Sentry", 1, 16, 16)
    commands.debug_set_value(world, world.tag_of(slot), life=9, shields=999, energy=999)
    assert (world.life[slot], world.shields[slot], world.energy[slot]) == (9, 40, 200)
    commands.debug_set_value(world, 77, life=1)


def test_units_of_a_finished_game_stand_still(field: Any) -> None:
    world = field.world
    unit = field.put("Zealot", 1, 10, 16)
    commands.move(world, [unit], (20, 16))
    commands.surrender(world, 2)
    assert advance(world, 10) == 0
    assert world.pos[unit].tolist() == [10, 16]


def test_a_unit_killed_by_hand_is_nobodys_kill(field: Any) -> None:
    world = field.world
    stalker, foe = field.put("Stalker", 1, 10, 16), field.put("SpineCrawler", 2, 15, 16)
    commands.attack_unit(world, [stalker], world.tag_of(foe))
    field.play(20)
    assert world.life[foe] < 300
    commands.debug_kill(world, [world.tag_of(foe)])
    field.play(1)
    assert world.deaths[-1].killer == -1
    assert world.players[1].score.killed_structures == 0
    assert world.players[2].score.lost_structures == 1


def test_an_attack_on_what_goes_out_of_sight_ends(make_field: Any) -> None:
    field = make_field(fog=True)
    world = field.world
    zealot, runner = field.put("Zealot", 1, 4, 16), field.put("Zergling", 2, 11, 16)
    world.acquires[runner] = False
    field.play(4)
    commands.attack_unit(world, [zealot], world.tag_of(runner))
    commands.move(world, [runner], (31, 16))
    field.play(150)
    assert world.orders_of(zealot) == []


def test_an_order_shows_the_target_and_the_queue(field: Any) -> None:
    world = field.world
    zealot, foe = field.put("Zealot", 1, 4, 16), field.put("SpineCrawler", 2, 25, 16)
    commands.attack_unit(world, [zealot], world.tag_of(foe))
    commands.patrol(world, [zealot], (4, 20), queue=True)
    attack, patrol = world.orders_of(zealot)
    assert (attack.kind, attack.target, attack.point) == (OrderKind.ATTACK_UNIT, world.tag_of(foe), None)
    assert (patrol.kind, patrol.point, patrol.ability) == (OrderKind.PATROL, (4, 20), 17)
