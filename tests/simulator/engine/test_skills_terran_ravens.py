"""Ravens: turrets, matrix, missile and detection, worked out from the tables of both versions."""

from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

VERSIONS = ("4.10", "5.0.13")
TURRET, MATRIX, SHREDDER = 1764, 3747, 3753


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


def raven(field: Any, x: float = 6, y: float = 10) -> int:
    slot: int = field.still("Raven", 1, x, y, energy=150)
    if field.world.catalog.version == "5.0.13":
        field.research(1, "InterferenceMatrix")
    return slot


def test_an_auto_turret_stands_on_the_grid_fires_and_falls_after_its_time(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(TURRET)
    slot, victim = raven(field), field.still("Ultralisk", 2, 12, 10)
    assert field.order(slot, TURRET, point=(8.2, 10.1))
    field.until(lambda: any(world.unit_type(s).name == "AutoTurret" for s in world.live.tolist()))
    begun = world.loop
    turret = next(s for s in world.live.tolist() if world.unit_type(s).name == "AutoTurret")
    assert world.pos[turret].tolist() == [8, 10]
    assert world.energy[slot] == pytest.approx(150 - ability.energy, abs=1)
    field.play(60)
    assert world.life[victim] < 500
    gone = field.until(lambda: not any(world.unit_type(s).name == "AutoTurret" for s in world.live.tolist()))
    lasts = ability.numbers["duration_loops"]
    assert lasts <= gone - begun <= lasts + ability.numbers["duration_random_loops"] + 1


def test_an_auto_turret_needs_room(field: Any) -> None:
    slot = raven(field)
    field.put("SupplyDepot", 2, 9, 10)
    assert field.why_not(slot, TURRET, point=(9, 10)) is not ActionResult.SUCCESS
    assert field.why_not(slot, TURRET, point=(9, 14)) is ActionResult.SUCCESS


def test_an_interference_matrix_keeps_a_machine_from_fighting_for_its_time(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(MATRIX)
    slot, victim = raven(field), field.put("SiegeTank", 2, 14, 10)
    assert field.order(slot, MATRIX, victim)
    field.play(2)
    assert world.energy[slot] == pytest.approx(150 - ability.energy, abs=0.2)
    field.until(lambda: not world.can_attack[victim])
    begun = world.loop
    assert not world.can_cast[victim]
    assert world.step_max[victim] > 0
    free = field.until(lambda: world.can_attack[victim])
    assert free - begun == ability.numbers["duration_loops"]


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [("Marine", 2, ActionResult.MUST_TARGET_MECHANICAL_UNITS), ("HighTemplar", 2, ActionResult.SUCCESS),
     ("Bunker", 2, ActionResult.CANT_TARGET_STRUCTURES), ("SiegeTank", 1, ActionResult.CANT_TARGET_YOUR_OWN_UNITS)],
)  # fmt: skip
def test_whom_an_interference_matrix_may_be_aimed_at(field: Any, name: str, owner: int, why: ActionResult) -> None:
    assert field.why_not(raven(field), MATRIX, field.still(name, owner, 12.5, 10.5)) is why


def test_an_interference_matrix_uncovers_who_is_cloaked(field: Any) -> None:
    world = field.world
    slot, victim = raven(field), field.still("Banshee", 2, 14, 10)
    buffs.apply(world, victim, "BansheeCloak")
    world.energy[victim] = 200.0
    field.play(4)
    assert world.visible[1, victim]  # a Raven detects
    field.order(slot, MATRIX, victim)
    field.until(lambda: not world.cloaked[victim])


def test_in_5_0_13_nobody_is_jammed_twice_and_research_is_needed(make_field: Any) -> None:
    field = make_field(version="5.0.13")
    bare, victim = field.still("Raven", 1, 6, 12, energy=150), field.still("SiegeTank", 2, 14, 10)
    assert field.why_not(bare, MATRIX, victim) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    slot = raven(field)
    field.order(slot, MATRIX, victim)
    field.play(3)
    assert field.why_not(bare, MATRIX, victim) is ActionResult.ALREADY_TARGETED


def test_an_anti_armor_missile_weakens_all_around_its_target_for_its_time(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(SHREDDER)
    slot, victim = raven(field), field.still("Ultralisk", 2, 14, 10)
    friend, far = field.still("Marauder", 1, 14, 11.9), field.still("Roach", 2, 14, 10 + 2.88 + 0.7)
    assert field.order(slot, SHREDDER, victim)
    field.play(20)
    assert buffs.has(world, victim, "RavenShredderMissileTint")
    field.until(lambda: buffs.has(world, victim, "RavenShredderMissileArmorReductionUISubtruct"))
    begun = world.loop
    old = world.catalog.version == "4.10"
    assert [world.armor_add[s] for s in (victim, friend, far)] == ([0, 0, 0] if old else [-2, -2, 0])
    assert [world.ranged_add[s] for s in (victim, friend, far)] == ([3, 3, 0] if old else [0, 0, 0])
    over = field.until(lambda: not buffs.has(world, victim, "RavenShredderMissileArmorReductionUISubtruct"))
    assert over - begun == ability.numbers["duration_loops"]


def test_an_anti_armor_missile_flies_at_its_speed_and_gives_up_on_who_runs_far(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(SHREDDER).numbers
    slot, victim = raven(field, 4), field.still("Mutalisk", 2, 13, 10)
    field.order(slot, SHREDDER, victim)
    begun = field.until(lambda: world.area_effects)
    world.pos[victim] = (31, 10)
    field.play(16)
    assert world.area_effects[0].at[0] == pytest.approx(4 + MECHANICS.shredder_speed_n, abs=0.3)
    lost = field.until(lambda: not world.area_effects)
    assert lost - begun == numbers["patience_loops"]
    assert not buffs.has(world, victim, "RavenShredderMissileArmorReductionUISubtruct")
    assert MECHANICS.shredder_speed_n * numbers["patience_loops"] / 16 > numbers["patience_range"]


def test_abilities_need_their_energy(field: Any) -> None:
    slot, victim = raven(field), field.still("SiegeTank", 2, 14, 10)
    for number in (TURRET, MATRIX, SHREDDER):
        ability = field.world.catalog.ability(number)
        field.world.energy[slot] = ability.energy - 1
        target, point = (NOBODY, (8.0, 10.0)) if number == TURRET else (victim, None)
        assert field.why_not(slot, number, target, point) is ActionResult.NOT_ENOUGH_ENERGY


def test_a_raven_detects(field: Any) -> None:
    world = field.world
    slot, hidden = raven(field), field.still("DarkTemplar", 2, 6 + 11 + 0.3, 10)
    beyond = field.still("DarkTemplar", 2, 6 + 11 + 0.6, 14)
    field.play(5)
    assert world.detects[slot] == world.catalog.unit("Raven").detect == 11
    assert world.visible[1, hidden]
    assert not world.visible[1, beyond]
