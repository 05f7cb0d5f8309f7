from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.orders import OrderKind


def test_an_idle_unit_engages_an_enemy_within_its_scan_range(field: Any) -> None:
    world = field.world
    zealot, foe = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 14, 16)
    world.acquires[foe] = False
    field.play(4)
    assert world.target[zealot] == foe
    assert [o.kind for o in world.orders_of(zealot)] == [OrderKind.ATTACK_UNIT]
    assert world.orders_of(zealot)[0].target == world.tag_of(foe)


@pytest.mark.parametrize(
    ("name", "scan"),
    [("Zealot", 5), ("Stalker", 6.5), ("Colossus", 7.5), ("Zergling", 5), ("Marine", 5.5), ("SiegeTankSieged", 13.5)],
)
def test_the_scan_range_is_the_larger_of_range_and_the_least_scan(field: Any, name: str, scan: float) -> None:
    world = field.world
    for gap, seen in ((scan - 0.05, True), (scan + 0.05, False)):
        unit = field.put(name, 1, 5, 16)
        distance = gap + world.radius[unit] + 0.375
        foe = field.put("Zergling", 2, 5 + distance, 16)
        world.acquires[foe] = False
        world.life[foe] = 1e6
        field.play(4)
        assert bool(world.target[unit] == foe) is seen
        commands.debug_kill(world, [world.tag_of(unit), world.tag_of(foe)])
        field.play(1)


def test_a_plain_walk_looks_at_nobody(field: Any) -> None:
    world = field.world
    zealot, foe = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 16, 17.2)
    world.acquires[foe] = False
    commands.move(world, [zealot], (28, 16))
    for _ in field.loops(130):
        assert world.target[zealot] == -1
    assert world.life[foe] == 35
    assert math.dist(world.pos[zealot], (28, 16)) < 1


def test_an_attack_move_fights_and_then_goes_on_to_its_point(field: Any) -> None:
    world = field.world
    stalker, foe = field.put("Stalker", 1, 5, 16), field.put("Zergling", 2, 14, 19)
    world.acquires[foe] = False
    commands.attack_move(world, [stalker], (24, 16))
    field.play(240)
    assert not world.alive[foe]
    assert math.dist(world.pos[stalker], (24, 16)) < 0.1


@pytest.mark.parametrize("order", ["attack_move", "patrol", "attack_unit"])
@pytest.mark.parametrize("weapon", ["Marine", "SiegeTank"])
def test_an_order_that_is_given_again_and_again_interrupts_no_attack(make_field: Any, order: str, weapon: str) -> None:
    lives = []
    for every in (200, 2):
        field = make_field(seed=3)
        attacker, foe = field.put(weapon, 1, 10, 16), field.still("Ultralisk", 2, 15, 16)
        goal = field.world.tag_of(foe) if order == "attack_unit" else (24, 16)
        for loop in range(200):
            if loop % every == 0:
                getattr(commands, order)(field.world, [attacker], goal)
            field.play(1)
        lives.append(field.world.life[foe])
    assert lives[0] == lives[1] < 450


def test_a_unit_that_holds_fires_but_does_not_walk(field: Any) -> None:
    world = field.world
    stalker = field.put("Stalker", 1, 10, 16)
    near, far = field.put("Zergling", 2, 16, 16), field.put("Zergling", 2, 18.2, 16)
    world.acquires[near] = world.acquires[far] = False
    commands.hold(world, [stalker])
    field.play(150)
    assert not world.alive[near]
    assert world.life[far] == 35
    assert world.pos[stalker].tolist() == [10, 16]


def test_the_nearest_of_the_most_urgent_targets_is_chosen(field: Any) -> None:
    world = field.world
    stalker = field.put("Stalker", 1, 10, 16)
    hatchery = field.put("Hatchery", 2, 14.5, 16.5)  # priority 11
    far, near = field.put("Zergling", 2, 16, 13), field.put("Zergling", 2, 15, 19)
    for slot in (far, near, hatchery):
        world.acquires[slot] = False
    field.play(4)
    assert world.target[stalker] == near


