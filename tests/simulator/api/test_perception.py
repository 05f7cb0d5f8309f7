"""What a player knows of units that are hidden, remembered, carried or under a spell."""

from __future__ import annotations

from typing import Any

import pytest
from s2clientprotocol import raw_pb2, ui_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.abilities import casting
from khala_simulator.api.observation import observe
from khala_simulator.api.sight import Display
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.process.client import command
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tick import advance
from khala_simulator.world.world import Mishap

RAW = sc.InterfaceOptions(raw=True, raw_affects_selection=True)
FEATURES = sc.InterfaceOptions(raw=True, raw_affects_selection=True)
FEATURES.feature_layer.resolution.x = FEATURES.feature_layer.resolution.y = 32
FEATURES.feature_layer.minimap_resolution.x = FEATURES.feature_layer.minimap_resolution.y = 32
SIEGE, HEAL, MOVE = 388, 386, 16


def units(table: Any, **wanted: int) -> list[raw_pb2.Unit]:
    told = table.observe().raw_data.units
    return [unit for unit in told if all(getattr(unit, name) == value for name, value in wanted.items())]


def is_snapshot(unit: raw_pb2.Unit) -> bool:
    return unit.display_type == raw_pb2.Snapshot


# snapshots ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def fogged(make_table: Any) -> Any:
    """Return a table with fog: a marine near the left edge, and an enemy pylon far to the right."""
    table = make_table(RAW, fog=True)
    table.marine = table.put("Marine", 1, 4, 16)
    table.pylon = table.put("Pylon", 2, 26, 16)
    advance(table.world, 8)
    return table


def walk(table: Any, x: float) -> None:
    table.world.pos[table.marine] = x, 16.0
    advance(table.world, 8)


def test_what_was_never_seen_is_not_told(fogged: Any) -> None:
    assert units(fogged, alliance=raw_pb2.Enemy) == []


@pytest.mark.parametrize("through_fog", [False, True])
def test_a_death_in_the_fog_is_not_told_to_who_has_looked_through_it(fogged: Any, through_fog: bool) -> None:
    world, tag = fogged.world, int(fogged.world.tag[fogged.pylon])
    units(fogged)
    seen = b"".join(observe(fogged.game, fogged.seat, disable_fog=through_fog))
    told = sc.ResponseObservation.FromString(seen).observation.raw_data.units
    assert (tag in {unit.tag for unit in told}) is through_fog
    world.life[fogged.pylon] = 0
    advance(world, 2)
    assert tag in {death.tag for death in world.deaths}
    assert list(fogged.observe().raw_data.event.dead_units) == []


def test_a_structure_stays_as_a_snapshot_when_the_fog_closes(fogged: Any) -> None:
    walk(fogged, 20.0)
    (seen,) = units(fogged, alliance=raw_pb2.Enemy)
    assert seen.display_type == raw_pb2.Visible
    walk(fogged, 4.0)
    (remembered,) = units(fogged, alliance=raw_pb2.Enemy)
    assert is_snapshot(remembered)
    assert remembered.tag != seen.tag
    assert remembered.tag >> 32 == 2
    assert (remembered.unit_type, remembered.pos.x, remembered.pos.y) == (seen.unit_type, seen.pos.x, seen.pos.y)
    assert not remembered.HasField("health")
    assert remembered.cloak == raw_pb2.CloakedUnknown


def test_a_snapshot_keeps_its_tag_and_outlives_the_structure_until_its_place_is_seen(fogged: Any) -> None:
    walk(fogged, 20.0)
    walk(fogged, 4.0)
    (before,) = units(fogged, alliance=raw_pb2.Enemy)
    fogged.world.life[fogged.pylon] = 0.0
    advance(fogged.world, 8)
    (after,) = units(fogged, alliance=raw_pb2.Enemy)
    assert after.tag == before.tag
    walk(fogged, 20.0)
    assert units(fogged, alliance=raw_pb2.Enemy) == []


def test_what_moves_leaves_no_snapshot(fogged: Any) -> None:
    fogged.put("Zergling", 2, 27, 16)
    walk(fogged, 20.0)
    assert len(units(fogged, alliance=raw_pb2.Enemy)) == 2
    walk(fogged, 4.0)
    assert [is_snapshot(unit) for unit in units(fogged, alliance=raw_pb2.Enemy)] == [True]


def test_neutral_things_are_snapshots_from_the_start(make_table: Any) -> None:
    table = make_table(RAW, fog=True)
    table.put("Marine", 1, 4, 16)
    table.put("MineralField", 0, 26, 16)
    advance(table.world, 4)
    (field,) = units(table, alliance=raw_pb2.Neutral)
    assert is_snapshot(field)


def test_without_fog_there_are_no_snapshots(make_table: Any) -> None:
    table = make_table(RAW)
    table.put("Marine", 1, 4, 16)
    table.put("Pylon", 2, 26, 16)
    advance(table.world, 8)
    assert [int(unit.display_type) for unit in units(table, alliance=raw_pb2.Enemy)] == [Display.VISIBLE]


def test_an_attack_on_a_snapshot_goes_to_its_place(fogged: Any) -> None:
    walk(fogged, 20.0)
    walk(fogged, 4.0)
    (remembered,) = units(fogged, alliance=raw_pb2.Enemy)
    tag = fogged.world.tag_of(fogged.marine)
    fogged.game.act(1, command(23, [tag], target=remembered.tag))
    fogged.game.step(1)
    (marine,) = units(fogged, alliance=raw_pb2.Self)
    point = marine.orders[0].target_world_space_pos
    assert (point.x, point.y) == (remembered.pos.x, remembered.pos.y)


