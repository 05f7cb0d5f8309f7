"""Orbital commands, repair, flying structures, fires, salvage, depots and radar, from the tables."""

from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.terran.buildings import Radar, radars
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

VERSIONS = ("4.10", "5.0.13")
SCAN, MULE, SUPPLIES, REPAIR, MULE_REPAIR, SALVAGE = 399, 171, 255, 316, 78, 32
LIFT_BARRACKS, LAND_BARRACKS, LOWER, RAISE = 452, 554, 556, 558
FLYERS = [
    ("CommandCenter", 417, 419), ("Barracks", 452, 554), ("Factory", 485, 520), ("Starport", 518, 522),
    ("OrbitalCommand", 1522, 1524),
]  # fmt: skip


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


@pytest.fixture(params=VERSIONS)
def foggy(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param, fog=True)


def orbital(field: Any) -> int:
    slot: int = field.put("OrbitalCommand", 1, 5.5, 5.5)
    field.world.energy[slot] = 60.0
    return slot


# scanner sweep --------------------------------------------------------------------------------------------------------


def test_a_sweep_shows_what_is_cloaked_in_its_circle_for_its_time(foggy: Any) -> None:
    world, ability = foggy.world, foggy.world.catalog.ability(SCAN)
    slot, hidden = orbital(foggy), foggy.still("DarkTemplar", 2, 26, 26)
    foggy.play(5)
    assert not world.visible[1, hidden]
    assert foggy.order(slot, SCAN, point=(24, 24))
    assert world.energy[slot] == pytest.approx(60 - ability.energy, abs=0.3)
    assert [(f.effect, f.radius, f.at, f.detects) for f in world.area_effects] == [(6, 13, (24, 24), True)]
    foggy.play(4)
    assert world.visible[1, hidden]
    assert world.visibility[1, 24, 24] == 2
    foggy.play(int(ability.numbers["duration_loops"]) + 1)
    assert not world.area_effects
    foggy.play(4)
    assert not world.visible[1, hidden]
    assert world.visibility[1, 24, 24] == 1


def test_a_sweep_needs_energy_and_of_several_the_one_with_most_is_used(field: Any) -> None:
    world = field.world
    poor, rich = orbital(field), field.put("OrbitalCommand", 1, 14.5, 5.5)
    world.energy[poor], world.energy[rich] = 49.0, 120.0
    assert field.why_not(poor, SCAN, point=(20, 20)) is ActionResult.NOT_ENOUGH_ENERGY
    world.energy[poor] = 55.0
    assert casting.use(world, [poor, rich], world.catalog.ability(SCAN), point=(20, 20))
    assert sorted([world.energy[poor], world.energy[rich]]) in ([5.0, 120.0], [55.0, 70.0])


# MULE -----------------------------------------------------------------------------------------------------------------


