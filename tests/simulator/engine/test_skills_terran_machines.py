"""Siege tanks, modes, Widow Mines and Cyclones, worked out from the tables of both versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
SIEGE, UNSIEGE, ASSAULT, FIGHTER, HELLBAT, HELLION, HIGH_IMPACT, EXPLOSIVE = 388, 390, 403, 405, 1998, 1978, 2362, 2364
BURROW, UNBURROW, MINE_ATTACK, LOCK_ON, CALL_OFF = 2095, 2097, 2099, 2350, 2354
MODES = [
    ("SiegeTank", SIEGE), ("SiegeTankSieged", UNSIEGE), ("VikingFighter", ASSAULT), ("VikingAssault", FIGHTER),
    ("Hellion", HELLBAT), ("HellionTank", HELLION), ("Thor", HIGH_IMPACT), ("ThorAP", EXPLOSIVE),
    ("WidowMine", BURROW), ("WidowMineBurrowed", UNBURROW),
]  # fmt: skip
SERVOS = {ASSAULT: 1.34, FIGHTER: 1.333, HELLBAT: 2.0, HELLION: 2.0, HIGH_IMPACT: 1.5, EXPLOSIVE: 1.5}
SERVOS_RANDOM = {HELLBAT: 0.25, HELLION: 0.25, HIGH_IMPACT: 0.25, EXPLOSIVE: 0.25}


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


# modes ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "number"), MODES)
def test_a_unit_changes_its_mode_in_the_time_of_the_tables(field: Any, name: str, number: int) -> None:
    world, ability = field.world, field.world.catalog.ability(number)
    world.players[1].cheats.append("tech_tree")
    slot = field.put(name, 1, 10, 10)
    tag = world.tag_of(slot)
    assert field.order(slot, number)
    done = field.until(lambda: world.unit_type(slot).name == ability.unit)
    least = 1 + ability.loops
    assert least <= done <= math.ceil(least + ability.random_loops) + 1
    assert world.tag_of(slot) == tag
    assert world.life[slot] == world.catalog.unit(ability.unit).life


@pytest.mark.parametrize("number", sorted(SERVOS))
def test_smart_servos_shorten_modes_by_what_the_data_says(field: Any, number: int) -> None:
    ability = field.world.catalog.ability(number)
    slot = field.put(ability.users[0], 1, 10, 10)
    field.research(1, "SmartServos")
    mine = casting.as_is(field.world, slot, ability)
    assert mine.loops == pytest.approx(ability.loops - SERVOS[number] * 16)
    assert mine.random_loops == pytest.approx(ability.random_loops - SERVOS_RANDOM.get(number, 0.0) * 16)
    assert field.world.stats.ability(2, ability) is ability


def test_an_order_given_while_a_tank_changes_its_mode_is_kept_for_afterwards(field: Any) -> None:
    world = field.world
    slot = field.put("SiegeTankSieged", 1, 6, 10)
    field.order(slot, UNSIEGE)
    field.play(10)
    commands.move(world, [slot], (12, 10))
    field.play(10)
    assert [o.ability for o in world.orders_of(slot)] == [UNSIEGE, 16]
    field.until(lambda: world.unit_type(slot).name == "SiegeTank")
    field.play(80)
    assert world.pos[slot].tolist() == pytest.approx([12, 10], abs=0.1)


@pytest.mark.parametrize(("name", "number", "cancel"), [("WidowMine", BURROW, 2096), ("Thor", HIGH_IMPACT, 2363)])
def test_what_can_be_cancelled_is(field: Any, name: str, number: int, cancel: int) -> None:
    slot = field.put(name, 1, 10, 10)
    field.order(slot, number)
    field.play(10)
    assert field.order(slot, cancel)
    field.play(60)
    assert field.world.unit_type(slot).name == name


def test_a_viking_does_not_land_where_nobody_can_stand(field: Any) -> None:
    slot = field.put("VikingFighter", 1, 10.5, 10.5)
    field.put("Barracks", 2, 10.5, 10.5)
    assert field.why_not(slot, ASSAULT) is ActionResult.CANT_LAND_LOCATION_INVALID
    field.world.pos[slot] = (14, 10)
    assert field.why_not(slot, ASSAULT) is ActionResult.SUCCESS


def test_stop_does_not_keep_a_tank_from_sieging(field: Any) -> None:
    world = field.world
    slot = field.put("SiegeTank", 1, 6, 10)
    field.order(slot, SIEGE)
    field.play(10)
    commands.stop(world, [slot])
    field.until(lambda: world.unit_type(slot).name == "SiegeTankSieged")


def test_a_tank_does_not_fire_while_it_changes_its_mode(field: Any) -> None:
    slot, victim = field.put("SiegeTank", 1, 6, 10), field.still("Hatchery", 2, 14.5, 10.5)
    field.order(slot, SIEGE)
    field.play(60)
    assert field.world.life[victim] == 1500
    field.play(80)
    assert field.world.life[victim] < 1500


def test_a_sieged_tank_neither_moves_nor_fires_at_what_is_too_close(field: Any) -> None:
    world = field.world
    slot = field.put("SiegeTankSieged", 1, 6, 10)
    weapon = world.unit_type(slot).weapons[0]
    near = field.still("Roach", 2, 6 + 0.875 + world.catalog.unit("Roach").radius + weapon.min_range - 0.2, 10)
    commands.move(world, [slot], (20, 10))
    field.play(100)
    assert world.pos[slot].tolist() == [6, 10]
    assert world.life[near] == 145
    assert weapon.min_range == 2


def test_the_splash_of_a_sieged_tank_hurts_friends(field: Any) -> None:
    world = field.world
    slot, victim = field.put("SiegeTankSieged", 1, 4, 10), field.still("Roach", 2, 14, 10)
    friend = field.still("Marauder", 1, 14, 11.3)
    commands.attack_unit(world, [slot], world.tag_of(victim))
    field.until(lambda: world.life[victim] < 145)
    assert world.life[friend] < 125


def test_hellbats_need_an_armory(field: Any) -> None:
    slot = field.put("Hellion", 1, 6, 10)
    assert field.why_not(slot, HELLBAT) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.put("Armory", 1, 20.5, 20.5)
    assert field.why_not(slot, HELLBAT) is ActionResult.SUCCESS


# Widow Mine -----------------------------------------------------------------------------------------------------------


def mine(field: Any, x: float = 10, y: float = 10) -> int:
    slot: int = field.put("WidowMineBurrowed", 1, x, y)
    field.play(1)
    return slot


def test_a_burrowed_mine_is_hidden_and_fires_by_itself_after_taking_aim(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(MINE_ATTACK)
    slot = mine(field)
    field.play(4)
    assert not world.visible[2, slot]
    victim = field.still("Ultralisk", 2, 10 + ability.range + 1.0, 10)
    begun = field.until(lambda: world.casts[slot])
    fired = field.until(lambda: world.area_effects)
    assert ability.prep_loops <= fired - begun <= ability.prep_loops + 2
    field.until(lambda: world.life[victim] < 500)
    assert 500 - world.life[victim] == pytest.approx(ability.numbers["damage"])


def test_a_mine_keeps_what_it_was_set_to_do_when_it_burrows(field: Any) -> None:
    world = field.world
    slot = field.put("WidowMine", 1, 10, 10)
    assert world.autocast[slot] == (MINE_ATTACK,)
    del world.autocast[slot]
    field.order(slot, BURROW)
    field.until(lambda: world.unit_type(slot).name == "WidowMineBurrowed")
    assert slot not in world.autocast


def test_a_right_click_of_a_burrowed_mine_on_a_foe_fires(field: Any) -> None:
    world = field.world
    slot = mine(field)
    world.autocast.pop(slot)
    near, friend = field.still("Ultralisk", 2, 15, 10), field.still("Marine", 1, 12, 12)
    assert casting.smart(world, [slot], target=world.tag_of(friend)) != [slot] or not world.casts[slot]
    casting.smart(world, [slot], target=world.tag_of(near))
    assert [o.ability for o in world.orders_of(slot)] == [MINE_ATTACK]
    field.until(lambda: world.life[near] < 500)


def test_a_mine_takes_more_from_shields(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(MINE_ATTACK).numbers
    mine(field)
    victim = field.still("Archon", 2, 14, 10)
    field.until(lambda: world.shields[victim] < 350)
    assert 350 - world.shields[victim] == numbers["damage"] + numbers["bonus_vs_shields"]


@pytest.mark.parametrize(
    ("name", "owner", "hurt"),
    [("Marine", 2, True), ("Marauder", 1, True), ("WidowMineBurrowed", 1, False), ("SpineCrawler", 2, False)],
)
def test_a_mine_hurts_who_is_beside_its_target_but_no_structure_and_no_mine_of_its_owner(
    field: Any, name: str, owner: int, *, hurt: bool
) -> None:
    world, numbers = field.world, field.world.catalog.ability(MINE_ATTACK).numbers
    mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    radius = world.catalog.unit(name).radius
    other = field.still(name, owner, 15, 10 + numbers["splash_radius"] + radius - 0.1)
    world.autocast.pop(other, None)
    if name == "SpineCrawler":
        world.growth.paint(0, 0, 32, 32)
    before = world.life[other]
    field.until(lambda: world.life[victim] < 500)
    assert before - world.life[other] == (numbers["splash_damage"] if hurt else 0)


def test_splash_reaches_its_radius_to_the_edge(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(MINE_ATTACK).numbers
    mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    other = field.still("Marauder", 1, 15, 10 + numbers["splash_radius"] + 0.5625 + 0.1)
    field.until(lambda: world.life[victim] < 500)
    assert world.life[other] == 125
    assert numbers["splash_radius"] == (1.75 if world.catalog.version == "4.10" else 1.5)


def test_a_mine_that_reloads_is_seen_until_it_is_ready(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(MINE_ATTACK)
    slot = mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    field.until(lambda: world.life[victim] < 500)
    fired = world.timers[slot][ability.timer] - ability.cooldown_loops
    world.life[victim] = 0.0
    field.play(5)
    assert world.visible[2, slot]
    field.play(int(fired + ability.cooldown_loops - world.loop) - 1)
    assert world.visible[2, slot]
    field.play(6)
    assert not world.visible[2, slot]


def test_drilling_claws_keep_a_reloading_mine_hidden_and_burrow_it_faster(field: Any) -> None:
    world, burrow = field.world, field.world.catalog.ability(BURROW)
    field.research(1, "DrillClaws")
    slot = mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    field.until(lambda: world.life[victim] < 500)
    field.play(8)
    assert not world.visible[2, slot]
    faster = 2 if world.catalog.version == "4.10" else 1.5
    assert casting.as_is(world, slot, burrow).loops == pytest.approx(burrow.loops - faster * 16)


def test_a_mine_fires_once_per_cooldown_and_only_from_the_ground(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(MINE_ATTACK)
    slot = mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    field.until(lambda: world.life[victim] < 500)
    life = world.life[victim]
    field.play(int(ability.cooldown_loops) - 40)
    assert world.life[victim] == pytest.approx(life, abs=13)  # Zerg regain life
    assert field.why_not(slot, MINE_ATTACK, victim) is ActionResult.COOLDOWN
    above = field.still("WidowMine", 1, 20, 20)
    assert field.why_not(above, MINE_ATTACK, victim) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_a_mine_lets_go_of_who_leaves_its_range_in_time(field: Any) -> None:
    world = field.world
    slot = mine(field)
    victim = field.still("Ultralisk", 2, 15, 10)
    field.until(lambda: world.casts[slot])
    field.play(10)
    world.pos[victim] = (22, 10)
    field.play(40)
    assert not world.area_effects
    assert world.life[victim] == 500


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [("Hatchery", 2, ActionResult.CANT_TARGET_STRUCTURES), ("Marine", 1, ActionResult.CANT_TARGET_YOUR_OWN_UNITS),
     ("Larva", 2, ActionResult.CANT_TARGET_THAT_UNIT), ("Mutalisk", 2, ActionResult.SUCCESS)],
)  # fmt: skip
def test_whom_a_mine_may_fire_at(field: Any, name: str, owner: int, why: ActionResult) -> None:
    slot = mine(field)
    assert field.why_not(slot, MINE_ATTACK, field.still(name, owner, 14, 10)) is why


# Cyclone --------------------------------------------------------------------------------------------------------------


def locked(field: Any, name: str = "Ultralisk", away: float = 6.0) -> tuple[int, int]:
    """Return a Cyclone that has just locked on to a unit."""
    slot, victim = field.still("Cyclone", 1, 4, 10), field.still(name, 2, 4 + away, 10)
    field.world.autocast.pop(slot, None)
    assert field.order(slot, LOCK_ON, victim)
    field.play(1)
    return slot, victim


def test_a_lock_marks_its_target_and_silences_the_cyclones_own_weapon(field: Any) -> None:
    slot, victim = locked(field)
    assert buffs.has(field.world, victim, "LockOn")
    assert not field.world.can_attack[slot]
    assert field.why_not(slot, LOCK_ON, victim) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_the_missiles_of_a_lock_add_up_to_what_the_tables_say(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(LOCK_ON).numbers
    slot, victim = locked(field, "CommandCenter")
    begun, last, shots, before = world.loop, 0, [], world.life[victim]
    lasts = int(numbers["ticks"] * numbers["tick_period_loops"])
    for loop in field.loops(lasts + 20):
        if world.life[victim] < before:
            shots.append(before - world.life[victim])
            before = world.life[victim]
            last = loop
    weapon = world.unit_type(slot).weapons[0]
    if world.catalog.version == "4.10":
        assert shots == [numbers["damage_per_tick"]] * numbers["ticks"]
        assert sum(shots) == numbers["total_damage"]
    else:
        per_shot = weapon.hits[0].damage + dict(weapon.hits[0].bonus)["mechanical"] - 1  # armor
        assert shots == [per_shot] * (lasts // 13 + 1)
    assert begun + lasts <= last + 15


def test_research_adds_to_the_missiles_of_a_lock_on_armored_targets_in_4_10(make_field: Any) -> None:
    field = make_field(version="4.10")
    field.research(1, "CycloneLockOnDamageUpgrade")
    _, victim = locked(field, "CommandCenter")
    life = field.world.life[victim]
    field.until(lambda: field.world.life[victim] < life)
    assert life - field.world.life[victim] == 40


def test_a_locked_cyclone_goes_where_it_wants(field: Any) -> None:
    slot, victim = locked(field)
    commands.move(field.world, [slot], (4, 13))
    life = field.world.life[victim]
    field.play(60)
    assert field.world.pos[slot].tolist() == pytest.approx([4, 13], abs=0.1)
    assert field.world.life[victim] < life
    assert buffs.has(field.world, victim, "LockOn")


@pytest.mark.parametrize("how", ["called off", "too far", "target dead", "cloaked", "time"])
def test_what_ends_a_lock_and_that_the_cooldown_runs_from_there(field: Any, how: str) -> None:
    world, ability = field.world, field.world.catalog.ability(LOCK_ON)
    slot, victim = locked(field, "CommandCenter" if how == "time" else "Ultralisk")
    field.play(5)
    if how == "called off":
        assert field.order(slot, CALL_OFF)
    elif how == "too far":
        world.pos[victim] = (4 + ability.numbers["leash_range"] + 0.1, 10)
    elif how == "target dead":
        world.life[victim] = 0.0
    elif how == "cloaked":
        buffs.apply(world, victim, "CloakFieldEffect", loops=200)
    else:
        field.play(int(ability.numbers["ticks"] * ability.numbers["tick_period_loops"]) - 8)
    field.play(5)
    assert not buffs.has(world, slot, "LockOnDisableAttack")
    assert world.can_attack[slot]
    left = casting.cooldown_left(world, slot, ability)
    assert ability.numbers["cooldown_after_lock_ends_loops"] - 6 <= left
    assert left <= ability.numbers["cooldown_after_lock_ends_loops"]
    if how != "target dead":
        assert not buffs.has(world, victim, "LockOn")


def test_a_cyclone_locks_on_by_itself(field: Any) -> None:
    world = field.world
    slot = field.put("Cyclone", 1, 4, 10)
    victim = field.still("Ultralisk", 2, 10.5, 10)
    field.until(lambda: buffs.has(world, victim, "LockOn"), 40)
    assert buffs.has(world, slot, "LockOnDisableAttack")


def test_two_locks_on_one_target_end_each_for_itself(field: Any) -> None:
    world = field.world
    slot, victim = locked(field)
    other = field.still("Cyclone", 1, 4, 12)
    world.autocast.pop(other, None)
    field.order(other, LOCK_ON, victim)
    field.play(3)
    field.order(slot, CALL_OFF)
    field.play(1)
    assert buffs.has(world, victim, "LockOn")
    field.order(other, CALL_OFF)
    assert not buffs.has(world, victim, "LockOn")


def test_a_cyclone_walks_into_range_to_lock_on(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(LOCK_ON)
    slot, victim = field.still("Cyclone", 1, 4, 10), field.still("Ultralisk", 2, 22, 10)
    world.autocast.pop(slot, None)
    field.order(slot, LOCK_ON, victim)
    field.until(lambda: buffs.has(world, victim, "LockOn"))
    gap = math.dist(world.pos[slot].tolist(), world.pos[victim].tolist()) - world.radius[slot] - world.radius[victim]
    assert gap == pytest.approx(ability.range, abs=0.3)
