from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import damage, lifecycle


def hit_once(field: Any, attacker: str, victim: int) -> None:
    world = field.world
    a = field.put(attacker, 1, 30, 30)
    row = world.catalog.unit(attacker).weapon_against("ground").row
    damage.strike(world, a, 1, victim, world.stats.damage[1][row][0])
    world.hurt.clear()
    lifecycle.remove(world, a)


def test_shields_come_back_160_loops_after_the_last_damage_at_an_eighth_per_loop(field: Any) -> None:
    world = field.world
    zealot = field.put("Zealot", 2, 16, 16)
    hit_once(field, "Stalker", zealot)
    assert world.shields[zealot] == 50 - 13
    field.play(160)
    assert world.shields[zealot] == 37
    field.play(1)
    assert world.shields[zealot] == pytest.approx(37 + 2 / 16)
    field.play(15)
    assert world.shields[zealot] == pytest.approx(37 + 2)
    field.play(200)
    assert world.shields[zealot] == 50


def test_new_damage_begins_the_wait_again(field: Any) -> None:
    world = field.world
    zealot = field.put("Zealot", 2, 16, 16)
    hit_once(field, "Stalker", zealot)
    field.play(150)
    hit_once(field, "Stalker", zealot)
    field.play(160)
    assert world.shields[zealot] == 50 - 26


def test_protoss_life_does_not_come_back(field: Any) -> None:
    zealot = field.put("Zealot", 2, 16, 16)
    commands.debug_set_value(field.world, field.world.tag_of(zealot), life=40)
    assert field.play(400).life[zealot] == 40


@pytest.mark.parametrize(
    ("name", "per_normal_second"), [("Zergling", 0.2734), ("SpineCrawler", 0.2734), ("Mutalisk", 1)]
)
def test_zerg_life_comes_back_all_the_time(field: Any, name: str, per_normal_second: float) -> None:
    world = field.world
    slot = field.put(name, 2, 16, 16)
    world.life[slot] = 10
    field.play(16)
    assert world.life[slot] == pytest.approx(10 + per_normal_second)


def test_energy_grows_to_its_limit(field: Any) -> None:
    world = field.world
    sentry = field.put("Sentry", 1, 16, 16)
    assert world.energy[sentry] == 50
    field.play(160)
    assert world.energy[sentry] == pytest.approx(50 + 0.5625 * 10)
    world.energy[sentry] = 199.99
    field.play(2)
    assert world.energy[sentry] == 200


def test_the_dead_do_not_regenerate(field: Any) -> None:
    world = field.world
    zergling = field.put("Zergling", 2, 16, 16)
    commands.debug_kill(world, [world.tag_of(zergling)])
    field.play(1)
    assert len(world.live) == 0
