"""Carriers and Interceptors, against the numbers of both game versions."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.abilities.protoss import carrier as carriers
from khala_simulator.combat import lifecycle
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
ARM = 1042


def put(field: Any, name: str, owner: int, x: float, y: float) -> int:
    slot: int = field.put(name, owner, x, y)
    field.world.looks_around[slot] = False
    return slot


def carrier(field: Any, x: float = 6.0, y: float = 16.0) -> int:
    slot = put(field, "Carrier", 1, x, y)
    field.play(1)
    return slot


def outside(field: Any, slot: int) -> list[int]:
    return [s for s in carriers.crew_of(field.world, slot) if field.world.carrier[s] < 0]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_carrier_begins_with_four_interceptors_in_its_hangar(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = carrier(field)
    assert len(field.world.passengers(slot)) == 4
    assert field.world.live.tolist() == [slot]


@pytest.mark.parametrize(("version", "loops"), [("4.10", 256), ("5.0.13", 192)])
def test_it_builds_up_to_eight_for_15_minerals_each(make_field: Any, version: str, loops: int) -> None:
    field = make_field(version=version)
    slot = carrier(field)
    field.world.players[1].minerals = 100.0
    for _ in range(4):
        assert field.order(slot, ARM)
    assert field.world.players[1].minerals == 100.0 - 4 * 15.0
    assert field.why_not(slot, ARM) is ActionResult.CANT_HOLD_ANY_MORE_AMMO
    field.play(loops - 1)
    assert len(field.world.passengers(slot)) == 4
    field.play(2)
    assert len(field.world.passengers(slot)) == 5
    field.play(3 * loops)
    assert len(field.world.passengers(slot)) == 8
    assert field.why_not(slot, ARM) is ActionResult.CANT_HOLD_ANY_MORE_AMMO


def test_it_needs_the_minerals_and_queues_five_at_most(field: Any) -> None:
    slot = carrier(field)
    field.world.players[1].minerals = 14.0
    assert field.why_not(slot, ARM) is ActionResult.NOT_ENOUGH_MINERALS
    for lost in carriers.crew_of(field.world, slot):
        lifecycle.remove(field.world, lost)
    field.world.players[1].minerals = 500.0
    for _ in range(5):
        field.order(slot, ARM)
    assert field.why_not(slot, ARM) is ActionResult.QUEUE_IS_FULL


@pytest.mark.parametrize("version", VERSIONS)
def test_it_launches_one_every_6_loops_at_8_and_they_deal_two_times_five(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = carrier(field)
    enemy = put(field, "Hatchery", 2, 6.5 + 8.0 + 1.25 + 2.0, 16.5)
    commands.attack_unit(field.world, [slot], field.world.tag_of(enemy))
    launched: list[int] = []
    hits: list[float] = []
    life = float(field.world.life[enemy])
    for loop in field.loops(160):
        launched += [loop] * (len(outside(field, slot)) - len(launched))
        if field.world.life[enemy] < life - 1.0:
            hits.append(life - float(field.world.life[enemy]))
        life = float(field.world.life[enemy])
    assert len(launched) == 4
    assert [b - a for a, b in pairwise(launched)] == [6, 6, 6]
    armor = field.world.catalog.unit("Hatchery").armor
    assert min(hits) == pytest.approx(2 * (5.0 - armor), abs=0.1)
    assert 8 <= round(sum(hits) / (2 * (5.0 - armor))) <= 12  # four of them, every 48 loops


def test_they_come_home_when_there_is_nobody_left_and_are_launched_again(field: Any) -> None:
    slot = carrier(field)
    enemy = put(field, "Marine", 2, 12.0, 16.0)
    commands.attack_unit(field.world, [slot], field.world.tag_of(enemy))
    for _ in field.loops(200):
        if not field.world.alive[enemy]:
            break
    assert not field.world.alive[enemy]
    field.play(60)
    assert not outside(field, slot)
    assert len(field.world.passengers(slot)) == 4
    other = put(field, "Roach", 2, 12.0, 18.0)
    commands.attack_unit(field.world, [slot], field.world.tag_of(other))
    field.play(40)
    assert outside(field, slot)


def test_they_stay_with_their_target_while_the_carrier_backs_off_within_12(field: Any) -> None:
    slot = carrier(field, 16.0, 16.0)
    enemy = put(field, "Hatchery", 2, 26.5, 16.5)
    commands.attack_unit(field.world, [slot], field.world.tag_of(enemy))
    field.play(80)
    assert len(outside(field, slot)) == 4
    commands.move(field.world, [slot], (14.0, 16.0))  # 12.5 less the bodies away: within the leash
    field.play(60)
    assert len(outside(field, slot)) == 4
    commands.move(field.world, [slot], (6.0, 16.0))
    field.play(120)
    assert not outside(field, slot)


def test_interceptors_can_be_shot_and_die_with_their_carrier(field: Any) -> None:
    slot = carrier(field)
    enemy = put(field, "Hatchery", 2, 16.5, 16.5)
    commands.attack_unit(field.world, [slot], field.world.tag_of(enemy))
    field.play(60)
    crew = carriers.crew_of(field.world, slot)
    tags = [field.world.tag_of(s) for s in crew]
    assert all(field.world.targetable[s] for s in crew)
    field.world.life[outside(field, slot)[0]] = 0.0
    field.play(1)
    assert len(carriers.crew_of(field.world, slot)) == 3
    field.world.life[slot] = 0.0
    field.play(2)
    assert all(field.world.slot_of(tag) < 0 for tag in tags)
    assert field.world.live.tolist() == [enemy]


def test_a_stalker_shoots_interceptors_but_nobody_can_be_told_to(field: Any) -> None:
    slot = carrier(field)
    enemy = put(field, "Hatchery", 2, 16.5, 16.5)
    commands.attack_unit(field.world, [slot], field.world.tag_of(enemy))
    field.play(60)
    hydra = field.put("Hydralisk", 2, 13.0, 19.0)
    (first, *_) = outside(field, slot)
    assert not commands.can_reach(field.world, hydra, first)
    before = sum(field.vitals(s) for s in outside(field, slot)) + field.vitals(slot)
    field.play(30)
    assert sum(field.vitals(s) for s in outside(field, slot)) + field.vitals(slot) < before


def test_an_image_of_a_carrier_has_no_interceptors(field: Any) -> None:
    slot = put(field, "Carrier", 1, 6.0, 16.0)
    field.world.hallucination[slot] = True
    field.play(2)
    assert not carriers.crew_of(field.world, slot)