def test_ground_weapons_do_not_engage_flyers(field: Any) -> None:
    world = field.world
    zealot, stalker = field.put("Zealot", 1, 10, 16), field.put("Stalker", 1, 10, 14)
    overlord = field.put("Overlord", 2, 12, 16)
    field.play(8)
    assert world.target[zealot] == -1
    assert world.target[stalker] == overlord


def test_a_colossus_can_be_hit_from_the_ground_and_from_the_air(field: Any) -> None:
    world = field.world
    colossus = field.put("Colossus", 1, 16, 16)
    zergling, corruptor = field.put("Zergling", 2, 14, 16), field.put("Corruptor", 2, 18, 18)
    world.acquires[colossus] = False
    field.play(4)
    assert world.target[zergling] == world.target[corruptor] == colossus


def test_neutral_units_are_left_alone(field: Any) -> None:
    world = field.world
    stalker = field.put("Stalker", 1, 10, 16)
    field.put("MineralField", 0, 14, 16.5)
    field.play(20)
    assert world.target[stalker] == -1


def test_workers_do_not_pick_fights(field: Any) -> None:
    world = field.world
    probe, foe = field.put("Probe", 1, 10, 16), field.put("Zergling", 2, 12, 16)
    world.acquires[foe] = False
    field.play(20)
    assert world.target[probe] == -1
    assert commands.attack_unit(world, [probe], world.tag_of(foe)) == [probe]
    field.play(20)
    assert world.target[probe] == foe


