"""Battlecruisers, Liberators and Medivacs, worked out from the tables of both versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
YAMATO, JUMP, GUARD, LEAVE, HEAL, BOOST = 401, 2358, 2558, 2560, 386, 2116
TO_AIR, TO_GROUND = 2556, 2554


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


# Yamato cannon --------------------------------------------------------------------------------------------------------


def cruiser(field: Any, x: float = 4, y: float = 10) -> int:
    slot: int = field.still("Battlecruiser", 1, x, y)
    field.research(1, "BattlecruiserEnableSpecializations")
    return slot


def test_the_yamato_cannon_fires_when_it_is_charged(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(YAMATO)
    slot, victim = cruiser(field), field.still("Ultralisk", 2, 13, 10)
    assert field.order(slot, YAMATO, victim)
    field.play(1)
    fired = field.until(lambda: world.area_effects)
    assert fired == 1 + ability.numbers["cast_time_loops"]
    field.until(lambda: world.life[victim] < 500)
    assert 500 - world.life[victim] == ability.numbers["damage"] == 240
    assert casting.cooldown_left(world, slot, ability) == ability.cooldown_loops - (world.loop - fired)


def test_a_charge_that_is_broken_off_costs_the_cooldown_only_where_the_tables_say_so(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(YAMATO)
    slot, victim = cruiser(field), field.still("Ultralisk", 2, 13, 10)
    field.order(slot, YAMATO, victim)
    field.play(20)
    commands.stop(world, [slot])
    field.play(40)
    assert world.life[victim] == 500
    assert casting.cooldown_left(world, slot, ability) > 0 if "interrupt_cooldown_loops" in ability.numbers else True
    assert field.why_not(slot, YAMATO, victim) is (
        ActionResult.COOLDOWN if world.catalog.version == "5.0.13" else ActionResult.SUCCESS
    )


def test_a_charge_follows_its_target_as_far_as_the_slop(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(YAMATO)
    slot, victim = cruiser(field), field.still("Ultralisk", 2, 13, 10)
    field.order(slot, YAMATO, victim)
    field.play(10)
    world.pos[victim] = (4 + ability.range + ability.slop, 10)
    field.until(lambda: world.life[victim] < 500)


def test_the_yamato_cannon_needs_its_research(field: Any) -> None:
    slot, victim = field.still("Battlecruiser", 1, 4, 10), field.still("Ultralisk", 2, 12, 10)
    assert field.why_not(slot, YAMATO, victim) is ActionResult.TECH_REQUIREMENTS_NOT_MET


# tactical jump --------------------------------------------------------------------------------------------------------


def test_a_jump_takes_its_time_and_nobody_can_touch_the_ship_on_the_way(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(JUMP)
    numbers = ability.numbers
    slot = cruiser(field)
    assert field.order(slot, JUMP, point=(28, 28))
    field.play(1)
    delay = numbers.get("pre_delay_vulnerable_loops", 0)
    assert bool(world.targetable[slot]) is (delay > 0)
    field.play(math.ceil(delay))
    assert not world.targetable[slot]
    assert world.pos[slot].tolist() == pytest.approx([4, 10], abs=0.1)
    field.play(math.ceil(numbers["out_loops"]))
    assert world.pos[slot].tolist() == pytest.approx([28, 28])
    over = field.until(lambda: world.targetable[slot])
    whole = delay + numbers["out_loops"] + numbers["transit_loops"] + numbers["in_loops"]
    assert over == pytest.approx(1 + whole, abs=1.5)
    assert casting.cooldown_left(world, slot, ability) == ability.cooldown_loops - over + 1


def test_orders_given_during_a_jump_wait_for_its_end(field: Any) -> None:
    world = field.world
    slot = cruiser(field)
    field.order(slot, JUMP, point=(26, 20))
    field.play(5)
    commands.move(world, [slot], (26, 24))
    field.play(30)
    assert world.orders_of(slot)[0].ability == JUMP
    field.play(250)
    assert world.pos[slot].tolist() == pytest.approx([26, 24], abs=0.2)


def test_a_ship_caught_in_fungal_growth_can_not_jump(field: Any) -> None:
    slot = cruiser(field)
    buffs.apply(field.world, slot, "FungalGrowth")
    assert field.why_not(slot, JUMP, point=(20, 20)) is ActionResult.ERROR


# Liberator ------------------------------------------------------------------------------------------------------------


def guarding(field: Any, point: tuple[float, float] = (14, 10)) -> int:
    """Return a Liberator at (8, 10) that has laid out its zone and taken its mode."""
    slot: int = field.put("Liberator", 1, 8, 10)
    assert field.order(slot, GUARD, point=point)
    field.until(lambda: field.world.unit_type(slot).name == "LiberatorAG")
    return slot


def test_a_zone_is_set_up_in_its_time_and_shown_to_everybody(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(GUARD).numbers
    slot = field.put("Liberator", 1, 9, 10)
    field.order(slot, GUARD, point=(14, 10))
    begun = field.until(lambda: world.area_effects)
    assert [(f.effect, f.radius, f.at) for f in world.area_effects] == [(8, numbers["radius"], (14, 10))]
    assert begun < 10
    working = field.until(lambda: world.area_effects[0].effect == 9)
    assert working == begun + numbers["setup_loops"]
    morph = world.catalog.ability(TO_GROUND)
    done = field.until(lambda: world.unit_type(slot).name == "LiberatorAG")
    assert done == pytest.approx(begun + 1 + morph.loops, abs=1.5)


@pytest.mark.parametrize(("y", "fires"), [(10 + 5 + 0.3, True), (10 + 5 + 0.625 + 0.05, False)])
def test_a_liberator_fires_only_at_who_touches_its_zone(field: Any, y: float, *, fires: bool) -> None:
    guarding(field)
    victim = field.still("Roach", 2, 14, y)
    field.play(40)
    assert bool(field.world.life[victim] < 145) is fires


@pytest.mark.parametrize("name", ["Mutalisk", "SpineCrawler"])
def test_a_liberator_on_guard_spares_flyers_and_structures(field: Any, name: str) -> None:
    field.world.growth.paint(0, 0, 32, 32)
    guarding(field)
    victim = field.still(name, 2, 14, 10)
    life = field.world.life[victim]
    field.play(40)
    assert field.world.life[victim] == life


def test_a_target_that_leaves_the_zone_is_let_go(field: Any) -> None:
    world = field.world
    guarding(field)
    victim = field.still("Ultralisk", 2, 14, 10)
    field.until(lambda: world.life[victim] < 500)
    world.pos[victim] = (21.5, 10)
    field.play(3)
    life = world.life[victim]
    field.play(40)
    assert world.life[victim] >= life


def test_a_liberator_hits_with_the_weapon_of_the_tables(field: Any) -> None:
    world = field.world
    slot = guarding(field)
    victim = field.still("Ultralisk", 2, 14, 10)
    field.until(lambda: world.life[victim] < 500)
    weapon = world.unit_type(slot).weapons[0]
    assert 500 - world.life[victim] == pytest.approx(
        weapon.hits[0].damage - world.catalog.unit("Ultralisk").armor, abs=0.1
    )


def test_the_zone_ends_with_the_mode_and_the_ship_takes_off(field: Any) -> None:
    world = field.world
    slot = guarding(field)
    assert field.order(slot, LEAVE)
    field.play(1)
    assert not [f for f in world.area_effects if f.effect]
    begun = world.loop
    done = field.until(lambda: world.unit_type(slot).name == "Liberator")
    assert done == pytest.approx(begun + world.catalog.ability(TO_AIR).loops, abs=1.5)
    victim = field.still("Mutalisk", 2, 10, 10)
    field.play(60)
    assert world.life[victim] < 120


def test_the_zone_ends_with_its_ship(field: Any) -> None:
    slot = guarding(field)
    field.world.life[slot] = 0.0
    field.play(2)
    assert not field.world.area_effects


def test_a_liberator_carried_away_from_its_zone_gives_it_up(field: Any) -> None:
    world = field.world
    slot = guarding(field)
    world.pos[slot] = (3, 10)
    field.play(60)
    assert not world.area_effects
    assert world.unit_type(slot).name == "Liberator"


def test_research_lets_zones_lie_farther_away(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(GUARD)
    slot: int = field.still("Liberator", 1, 4, 10)
    field.research(1, "LiberatorAGRangeUpgrade")
    more = 4 if world.catalog.version == "4.10" else 2
    assert casting.as_is(world, slot, ability).range == ability.range + more
    field.order(slot, GUARD, point=(4 + 0.75 + ability.range + more, 10))
    field.play(3)
    assert world.area_effects
    assert world.pos[slot].tolist() == [4, 10]


# Medivac --------------------------------------------------------------------------------------------------------------


def test_a_medivac_heals_by_itself_for_energy(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(HEAL).numbers
    slot, marine = field.put("Medivac", 1, 10, 10), field.still("Marauder", 1, 12, 10)
    world.life[marine], world.energy[slot] = 25.0, 100.0
    begun = field.until(lambda: world.life[marine] > 25.0)
    field.play(49)
    rate = numbers["life_per_s_normal"] / 16
    assert world.life[marine] == pytest.approx(25 + rate * (world.loop - begun + 1), abs=rate + 0.01)
    healed = world.life[marine] - 25
    gained = world.loop * 0.5625 / 16
    assert world.energy[slot] == pytest.approx(100 - healed * numbers["energy_per_life"] + gained, abs=0.1)
    assert world.players[1].score.healed.life == pytest.approx(healed)


def test_healing_stops_at_full_life_and_without_energy(field: Any) -> None:
    world = field.world
    slot, marine = field.put("Medivac", 1, 10, 10), field.still("Marine", 1, 12, 10)
    world.life[marine], world.energy[slot] = 40.0, 100.0
    field.play(40)
    assert world.life[marine] == world.life_max[marine]
    assert world.order_kind[slot] == 0
    world.life[marine], world.energy[slot] = 5.0, 1.0
    field.play(60)
    assert world.life[marine] < 20


def test_a_medivac_follows_who_walks_away(field: Any) -> None:
    world = field.world
    slot, scv = field.put("Medivac", 1, 8, 10), field.still("Marauder", 1, 10, 10)
    world.life[scv], world.energy[slot] = 20.0, 200.0
    field.play(8)
    commands.move(world, [scv], (28, 10))
    field.play(100)
    assert world.life[scv] > 20 + 60 * 9 / 16
    assert world.pos[slot, 0] > 15


def test_one_unit_is_healed_by_one_medivac_at_a_time(field: Any) -> None:
    world = field.world
    marine = field.still("Marauder", 1, 12, 10)
    world.life[marine] = 25.0
    for y in (8, 10, 12):
        world.energy[field.put("Medivac", 1, 10, y)] = 100.0
    begun = field.until(lambda: world.life[marine] > 25)
    field.play(40)
    assert world.life[marine] <= 25 + (world.loop - begun + 2) * 9 / 16


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [("SiegeTank", 1, ActionResult.MUST_TARGET_BIOLOGICAL_UNITS), ("Marine", 2, ActionResult.CANT_TARGET_ENEMY_UNITS),
     ("Marine", 1, ActionResult.SUCCESS)],
)  # fmt: skip
def test_whom_a_medivac_heals(field: Any, name: str, owner: int, why: ActionResult) -> None:
    slot, other = field.still("Medivac", 1, 10, 10, energy=50), field.still(name, owner, 12, 10)
    field.world.life[other] = 20.0
    assert field.why_not(slot, HEAL, other) is why


def test_who_is_well_is_not_healed_and_without_energy_nobody_is(field: Any) -> None:
    slot, marine = field.still("Medivac", 1, 10, 10, energy=50), field.still("Marine", 1, 12, 10)
    assert field.why_not(slot, HEAL, marine) is ActionResult.REQUIRES_HEAL_TARGET
    field.world.life[marine], field.world.energy[slot] = 10.0, 0.0
    assert field.why_not(slot, HEAL, marine) is ActionResult.NOT_ENOUGH_ENERGY


def test_the_afterburners_speed_a_medivac_up_for_their_time(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(BOOST)
    slot = field.put("Medivac", 1, 4, 10)
    step = world.step_max[slot]
    assert field.order(slot, BOOST)
    assert world.step_max[slot] == pytest.approx(step * ability.numbers["move_speed_multiplier"])
    field.play(int(ability.numbers["duration_loops"]))
    assert world.step_max[slot] == pytest.approx(step)
    assert field.why_not(slot, BOOST) is ActionResult.COOLDOWN
    field.play(int(ability.cooldown_loops - ability.numbers["duration_loops"]))
    assert field.why_not(slot, BOOST) is ActionResult.SUCCESS


def test_research_shortens_the_afterburners_cooldown(field: Any) -> None:
    slot, ability = field.put("Medivac", 1, 4, 10), field.world.catalog.ability(BOOST)
    field.research(1, "MedivacIncreaseSpeedBoost")
    assert casting.as_is(field.world, slot, ability).cooldown_loops == ability.cooldown_loops - 7 * 16
