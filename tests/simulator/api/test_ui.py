"""What the interface shows of production, cargo and the economy, and what clicks on it do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.abilities import casting, commands
from khala_simulator.api import debug
from khala_simulator.api.actions import judge, perform
from khala_simulator.combat import lifecycle
from khala_simulator.economy import harvesting
from khala_simulator.process.client import interface
from khala_simulator.tick import advance

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulator.api.conftest import Table

PROBE, MARINE = 1006, 560


@pytest.fixture
def table(make_table: Callable[..., Table]) -> Table:
    table = make_table(interface(screen=32), "{flat: [64, 64]}")
    table.world.players[1].minerals = table.world.players[1].vespene = 1000.0
    table.world.players[1].cheats.append("food")
    return table


def train(table: Table, slot: int, number: int, times: int = 1) -> None:
    for _ in range(times):
        assert casting.use(table.world, [slot], table.world.catalog.ability(number))


def unit(table: Table, slot: int) -> raw_pb2.Unit:
    tag = table.world.tag_of(slot)
    return next(u for u in table.observe().raw_data.units if u.tag == tag)


def select(table: Table, *slots: int) -> None:
    table.seat.selection.choose([table.world.tag_of(s) for s in slots])


# panels ---------------------------------------------------------------------------------------------------------------


def test_a_structure_that_makes_something_has_the_production_panel(table: Table) -> None:
    nexus = table.put("Nexus", 1, 30.5, 30.5)
    train(table, nexus, PROBE, 2)
    advance(table.world, 136)
    select(table, nexus)
    ui = table.observe().ui_data
    assert not ui.HasField("single")
    assert ui.production.unit.unit_type == 59
    assert [(item.ability_id, item.build_progress) for item in ui.production.production_queue] == [
        (PROBE, 0.5),
        (PROBE, 0),
    ]
    assert [item.unit_type for item in ui.production.build_queue] == [84, 84]


def test_a_click_on_the_production_panel_calls_a_job_off(table: Table) -> None:
    nexus = table.put("Nexus", 1, 30.5, 30.5)
    train(table, nexus, PROBE, 2)
    select(table, nexus)
    click = sc.Action()
    click.action_ui.production_panel.unit_index = 1
    assert judge(table.seat, click).result == 1
    perform(table.seat, click, 1)
    assert len(table.world.jobs[nexus]) == 1
    assert judge(table.seat, click).result != 1


def test_a_transport_with_somebody_inside_has_the_cargo_panel(table: Table) -> None:
    prism, zealot = table.put("WarpPrism", 1, 30.0, 30.0), table.put("Zealot", 1, 30.0, 32.0)
    lifecycle.stow(table.world, zealot, prism)
    select(table, prism)
    ui = table.observe().ui_data
    assert [passenger.unit_type for passenger in ui.cargo.passengers] == [73]
    assert ui.cargo.slots_available == 6


# units ----------------------------------------------------------------------------------------------------------------


def test_a_structure_that_makes_something_is_active_and_its_orders_have_progress(table: Table) -> None:
    nexus = table.put("Nexus", 1, 30.5, 30.5)
    assert not unit(table, nexus).is_active
    train(table, nexus, PROBE)
    advance(table.world, 136)
    seen = unit(table, nexus)
    assert seen.is_active
    assert [(order.ability_id, order.progress) for order in seen.orders] == [(PROBE, 0.5)]


def test_town_halls_tell_how_many_workers_they_have_and_want(table: Table) -> None:
    nexus = table.put("Nexus", 1, 30.5, 30.5)
    fields = [table.put("MineralField", 0, 37.0, y) for y in (28.5, 30.5, 32.5)]
    gas = table.put("Assimilator", 1, 24.5, 30.5)
    probes = [table.put("Probe", 1, 33.5, 29.0 + i) for i in range(4)]
    commands.gather(table.world, probes[:3], table.world.tag_of(fields[1]))
    commands.gather(table.world, probes[3:], table.world.tag_of(gas))
    told = {slot: (u.assigned_harvesters, u.ideal_harvesters) for slot in (nexus, gas) for u in [unit(table, slot)]}
    assert told == {nexus: (3, 6), gas: (1, 3)}


def test_resources_tell_what_is_left_in_them(table: Table) -> None:
    field, geyser = table.put("MineralField", 0, 37.0, 30.5), table.put("VespeneGeyser", 0, 24.5, 30.5)
    table.world.contents[field] = 1795
    assert (unit(table, field).mineral_contents, unit(table, geyser).vespene_contents) == (1795, 2250)


def test_power_is_told_of_structures_that_need_it(table: Table) -> None:
    table.put("Pylon", 1, 30.0, 30.0)
    near, far = table.put("Gateway", 1, 33.5, 30.5), table.put("Gateway", 1, 50.5, 50.5)
    advance(table.world)
    assert [unit(table, slot).is_powered for slot in (near, far)] == [True, False]


def test_rally_points_are_told(table: Table) -> None:
    nexus, field = table.put("Nexus", 1, 30.5, 30.5), table.put("MineralField", 0, 37.0, 30.5)
    casting.smart(table.world, [nexus], target=table.world.tag_of(field))
    (rally,) = unit(table, nexus).rally_targets
    assert (rally.point.x, rally.point.y, rally.tag) == (37.0, 30.5, table.world.tag_of(field))


@pytest.mark.parametrize("shown", [True, False])
def test_what_is_going_to_be_built_has_a_placeholder(make_table: Callable[..., Table], shown: bool) -> None:
    options = interface(screen=32)
    options.show_placeholders = shown
    table = make_table(options, "{flat: [64, 64]}")
    table.world.players[1].minerals = 200.0
    probe, pylon = table.put("Probe", 1, 16.0, 16.0), table.world.catalog.ability(881)
    casting.use(table.world, [probe], pylon, point=(22.2, 16.0))
    casting.use(table.world, [probe], pylon, point=(26.0, 16.0), queue=True)
    told = [u for u in table.observe().raw_data.units if u.display_type == raw_pb2.Placeholder]
    assert [(u.unit_type, u.pos.x, u.alliance) for u in told] == [(60, 22.0, 1), (60, 26.0, 1)] * shown
    assert table.screen("placeholder").any() == shown


# the player -----------------------------------------------------------------------------------------------------------


def test_blizzards_own_example_of_the_counters(make_table: Callable[..., Table]) -> None:
    table = make_table(interface(screen=0))
    for i in range(10):
        table.put("Zealot", 1, 4.0 + i, 6.0)
        table.put("Probe", 1, 4.0 + i, 10.0)
    table.put("Pylon", 1, 8.0, 20.0)
    table.put("Pylon", 1, 14.0, 20.0)
    common = table.observe().player_common
    assert (common.army_count, common.food_army, common.food_used, common.food_cap) == (10, 20, 30, 16)
    assert (common.food_workers, common.idle_worker_count) == (10, 10)


def test_what_is_begun_uses_supply(table: Table) -> None:
    barracks = table.put("Barracks", 1, 30.5, 30.5)
    train(table, barracks, MARINE, 2)
    advance(table.world)
    assert table.observe().player_common.food_used == 1


def test_the_score_knows_what_was_collected_and_spent(table: Table) -> None:
    nexus, field = table.put("Nexus", 1, 30.5, 30.5), table.put("MineralField", 0, 37.0, 30.5)
    probe = table.put("Probe", 1, 34.0, 30.5)
    commands.gather(table.world, [probe], table.world.tag_of(field))
    train(table, nexus, PROBE)
    advance(table.world, 130)
    details = table.observe().score.score_details
    assert (details.collected_minerals, details.spent_minerals) == (5.0, 50.0)
    assert details.collection_rate_minerals == pytest.approx(5 * 60 * 22.4 / table.world.loop)
    assert harvesting.workers_per_resource(table.world)[field] == 1


def test_alerts_are_told_once(table: Table) -> None:
    nexus = table.put("Nexus", 1, 30.5, 30.5)
    train(table, nexus, PROBE)
    advance(table.world, 272)
    assert list(table.observe().alerts) == [sc.TrainWorkerComplete]
    assert list(table.observe().alerts) == []


# debug ----------------------------------------------------------------------------------------------------------------


def switch(table: Table, state: debug_pb2.DebugGameState.ValueType) -> None:
    debug.execute(table.world, 1, debug_pb2.DebugCommand(game_state=state))


@pytest.mark.parametrize(
    ("state", "name"),
    [
        (debug_pb2.food, "food"),
        (debug_pb2.free, "free"),
        (debug_pb2.god, "god"),
        (debug_pb2.cooldown, "cooldown"),
        (debug_pb2.tech_tree, "tech_tree"),
        (debug_pb2.fast_build, "fast_build"),
        (debug_pb2.control_enemy, "control_enemy"),
    ],
)
def test_debug_states_are_switched_on_and_off(
    make_table: Callable[..., Table], state: debug_pb2.DebugGameState.ValueType, name: str
) -> None:
    table = make_table(interface(screen=0))
    switch(table, state)
    assert table.world.players[1].cheats == [name]
    switch(table, state)
    assert table.world.players[1].cheats == []


def test_the_tech_tree_needs_nothing(table: Table) -> None:
    barracks = table.put("Barracks", 1, 30.5, 30.5)
    marauder = table.world.catalog.ability(563)
    assert not casting.use(table.world, [barracks], marauder)
    switch(table, debug_pb2.tech_tree)
    assert casting.use(table.world, [barracks], marauder) == [barracks]


def test_gods_take_no_damage(table: Table) -> None:
    switch(table, debug_pb2.god)
    marine, foe = table.put("Marine", 1, 30.0, 30.0), table.put("Zealot", 2, 31.0, 30.0)
    advance(table.world, 60)
    assert table.world.life[marine] == 45.0
    assert table.world.shields[foe] < 50.0


def test_all_upgrades_come_at_once_and_the_first_of_those_with_levels(table: Table) -> None:
    switch(table, debug_pb2.upgrade)
    names = [table.world.catalog.upgrade(number).name for number in table.world.players[1].upgrades]
    assert {"Stimpack", "BlinkTech", "TerranInfantryWeaponsLevel1"} <= set(names)
    assert not [name for name in names if name.endswith(("Level2", "Level3"))]
    assert len(names) == len(set(names)) > 40


def test_enemies_obey_when_a_player_controls_them(table: Table) -> None:
    foe = table.put("Zealot", 2, 31.0, 30.0)
    action = sc.Action()
    action.action_raw.unit_command.ability_id = 16
    action.action_raw.unit_command.unit_tags.append(table.world.tag_of(foe))
    action.action_raw.unit_command.target_world_space_pos.x = 40.0
    action.action_raw.unit_command.target_world_space_pos.y = 40.0
    assert judge(table.seat, action).result != 1
    switch(table, debug_pb2.control_enemy)
    assert judge(table.seat, action).result == 1
