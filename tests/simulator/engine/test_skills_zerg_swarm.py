"""Units that the Zerg spawn: larvae, locusts, broodlings, changelings; and bursting, spraying and contaminating."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.abilities.zerg import larvae
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

VERSIONS = ("4.10", "5.0.13")
FLAT = "{flat: [64, 64]}"
INJECT, LOCUSTS, SWOOP, EXPLODE, BUILDINGS_ON, BUILDINGS_OFF = 251, 2704, 2387, 42, 2081, 2082
CHANGELING, CONTAMINATE, SPRAY, HOLD_FIRE, FREE_FIRE = 181, 1825, 2324, 2550, 2552


@pytest.fixture(params=[VERSIONS[0], pytest.param(VERSIONS[1], marks=pytest.mark.slow)])
def field(request: pytest.FixtureRequest, make_field: Callable[..., Any]) -> Any:
    return make_field(FLAT, version=request.param)


@pytest.fixture
def peace(field: Any) -> None:
    """Keep all units from picking fights by themselves."""
    field.fights = False


def census(field: Any) -> Counter[str]:
    return Counter(field.world.unit_type(slot).name for slot in field.world.live.tolist())


def those(field: Any, name: str) -> list[int]:
    """Return the slots of the living units of a type."""
    world = field.world
    slots: list[int] = world.live[world.type[world.live] == world.catalog.unit(name).row].tolist()
    return slots


# larvae ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "hall", [larvae.HALLS[0], *(pytest.param(h, marks=pytest.mark.slow) for h in larvae.HALLS[1:])]
)
def test_a_town_hall_hatches_up_to_three_larvae(field: Any, hall: str) -> None:
    field.play(2)
    slot = field.put(hall, 1, 32.5, 32.5)
    hatched: list[int] = []
    for loop in field.loops(3 * MECHANICS.larva_loops + 300):
        if len(larvae.of(field.world, slot)) > len(hatched):
            hatched.append(loop - 3)
    assert hatched == [n * MECHANICS.larva_loops for n in (1, 2, 3)]


def test_a_game_begins_with_three_larvae_at_every_hall(field: Any) -> None:
    slot = field.put("Hatchery", 1, 32.5, 32.5)
    field.play(1)
    assert len(larvae.of(field.world, slot)) == MECHANICS.larvae_natural


def test_larvae_that_a_map_has_belong_to_the_hall_beside_them(field: Any) -> None:
    slot = field.put("Hatchery", 1, 32.5, 32.5)
    mine = [field.put("Larva", 1, 31.0 + i, 29.0) for i in range(3)]
    field.put("Hatchery", 2, 12.5, 12.5)
    stranger = field.put("Larva", 2, 32.0, 28.0)
    field.play(2)
    assert larvae.of(field.world, slot).tolist() == mine
    assert field.world.home[stranger] == NOBODY


def test_a_larva_that_is_used_is_replaced(field: Any) -> None:
    slot = field.put("Hatchery", 1, 32.5, 32.5)
    field.play(100)
    first = int(larvae.of(field.world, slot)[0])
    lifecycle.become(field.world, first, field.world.catalog.unit("Egg"))
    field.play(MECHANICS.larva_loops)
    assert len(larvae.of(field.world, slot)) == 2
    field.play(2)
    assert len(larvae.of(field.world, slot)) == 3


def test_larvae_stay_near_their_hall_and_never_still(field: Any) -> None:
    world, slot = field.world, field.put("Hatchery", 1, 32.5, 32.5)
    field.play(1)
    mine = larvae.of(world, slot)
    seen: dict[int, set[tuple[float, ...]]] = {larva: set() for larva in mine.tolist()}
    for loop in field.loops(600):
        if loop % 60 == 0:
            for larva, places in seen.items():
                places.add(tuple(world.pos[larva].tolist()))
    assert min(len(places) for places in seen.values()) > 5
    far = MECHANICS.larva_leash + MECHANICS.larva_step + 2.0  # the third one hatched that far away
    assert all(math.dist(place, (32.5, 29.5)) < far for places in seen.values() for place in places)


def test_larvae_die_off_creep(field: Any) -> None:
    larva = field.put("Larva", 1, 10, 10)
    field.play(MECHANICS.larva_rest_loops + 1)
    assert not field.world.alive[larva]


def test_an_injection_hatches_three_more_larvae(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(INJECT).numbers
    slot, queen = field.put("Hatchery", 1, 32.5, 32.5), field.put("Queen", 1, 32, 28)
    world.energy[queen] = 60.0
    field.play(1)
    assert field.order(queen, INJECT, slot)
    while not buffs.has(world, slot, "QueenSpawnLarvaTimer"):
        field.play(1)
        assert world.loop < 60
    injected = world.loop
    assert world.energy[queen] < 60.0 - 24.0
    field.play(int(numbers["delay_loops"]))
    assert world.loop - injected == numbers["delay_loops"]
    assert not buffs.has(world, slot, "QueenSpawnLarvaTimer")
    assert len(larvae.of(world, slot)) == 3
    field.play(int(numbers["larva"] * MECHANICS.injected_larva_loops))
    assert len(larvae.of(world, slot)) == 3 + numbers["larva"]


def test_injections_wait_for_each_other(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(INJECT).numbers
    slot = field.put("Hatchery", 1, 32.5, 32.5)
    queens = [field.put("Queen", 1, 30 + 2 * i, 28) for i in range(3)]
    field.play(1)
    for queen in queens:
        world.energy[queen] = 60.0
        assert field.order(queen, INJECT, slot)
    field.play(int(numbers["delay_loops"]) + 60)
    assert len(larvae.of(world, slot)) == 3 + numbers["larva"]
    field.play(2 * int(numbers["delay_loops"]) + 60)
    assert len(larvae.of(world, slot)) == 3 + 3 * numbers["larva"]


def test_a_hall_has_at_most_nineteen_larvae(field: Any) -> None:
    slot = field.put("Hatchery", 1, 32.5, 32.5)
    larvae.hatch(field.world, slot, 50)
    assert len(larvae.of(field.world, slot)) == MECHANICS.larva_limit


@pytest.mark.parametrize(("name", "owner", "why"), [
    ("Hatchery", 1, ActionResult.SUCCESS), ("Hatchery", 2, ActionResult.CANT_TARGET_ENEMY_UNITS),
    ("SpawningPool", 1, ActionResult.CANT_TARGET_THAT_UNIT),
])  # fmt: skip
def test_only_own_town_halls_are_injected(field: Any, name: str, owner: int, why: ActionResult) -> None:
    slot, queen = field.put(name, owner, 32.5, 32.5), field.put("Queen", 1, 32, 28)
    field.world.energy[queen] = 60.0
    assert field.why_not(queen, INJECT, slot) is why


# Swarm Host -----------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("peace")
@pytest.mark.parametrize("host", ["SwarmHostMP", "SwarmHostBurrowedMP"])
def test_a_swarm_host_sends_two_locusts_that_live_for_their_time(field: Any, host: str) -> None:
    world, record = field.world, field.world.catalog.ability(LOCUSTS)
    numbers, slot = record.numbers, field.put(host, 1, 20, 32)
    assert field.order(slot, LOCUSTS, point=(50.0, 32.0))
    field.play(1)
    hatched = those(field, "LocustMP")
    assert len(hatched) == numbers["count"]
    begun = world.loop
    assert not world.targetable[hatched].any()
    assert field.why_not(slot, LOCUSTS, point=(50.0, 32.0)) is ActionResult.COOLDOWN
    field.play(int(numbers["spawn_stun_loops"]) + 12)
    assert len(those(field, "LocustMPFlying")) == numbers["count"]
    field.play(150)
    assert all(world.pos[s, 0] > 24.0 for s in those(field, "LocustMPFlying"))
    life = numbers["spawn_stun_loops"] + numbers["locust_life_loops"]
    field.play(int(begun + life - world.loop) - 1)
    assert census(field)["LocustMPFlying"] == numbers["count"]
    field.play(int(numbers["life_random_loops"]) + 3)
    assert "LocustMPFlying" not in census(field)
    field.play(int(record.cooldown_loops - life))
    assert field.why_not(slot, LOCUSTS, point=(50.0, 32.0)) is ActionResult.SUCCESS


def test_locusts_swoop_down_on_what_they_meet(field: Any) -> None:
    world, slot = field.world, field.put("SwarmHostMP", 1, 20, 32)
    enemy = field.put("Disruptor", 2, 34, 32)
    commands.hold(world, [enemy])
    assert field.order(slot, LOCUSTS, point=(34.0, 32.0))
    field.play(140)
    ground = those(field, "LocustMP")
    assert ground
    assert all(math.dist(world.pos[s], world.pos[enemy]) < 5.0 for s in ground)
    assert field.vitals(enemy) < world.life_max[enemy] + world.shields_max[enemy]


@pytest.mark.usefixtures("peace")
def test_a_locust_comes_down_where_it_is_told(field: Any) -> None:
    world, slot = field.world, field.put("LocustMPFlying", 1, 20, 32)
    record = world.catalog.ability(SWOOP)
    assert field.order(slot, SWOOP, point=(24.0, 32.0))
    field.play(3)
    assert world.unit_type(slot).name == "LocustMP"
    assert not world.can_act[slot]
    field.play(int(record.numbers["uncommandable_loops"]))
    assert world.can_act[slot]
    assert math.dist(world.pos[slot], (24.0, 32.0)) < 0.6


# broodlings -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("target", "branch"), [("SiegeTank", "else"), ("Forge", "IsStructure")])
def test_a_brood_lord_throws_broodlings(field: Any, target: str, branch: str) -> None:
    world, lord, enemy = field.world, field.put("BroodLord", 1, 20, 32), field.put(target, 2, 29.5, 32.5)
    if target == "SiegeTank":
        commands.hold(world, [enemy])
    whole = field.vitals(enemy)
    commands.attack_unit(world, [lord], world.tag_of(enemy))
    while not those(field, "Broodling"):
        field.play(1)
        assert world.loop < 60
    (broodling,) = those(field, "Broodling")
    escort = next(w for w in world.catalog.weapons if w.id == "BroodlingEscort")
    hit = next(h for h in escort.hits if h.when == branch and h.damage)
    armor = world.catalog.unit(target).shield_armor
    field.play(2)
    assert whole - field.vitals(enemy) == pytest.approx(hit.damage - armor, abs=4.0)
    assert world.owner[broodling] == 1
    assert world.target[broodling] == enemy
    life = world.catalog.buff("BroodlingFate").loops
    left = world.expires[broodling] - world.loop
    assert life - 3 <= left <= life + MECHANICS.broodling_random_loops + 1


@pytest.mark.parametrize(("name", "count"), [("Hatchery", 9), ("Hive", 9), ("SpawningPool", 6), ("SpineCrawler", 0)])
def test_broodlings_avenge_a_structure(field: Any, name: str, count: int) -> None:
    slot = field.put(name, 1, 32.5, 32.5)
    field.play(2)
    commands.debug_kill(field.world, [field.world.tag_of(slot)])
    field.play(1)
    assert census(field)["Broodling"] == count
    field.play(140)
    assert census(field)["Broodling"] == 0


# Banelings ------------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("peace")
@pytest.mark.parametrize("how", ["told", "killed"])
@pytest.mark.parametrize("name", ["Baneling", "BanelingBurrowed"])
def test_a_baneling_bursts_once(field: Any, name: str, how: str) -> None:
    world, numbers = field.world, field.world.catalog.ability(EXPLODE).numbers
    slot = field.put(name, 1, 32, 32)
    light, heavy = field.put("Marine", 2, 33, 32), field.put("Marauder", 2, 31, 32)
    flyer, friend = field.put("VikingFighter", 2, 32, 33), field.put("Zergling", 1, 32, 31)
    far = field.put("Marauder", 2, 32.0 + numbers["radius"] + 0.7, 32)
    forge = field.put("Forge", 2, 32.5, 34.5)
    units = (light, heavy, flyer, friend, far, forge)
    before = {s: field.vitals(s) for s in units}
    if how == "told":
        assert field.order(slot, EXPLODE)
    else:
        commands.debug_kill(world, [world.tag_of(slot)])
    field.play(2)
    assert not world.alive[slot]
    armor = {s: world.catalog.unit(n).armor for s, n in ((heavy, "Marauder"),)}
    lost = {s: before[s] - (field.vitals(s) if world.alive[s] else 0.0) for s in units}
    assert lost == pytest.approx({
        light: min(numbers["damage_units"] + numbers["bonus_light"], before[light]),
        heavy: numbers["damage_units"] - armor[heavy],
        flyer: 0.0, friend: 0.0, far: 0.0, forge: numbers["damage_structures"],
    }, abs=0.5)  # fmt: skip


@pytest.mark.usefixtures("peace")
def test_banelings_set_each_other_off_and_are_credited_with_whom_they_kill(field: Any) -> None:
    world = field.world
    first, marine = field.put("Baneling", 1, 32, 32), field.put("Marine", 2, 33, 32)
    enemy, own = field.put("Baneling", 2, 31, 32), field.put("Zergling", 1, 29.5, 32)
    world.life[marine] = world.life[enemy] = world.life[own] = 5.0
    commands.debug_kill(world, [world.tag_of(first)])
    field.play(1)
    assert not world.alive[[first, marine, enemy, own]].any()
    assert world.players[1].score.killed_units == 2
    assert world.players[2].score.killed_units == 1


@pytest.mark.usefixtures("peace")
def test_a_baneling_attacks_structures_when_it_is_told_to_look_for_them(field: Any) -> None:
    slot = field.put("Baneling", 1, 32, 32)
    assert field.why_not(slot, BUILDINGS_OFF) is ActionResult.ERROR
    assert field.order(slot, BUILDINGS_ON)
    assert buffs.has(field.world, slot, "VolatileBurstBuilding")
    assert field.why_not(slot, BUILDINGS_ON) is ActionResult.ERROR
    assert field.order(slot, BUILDINGS_OFF)
    assert not buffs.has(field.world, slot, "VolatileBurstBuilding")


# Overseer -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("enemy", "upgrade", "looks"), [
    ("Probe", "", "ChangelingZealot"), ("SCV", "", "ChangelingMarine"), ("SCV", "ShieldWall", "ChangelingMarineShield"),
    ("Drone", "", "ChangelingZergling"), ("Drone", "zerglingmovementspeed", "ChangelingZerglingWings"),
])  # fmt: skip
def test_a_changeling_takes_the_looks_of_the_enemy(field: Any, enemy: str, upgrade: str, looks: str) -> None:
    world, record = field.world, field.world.catalog.ability(CHANGELING)
    overseer = field.put("Overseer", 1, 20, 32)
    world.energy[overseer] = 60.0
    if upgrade:
        field.research(2, upgrade)
    assert field.order(overseer, CHANGELING)
    field.play(2)
    (slot,) = those(field, "Changeling")
    born = world.loop
    assert world.energy[overseer] < 60.0 - record.energy + 1.0
    field.play(20)
    assert world.unit_type(slot).name == "Changeling"
    field.put(enemy, 2, 30, 32)
    field.play(int(world.catalog.buff("ChangelingDisguiseEx3").period_loops) + 1)
    assert world.unit_type(slot).name == looks
    assert world.life[slot] == world.life_max[slot]
    assert not world.can_attack[slot]
    left = world.expires[slot] - born
    assert record.numbers["duration_loops"] - 2 <= left <= record.numbers["duration_loops"] + 6


def test_a_changeling_lives_for_its_time(field: Any) -> None:
    world, overseer = field.world, field.put("Overseer", 1, 20, 32)
    world.energy[overseer] = 60.0
    assert field.order(overseer, CHANGELING)
    field.play(2)
    (slot,) = those(field, "Changeling")
    world.expires[slot] = world.loop + 5
    field.play(6)
    assert not world.alive[slot]


@pytest.mark.usefixtures("peace")
def test_a_contaminated_structure_neither_hatches_nor_trains(field: Any) -> None:
    world, record = field.world, field.world.catalog.ability(CONTAMINATE)
    field.play(2)
    hall, overseer = field.put("Hatchery", 2, 32.5, 32.5), field.put("Overseer", 1, 26, 32)
    world.energy[overseer] = 150.0
    assert field.order(overseer, CONTAMINATE, hall)
    field.play(20)
    assert buffs.has(world, hall, "Contaminated")
    assert world.energy[overseer] < 150.0 - record.energy + 1.0
    assert world.work_rate[hall] == 0.0
    field.play(int(record.numbers["duration_loops"]) - 30)
    assert len(larvae.of(world, hall)) == 0
    field.play(MECHANICS.larva_loops + 60)
    assert len(larvae.of(world, hall)) == 1
    assert world.work_rate[hall] == 1.0


def test_a_nydus_worm_is_hardened_until_it_is_finished(field: Any) -> None:
    world, slot = field.world, field.put("NydusCanal", 1, 32.5, 32.5)
    world.build_progress[slot], more = 0.5, world.catalog.buff("NydusWormArmor").armor_add
    field.play(2)
    assert world.armor_add[slot] == more > 0.0
    world.build_progress[slot] = 1.0
    field.play(2)
    assert world.armor_add[slot] == 0.0


# Corruptor, Lurker ----------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("peace")
def test_caustic_spray_harms_a_structure_more_the_longer_it_lasts(field: Any) -> None:
    world, record = field.world, field.world.catalog.ability(SPRAY)
    numbers, slot, target = record.numbers, field.put("Corruptor", 1, 26, 32), field.put("Nexus", 2, 34.5, 32.5)
    assert field.order(slot, SPRAY, target)
    while not world.channels[slot]:
        field.play(1)
    whole = field.vitals(target)
    first = int(numbers["first_ticks"] * numbers["period_loops"])
    field.play(first)
    assert whole - field.vitals(target) == numbers["first_ticks"] * numbers["damage_per_tick_first"]
    field.play(int(20 * numbers["period_loops"]))
    more = 20 * numbers["damage_per_tick_after"]
    assert whole - field.vitals(target) == numbers["first_ticks"] * numbers["damage_per_tick_first"] + more
    commands.stop(world, [slot])
    field.play(2)
    left = field.vitals(target)
    field.play(20)
    assert field.vitals(target) == left
    assert not buffs.has(world, slot, "ChannelingCausticSpray")
    assert field.why_not(slot, SPRAY, target) is ActionResult.COOLDOWN


def test_a_lurker_that_holds_its_fire_picks_nobody(field: Any) -> None:
    world, slot = field.world, field.put("LurkerMPBurrowed", 1, 32, 32)
    assert field.order(slot, HOLD_FIRE)
    enemy = field.put("Marauder", 2, 36, 32)
    field.play(40)
    assert world.target[slot] == NOBODY
    assert field.order(slot, FREE_FIRE)
    field.play(20)
    assert world.target[slot] == enemy


# Ultralisk, Overseer --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["Slow", "FungalGrowthSlowMovement", "OracleStasisTrapTarget", "TemporalField", "NeuralParasite", "Yoink"]
)
def test_nothing_holds_or_slows_an_ultralisk(field: Any, name: str) -> None:
    for unit, bears in (("Ultralisk", False), ("UltraliskBurrowed", False), ("Roach", True)):
        slot = field.put(unit, 1, 32, 32)
        buffs.apply(field.world, slot, name)
        assert buffs.has(field.world, slot, name) is bears


def test_an_overseer_on_watch_sees_farther_and_stays(field: Any) -> None:
    world, slot = field.world, field.put("Overseer", 1, 32, 32)
    assert field.order(slot, 3743)
    field.play(int(world.catalog.ability(3743).loops) + 2)
    watch, plain = world.catalog.unit("OverseerSiegeMode"), world.catalog.unit("Overseer")
    assert world.unit_type(slot) is watch
    assert world.detects[slot] == watch.detect > plain.detect
    assert world.sight[slot] == watch.sight > plain.sight
    assert not commands.move(world, [slot], (40.0, 32.0))


def test_fungal_growth_uncovers_what_is_burrowed(field: Any) -> None:
    world, slot = field.world, field.put("Infestor", 1, 26, 32)
    world.energy[slot] = 100.0
    roach = field.put("RoachBurrowed", 2, 32, 32)
    field.play(4)
    assert not world.visible[1, roach]
    assert field.order(slot, 74, point=(32.0, 32.0))
    field.play(20)
    assert world.visible[1, roach]
