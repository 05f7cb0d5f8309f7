"""Ravager, Infestor, Viper and Queen: reach, price, time and effect of their spells, by the tables of each version."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

VERSIONS = ("4.10", "5.0.13")
BILE, FUNGAL, NEURAL, CANCEL_NEURAL, TERRANS, SHROUD = 2338, 74, 249, 250, 247, 4109
CLOUD, ABDUCT, BOMB, CONSUME, TRANSFUSE = 2063, 2067, 2542, 2073, 1664
CASTERS = {
    BILE: "Ravager", FUNGAL: "Infestor", NEURAL: "Infestor", CLOUD: "Viper", ABDUCT: "Viper", BOMB: "Viper",
    CONSUME: "Viper", TRANSFUSE: "Queen",
}  # fmt: skip


@pytest.fixture
def make_field(make_field: Callable[..., Any]) -> Callable[..., Any]:
    """Return what makes fields in which units do not pick fights by themselves."""

    def make_peaceful(**options: Any) -> Any:
        field = make_field(**options)
        field.fights = False
        return field

    return make_peaceful


@pytest.fixture(params=VERSIONS)
def arena(request: pytest.FixtureRequest, make_field: Callable[..., Any]) -> Any:
    """Return a bare field of each version whose first player has researched what the spells need."""
    field = make_field(version=request.param)
    field.research(1, "NeuralParasite", "Burrow")
    return field


def caster(field: Any, ability: int, x: float = 8.0, y: float = 16.0) -> int:
    slot: int = field.put(CASTERS[ability], 1, x, y)
    field.world.energy[slot] = field.world.energy_max[slot]
    return slot


def victim(field: Any, name: str = "Disruptor", x: float = 14.0, y: float = 16.0, owner: int = 2) -> int:
    """Return a unit that stays where it is."""
    slot: int = field.put(name, owner, x, y)
    commands.hold(field.world, [slot])
    return slot


def aim_for(field: Any, ability: int) -> tuple[int, int, tuple[float, float] | None]:
    """Return a caster far away from a fitting target: (caster, target slot or NOBODY, point)."""
    slot = caster(field, ability)
    match ability:
        case 2063 | 74 | 2338:
            return slot, NOBODY, (24.0, 16.0)
        case 2542:
            return slot, victim(field, "Phoenix", 24.0), None
        case 2073:
            return slot, field.put("Hatchery", 1, 24.5, 16.5), None
        case 1664:
            field.world.growth.add(0, "Hatchery", (8, 16), 0, grown=True)
            field.world.growth.add(0, "Hatchery", (16, 16), 0, grown=True)
            field.world.growth.settle()
            friend = victim(field, "Roach", 24.0, owner=1)
            field.world.life[friend] = 10.0
            return slot, friend, None
    return slot, victim(field, x=24.0), None


# what is the same for all ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ability", CASTERS)
def test_a_caster_walks_up_to_its_range_pays_and_cools_down(arena: Any, ability: int) -> None:
    world, record = arena.world, arena.world.catalog.ability(ability)
    slot, target, point = aim_for(arena, ability)
    if ability == CONSUME:
        world.energy[slot] = 50.0
    assert arena.order(slot, ability, None if target == NOBODY else target, point)
    paid = False
    for _ in arena.loops(400):
        before = float(world.energy[slot])
        if world.casts[slot] and world.cast_at[slot] < 0 and not world.channels[slot]:
            continue
        goal = point or world.pos[target].tolist()
        gap = math.dist(world.pos[slot], goal) - world.radius[slot]
        gap -= world.radius[target] if target != NOBODY else 0.0
        assert gap <= record.range + 1e-6
        assert gap > record.range - 0.5
        if before > 200.0 - record.energy / 2.0:
            continue
        paid = True
        break
    assert paid
    arena.play(math.ceil(record.intro_loops) + 1)
    if record.energy:
        regained = world.energy_regen[slot] * world.loop
        assert world.energy[slot] <= 200.0 - record.energy + regained
    if record.cooldown_loops:
        left = world.timers[slot][record.timer] - world.loop
        assert 0.0 < left <= record.cooldown_loops


@pytest.mark.parametrize("ability", [a for a in CASTERS if a not in (BILE, CONSUME)])
def test_without_energy_there_is_no_spell(arena: Any, ability: int) -> None:
    slot, target, point = aim_for(arena, ability)
    arena.world.energy[slot] = arena.world.catalog.ability(ability).energy - 0.01
    assert arena.why_not(slot, ability, target, point) is ActionResult.NOT_ENOUGH_ENERGY
    arena.world.energy[slot] += 0.02
    assert arena.why_not(slot, ability, target, point) is ActionResult.SUCCESS


def test_bile_waits_for_its_cooldown(arena: Any) -> None:
    slot = caster(arena, BILE)
    assert arena.order(slot, BILE, point=(14.0, 16.0))
    arena.play(2)
    assert arena.why_not(slot, BILE, point=(14.0, 16.0)) is ActionResult.COOLDOWN
    arena.play(int(arena.world.catalog.ability(BILE).cooldown_loops))
    assert arena.why_not(slot, BILE, point=(14.0, 16.0)) is ActionResult.SUCCESS


# Ravager --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "owner"), [("Disruptor", 2), ("Roach", 1), ("Phoenix", 2), ("Forge", 2)])
def test_bile_harms_friend_and_foe_on_the_ground_and_in_the_air(arena: Any, name: str, owner: int) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(BILE).numbers
    slot, target = caster(arena, BILE), victim(arena, name, 14.5, 16.5, owner)
    x, y = world.pos[target].tolist()
    before = arena.vitals(target)
    assert arena.order(slot, BILE, point=(x, y))
    arena.play(1)
    (bile,) = world.area_effects
    assert (bile.effect, bile.at, bile.radius) == (11, (x, y), numbers["radius"])
    falls = numbers["delay_loops"] + numbers["fall_loops"]
    arena.play(int(falls) - 1)
    assert arena.vitals(target) >= before
    arena.play(1)
    assert not world.area_effects
    assert before - arena.vitals(target) == pytest.approx(numbers["damage"], abs=0.5)


def test_bile_spares_who_stands_farther_away(arena: Any) -> None:
    slot, target = caster(arena, BILE), victim(arena, x=14.0)
    beside = 14.0 + arena.world.radius[target] + arena.world.catalog.ability(BILE).numbers["radius"] + 0.05
    before = arena.vitals(target)
    assert arena.order(slot, BILE, point=(beside, 16.0))
    arena.play(60)
    assert arena.vitals(target) == before


def test_bile_destroys_force_fields(arena: Any) -> None:
    slot, field = caster(arena, BILE), arena.put("ForceField", 2, 14, 16)
    assert arena.order(slot, BILE, point=(14.5, 16.0))
    arena.play(45)
    assert not arena.world.alive[field]


# Infestor -------------------------------------------------------------------------------------------------------------


def test_fungal_growth_harms_slows_and_uncloaks_enemies_for_its_time(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(FUNGAL).numbers
    slot, target = caster(arena, FUNGAL), victim(arena)
    ghost = arena.put("DarkTemplar", 2, 14, 17.5)
    friend = victim(arena, "Roach", 14, 14.5, 1)
    far = victim(arena, x=14.0 + numbers["radius"] + 2 * 0.9)
    ordinary, whole = float(world.step_max[target]), arena.vitals(target)
    assert arena.order(slot, FUNGAL, point=(14.0, 16.0))
    while not buffs.has(world, target, "FungalGrowth"):
        arena.play(1)
        assert world.loop < 30
    hit = world.loop
    assert world.step_max[target] == pytest.approx(ordinary * numbers["move_speed_multiplier"])
    assert not world.cloaked[ghost]
    assert not buffs.has(world, friend, "FungalGrowth")
    assert not buffs.has(world, far, "FungalGrowth")
    while buffs.has(world, target, "FungalGrowth"):
        arena.play(1)
    assert world.loop - hit == numbers["duration_loops"]
    assert whole - arena.vitals(target) == pytest.approx(numbers["total_damage"])
    assert world.step_max[target] == pytest.approx(ordinary)
    assert world.cloaked[ghost]


def test_an_ultralisk_is_harmed_by_fungal_growth_and_not_slowed(arena: Any) -> None:
    slot, target = caster(arena, FUNGAL), victim(arena, "Ultralisk")
    ordinary = float(arena.world.step_max[target])
    assert arena.order(slot, FUNGAL, point=(14.0, 16.0))
    arena.play(30)
    assert buffs.has(arena.world, target, "FungalGrowth")
    assert arena.world.step_max[target] == ordinary


def test_neural_parasite_takes_a_unit_over_for_its_time(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(NEURAL).numbers
    slot, target = caster(arena, NEURAL), victim(arena)
    assert arena.order(slot, NEURAL, target)
    while world.owner[target] != 1:
        arena.play(1)
        assert world.loop < 30
    taken = world.loop
    assert buffs.has(world, target, "NeuralParasite")
    assert world.order_kind[target] == 0
    while world.owner[target] == 1:
        arena.play(1)
    assert world.loop - taken == numbers["duration_loops"]
    arena.play(1)
    assert not world.casts[slot]


@pytest.mark.parametrize("cause", ["stop", "death", "leash", "cancel"])
def test_neural_parasite_ends_with_the_infestors_hold(arena: Any, cause: str) -> None:
    world, record = arena.world, arena.world.catalog.ability(NEURAL)
    slot, target = caster(arena, NEURAL), victim(arena)
    assert arena.order(slot, NEURAL, target)
    arena.play(30)
    assert world.owner[target] == 1
    match cause:
        case "stop":
            commands.stop(world, [slot])
        case "death":
            commands.debug_kill(world, [world.tag_of(slot)])
        case "leash":
            bodies = world.radius[slot] + world.radius[target]
            world.pos[target] = world.pos[slot] + (record.numbers["leash_range"] + bodies + 0.1, 0.0)
        case "cancel":
            assert arena.order(slot, CANCEL_NEURAL)
    arena.play(3)
    assert world.owner[target] == 2
    assert not buffs.has(world, target, "NeuralParasite")


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [
        ("Ultralisk", 2, ActionResult.CANT_TARGET_THAT_UNIT),
        ("Forge", 2, ActionResult.CANT_TARGET_STRUCTURES),
        ("Roach", 1, ActionResult.CANT_TARGET_YOUR_OWN_UNITS),
    ],
)
def test_neural_parasite_has_its_limits(arena: Any, name: str, owner: int, why: ActionResult) -> None:
    slot, target = caster(arena, NEURAL), victim(arena, name, owner=owner)
    assert arena.why_not(slot, NEURAL, target) is why


@pytest.mark.parametrize(
    ("version", "why"), [("4.10", ActionResult.SUCCESS), ("5.0.13", ActionResult.CANT_TARGET_HEROIC_UNITS)]
)
def test_a_newer_mothership_is_heroic(make_field: Callable[..., Any], version: str, why: ActionResult) -> None:
    field = make_field(version=version)
    field.research(1, "NeuralParasite")
    slot, target = caster(field, NEURAL), victim(field, "Mothership")
    assert field.why_not(slot, NEURAL, target) is why


def test_neural_parasite_must_be_researched(make_field: Callable[..., Any]) -> None:
    field = make_field()
    slot, target = caster(field, NEURAL), victim(field)
    assert field.why_not(slot, NEURAL, target) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_an_infested_terran_hatches_from_a_thrown_egg_and_lives_for_its_time(make_field: Callable[..., Any]) -> None:
    field = make_field(version="4.10")
    world, numbers = field.world, field.world.catalog.ability(TERRANS).numbers
    slot = caster(field, FUNGAL)
    assert field.order(slot, TERRANS, point=(14.0, 16.0))
    row = world.catalog.unit("InfestorTerran").row
    egg = world.catalog.unit("InfestedTerransEgg").row
    while egg not in world.type[world.live]:
        field.play(1)
        assert world.loop < 30
    (infested,) = world.live[world.type[world.live] == egg].tolist()
    assert math.dist(world.pos[infested], (14.0, 16.0)) < 1.0
    field.play(int(world.catalog.ability(40).loops))
    assert world.type[infested] == row
    assert world.expires[infested] == world.loop + numbers["life_loops"]
    field.play(int(numbers["life_loops"]))
    assert not world.alive[infested]


@pytest.mark.parametrize(("attacker", "share"), [("Phoenix", 0.5), ("Marine", 1.0)])
def test_a_shroud_halves_what_flyers_deal(make_field: Callable[..., Any], attacker: str, share: float) -> None:
    field = make_field(version="5.0.13")
    world, numbers = field.world, field.world.catalog.ability(SHROUD).numbers
    slot, target = caster(field, FUNGAL), victim(field, "Hydralisk", owner=1)
    enemy = field.put(attacker, 2, 20, 16)
    assert field.order(slot, SHROUD, point=(14.0, 16.0))
    field.play(2)
    assert buffs.has(world, target, "AmorphousArmorcloud")
    before = float(world.life[target])
    apply_damage(world, enemy, 2, target, 20.0, kind="ranged")
    assert before - world.life[target] == pytest.approx(20.0 * share)
    field.play(int(numbers["duration_loops"]) + 12)
    assert not buffs.has(world, target, "AmorphousArmorcloud")


# Viper ----------------------------------------------------------------------------------------------------------------


def test_a_blinding_cloud_leaves_no_reach_to_whoever_is_in_it(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(CLOUD).numbers
    slot, marine = caster(arena, CLOUD), arena.put("Marine", 2, 14, 16)
    enemy = victim(arena, "Roach", 17.5, 16, 1)
    cannon = arena.put("SporeCrawler", 2, 14, 18)
    assert arena.order(slot, CLOUD, point=(14.0, 16.5))
    arena.play(2)
    (cloud,) = world.area_effects
    assert (cloud.effect, cloud.radius) == (10, numbers["radius"])
    assert world.detects[cannon] == 0.0
    life = float(world.life[enemy])
    world.pos[marine] = (14.0, 16.0)
    world.step_max[marine] = 0.0
    commands.attack_unit(world, [marine], world.tag_of(enemy))
    arena.play(int(numbers["duration_loops"]) - 10)
    assert world.life[enemy] >= life
    assert world.reach[marine] == 0.0
    arena.play(60)
    assert not world.area_effects
    assert world.life[enemy] < life
    assert world.detects[cannon] > 0.0


@pytest.mark.parametrize("name", ["Disruptor", "Phoenix", "Colossus"])
def test_abduct_brings_a_unit_to_the_viper(arena: Any, name: str) -> None:
    world = arena.world
    slot, target = caster(arena, ABDUCT), victim(arena, name, 16.0)
    assert arena.order(slot, ABDUCT, target)
    arena.play(12)
    assert buffs.has(world, target, "Yoink")
    assert not world.can_act[target]
    arena.play(30)
    assert not buffs.has(world, target, "Yoink")
    assert math.dist((8.0, 16.0), world.pos[target]) <= world.radius[slot] + world.radius[target] + 1.0


@pytest.mark.parametrize(("name", "becomes"), [("RoachBurrowed", "Roach"), ("SiegeTankSieged", "SiegeTank")])
def test_abduct_pulls_units_out_of_the_ground(arena: Any, name: str, becomes: str) -> None:
    slot, target = caster(arena, ABDUCT), arena.put(name, 2, 15, 16)
    arena.put("Overseer", 1, 15, 18)
    arena.play(1)
    assert arena.order(slot, ABDUCT, target)
    arena.play(40)
    assert arena.world.unit_type(target).name == becomes


@pytest.mark.parametrize(("name", "why"), [("Ultralisk", ActionResult.CANT_TARGET_THAT_UNIT),
                                           ("Forge", ActionResult.CANT_TARGET_STRUCTURES)])  # fmt: skip
def test_abduct_has_its_limits(arena: Any, name: str, why: ActionResult) -> None:
    slot, target = caster(arena, ABDUCT), victim(arena, name, 16.5, 16.5)
    assert arena.why_not(slot, ABDUCT, target) is why


def test_a_parasitic_bomb_harms_enemy_flyers_around_its_host(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(BOMB).numbers
    slot, host = caster(arena, BOMB), victim(arena, "Carrier")
    near, far = victim(arena, "Carrier", 16), victim(arena, "Carrier", 20)
    friend = victim(arena, "Mutalisk", 14, 18, 1)
    whole = {s: arena.vitals(s) for s in (host, near, far, friend)}
    for column in (world.shield_regen, world.life_regen):
        column[[host, near, far, friend]] = 0.0
    assert arena.order(slot, BOMB, host)
    arena.play(16)
    assert arena.vitals(host) == whole[host]
    arena.play(200)
    lost = {s: before - arena.vitals(s) for s, before in whole.items()}
    assert lost == pytest.approx(
        {host: numbers["total_on_target"], near: numbers["total_on_target"], far: 0, friend: 0}
    )


def test_a_parasitic_bomb_goes_on_where_its_host_has_died(arena: Any) -> None:
    world = arena.world
    slot, host, near = caster(arena, BOMB), victim(arena, "Phoenix"), victim(arena, "Carrier", 16)
    assert arena.order(slot, BOMB, host)
    arena.play(60)
    commands.debug_kill(world, [world.tag_of(host)])
    arena.play(10)
    left = arena.vitals(near)
    arena.play(40)
    assert arena.vitals(near) < left
    arena.play(140)
    cloud = world.catalog.unit("ParasiticBombDummy").row
    assert cloud not in world.type[world.live]


def test_consume_turns_a_structures_life_into_energy(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(CONSUME).numbers
    slot, target = caster(arena, CONSUME), arena.put("Hatchery", 1, 15.5, 16.5)
    world.energy[slot] = 10.0
    assert arena.order(slot, CONSUME, target)
    arena.play(2)
    world.energy_regen[slot] = world.life_regen[target] = 0.0
    world.energy[slot], whole = 10.0, float(world.life[target])
    arena.play(int(numbers["ticks"] * numbers["period_loops"]) + 30)
    assert whole - world.life[target] == pytest.approx(-numbers["life_per_tick"] * numbers["ticks"], abs=1.0)
    assert world.energy[slot] == pytest.approx(10.0 + numbers["energy_per_tick"] * numbers["ticks"])
    assert not world.casts[slot]


def test_a_full_viper_consumes_nothing(arena: Any) -> None:
    slot, target = caster(arena, CONSUME), arena.put("Hatchery", 1, 15.5, 16.5)
    assert arena.why_not(slot, CONSUME, target) is ActionResult.CANT_TARGET_THAT_UNIT


# Queen ----------------------------------------------------------------------------------------------------------------


def test_transfusion_heals_at_once_and_over_time(arena: Any) -> None:
    world, numbers = arena.world, arena.world.catalog.ability(TRANSFUSE).numbers
    world.growth.add(0, "Hatchery", (10, 16), 0, grown=True)
    world.growth.settle()
    slot, friend = caster(arena, TRANSFUSE), victim(arena, "Ultralisk", 12, 16, 1)
    world.life[friend] = 100.0
    assert arena.order(slot, TRANSFUSE, friend)
    arena.play(5)
    at_once = float(world.life[friend])
    assert at_once == pytest.approx(100.0 + numbers["instant_life"], abs=3.0)
    arena.play(int(numbers["hot_duration_loops"]))
    regained = 165 * float(world.life_regen[friend])
    assert world.life[friend] == pytest.approx(
        100.0 + numbers["instant_life"] + numbers["hot_life_total"] + regained, abs=1.0
    )


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [
        ("Disruptor", 1, ActionResult.MUST_TARGET_BIOLOGICAL_UNITS),
        ("Roach", 2, ActionResult.CANT_TARGET_ENEMY_UNITS),
        ("Zergling", 1, ActionResult.REQUIRES_HEAL_TARGET),
    ],
)
def test_transfusion_has_its_limits(arena: Any, name: str, owner: int, why: ActionResult) -> None:
    arena.world.growth.add(0, "Hatchery", (10, 16), 0, grown=True)
    arena.world.growth.settle()
    slot, target = caster(arena, TRANSFUSE), victim(arena, name, 12, 16, owner)
    assert arena.why_not(slot, TRANSFUSE, target) is why


@pytest.mark.parametrize(("version", "why"), [("4.10", ActionResult.SUCCESS),
                                              ("5.0.13", ActionResult.TECH_REQUIREMENTS_NOT_MET)])  # fmt: skip
def test_a_newer_queen_transfuses_on_creep_only(
    make_field: Callable[..., Any], version: str, why: ActionResult
) -> None:
    field = make_field(version=version)
    slot, friend = caster(field, TRANSFUSE), victim(field, "Roach", 12, 16, 1)
    field.world.life[friend] = 10.0
    assert field.why_not(slot, TRANSFUSE, friend) is why
