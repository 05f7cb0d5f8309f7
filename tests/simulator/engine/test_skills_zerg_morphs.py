"""Zerg that change: burrowing and coming up, cocoons and larger structures, crawlers, creep tumors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.economy import supply
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND, load_catalog
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import MOVE, OrderKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.abilities import Ability

VERSIONS = ("4.10", "5.0.13")
FLAT = "{flat: [64, 64]}"
PLANT, QUEEN_TUMOR, QUEUE_CANCEL = 1733, 1694, 304
CENTRE = (32.5, 32.5)


def rules(does: str, *, named: str = "") -> list[Any]:
    """Return (version, ability) of every ability with this skill on the card of a type of the version.

    One that is the same as in the first version is left to the long tests.
    """
    found, usual = [], load_catalog(VERSIONS[0]).abilities
    for version in VERSIONS:
        catalog = load_catalog(version)
        for ability in catalog.abilities:
            users = [u for u in ability.users if ability in catalog.abilities_of(catalog.unit(u).row)]
            fits = ability.effect == does and ability.name.startswith(named) and users
            if fits and catalog.unit(users[0]).race == "zerg":
                same = version != VERSIONS[0] and any(a == ability and a.numbers == ability.numbers for a in usual)
                marks = [pytest.mark.slow] if same or ability.name == "Morph Hive" else []  # 3 s, and as a Lair
                found.append(pytest.param(version, ability, id=f"{version}-{ability.name}", marks=marks))
    return found


def ready(make_field: Callable[..., Any], version: str, *upgrades: str) -> Any:
    """Return a wide field whose first player has all structures and means, on creep."""
    field = make_field(FLAT, version=version)
    field.world.growth.paint(0, 0, 64, 64)
    player = field.world.players[1]
    player.cheats.append("tech_tree")
    player.minerals, player.vespene = 1000.0, 1000.0
    for number in range(30):
        field.put("Overlord", 1, 2.0 + number % 10, 2.0 + number // 10)
    field.research(1, *upgrades)
    return field


# burrowing ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "ability"), rules("morph", named="Burrow"))
def test_burrowing_and_coming_up_take_their_time(
    make_field: Callable[..., Any], version: str, ability: Ability
) -> None:
    field = ready(make_field, version)
    world, slot = field.world, field.put(ability.users[0], 1, *CENTRE)
    world.life[slot] *= 0.5
    half = float(world.life[slot])
    assert len(ability.users) == 1
    assert field.order(slot, ability.id)
    began = world.loop + 1
    while world.type[slot] != world.catalog.unit(ability.unit).row:
        field.play(1)
        assert world.loop - began <= ability.loops + ability.random_loops + 1
    assert world.loop - began >= ability.loops - 1
    assert world.burrowed[slot] == world.catalog.unit(ability.unit).burrowed
    assert world.life[slot] >= half
    assert world.order_kind[slot] == OrderKind.IDLE


@pytest.mark.parametrize("version", VERSIONS)
def test_most_units_burrow_only_with_the_upgrade(make_field: Callable[..., Any], version: str) -> None:
    field = make_field(version=version)
    able = {}
    for param in rules("morph", named="BurrowDown"):
        _, ability = param.values
        able[ability.id] = field.put(ability.users[0], 1, 10, 16)
        free = ability.users[0] == "LurkerMP"
        expected = ActionResult.SUCCESS if free else ActionResult.TECH_REQUIREMENTS_NOT_MET
        assert field.why_not(able[ability.id], ability.id) is expected
    assert len(able) > 10
    field.research(1, "Burrow")
    assert {field.why_not(slot, number) for number, slot in able.items()} == {ActionResult.SUCCESS}


def test_what_is_burrowed_is_neither_seen_nor_attacks(make_field: Callable[..., Any]) -> None:
    field = ready(make_field, "4.10")
    world = field.world
    slot, enemy = field.put("ZerglingBurrowed", 1, *CENTRE), field.put("Marine", 2, 33, 32)
    field.play(100)
    assert not world.visible[2, slot]
    assert world.target[slot] == world.target[enemy] == NOBODY
    assert not commands.attack_unit(world, [slot], world.tag_of(enemy))
    field.put("Raven", 2, 33, 34)
    field.play(20)
    assert world.visible[2, slot]


def test_a_burrowed_lurker_attacks(make_field: Callable[..., Any]) -> None:
    field = ready(make_field, "4.10")
    field.put("LurkerMPBurrowed", 1, *CENTRE)
    enemy = field.put("Marauder", 2, 36, 32)
    field.play(40)
    assert field.vitals(enemy) < field.world.life_max[enemy]


def test_orders_wait_until_a_unit_is_burrowed(make_field: Callable[..., Any]) -> None:
    field = ready(make_field, "4.10")
    world, slot = field.world, field.put("Infestor", 1, *CENTRE)
    assert field.order(slot, 1444)
    field.play(2)
    commands.move(world, [slot], (40.0, 32.0))
    field.play(3)
    assert world.unit_type(slot).name == "Infestor"
    assert world.pos[slot].tolist() == list(CENTRE)
    field.play(20)
    assert world.unit_type(slot).name == "InfestorBurrowed"
    assert world.pos[slot, 0] > CENTRE[0]


def test_burrowing_can_be_called_off(make_field: Callable[..., Any]) -> None:
    field = ready(make_field, "4.10")
    slot = field.put("Hydralisk", 1, *CENTRE)
    assert field.why_not(slot, 1383) is ActionResult.CANT_FIND_CANCEL_ORDER
    assert field.order(slot, 1382)
    field.play(3)
    assert field.order(slot, 1383)
    field.play(60)
    assert field.world.unit_type(slot).name == "Hydralisk"


@pytest.mark.parametrize("version", VERSIONS)
def test_burrowed_roaches_heal_and_walk_with_their_upgrade(make_field: Callable[..., Any], version: str) -> None:
    field = ready(make_field, version)
    world, slot = field.world, field.put("RoachBurrowed", 1, *CENTRE)
    world.life[slot] = 50.0
    assert commands.move(world, [slot], (40.0, 32.5)) == []
    assert casting.refusal(world, slot, world.catalog.ability(MOVE)) is ActionResult.UNIT_CANT_MOVE
    field.play(32)
    healed = world.catalog.unit("RoachBurrowed").life_regen_n / LOOPS_PER_NORMAL_SECOND * 32
    assert world.life[slot] == pytest.approx(50.0 + healed)
    field.research(1, "TunnelingClaws")
    assert casting.refusal(world, slot, world.catalog.ability(MOVE)) is ActionResult.SUCCESS
    assert commands.move(world, [slot], (40.0, 32.5)) == [slot]
    field.play(32)
    claws = next(c.value for c in world.catalog.upgrade("TunnelingClaws").changes if c.field == "Speed")
    factor = world.catalog.unit("RoachBurrowed").creep_factor
    assert world.pos[slot, 0] - CENTRE[0] == pytest.approx(claws / LOOPS_PER_NORMAL_SECOND * 31 * factor, rel=0.05)


@pytest.mark.parametrize("version", VERSIONS)
def test_adaptive_talons_shorten_the_lurkers_way_down(make_field: Callable[..., Any], version: str) -> None:
    field = ready(make_field, version, "DiggingClaws")
    world, slot, ability = field.world, field.put("LurkerMP", 1, *CENTRE), field.world.catalog.ability(2108)
    cut = {c.field: c.value * LOOPS_PER_NORMAL_SECOND for c in world.catalog.upgrade("DiggingClaws").changes
           if c.catalog == "abil"}  # fmt: skip
    stats = next(value for name, value in cut.items() if "[Stats]" in name)
    delay = next(value for name, value in cut.items() if name.endswith("RandomDelayMax"))
    assert field.order(slot, ability.id)
    while not world.burrowed[slot]:
        field.play(1)
    assert ability.loops - stats <= world.loop <= ability.loops - stats + ability.random_loops - delay + 2


@pytest.mark.parametrize(("name", "comes_up"), [("Marine", True), ("Banshee", False)])
def test_with_autocast_a_burrowed_unit_comes_up_for_enemies_near(
    make_field: Callable[..., Any], name: str, *, comes_up: bool
) -> None:
    field = ready(make_field, "4.10")
    slot = field.put("ZerglingBurrowed", 1, *CENTRE)
    field.world.autocast[slot] = (1392,)
    field.put(name, 2, 38, 32.5)
    field.play(20)
    assert field.world.burrowed[slot]
    field.put(name, 2, 34.5, 32.5)
    field.play(20)
    assert field.world.burrowed[slot] != comes_up


# cocoons and larger structures ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "ability"), rules("grow"))
def test_a_morph_is_paid_at_its_beginning_and_ends_after_its_time(
    make_field: Callable[..., Any], version: str, ability: Ability
) -> None:
    field = ready(make_field, version)
    world, player = field.world, field.world.players[1]
    slot = field.put(ability.users[0], 1, *CENTRE)
    before, cocoon = world.unit_type(slot).name, ability.numbers.get("cocoon", ability.users[0])
    assert field.order(slot, ability.id)
    while player.minerals == 1000.0 and player.vespene == 1000.0:
        field.play(1)
        assert world.loop <= ability.random_loops + 2
    began = world.loop
    assert (player.minerals, player.vespene) == (1000.0 - ability.minerals, 1000.0 - ability.vespene)
    assert world.unit_type(slot).name == cocoon
    commands.stop(world, [slot])
    field.play(int(ability.loops / 2))
    assert world.unit_type(slot).name == cocoon
    assert world.orders_of(slot)[0].progress == pytest.approx(0.5, abs=0.02)
    while world.unit_type(slot).name == cocoon:
        field.play(1)
        assert world.loop - began <= ability.loops + 1
    assert world.unit_type(slot).name == ability.unit != before
    assert world.loop - began >= ability.loops
    assert world.life[slot] == world.life_max[slot]
    field.play(1)
    assert world.order_kind[slot] == OrderKind.IDLE


@pytest.mark.parametrize(("version", "ability"), rules("grow"))
def test_a_morph_called_off_gives_the_unit_and_most_of_the_price_back(
    make_field: Callable[..., Any], version: str, ability: Ability
) -> None:
    field = ready(make_field, version)
    world, player = field.world, field.world.players[1]
    slot = field.put(ability.users[0], 1, *CENTRE)
    assert field.order(slot, ability.id)
    field.play(20)
    own = [a for a in world.catalog.abilities if a.effect == "cancel_growth" and a.link == ability.link]
    cancel = own[0] if own else world.catalog.ability(QUEUE_CANCEL)  # as 4.10's Baneling cocoon has it
    assert field.order(slot, cancel.id)
    field.play(2)
    assert world.unit_type(slot).name == ability.users[0]
    assert player.minerals == 1000.0 - ability.minerals + int(0.75 * ability.minerals)
    assert player.vespene == 1000.0 - ability.vespene + int(0.75 * ability.vespene)
    assert field.why_not(slot, cancel.id) is ActionResult.CANT_FIND_CANCEL_ORDER


@pytest.mark.parametrize(("version", "ability"), rules("grow"))
def test_a_morph_needs_its_price(make_field: Callable[..., Any], version: str, ability: Ability) -> None:
    field = ready(make_field, version)
    slot, player = field.put(ability.users[0], 1, *CENTRE), field.world.players[1]
    player.minerals = ability.minerals - 1.0
    assert field.why_not(slot, ability.id) is ActionResult.NOT_ENOUGH_MINERALS
    player.minerals, player.vespene = float(ability.minerals), ability.vespene - 1.0
    assert field.why_not(slot, ability.id) is ActionResult.NOT_ENOUGH_VESPENE
    player.cheats.clear()
    assert field.why_not(slot, ability.id) is ActionResult.TECH_REQUIREMENTS_NOT_MET


@pytest.mark.parametrize("version", VERSIONS)
def test_a_cocoon_uses_the_supply_of_what_hatches(make_field: Callable[..., Any], version: str) -> None:
    field = ready(make_field, version)
    slot = field.put("Roach", 1, *CENTRE)
    before = supply.in_use(field.world, 1)
    assert field.order(slot, 2330)
    field.play(20)
    more = field.world.catalog.unit("Ravager").supply - field.world.catalog.unit("Roach").supply
    assert supply.in_use(field.world, 1) == before + more


# crawlers -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("name", "up", "down"), [("SpineCrawler", 1725, 1729), ("SporeCrawler", 1727, 1731)])
def test_a_crawler_walks_to_another_place_and_takes_root_there(
    make_field: Callable[..., Any], version: str, name: str, up: int, down: int
) -> None:
    field = ready(make_field, version)
    world, slot = field.world, field.put(name, 1, 32, 32)
    assert field.order(slot, up)
    field.play(int(world.catalog.ability(up).loops) + 2)
    assert world.unit_type(slot).name == name + "Uprooted"
    assert world.ground.walk[32, 32]
    assert field.order(slot, down, point=(40.2, 32.1))
    while world.cast_at[slot] < 0.0:
        field.play(1)
        assert world.loop < 300
    began = world.loop
    while world.unit_type(slot).name != name:
        field.play(1)
    assert world.loop - began == world.catalog.ability(down).loops
    assert world.pos[slot].tolist() == [40.0, 32.0]
    assert not world.ground.walk[32, 40]


@pytest.mark.parametrize(
    ("point", "why"),
    [
        ((40.0, 32.0), ActionResult.SUCCESS),
        ((60.0, 60.0), ActionResult.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE),
        ((32.5, 40.5), ActionResult.CANT_BUILD_ON_THAT),
        ((0.0, 0.0), ActionResult.CANT_BUILD_LOCATION_INVALID),
    ],
)
def test_a_crawler_takes_root_on_free_creep_only(
    make_field: Callable[..., Any], point: tuple[float, float], why: ActionResult
) -> None:
    field = make_field(FLAT)
    field.world.growth.paint(20, 20, 50, 50)
    field.put("Hatchery", 2, 32.5, 40.5)
    slot = field.put("SpineCrawlerUprooted", 1, 32, 32)
    assert field.why_not(slot, 1729, point=point) is why


# creep tumors ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_tumor_grows_burrows_and_plants_one_other(make_field: Callable[..., Any], version: str) -> None:
    field = ready(make_field, version)
    world, queen = field.world, field.put("Queen", 1, *CENTRE)
    world.energy[queen] = 60.0
    plant, build = world.catalog.ability(PLANT), world.catalog.ability(QUEEN_TUMOR)
    assert field.order(queen, QUEEN_TUMOR, point=(34.3, 32.2))
    kind = world.catalog.unit("CreepTumorQueen").row
    while kind not in world.type[world.live]:
        field.play(1)
        assert world.loop < 100
    assert world.energy[queen] < 60.0 - build.energy + 2.0
    (tumor,) = world.live[world.type[world.live] == kind].tolist()
    planted = world.loop
    assert world.pos[tumor].tolist() == [34.5, 32.5]
    while world.build_progress[tumor] < 1.0:
        field.play(1)
    assert world.loop - planted == pytest.approx(build.loops, abs=1)
    burrow, grown = world.catalog.ability(1662), world.loop
    while not world.burrowed[tumor]:
        field.play(1)
    assert burrow.loops <= world.loop - grown <= burrow.loops + burrow.random_loops + 3
    assert field.why_not(tumor, PLANT, point=(40.5, 32.5)) is ActionResult.COOLDOWN
    field.play(grown + int(plant.numbers["first_use_after_loops"]) - 1 - world.loop)
    assert field.why_not(tumor, PLANT, point=(40.5, 32.5)) is ActionResult.COOLDOWN
    field.play(1)
    far = 34.5 + plant.range + float(world.radius[tumor]) + 0.6
    assert field.why_not(tumor, PLANT, point=(far, 32.5)) is ActionResult.TARGET_IS_OUT_OF_RANGE
    assert field.order(tumor, PLANT, point=(far - 1.0, 32.5))
    field.play(2)
    (child,) = world.live[world.type[world.live] == world.catalog.unit("CreepTumor").row].tolist()
    assert 266 <= world.build_loops[child] <= 281  # recorded games
    field.play(2000)
    assert field.why_not(tumor, PLANT, point=(40.5, 32.5)) is ActionResult.COOLDOWN


@pytest.mark.parametrize(
    ("point", "why"),
    [
        ((34.0, 32.0), ActionResult.SUCCESS),
        ((60.0, 60.0), ActionResult.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE),
        ((32.5, 40.5), ActionResult.CANT_BUILD_ON_THAT),
        ((-3.0, 5.0), ActionResult.CANT_BUILD_LOCATION_INVALID),
    ],
)
def test_a_tumor_needs_free_creep(
    make_field: Callable[..., Any], point: tuple[float, float], why: ActionResult
) -> None:
    field = make_field(FLAT)
    field.world.growth.paint(20, 20, 50, 50)
    field.put("Hatchery", 2, 32.5, 40.5)
    queen = field.put("Queen", 1, 32, 32)
    field.world.energy[queen] = 100.0
    assert field.why_not(queen, QUEEN_TUMOR, point=point) is why


def test_every_time_in_these_tests_is_a_number() -> None:
    for param in rules("grow") + rules("morph", named="Burrow"):
        _, ability = param.values
        assert math.isfinite(ability.loops)
        assert ability.loops > 0.0