def test_a_mule_comes_down_after_its_delay_and_lives_its_time(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(MULE)
    slot = orbital(field)
    assert field.order(slot, MULE, point=(20, 20))
    landed = field.until(lambda: any(world.unit_type(s).name == "MULE" for s in world.live.tolist()))
    assert landed == ability.numbers["delay_loops"]
    mule = next(s for s in world.live.tolist() if world.unit_type(s).name == "MULE")
    assert world.owner[mule] == 1
    gone = field.until(lambda: not world.alive[mule], 1500)
    lasts = ability.numbers["duration_loops"]
    assert lasts <= gone - landed <= lasts + ability.numbers["duration_random_loops"] + 1
    assert [(a.player, a.name) for a in world.alerts] == [(1, "MULEExpired")]


def test_a_mule_is_called_onto_minerals_that_it_mines(field: Any) -> None:
    world = field.world
    slot, patch = orbital(field), field.put("MineralField", 0, 20, 20.5)
    assert field.order(slot, MULE, patch)
    field.play(80)
    mule = next(s for s in world.live.tolist() if world.unit_type(s).name == "MULE")
    assert [o.target for o in world.orders_of(mule)] == [world.tag_of(patch)]


def test_a_mule_is_not_called_onto_units_or_into_the_fog(foggy: Any) -> None:
    slot, marine = orbital(foggy), foggy.still("Marine", 1, 12, 5)
    foggy.play(5)
    assert foggy.why_not(slot, MULE, marine) is ActionResult.MUST_TARGET_RESOURCES
    assert foggy.why_not(slot, MULE, point=(29, 29)) is ActionResult.MUST_TARGET_VISIBLE_LOCATION
    assert foggy.why_not(slot, MULE, point=(8, 10)) is ActionResult.SUCCESS


# extra supplies -------------------------------------------------------------------------------------------------------


def test_extra_supplies_arrive_once_per_depot(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(SUPPLIES)
    slot, depot = orbital(field), field.put("SupplyDepot", 1, 12, 12)
    world.energy[slot] = 150.0
    assert field.order(slot, SUPPLIES, depot)
    assert field.why_not(slot, SUPPLIES, depot) is ActionResult.CANT_TARGET_THAT_UNIT
    field.play(int(ability.numbers["delay_loops"]) - 1)
    assert not buffs.has(world, depot, "SupplyDrop")
    field.play(2)
    assert buffs.has(world, depot, "SupplyDrop")
    assert world.catalog.buff("SupplyDrop").supply == ability.numbers["supply"] == 8
    assert field.why_not(slot, SUPPLIES, depot) is ActionResult.CANT_TARGET_THAT_UNIT
    assert field.why_not(slot, SUPPLIES, slot) is ActionResult.CANT_TARGET_THAT_UNIT


# repair ---------------------------------------------------------------------------------------------------------------


def worker(field: Any, x: float, y: float, minerals: float = 500, vespene: float = 500) -> int:
    slot: int = field.still("SCV", 1, x, y)
    field.world.players[1].minerals, field.world.players[1].vespene = minerals, vespene
    return slot


@pytest.mark.parametrize("name", ["SiegeTank", "SiegeTankSieged", "Battlecruiser", "WidowMine", "Hellion"])
def test_one_worker_mends_at_the_rate_and_price_of_the_tables(field: Any, name: str) -> None:
    world, unit = field.world, field.world.catalog.unit(name)
    other = field.still(name, 1, 12, 10)
    slot = worker(field, 12 - unit.radius - 0.4, 10)
    world.life[other] = unit.life / 2
    assert field.order(slot, REPAIR, other)
    begun = field.until(lambda: world.life[other] > unit.life / 2)
    field.play(40)
    mended = world.life[other] - unit.life / 2
    assert mended == pytest.approx((world.loop - begun + 1) * unit.life / unit.repair_loops)
    share = mended / unit.life * 0.25
    player = world.players[1]
    assert 500 - player.minerals == pytest.approx(unit.cost[0] * share)
    assert 500 - player.vespene == pytest.approx(unit.cost[1] * share)


def test_two_workers_mend_twice_as_fast_and_stop_when_it_is_whole(field: Any) -> None:
    world, unit = field.world, field.world.catalog.unit("Hellion")
    other = field.still("Hellion", 1, 12, 10)
    pair = [worker(field, 10.9, 10), worker(field, 13.1, 10)]
    world.life[other] = 10.0
    for slot in pair:
        field.order(slot, REPAIR, other)
    begun = field.until(lambda: world.life[other] > 10.0)
    done = field.until(lambda: world.life[other] == unit.life)
    assert done - begun == pytest.approx((unit.life - 10) / unit.life * unit.repair_loops / 2, abs=3)
    field.play(2)
    assert [world.order_kind[s] for s in pair] == [0, 0]


def test_repair_stops_when_the_money_is_gone(field: Any) -> None:
    world = field.world
    other = field.still("Battlecruiser", 1, 12, 10)
    slot = worker(field, 10.3, 10, minerals=1.0, vespene=1.0)
    world.life[other] = 100.0
    field.order(slot, REPAIR, other)
    field.play(300)
    assert world.players[1].minerals == pytest.approx(0, abs=0.1)
    assert world.life[other] < 110
    assert world.order_kind[slot] == 0
    assert field.why_not(slot, REPAIR, other) is ActionResult.NOT_ENOUGH_MINERALS


@pytest.mark.parametrize("start", [(4.0, 4.0), (12.5, 4.0), (20.0, 20.0), (8.5, 12.0)])
def test_a_worker_comes_to_a_structure_from_any_side(field: Any, start: tuple[float, float]) -> None:
    world = field.world
    hall = field.put("CommandCenter", 1, 12.5, 12.5)
    world.life[hall] = 1000.0
    slot = worker(field, *start)
    field.order(slot, REPAIR, hall)
    field.until(lambda: world.life[hall] > 1000.0, 300)


def test_a_worker_follows_what_drives_away(field: Any) -> None:
    world = field.world
    other = field.still("SiegeTank", 1, 8, 10)
    slot = worker(field, 6.5, 10)
    world.life[other] = 50.0
    field.order(slot, REPAIR, other)
    field.play(20)
    commands.move(world, [other], (20, 10))
    field.play(150)
    life = world.life[other]
    field.play(20)
    assert world.life[other] > life


@pytest.mark.parametrize(
    ("name", "owner", "life", "why"),
    [("Marine", 1, 10, ActionResult.MUST_TARGET_MECHANICAL_UNITS),
     ("SiegeTank", 2, 10, ActionResult.CANT_TARGET_ENEMY_UNITS),
     ("SiegeTank", 1, 175, ActionResult.REQUIRES_REPAIR_TARGET), ("SiegeTank", 1, 10, ActionResult.SUCCESS)],
)  # fmt: skip
def test_what_can_be_repaired(field: Any, name: str, owner: int, life: float, why: ActionResult) -> None:
    slot, other = worker(field, 10, 10), field.still(name, owner, 12, 10)
    field.world.life[other] = life
    assert field.why_not(slot, REPAIR, other) is why


def test_a_worker_with_autocast_repairs_by_itself(field: Any) -> None:
    world = field.world
    slot, other = worker(field, 10, 10), field.still("SiegeTank", 1, 14, 10)
    world.life[other] = 100.0
    field.play(60)
    assert world.life[other] == 100.0
    world.autocast[slot] = (REPAIR,)
    field.until(lambda: world.life[other] > 100.0, 100)


def test_a_right_click_on_what_is_damaged_means_repair(field: Any) -> None:
    world = field.world
    slot, other = worker(field, 10, 10), field.still("SiegeTank", 1, 12, 10)
    casting.smart(world, [slot], target=world.tag_of(other))
    assert [o.ability for o in world.orders_of(slot)] == [16]
    world.life[other] = 100.0
    casting.smart(world, [slot], target=world.tag_of(other))
    assert [o.ability for o in world.orders_of(slot)] == [REPAIR]


def test_a_mule_repairs_too(field: Any) -> None:
    world = field.world
    slot, other = field.still("MULE", 1, 10, 10), field.still("SiegeTank", 1, 12, 10)
    world.life[other] = 100.0
    world.players[1].minerals = world.players[1].vespene = 100.0
    assert field.order(slot, MULE_REPAIR, other)
    field.until(lambda: world.life[other] > 100.0, 100)


# flying structures ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "lift", "land"), FLYERS)
def test_a_structure_lifts_off_flies_and_lands_again(field: Any, name: str, lift: int, land: int) -> None:
    world = field.world
    slot = field.put(name, 1, 10.5, 10.5)
    world.life[slot] = 700.0
    assert field.order(slot, lift)
    field.until(lambda: world.unit_type(slot).flying)
    assert world.loop == pytest.approx(1 + world.catalog.ability(lift).loops, abs=1.5)
    assert not world.footprint_cells(slot).size
    assert world.ground.walk[10, 10]
    assert field.order(slot, land, point=(20.4, 20.7))
    field.until(lambda: not world.unit_type(slot).flying, 900)
    assert world.unit_type(slot).name == name
    assert world.pos[slot].tolist() == [20.5, 20.5]
    assert world.life[slot] == 700.0
    assert not world.ground.walk[20, 20]


def test_landing_takes_its_time_above_the_place(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(LAND_BARRACKS)
    slot = field.put("BarracksFlying", 1, 12.5, 10.5)
    field.order(slot, LAND_BARRACKS, point=(15.5, 10.5))
    field.until(lambda: world.bound[slot])
    begun = world.loop
    assert world.pos[slot].tolist() == pytest.approx([15.5, 10.5], abs=0.01)
    done = field.until(lambda: not world.unit_type(slot).flying)
    assert done - begun == ability.loops


def test_a_structure_does_not_land_on_others_or_off_the_map(field: Any) -> None:
    slot = field.put("BarracksFlying", 1, 10.5, 10.5)
    field.put("SupplyDepotLowered", 1, 20, 20)
    assert field.why_not(slot, LAND_BARRACKS, point=(20.5, 20.5)) is not ActionResult.SUCCESS
    assert field.why_not(slot, LAND_BARRACKS, point=(0.5, 0.5)) is not ActionResult.SUCCESS
    assert field.why_not(slot, LAND_BARRACKS, point=(14.5, 10.5)) is ActionResult.SUCCESS


def test_an_add_on_stays_behind_and_serves_who_lands_beside_it(field: Any) -> None:
    world = field.world
    slot, lab = field.put("Barracks", 1, 10.5, 10.5), field.put("BarracksTechLab", 1, 13, 10)
    world.addon[slot] = lab
    field.order(slot, LIFT_BARRACKS)
    field.until(lambda: world.unit_type(slot).flying)
    assert world.addon[slot] == NOBODY
    assert world.unit_type(lab).name == "TechLab"
    factory = field.put("FactoryFlying", 1, 10.5, 14.5)
    assert field.order(factory, 520, point=(10.5, 10.5))
    commands.move(world, [slot], (20, 20))
    field.until(lambda: world.unit_type(factory).name == "Factory", 600)
    assert world.addon[factory] == lab
    assert world.unit_type(lab).name == "FactoryTechLab"


# fires ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("share", "burns"), [(0.3, True), (0.34, False)])
def test_a_structure_below_a_third_of_its_life_burns(field: Any, share: float, *, burns: bool) -> None:
    world = field.world
    slot, kind = field.put("Barracks", 1, 10.5, 10.5), world.catalog.buff("TerranBuildingBurnDown")
    world.life[slot] = share * 1000
    begun = field.until(lambda: buffs.has(world, slot, kind.name), 8) if burns else 0
    field.play(160)
    lost = share * 1000 - world.life[slot]
    assert lost == (pytest.approx((world.loop - begun) / kind.period_loops, abs=1) if burns else 0)


def test_a_burning_structure_burns_down_and_nobody_is_credited(field: Any) -> None:
    world = field.world
    slot = field.put("SupplyDepot", 1, 10, 10)
    world.life[slot] = 3.0
    field.until(lambda: not world.alive[slot], 60)
    assert world.deaths[-1].killer == -1


def test_a_bunker_that_holds_marines_burns_as_well(field: Any) -> None:
    world = field.world
    slot, marine = field.put("Bunker", 1, 10.5, 10.5), field.put("Marine", 1, 14, 10)
    lifecycle.stow(world, marine, slot)
    world.life[slot] = 100.0
    field.play(60)
    assert world.life[slot] < 95.0


def test_repair_puts_a_fire_out(field: Any) -> None:
    world = field.world
    slot = field.put("Barracks", 1, 10.5, 10.5)
    world.life[slot] = 300.0
    field.play(8)
    world.life[slot] = 400.0
    field.play(60)
    assert world.life[slot] == 400.0
    assert not buffs.has(world, slot, "TerranBuildingBurnDown")


@pytest.mark.parametrize("name", ["Gateway", "Hatchery"])
def test_structures_of_others_do_not_burn(field: Any, name: str) -> None:
    world = field.world
    slot = field.put(name, 1, 10.5, 10.5)
    world.growth.paint(0, 0, 32, 32)
    world.life[slot] = 100.0
    field.play(60)
    assert world.life[slot] >= 100.0


# salvage --------------------------------------------------------------------------------------------------------------


def test_salvage_gives_three_quarters_back_when_it_is_done(field: Any) -> None:
    world = field.world
    slot = field.put("Bunker", 1, 10.5, 10.5)
    tag = world.tag_of(slot)
    assert field.order(slot, SALVAGE)
    lasts = int(world.catalog.buff("SalvageShared").loops)
    field.play(lasts - 1)
    assert world.players[1].minerals == 0
    field.play(2)
    assert world.slot_of(tag) == NOBODY
    assert world.players[1].minerals == 75
    assert world.players[1].score.lost_structures == 0
    assert world.ground.walk[10, 10]


def test_a_bunker_with_somebody_inside_is_not_salvaged(field: Any) -> None:
    slot, marine = field.put("Bunker", 1, 10.5, 10.5), field.put("Marine", 1, 14, 10)
    lifecycle.stow(field.world, marine, slot)
    assert field.why_not(slot, SALVAGE) is ActionResult.ERROR


# depots and radar -----------------------------------------------------------------------------------------------------


def test_units_walk_over_a_lowered_depot_and_not_over_a_raised_one(field: Any) -> None:
    world = field.world
    depots = [field.put("SupplyDepot", 1, 15, y) for y in range(1, 32, 2)]
    marine = field.still("Marine", 1, 10, 15)
    commands.move(world, [marine], (20, 15))
    field.play(120)
    assert world.pos[marine, 0] < 14
    for depot in depots:
        field.order(depot, LOWER)
    field.play(int(world.catalog.ability(LOWER).loops) + 3)
    assert all(world.unit_type(d).name == "SupplyDepotLowered" for d in depots)
    commands.move(world, [marine], (20, 15))
    field.play(120)
    assert world.pos[marine].tolist() == pytest.approx([20, 15], abs=0.1)


def test_a_rising_depot_moves_aside_who_stands_on_it(field: Any) -> None:
    world = field.world
    depot, marine = field.put("SupplyDepotLowered", 1, 15, 15), field.still("Marine", 1, 15.2, 15.1)
    field.order(depot, RAISE)
    field.play(40)
    assert world.unit_type(depot).name == "SupplyDepot"
    x, y = world.pos[marine].tolist()
    assert max(abs(x - 15), abs(y - 15)) > 1.0
    commands.move(world, [marine], (20, 15))
    field.play(60)
    assert world.pos[marine].tolist() == pytest.approx([20, 15], abs=0.1)


def test_sensor_towers_tell_their_circles(field: Any) -> None:
    field.put("SensorTower", 1, 10.5, 10.5)
    assert radars(field.world) == [Radar(1, (10.5, 10.5), 30.0 if field.world.catalog.version == "4.10" else 27.0)]
    unfinished = field.put("SensorTower", 2, 20.5, 20.5)
    field.world.build_progress[unfinished] = 0.5
    assert len(radars(field.world)) == 1
