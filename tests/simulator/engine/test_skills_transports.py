"""Loading and unloading: which units a carrier takes, how they get in and out, and the fate of passengers."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
LOAD = {"Medivac": 394, "WarpPrism": 911, "OverlordTransport": 1406, "Bunker": 407, "NydusNetwork": 1437}
UNLOAD_AT = {"Medivac": 396, "WarpPrism": 913, "OverlordTransport": 1408}
UNLOAD_ALL = {"Bunker": 408, "NydusNetwork": 1438, "CommandCenter": 413}
UNLOAD_UNIT = {"Medivac": 397, "WarpPrism": 914, "Bunker": 410, "NydusNetwork": 1440}
LOAD_WORKERS = 416


def put(field: Any, name: str, owner: int, x: float, y: float) -> int:
    slot: int = field.put(name, owner, x, y)
    field.world.looks_around[slot] = False
    return slot


def fill(field: Any, carrier: int, *names: str) -> list[int]:
    slots = []
    for name in names:
        slot = put(field, name, int(field.world.owner[carrier]), 3.0, 3.0)
        lifecycle.stow(field.world, slot, carrier)
        slots.append(slot)
    return slots


def right_click(field: Any, slots: list[int], target: int) -> list[int]:
    return casting.smart(field.world, slots, target=field.world.tag_of(target))


def out(field: Any, slots: list[int]) -> list[int]:
    return [s for s in slots if field.world.carrier[s] < 0]


# in -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("name", "cargo"), [("Medivac", "Marine"), ("WarpPrism", "Zealot"),
                                             ("OverlordTransport", "Roach")])  # fmt: skip
def test_a_flying_carrier_fetches_who_it_is_told_to_load(make_field: Any, version: str, name: str, cargo: str) -> None:
    field = make_field(version=version)
    carrier, unit = put(field, name, 1, 8.0, 8.0), put(field, cargo, 1, 20.0, 8.0)
    commands.hold(field.world, [unit])
    assert field.order(carrier, LOAD[name], unit)
    for _ in field.loops(400):
        if field.world.carrier[unit] == carrier:
            break
    assert field.world.passengers(carrier) == [unit]
    away = 20.0 - field.world.pos[carrier, 0] - field.world.radius[carrier] - 0.5
    assert away <= (6.0 if name == "WarpPrism" else 0.1)
    assert away > (5.5 if name == "WarpPrism" else -2.0)
    assert unit not in field.world.live
    assert not field.world.orders_of(unit)


@pytest.mark.parametrize(("name", "cargo", "why"), [
    ("Medivac", "Marine", ActionResult.SUCCESS),
    ("Medivac", "Thor", ActionResult.SUCCESS),
    ("Medivac", "VikingFighter", ActionResult.CANT_LOAD_THAT_UNIT),
    ("Medivac", "SupplyDepot", ActionResult.CANT_LOAD_THAT_UNIT),
    ("Bunker", "Marauder", ActionResult.SUCCESS),
    ("Bunker", "SCV", ActionResult.SUCCESS),
    ("Bunker", "Hellion", ActionResult.MUST_TARGET_BIOLOGICAL_UNITS),
    ("NydusNetwork", "Ultralisk", ActionResult.SUCCESS),
    ("NydusNetwork", "Mutalisk", ActionResult.CANT_LOAD_THAT_UNIT),
])  # fmt: skip
def test_whom_a_carrier_takes(field: Any, name: str, cargo: str, why: ActionResult) -> None:
    carrier = put(field, name, 1, 8.5, 8.5)
    unit = put(field, cargo, 1, 10.6, 8.5)
    judged = field.why_not(carrier, LOAD[name], unit)
    assert judged is why


def test_nobody_gets_into_what_is_full_or_an_enemy_s(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 8.0, 8.0)
    fill(field, carrier, "Thor")
    assert field.why_not(carrier, LOAD["Medivac"], put(field, "Marine", 1, 9.0, 9.0)) is (
        ActionResult.NOT_ENOUGH_ROOM_TO_LOAD_UNIT
    )
    empty = put(field, "Medivac", 1, 8.0, 12.0)
    assert (
        field.why_not(empty, LOAD["Medivac"], put(field, "Marine", 2, 9.0, 9.0)) is ActionResult.CANT_TARGET_ENEMY_UNITS
    )


@pytest.mark.parametrize("buff", ["FungalGrowthSlowMovement", "GravitonBeam", "NexusMassRecallWarpOut"])
def test_who_is_held_can_t_be_loaded(field: Any, buff: str) -> None:
    carrier, unit = put(field, "Medivac", 1, 8.0, 8.0), put(field, "Marine", 1, 9.0, 9.0)
    buffs.apply(field.world, unit, buff)
    assert field.why_not(carrier, LOAD["Medivac"], unit) is ActionResult.CANT_LOAD_THAT_UNIT


@pytest.mark.parametrize("name", ["Bunker", "NydusNetwork"])
def test_to_a_carrier_that_stands_still_its_passengers_come(field: Any, name: str) -> None:
    carrier, unit = put(field, name, 1, 8.5, 8.5), put(field, "Marine", 1, 20.0, 8.5)
    assert field.order(carrier, LOAD[name], unit)
    field.play(20)
    assert field.world.carrier[unit] < 0
    field.play(100)
    assert field.world.passengers(carrier) == [unit]


@pytest.mark.parametrize("name", ["Medivac", "Bunker"])
def test_units_sent_to_a_carrier_with_the_right_click_get_in_as_long_as_there_is_room(field: Any, name: str) -> None:
    carrier = put(field, name, 1, 8.5, 8.5)
    commands.hold(field.world, [carrier])
    units = [put(field, "Marauder", 1, 14.0, 6.0 + 2 * i) for i in range(5)]
    assert right_click(field, units, carrier) == units
    field.play(150)
    room = field.world.unit_type(carrier).cargo_space // 2
    assert len(field.world.passengers(carrier)) == room
    left = out(field, units)
    assert len(left) == 5 - room
    assert not any(field.world.orders_of(slot) for slot in left)


def test_a_carrier_sent_to_a_unit_with_the_right_click_loads_it(field: Any) -> None:
    carrier, unit = put(field, "Medivac", 1, 8.0, 8.0), put(field, "Marine", 1, 14.0, 8.0)
    assert right_click(field, [carrier], unit) == [carrier]
    field.play(60)
    assert field.world.passengers(carrier) == [unit]


def test_a_command_center_calls_its_nearest_workers(field: Any) -> None:
    center = put(field, "CommandCenter", 1, 10.5, 10.5)
    workers = [put(field, "SCV", 1, 16.0 + 1.2 * i, 10.0) for i in range(7)]
    put(field, "Marine", 1, 15.0, 12.0)
    assert field.order(center, LOAD_WORKERS)
    field.play(120)
    assert field.world.passengers(center) == workers[:5]
    assert field.order(center, UNLOAD_ALL["CommandCenter"])
    field.play(3)
    assert len(out(field, workers)) == 7


def test_without_workers_there_is_nobody_to_load(field: Any) -> None:
    center = put(field, "CommandCenter", 1, 10.5, 10.5)
    assert field.why_not(center, LOAD_WORKERS) is ActionResult.LOAD_ALL_NO_TARGETS_FOUND


# out ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", UNLOAD_AT)
def test_a_carrier_flies_to_a_point_and_lets_one_out_per_second_there(make_field: Any, version: str, name: str) -> None:
    field = make_field(version=version)
    carrier = put(field, name, 1, 8.0, 8.0)
    units = fill(field, carrier, *["Zergling"] * 3)
    assert field.order(carrier, UNLOAD_AT[name], point=(14.0, 8.0))
    came: list[int] = []
    for loop in field.loops(400):
        if len(out(field, units)) > len(came):
            came.append(loop)
        if len(came) == 3:
            break
    assert [b - a for a, b in pairwise(came)] == [16, 16]
    for slot in units:
        assert math.dist(field.world.pos[slot], field.world.pos[carrier]) < 2.0
        assert field.world.looks_around[slot]
    field.play(3)
    assert not field.world.orders_of(carrier)


def test_a_carrier_unloads_on_its_way_when_told_to_do_it_at_itself(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 4.0, 8.0)
    units = fill(field, carrier, "Marine", "Marine", "Marine")
    commands.move(field.world, [carrier], (28.0, 8.0))
    assert field.order(carrier, UNLOAD_AT["Medivac"], carrier)
    field.play(100)
    xs = sorted(float(field.world.pos[s, 0]) for s in out(field, units))
    assert len(xs) == 3
    assert xs[2] - xs[0] > 2.0
    assert field.world.pos[carrier, 0] > 10.0


def test_a_new_order_ends_the_stay_but_not_before_the_next_is_out(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 8.0, 8.0)
    units = fill(field, carrier, *["Marine"] * 4)
    field.order(carrier, UNLOAD_AT["Medivac"], point=(8.0, 8.0))
    field.play(4)
    assert len(out(field, units)) == 1
    commands.move(field.world, [carrier], (30.0, 8.0))
    field.play(80)
    assert field.world.pos[carrier, 0] > 12.0


@pytest.mark.parametrize("name", ["Bunker", "CommandCenter"])
def test_a_structure_lets_everybody_out_at_once(field: Any, name: str) -> None:
    carrier = put(field, name, 1, 10.5, 10.5)
    units = fill(field, carrier, *["SCV"] * 4)
    assert field.order(carrier, UNLOAD_ALL[name])
    field.play(2)
    assert out(field, units) == units
    walls = field.world.ground.walk
    assert all(walls[int(field.world.pos[s, 1]), int(field.world.pos[s, 0])] for s in units)


@pytest.mark.parametrize("name", UNLOAD_UNIT)
def test_one_passenger_can_be_named(field: Any, name: str) -> None:
    carrier = put(field, name, 1, 10.5, 10.5)
    units = fill(field, carrier, "Marine", "Marauder")
    assert field.order(carrier, UNLOAD_UNIT[name], units[1])
    assert out(field, units) == [units[1]]
    field.play(1)
    assert field.order(carrier, UNLOAD_UNIT[name])
    assert out(field, units) == units


@pytest.mark.parametrize(("name", "number"), [*UNLOAD_AT.items(), *UNLOAD_ALL.items(), *UNLOAD_UNIT.items()])
def test_an_empty_carrier_has_nothing_to_unload(field: Any, name: str, number: int) -> None:
    carrier = put(field, name, 1, 10.5, 10.5)
    assert field.why_not(carrier, number, point=(9.0, 9.0)) is ActionResult.NO_CARGO_TO_UNLOAD


def test_nobody_is_let_out_where_nobody_can_stand(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 8.0, 8.0)
    fill(field, carrier, "Marine")
    field.world.ground.block(63, np.array([(x, y) for x in range(16, 32) for y in range(32)]))
    assert field.why_not(carrier, UNLOAD_AT["Medivac"], point=(26.0, 8.0)) is ActionResult.CANT_UNLOAD_UNITS_THERE
    assert field.why_not(carrier, UNLOAD_AT["Medivac"], point=(17.0, 8.0)) is ActionResult.SUCCESS


def test_nydus_entrances_share_what_is_inside_and_let_out_four_a_second(field: Any) -> None:
    entrance, exit_ = put(field, "NydusNetwork", 1, 6.5, 6.5), put(field, "NydusCanal", 1, 24.5, 24.5)
    units = fill(field, entrance, *["Zergling"] * 3)
    assert field.order(exit_, 2371)
    came: list[int] = []
    for loop in field.loops(30):
        came += [loop] * (len(out(field, units)) - len(came))
    period = 16 * field.world.unit_type(exit_).unload_period_n
    assert [b - a for a, b in pairwise(came)] == [period, period]
    assert all(math.dist(field.world.pos[s], (24.5, 24.5)) < 5.0 for s in units)


# passengers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "lives"), [("Medivac", False), ("WarpPrism", False), ("OverlordTransport", False),
                                             ("Bunker", True), ("CommandCenter", True)])  # fmt: skip
def test_what_becomes_of_passengers_when_the_carrier_dies(field: Any, name: str, *, lives: bool) -> None:
    carrier = put(field, name, 1, 10.5, 10.5)
    units = fill(field, carrier, "SCV", "SCV")
    tags = [field.world.tag_of(slot) for slot in units]
    field.world.life[carrier] = 0.0
    field.play(2)
    assert [field.world.slot_of(tag) >= 0 for tag in tags] == [lives, lives]
    assert field.world.players[1].score.lost_units == (0 if lives else 2) + (name not in ("Bunker", "CommandCenter"))


def test_what_sits_in_a_nydus_lives_while_an_entrance_is_left(field: Any) -> None:
    one, other = put(field, "NydusNetwork", 1, 6.5, 6.5), put(field, "NydusCanal", 1, 24.5, 24.5)
    (ling,) = fill(field, one, "Zergling")
    field.world.life[one] = 0.0
    field.play(2)
    assert field.world.carrier[ling] == other
    field.world.life[other] = 0.0
    field.play(2)
    assert not field.world.alive[ling]


def test_a_passenger_takes_no_orders(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 8.0, 8.0)
    (marine,) = fill(field, carrier, "Marine")
    assert commands.move(field.world, [marine], (20.0, 20.0)) == []


def test_marines_in_a_bunker_shoot_from_its_edge_one_farther_and_can_t_be_hit(field: Any) -> None:
    bunker = put(field, "Bunker", 1, 8.5, 8.5)
    marines = [put(field, "Marine", 1, 11.0, 7.0 + i) for i in range(2)]
    right_click(field, marines, bunker)
    field.play(40)
    assert field.world.passengers(bunker) == marines
    reach = 5.0 + 1.0 + 1.25 + 0.5  # a Marine's range, one more, the Bunker's radius and the Roach's
    beyond = put(field, "Roach", 2, 8.5 + reach + 0.3, 8.5)
    field.play(40)
    assert field.world.life[beyond] == 145.0
    roach = put(field, "Roach", 2, 8.5 + reach - 0.1, 8.5)
    field.play(60)
    assert field.world.life[roach] < 145.0 - 20.0
    assert field.world.pos[marines[0]].tolist() == [8.5, 8.5]
    commands.attack_unit(field.world, [roach], field.world.tag_of(bunker))
    field.play(120)
    assert [field.world.life[m] for m in marines] == [45.0, 45.0]


def test_who_sits_in_a_medivac_does_not_shoot(field: Any) -> None:
    carrier = put(field, "Medivac", 1, 8.0, 8.0)
    units = [put(field, "Marine", 1, 9.0, 9.0)]
    right_click(field, units, carrier)
    enemy = put(field, "Roach", 2, 12.0, 8.0)
    field.play(60)
    assert field.world.passengers(carrier) == units
    assert field.world.life[enemy] == pytest.approx(145.0, abs=10.0)
    before = float(field.world.life[enemy])
    field.play(60)
    assert field.world.life[enemy] >= before


# orders that a Bunker hands on ----------------------------------------------------------------------------------------

SHOOT, STIM_MARINES, CEASE = 1682, 1683, 1691


def test_a_bunker_s_passengers_shoot_at_whom_it_is_told_to(field: Any) -> None:
    bunker = put(field, "Bunker", 1, 8.5, 8.5)
    marines = [put(field, "Marine", 1, 11.0, 7.0 + i) for i in range(2)]
    right_click(field, marines, bunker)
    field.play(40)
    near, far = put(field, "Roach", 2, 13.0, 8.5), put(field, "Roach", 2, 8.5, 14.5)
    beyond = put(field, "Roach", 2, 30.0, 8.5)
    field.play(10)
    assert {int(field.world.target[m]) for m in marines} == {near}
    assert field.order(bunker, SHOOT, far)
    assert {int(field.world.target[m]) for m in marines} == {far}
    field.play(30)
    assert field.world.life[far] < 145.0
    assert field.why_not(bunker, SHOOT, beyond) is ActionResult.TARGET_IS_OUT_OF_RANGE


@pytest.mark.parametrize("version", VERSIONS)
def test_a_bunker_s_marines_use_their_stimpacks_when_it_is_told_so(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    bunker = put(field, "Bunker", 1, 8.5, 8.5)
    marine, marauder = fill(field, bunker, "Marine", "Marauder")
    assert field.why_not(bunker, STIM_MARINES) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.research(1, "Stimpack")
    assert field.order(bunker, STIM_MARINES)
    assert buffs.has(field.world, marine, "Stimpack")
    assert not buffs.has(field.world, marauder, "StimpackMarauder")
    assert field.world.life[marine] == 35.0


def test_an_empty_bunker_shoots_at_nobody(field: Any) -> None:
    bunker = put(field, "Bunker", 1, 8.5, 8.5)
    roach = put(field, "Roach", 2, 13.0, 8.5)
    assert field.why_not(bunker, SHOOT, roach) is ActionResult.CANT_ATTACK_WEAPONS_DISABLED
    assert field.why_not(bunker, CEASE) is ActionResult.CANT_ATTACK_WEAPONS_DISABLED
