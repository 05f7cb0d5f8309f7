"""Construction: where structures may stand, how each race builds, what cancelling gives back, add-ons."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.economy import building_sites, supply
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()
BUILD = {
    "Pylon": 881, "Gateway": 883, "Nexus": 880, "Assimilator": 882, "SupplyDepot": 319, "Barracks": 321,
    "Refinery": 320, "Extractor": 1154, "SpawningPool": 1155, "Hatchery": 1152, "CyberneticsCore": 894,
}  # fmt: skip
CANCEL, HALT, TECHLAB, REACTOR, CANCEL_ADDON = 314, 315, 421, 422, 451


@pytest.fixture
def field(make_field: Callable[..., Field]) -> Field:
    """Return level ground, and plenty of everything for player 1."""
    field = make_field("{flat: [64, 64]}")
    field.world.players[1].minerals = field.world.players[1].vespene = 2000.0
    return field


def order(field: Field, slot: int, number: int, **aim: object) -> list[int]:
    return casting.use(field.world, [slot], CATALOG.ability(number), **aim)  # type: ignore[arg-type]  # a short name for tests


def find(field: Field, name: str) -> int:
    """Return the only living unit of a type."""
    row = CATALOG.unit(name).row
    (slot,) = (s for s in field.world.live.tolist() if field.world.type[s] == row)
    return int(slot)


def has(field: Field, name: str) -> bool:
    return bool((field.world.type[field.world.live] == CATALOG.unit(name).row).any())


def placed(field: Field, name: str, limit: int = 200) -> int:
    """Play until a structure is begun; return its slot."""
    for _ in field.loops(limit):
        if has(field, name):
            return find(field, name)
    raise AssertionError(f"no {name}")


# how each race builds -------------------------------------------------------------------------------------------------


def test_a_probe_places_and_goes(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    assert order(field, probe, BUILD["Pylon"], point=(26.0, 20.0)) == [probe]
    assert field.world.players[1].minerals == 2000.0  # paid when it is placed
    commands.move(field.world, [probe], (10.0, 20.0), queue=True)
    pylon = placed(field, "Pylon")
    begun = field.world.loop
    assert field.world.players[1].minerals == 1900.0
    assert field.world.build_progress[pylon] < 0.01
    field.play(2)
    assert field.world.orders_of(probe)[0].point == (10.0, 20.0)
    assert supply.cap(field.world, 1) == 0.0
    while field.world.build_progress[pylon] < 1.0:
        field.play(1)
    assert field.world.loop - begun == 400  # as in recorded games
    assert supply.cap(field.world, 1) == 8.0


def test_life_and_shields_grow_with_the_work(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    order(field, probe, BUILD["Pylon"], point=(22.0, 20.0))
    pylon = placed(field, "Pylon")
    assert field.world.life[pylon] == pytest.approx(20.0, abs=1.0)
    field.play(200)
    assert field.world.build_progress[pylon] == pytest.approx(0.5)
    assert (field.world.life[pylon], field.world.shields[pylon]) == (pytest.approx(110.0), pytest.approx(110.0))
    field.play(200)
    assert (field.world.life[pylon], field.world.shields[pylon]) == (pytest.approx(200.0), pytest.approx(200.0))


def test_an_scv_stays_until_it_is_done(field: Field) -> None:
    scv = field.put("SCV", 1, 20.0, 20.0)
    order(field, scv, BUILD["SupplyDepot"], point=(24.0, 20.0))
    depot = placed(field, "SupplyDepot")
    field.play(240)
    (now,) = field.world.orders_of(scv)
    assert now.ability == BUILD["SupplyDepot"]
    assert field.world.build_progress[depot] == pytest.approx(0.5, abs=0.01)
    field.play(242)
    assert field.world.build_progress[depot] == 1.0
    assert field.world.orders_of(scv) == []


@pytest.mark.parametrize("name", ["SupplyDepot", "Refinery"])
@pytest.mark.parametrize("waits", [True, False])
def test_who_finishes_a_refinery_and_has_nothing_else_to_do_gathers(field: Field, name: str, *, waits: bool) -> None:
    scv, geyser = field.put("SCV", 1, 20.0, 20.0), field.put("VespeneGeyser", 0, 26.5, 20.5)
    field.put("CommandCenter", 1, 16.5, 20.5)
    aim = {"target": field.world.tag_of(geyser)} if name == "Refinery" else {"point": (24.0, 26.0)}
    order(field, scv, BUILD[name], **aim)
    built = placed(field, name)
    if waits:
        commands.move(field.world, [scv], (20.0, 10.0), queue=True)
    field.until(lambda: field.world.build_progress[built] >= 1.0)
    orders = [o.ability for o in field.world.orders_of(scv)]
    assert orders == ([16] if waits else [295] if name == "Refinery" else [])
    if orders == [295]:
        field.until(lambda: field.world.players[1].vespene > 2000.0)


def test_nothing_grows_while_nobody_builds_and_another_scv_can_go_on(field: Field) -> None:
    scv, other = field.put("SCV", 1, 20.0, 20.0), field.put("SCV", 1, 18.0, 20.0)
    order(field, scv, BUILD["SupplyDepot"], point=(24.0, 20.0))
    depot = placed(field, "SupplyDepot")
    field.play(100)
    assert order(field, depot, HALT) == [depot]
    left = float(field.world.build_progress[depot])
    field.play(50)
    assert field.world.build_progress[depot] == pytest.approx(left, abs=0.005)
    casting.smart(field.world, [other], target=field.world.tag_of(depot))
    field.play(480)
    assert field.world.build_progress[depot] == 1.0


def test_a_drone_becomes_what_it_builds_and_comes_back_when_it_is_called_off(field: Field) -> None:
    drone, tag = field.put("Drone", 1, 20.0, 20.0), field.world.tag_of(field.put("Drone", 1, 30.0, 30.0))
    geyser = field.put("VespeneGeyser", 0, 26.5, 20.5)
    order(field, drone, BUILD["Extractor"], target=field.world.tag_of(geyser))
    extractor = placed(field, "Extractor")
    assert field.world.players[1].minerals == 2000.0 - 25.0
    assert supply.in_use(field.world, 1) == 1.0
    order(field, extractor, CANCEL)
    assert supply.in_use(field.world, 1) == 2.0
    assert field.world.players[1].minerals == 2000.0 - 25.0 + int(25 * 0.75)
    assert field.world.slot_of(tag) > 0
    assert field.world.occupant[geyser] < 0


def test_a_gas_structure_has_what_its_geyser_has(field: Field) -> None:
    probe, geyser = field.put("Probe", 1, 20.0, 20.0), field.put("RichVespeneGeyser", 0, 26.5, 20.5)
    order(field, probe, BUILD["Assimilator"], target=field.world.tag_of(geyser))
    assimilator = placed(field, "AssimilatorRich")
    assert field.world.contents[assimilator] == 2250
    assert field.world.pos[assimilator].tolist() == [26.5, 20.5]
    field.play(481)
    commands.gather(field.world, [probe], field.world.tag_of(assimilator))
    field.play(120)
    assert field.world.load[probe] == 8
    assert field.world.contents[geyser] == field.world.contents[assimilator] == 2242


def test_calling_off_gives_three_quarters_back(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    order(field, probe, BUILD["Pylon"], point=(22.0, 20.0))
    pylon = placed(field, "Pylon")
    tag = field.world.tag_of(pylon)
    order(field, pylon, CANCEL)
    assert field.world.players[1].minerals == 2000.0 - 100.0 + 75.0
    assert field.world.slot_of(tag) < 0


def test_an_unfinished_structure_does_nothing(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    order(field, probe, BUILD["Nexus"], point=(26.5, 20.5))
    nexus = placed(field, "Nexus")
    assert not order(field, nexus, 1006)
    assert field.world.sight[nexus] == 4.0
    assert field.world.shield_regen[nexus] == 0.0
    assert not field.world.can_act[nexus]


# where ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "point", "refusal"),
    [
        ("Pylon", (30.0, 30.0), ActionResult.SUCCESS),
        ("Pylon", (-3.0, 30.0), ActionResult.CANT_BUILD_LOCATION_INVALID),
        ("Pylon", (40.0, 40.0), ActionResult.CANT_BUILD_ON_THAT),  # a structure
        ("Pylon", (50.0, 20.0), ActionResult.CANT_BUILD_ON_THAT),  # an enemy's unit
        ("Pylon", (52.0, 30.0), ActionResult.SUCCESS),  # one's own unit makes room
        ("Nexus", (26.5, 20.5), ActionResult.SUCCESS),  # three cells from the mineral field
        ("Nexus", (25.5, 20.5), ActionResult.CANT_BUILD_TOO_CLOSE_TO_RESOURCES),
        ("Gateway", (43.5, 40.5), ActionResult.SUCCESS),
        ("Gateway", (30.5, 30.5), ActionResult.CANT_BUILD_TOO_FAR_FROM_POWER),
        ("SpawningPool", (30.5, 30.5), ActionResult.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE),
        ("Assimilator", (10.5, 50.5), ActionResult.SUCCESS),
        ("Assimilator", (30.5, 50.5), ActionResult.CANT_BUILD_LOCATION_INVALID),
    ],
)
def test_where_a_structure_may_stand(
    field: Field, name: str, point: tuple[float, float], refusal: ActionResult
) -> None:
    field.put("Pylon", 1, 40.0, 40.0)
    field.put("Zergling", 2, 50.0, 20.0)
    field.put("Zealot", 1, 52.0, 30.0)
    field.put("MineralField", 0, 20.0, 20.5)
    field.put("VespeneGeyser", 0, 10.5, 50.5)
    assert building_sites.refusal(field.world, 1, CATALOG.unit(name), point) is refusal


def test_what_stands_in_the_way_when_the_builder_comes_ends_the_order(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    order(field, probe, BUILD["Pylon"], point=(30.0, 20.0))
    field.play(5)
    field.put("PhotonCannon", 1, 30.0, 20.0)
    field.play(80)
    assert not has(field, "Pylon")
    assert field.world.players[1].minerals == 2000.0
    assert field.world.mishaps[0].refusal is ActionResult.CANT_BUILD_ON_THAT


def test_of_two_builders_with_the_price_of_one_structure_the_later_one_stands_idle(field: Field) -> None:
    field.world.players[1].minerals = 150.0
    early, late = field.put("Probe", 1, 20.0, 20.0), field.put("Probe", 1, 20.0, 30.0)
    assert order(field, early, BUILD["Pylon"], point=(26.0, 20.0)) == [early]
    assert order(field, late, BUILD["Pylon"], point=(30.0, 30.0)) == [late]  # nothing is paid yet
    field.play(100)
    assert find(field, "Pylon")
    assert field.world.players[1].minerals == 50.0
    assert field.world.mishaps[0].refusal is ActionResult.NOT_ENOUGH_MINERALS
    assert not field.world.orders_of(late)


def test_builders_whose_place_another_one_has_taken_stand_idle(field: Field) -> None:
    for x in range(9):
        order(field, field.put("Drone", 1, 20.0 + x, 20.0), BUILD["Hatchery"], point=(32.0, 32.0))
    placed(field, "Hatchery")
    field.play(300)  # they crowd around it, and push each other away from where its edge is nearest to its middle
    drones = [slot for slot in field.world.live.tolist() if field.world.unit_type(slot).name == "Drone"]
    assert len(drones) == 8
    assert not any(field.world.orders_of(drone) for drone in drones)


@pytest.mark.parametrize(("name", "hidden"), [("ZerglingBurrowed", True), ("DarkTemplar", True), ("Zergling", False)])
def test_a_builder_finds_out_on_the_site_what_its_player_does_not_see(field: Field, name: str, *, hidden: bool) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    field.still(name, 2, 30.0, 20.0)
    field.play(2)
    known = order(field, probe, BUILD["Pylon"], point=(30.0, 20.0))
    assert known == ([probe] if hidden else [])
    field.play(120)
    assert not has(field, "Pylon")
    assert [mishap.refusal for mishap in field.world.mishaps] == [ActionResult.CANT_BUILD_ON_THAT] * hidden


def test_a_structure_needs_what_comes_before_it(field: Field) -> None:
    probe = field.put("Probe", 1, 20.0, 20.0)
    core = CATALOG.ability(BUILD["CyberneticsCore"])
    assert casting.refusal(field.world, probe, core) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.put("Gateway", 1, 30.5, 30.5)
    assert casting.refusal(field.world, probe, core) is ActionResult.SUCCESS


# add-ons --------------------------------------------------------------------------------------------------------------


def test_a_tech_lab_is_built_at_the_side_and_lets_marauders_be_trained(field: Field) -> None:
    barracks = field.put("Barracks", 1, 30.5, 30.5)
    marauder = CATALOG.ability(563)
    assert casting.refusal(field.world, barracks, marauder) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    order(field, barracks, TECHLAB)
    lab = find(field, "BarracksTechLab")
    assert field.world.pos[lab].tolist() == [33.0, 30.0]
    assert (field.world.players[1].minerals, field.world.players[1].vespene) == (1950.0, 1975.0)
    assert casting.refusal(field.world, barracks, CATALOG.ability(560)) is ActionResult.CANT_QUEUE_THAT_ORDER
    field.play(401)
    assert field.world.addon[barracks] == lab
    field.put("SupplyDepot", 1, 10.0, 10.0)
    assert casting.refusal(field.world, barracks, marauder) is ActionResult.SUCCESS


@pytest.mark.parametrize(
    ("ability", "name", "loops"), [(TECHLAB, "BarracksTechLab", 400), (REACTOR, "BarracksReactor", 800)]
)
def test_an_add_on_takes_its_time_from_the_loop_in_which_it_is_first_seen(
    field: Field, ability: int, name: str, loops: int
) -> None:
    barracks = field.put("Barracks", 1, 20.5, 20.5)
    order(field, barracks, ability)
    field.play(1)
    site = find(field, name)
    field.play(loops - 1)
    assert field.world.build_progress[site] < 1.0
    field.play(1)
    assert field.world.build_progress[site] == 1.0


def test_a_refinery_takes_as_long_as_its_extractor(field: Field) -> None:
    geyser, scv = field.put("VespeneGeyser", 0, 30.5, 30.5), field.put("SCV", 1, 20.5, 20.5)
    order(field, scv, BUILD["Refinery"], target=field.world.tag_of(geyser))
    site = placed(field, "Refinery")
    field.play(480 - 1)
    assert field.world.build_progress[site] < 1.0
    field.play(1)
    assert field.world.build_progress[site] == 1.0


def test_an_add_on_can_be_called_off(field: Field) -> None:
    barracks = field.put("Barracks", 1, 30.5, 30.5)
    order(field, barracks, REACTOR)
    order(field, barracks, CANCEL_ADDON)
    assert not has(field, "BarracksReactor")
    assert barracks not in field.world.jobs
    assert (field.world.players[1].minerals, field.world.players[1].vespene) == (1950.0 + 37.0, 1950.0 + 37.0)


def test_an_add_on_needs_its_place(field: Field) -> None:
    barracks = field.put("Barracks", 1, 30.5, 30.5)
    field.put("SupplyDepot", 1, 33.0, 30.0)
    assert casting.refusal(field.world, barracks, CATALOG.ability(TECHLAB)) is ActionResult.CANT_BUILD_ON_THAT