@pytest.mark.parametrize("give", [commands.attack_move, commands.patrol], ids=["attack-move", "patrol"])
def test_workers_on_an_attack_move_fight_who_they_meet(field: Any, give: Any) -> None:
    world = field.world
    drones = [field.put("Drone", 1, 10 + i % 4, 14 + i // 4) for i in range(12)]
    victims = [field.still("SCV", 2, 18, 14 + i) for i in range(6)]
    give(world, drones, (22, 16))
    field.until(lambda: not world.alive[victims].all(), most=200)
    assert world.alive[drones].all()


def test_a_passive_type_fires_from_its_turret_at_what_comes_into_range_and_walks_to_nobody(field: Any) -> None:
    near, far = field.put("Zergling", 2, 14, 16), field.put("Zergling", 2, 22, 16)
    colossus, zealot = field.put("Colossus_RL", 1, 8, 16), field.put("Zealot_RL", 1, 13, 18)
    world = field.world
    world.acquires[[near, far]] = False
    world.life[[near, far]] = 1e6
    field.play(100)
    assert world.life[near] < 1e6
    assert world.life[far] == 1e6
    assert world.pos[colossus].tolist() == [8, 16]
    assert world.target[zealot] == -1


def test_an_attack_on_a_place_goes_on_with_what_else_is_there_when_the_first_enemy_is_dead(field: Any) -> None:
    world = field.world
    drones = [field.put("Drone", 1, 20 + i % 2, 13 + i // 2) for i in range(12)]
    weak, depot = field.put("SupplyDepot", 2, 24, 16), field.put("SupplyDepot", 2, 26, 16)
    world.life[weak] = 60.0
    commands.attack_move(world, drones, (24, 16))
    field.until(lambda: not world.alive[weak], most=200)
    field.play(8)
    assert (world.target[drones] == depot).all()


def test_a_worker_on_a_plain_walk_or_at_work_fights_nobody(field: Any) -> None:
    world = field.world
    drone, foe = field.put("Drone", 1, 10, 16), field.still("SCV", 2, 14, 16)
    commands.move(world, [drone], (20, 16))
    field.play(120)
    assert world.life[foe] == 45
    assert world.target[drone] == -1


def test_a_unit_under_attack_turns_on_an_attacker_beyond_its_scan_range_and_calls_its_friends(field: Any) -> None:
    world = field.world
    tank = field.put("SiegeTankSieged", 2, 4, 16)
    zealot, friend = field.put("Zealot", 1, 16, 16), field.put("Zealot", 1, 19, 16)
    stranger = field.put("Zealot", 1, 22, 22)
    field.play(12)
    assert world.target[zealot] == world.target[friend] == tank
    assert world.target[stranger] == -1


def test_an_idle_unit_goes_back_after_a_fight(field: Any) -> None:
    world = field.world
    zealot, foe = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 15, 16)
    world.acquires[foe] = False
    field.play(160)
    assert not world.alive[foe]
    assert math.dist(world.pos[zealot], (10, 16)) < 0.6


def test_an_idle_unit_gives_a_chase_up_at_the_end_of_its_leash(field: Any) -> None:
    world = field.world
    zealot, bait = field.put("Zealot", 1, 3, 16), field.put("Zergling", 2, 7, 16)
    world.acquires[bait] = False
    field.play(4)
    assert world.target[zealot] == bait
    commands.move(world, [bait], (31, 16))
    farthest = 0.0
    for _ in field.loops(450):
        farthest = max(farthest, float(world.pos[zealot, 0]) - 3)
    assert 20.5 < farthest < 22.5
    assert math.dist(world.pos[zealot], (3, 16)) < 0.6


def test_a_chaser_takes_an_equal_one_in_reach_only_if_bodies_stop_it(field: Any) -> None:
    world = field.world
    zealot, runner = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 14.0, 16)
    world.acquires[runner] = False
    commands.attack_move(world, [zealot], (30, 16))
    field.play(4)
    commands.move(world, [runner], (30, 16))
    beside = field.put("Zergling", 2, 13.0, 17.0)
    world.acquires[beside] = False
    for _ in field.loops(30):
        assert world.target[zealot] == runner
    for y in (15.5, 16.25, 17.0):
        world.acquires[field.still("Zergling", 2, world.pos[zealot, 0] + 1.0, y)] = False
    field.until(lambda: world.target[zealot] != runner)
    assert world.gap[zealot] <= world.reach[zealot] + 0.2


def test_a_target_that_leaves_the_reach_is_lost_to_a_nearer_one(field: Any) -> None:
    world = field.world
    marine, first = field.put("Marine", 1, 10, 16), field.put("Zealot", 2, 14, 16)
    second = field.still("Zealot", 2, 15, 14)
    world.step_max[marine] = 0.0
    world.acquires[first] = False
    field.play(8)
    assert world.target[marine] == first
    commands.move(world, [first], (30, 16))
    field.until(lambda: world.target[marine] == second)
    assert world.alive[first]


def test_a_unit_that_never_fights_by_itself_threatens_only_whom_it_fights(field: Any) -> None:
    world = field.world
    victim, onlooker = field.put("Marine", 1, 10, 16), field.put("Marine", 1, 10, 18)
    tame, prism = field.put("Probe", 2, 10.8, 16), field.put("WarpPrism", 2, 10, 17)
    world.step_max[[victim, onlooker, tame, prism]] = 0.0
    commands.attack_unit(world, [tame], world.tag_of(victim))
    field.play(30)
    assert world.target[victim] == tame
    assert world.target[onlooker] == prism


def test_an_order_to_attack_one_unit_does_not_change_its_target(field: Any) -> None:
    world = field.world
    zealot = field.put("Zealot", 1, 10, 16)
    far, near = field.put("SpineCrawler", 2, 20, 16), field.put("Zergling", 2, 12, 16.8)
    world.acquires[far] = world.acquires[near] = False
    commands.attack_unit(world, [zealot], world.tag_of(far))
    field.play(150)
    assert world.life[near] == 35
    assert world.life[far] < 300


def test_after_its_target_died_a_unit_goes_on_with_the_queue(field: Any) -> None:
    world = field.world
    stalker, foe = field.put("Stalker", 1, 10, 16), field.put("Zergling", 2, 14, 16)
    world.acquires[foe] = False
    commands.attack_unit(world, [stalker], world.tag_of(foe))
    commands.move(world, [stalker], (6, 8), queue=True)
    field.play(200)
    assert not world.alive[foe]
    assert math.dist(world.pos[stalker], (6, 8)) < 0.1


def test_stop_ends_a_walk_and_an_idle_unit_fights_again(field: Any) -> None:
    world = field.world
    zealot, foe = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 14, 16)
    world.acquires[foe] = False
    commands.move(world, [zealot], (30, 16))
    field.play(2)
    commands.stop(world, [zealot])
    field.play(4)
    assert world.target[zealot] == foe


def test_a_cloaked_enemy_is_not_engaged(field: Any) -> None:
    world = field.world
    zealot, templar = field.put("Zealot", 1, 10, 16), field.put("DarkTemplar", 2, 13, 16)
    world.acquires[templar] = False
    field.play(12)
    assert world.target[zealot] == -1


def test_one_that_can_hit_back_comes_before_a_nearer_harmless_one(field: Any) -> None:
    world = field.world
    marine = field.put("Marine", 1, 10, 16)
    observer, probe = field.put("WarpPrism", 2, 12, 16), field.put("Probe", 2, 12, 17)
    zealot, templar = field.put("Zealot", 2, 15, 16), field.put("HighTemplar", 2, 14, 14)
    for slot in (observer, probe, zealot, templar, marine):
        world.step_max[slot] = 0.0
    world.acquires[[probe, zealot, templar]] = False
    field.play(1)
    assert world.target[marine] == templar  # always a threat, and nearer than the Zealot
    commands.debug_kill(world, [world.tag_of(templar)])
    field.play(5)
    assert world.target[marine] == zealot
    commands.debug_kill(world, [world.tag_of(zealot)])
    field.play(5)
    assert world.target[marine] in (observer, probe)


def test_a_worker_that_fights_is_a_threat(field: Any) -> None:
    world = field.world
    marine = field.put("Marine", 1, 10, 16)
    calm, fighting = field.put("Probe", 2, 12, 16), field.put("Probe", 2, 13, 16)
    world.step_max[[calm, fighting, marine]] = 0.0
    commands.attack_unit(world, [fighting], world.tag_of(marine))
    field.play(1)
    assert world.target[marine] == calm, "before it is in reach, a fighter threatens nobody"
    world.pos[fighting] = (10.8, 16)
    field.play(30)
    assert world.target[marine] == fighting


def test_a_unit_that_fires_at_a_structure_turns_to_an_army_between_two_shots(field: Any) -> None:
    world = field.world
    stalker, pylon = field.put("Stalker", 1, 10, 16), field.put("Pylon", 2, 15, 16)
    commands.attack_move(world, [stalker], (24, 16))
    field.play(60)
    assert world.target[stalker] == pylon
    assert world.shields[pylon] < 200
    zealot = field.put("Zealot", 2, 14, 13)
    world.acquires[zealot] = False
    field.play(34)
    assert world.target[stalker] == zealot


def test_a_unit_keeps_its_target_while_nothing_of_a_higher_rank_comes(field: Any) -> None:
    world = field.world
    stalker, far = field.put("Stalker", 1, 10, 16), field.put("Zealot", 2, 15, 16)
    world.step_max[far] = 0.0
    world.life[far] = 1e5
    world.acquires[far] = False
    field.play(30)
    near = field.put("Zealot", 2, 12, 16)
    world.step_max[near] = 0.0
    field.play(60)
    assert world.target[stalker] == far


def test_one_that_gave_up_looks_at_nobody_until_it_is_nearly_back(field: Any) -> None:
    world = field.world
    zealot, bait = field.put("Zealot", 1, 4, 16), field.put("Overlord", 2, 26, 25)
    world.guard[zealot] = (4.0, 16.0)
    world.pos[zealot] = (26.0, 16.0)
    world.returning[zealot] = world.leashed[zealot] = True
    runner = field.put("Marine", 2, 24, 16)
    world.acquires[runner] = False
    del bait
    while world.pos[zealot, 0] > 4 + MECHANICS.leash_reset:
        field.play(1)
        assert world.target[zealot] == -1
        world.pos[runner] = world.pos[zealot] + (1.5, 0.0)
        assert world.loop < 400
    field.play(8)
    assert world.target[zealot] == runner


@pytest.mark.parametrize("name", ["Probe", "Overlord"])
def test_an_idle_unit_that_does_not_fight_back_runs_from_its_attacker(field: Any, name: str) -> None:
    world = field.world
    runner, marine = field.put(name, 1, 14, 16), field.put("Marine", 2, 10, 16)
    world.step_max[marine] = 0.0
    field.play(120)
    assert world.alive[runner]
    assert world.pos[runner, 0] > 15.5
    assert world.order_kind[runner] == 0