# on units -------------------------------------------------------------------------------------------------------------


def test_buffs_are_told_of_everybody_and_how_long_they_last_of_own_units(make_table: Any) -> None:
    table = make_table(RAW)
    mine, theirs = table.put("Marine", 1, 10, 16), table.put("Marine", 2, 20, 16)
    stim = table.world.catalog.buff("Stimpack")
    for slot in (mine, theirs):
        buffs.apply(table.world, slot, "Stimpack")
    advance(table.world, 10)
    (own,), (enemy,) = units(table, alliance=raw_pb2.Self), units(table, alliance=raw_pb2.Enemy)
    assert list(own.buff_ids) == list(enemy.buff_ids) == [stim.id]
    assert own.buff_duration_max == int(stim.loops)
    assert own.buff_duration_remain == int(stim.loops) - 10
    assert not enemy.HasField("buff_duration_remain")


def test_the_order_of_a_unit_that_prepares_tells_its_progress(make_table: Any) -> None:
    table = make_table(RAW)
    slot = table.put("SiegeTank", 1, 10, 16)
    casting.use(table.world, [slot], table.world.catalog.ability(SIEGE))
    advance(table.world, 1)
    begun = units(table)[0].orders[0].progress
    advance(table.world, 30)
    later = units(table)[0].orders[0].progress
    assert begun < 0.1
    assert 0.3 < later < 0.7


def test_a_transport_tells_who_is_inside(make_table: Any) -> None:
    table = make_table(FEATURES)
    carrier, marine = table.put("Medivac", 1, 10, 16), table.put("Marine", 1, 10, 17)
    tag = table.world.tag_of(marine)
    lifecycle.stow(table.world, marine, carrier)
    (told,) = units(table)
    assert [(p.tag, p.unit_type, p.health) for p in told.passengers] == [(tag, 48, 45.0)]
    assert (told.cargo_space_taken, told.cargo_space_max) == (1, 8)


def test_an_order_that_failed_on_the_way_is_an_action_error_once(make_table: Any) -> None:
    table = make_table(RAW)
    tag = table.world.tag_of(table.put("Marine", 1, 10, 16))
    table.world.mishaps.append(Mishap(1, 1, tag, 380, ActionResult.NOT_ENOUGH_ENERGY))
    table.world.mishaps.append(Mishap(1, 2, tag, 380, ActionResult.COOLDOWN))
    errors = table.respond().action_errors
    assert [(e.unit_tag, e.ability_id, e.result) for e in errors] == [(tag, 380, 17)]
    assert not table.respond().action_errors


@pytest.mark.parametrize("by", ["tags", "selection"])
def test_autocast_is_switched_off_and_on(make_table: Any, by: str) -> None:
    table = make_table(FEATURES)
    slot = table.put("Medivac", 1, 10, 16)
    tag = table.world.tag_of(slot)
    assert table.world.autocast[slot] == (HEAL,)
    action = sc.Action()
    if by == "tags":
        action.action_raw.toggle_autocast.ability_id = HEAL
        action.action_raw.toggle_autocast.unit_tags.append(tag)
    else:
        table.seat.selection.choose([tag])
        action.action_ui.toggle_autocast.ability_id = HEAL
    for expected in ((), (HEAL,)):
        table.game.act(1, action)
        table.game.step(1)
        assert table.world.autocast[slot] == expected
        (told,) = table.respond().actions  # PySC2 knows the words of the panel only
        assert told.action_ui.toggle_autocast.ability_id == told.action_raw.toggle_autocast.ability_id == HEAL
        assert list(told.action_raw.toggle_autocast.unit_tags) == [tag]


def test_a_panel_of_cargo_that_is_not_there_is_no_fault(make_table: Any) -> None:
    table = make_table(FEATURES)
    table.seat.selection.choose([table.world.tag_of(table.put("Medivac", 1, 10, 16))])
    click = sc.Action(action_ui=ui_pb2.ActionUI(cargo_panel=ui_pb2.ActionCargoPanelUnload(unit_index=0)))
    assert table.game.act(1, click) == 3
    table.game.step(1)
    assert not table.observe().ui_data.HasField("cargo")


def test_images_are_counted_nowhere(make_table: Any) -> None:
    table = make_table(RAW)
    table.put("Zealot", 1, 10, 16)
    before = table.observe().player_common
    image = table.put("Probe", 1, 12, 16)
    table.world.hallucination[image] = True
    assert table.observe().player_common == before


@pytest.mark.parametrize(("ability", "on_minimap"), [(298, False), (1, True)])
def test_a_command_at_what_is_off_the_screen_is_told_as_a_click_that_clients_know(
    make_table: Any, ability: int, *, on_minimap: bool
) -> None:
    table = make_table(FEATURES)
    probe, field = table.put("Probe", 1, 10, 16), table.put("MineralField", 0, 30, 16)
    table.game.act(1, command(ability, [table.world.tag_of(probe)], target=table.world.tag_of(field)))
    table.game.step(1)
    (told,) = [a for a in table.respond().actions if a.action_feature_layer.HasField("unit_command")]
    click = told.action_feature_layer.unit_command
    assert click.HasField("target_minimap_coord") == on_minimap
    if not on_minimap:
        assert (click.target_screen_coord.x, click.target_screen_coord.y) == (31, 16)
