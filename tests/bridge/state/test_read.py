from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2, error_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import facts_of
from khala_bridge.state import (
    ActionError,
    Alliance,
    Display,
    Effect,
    EpisodeInfo,
    PictureSizes,
    PlayerScore,
    PlayerState,
    PowerSource,
    Unit,
    UnitOrder,
    read_info,
    read_snapshot,
    read_unit,
)
from khala_bridge.state.grid import NO_GRID, Grid
from khala_protocol.messages import Frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.state import Snapshot

    Make = Callable[..., raw_pb2.Unit]

STALKER = 74
OWN_ONLY = Unit._fields[Unit._fields.index("is_powered") :]
MANY = {
    "tag": 7, "unit_type": STALKER, "owner": 2, "facing": 1.5, "radius": 0.625, "build_progress": 0.5, "health": 40,
    "health_max": 80, "shield": 30, "shield_max": 81, "energy": 20, "energy_max": 200, "is_flying": True,
    "is_burrowed": True, "is_hallucination": True, "mineral_contents": 5, "vespene_contents": 6, "is_powered": True,
    "is_selected": True, "add_on_tag": 11, "engaged_target_tag": 12, "weapon_cooldown": 13, "cargo_space_max": 8,
    "assigned_harvesters": 14, "ideal_harvesters": 16,
}  # fmt: skip
"""Fields that the API has under the names that a unit has them under, each with a value of its own."""


def of(message: raw_pb2.Unit) -> Unit:
    found = read_unit(message, facts_of("multi"))
    assert found is not None
    return found


def full(**fields: Any) -> raw_pb2.Unit:
    message = raw_pb2.Unit(**{**MANY, "pos": common_pb2.Point(x=3, y=4, z=10), "buff_ids": (5, 8), **fields})
    message.orders.add(ability_id=3674, target_unit_tag=99, progress=0.25)
    message.orders.add(ability_id=3794).target_world_space_pos.CopyFrom(common_pb2.Point(x=1, y=2))
    message.orders.add(ability_id=3793)
    message.passengers.add(tag=1, unit_type=73)
    message.passengers.add(tag=2, unit_type=STALKER)
    return message


def see(*units: raw_pb2.Unit, **fields: Any) -> Snapshot:
    response = sc_pb.ResponseObservation()
    response.observation.raw_data.units.extend(units)
    return read_snapshot(response, EpisodeInfo(facts_of("multi")), **fields)


# --- a unit -----------------------------------------------------------------------------------------------------


def test_a_unit_has_what_the_api_says_of_it() -> None:
    found = of(full(alliance=raw_pb2.Self, cloak=raw_pb2.CloakedDetected))
    assert {name: getattr(found, name) for name in MANY} == MANY
    assert (found.name, found.facts and found.facts.id) == ("Stalker", STALKER)
    assert (found.alliance, found.display_type) == (Alliance.OWN, Display.VISIBLE)
    assert found.pos == WorldPoint(3, 4)
    assert found.is_cloaked
    assert found.buff_ids == (5, 8)
    assert found.buffs == ("GravitonBeam", "PowerUserWarpable")
    assert found.passengers == ("Zealot", "Stalker")
    assert found.orders == (
        UnitOrder(3674, target_unit_tag=99, progress=0.25),
        UnitOrder(3794, target_world_space_pos=WorldPoint(1, 2)),
        UnitOrder(3793),
    )
    assert [order.name for order in found.orders] == ["Attack", "Move", "HoldPosition"]


@pytest.mark.parametrize("alliance", ["Ally", "Enemy", "Neutral"])
def test_what_only_own_units_tell_is_empty_for_all_others(alliance: str) -> None:
    found = of(full(alliance=raw_pb2.Alliance.Value(alliance)))
    assert {name: getattr(found, name) for name in OWN_ONLY} == {name: Unit._field_defaults[name] for name in OWN_ONLY}
    assert found.health == 40
    assert found.buff_ids == (5, 8)


@pytest.mark.parametrize(
    ("alliance", "whose"), [("Self", "is_own"), ("Ally", ""), ("Enemy", "is_enemy"), ("Neutral", "is_neutral")]
)
def test_whose_a_unit_is(alliance: str, whose: str) -> None:
    found = of(raw_pb2.Unit(tag=1, alliance=raw_pb2.Alliance.Value(alliance)))
    assert [name for name in ("is_own", "is_enemy", "is_neutral") if getattr(found, name)] == [whose] * bool(whose)


@pytest.mark.parametrize(
    ("cloak", "is_cloaked"),
    [("Cloaked", True), ("CloakedDetected", True), ("CloakedAllied", True), ("NotCloaked", False)],
)
def test_a_unit_that_is_detected_is_cloaked_all_the_same(cloak: str, is_cloaked: bool) -> None:
    assert of(raw_pb2.Unit(tag=1, cloak=raw_pb2.CloakState.Value(cloak))).is_cloaked is is_cloaked


def test_a_type_that_nobody_knows_has_a_name_and_no_facts() -> None:
    found = of(raw_pb2.Unit(tag=1, unit_type=99999))
    assert (found.name, found.facts, found.is_structure) == ("Unit99999", None, False)
    assert found.planes == {"ground"}


@pytest.mark.parametrize(
    ("name", "fields", "planes"),
    [
        ("Stalker", {}, {"ground"}),
        ("Stalker", {"buff_ids": (5,)}, {"air"}),  # held up by a Phoenix
        ("Colossus", {}, {"ground", "air"}),
        ("VoidRay", {"is_flying": True}, {"air"}),
        ("Nexus", {}, {"ground"}),
    ],
)
def test_where_weapons_find_a_unit(name: str, fields: dict[str, Any], planes: set[str], unit: Make) -> None:
    found = of(unit(1, name, 3, 4, **fields))
    assert found.planes == planes
    assert found.is_structure == (name == "Nexus")


# --- all units --------------------------------------------------------------------------------------------------


def test_units_stand_in_the_order_of_their_tags() -> None:
    seen = see(*(raw_pb2.Unit(tag=tag, alliance=raw_pb2.Self) for tag in (5, 2, 9)))
    assert list(seen.known) == list(seen.units) == [unit.tag for unit in seen.own] == [2, 5, 9]


def test_what_is_remembered_is_known_and_not_in_sight() -> None:
    shown = ((1, raw_pb2.Visible), (2, raw_pb2.Snapshot), (3, raw_pb2.Hidden), (0, raw_pb2.Placeholder))
    seen = see(*(raw_pb2.Unit(tag=tag, display_type=how, alliance=raw_pb2.Enemy) for tag, how in shown))
    assert list(seen.known) == [1, 2, 3]
    assert list(seen.units) == [1, 3]
    assert [unit.is_remembered for unit in seen.known.values()] == [False, True, False]


# --- the rest ---------------------------------------------------------------------------------------------------


def test_a_snapshot_has_the_account_of_the_player() -> None:
    names = PlayerState._fields
    response = sc_pb.ResponseObservation()
    for number, name in enumerate(names, 1):
        setattr(response.observation.player_common, name, number)
    response.observation.game_loop = 224
    seen = read_snapshot(response, EpisodeInfo(facts_of("multi")))
    assert seen.player == PlayerState(*range(1, len(names) + 1))
    assert seen.game_loop == 224


def test_a_snapshot_has_upgrades_power_effects_and_warnings() -> None:
    response = sc_pb.ResponseObservation()
    raw = response.observation.raw_data
    raw.player.upgrade_ids.extend((87, 84))
    raw.player.camera.x, raw.player.camera.y = 20, 30
    raw.player.power_sources.add(tag=8, radius=6.5).pos.CopyFrom(common_pb2.Point(x=1, y=2))
    effect = raw.effects.add(effect_id=1, alliance=raw_pb2.Enemy, radius=1.5)
    effect.pos.add(x=3, y=4)
    effect.pos.add(x=5, y=6)
    response.observation.alerts.extend((sc_pb.MineralsExhausted, sc_pb.NuclearLaunchDetected))
    seen = read_snapshot(response, EpisodeInfo(facts_of("multi")))
    assert seen.upgrades == ("WarpGateResearch", "Blink")
    assert seen.camera == WorldPoint(20, 30)
    assert seen.power_sources == (PowerSource(8, WorldPoint(1, 2), 6.5),)
    assert seen.effects == (Effect(1, Alliance.ENEMY, 1.5, (WorldPoint(3, 4), WorldPoint(5, 6))),)
    assert seen.alerts == ("MineralsExhausted", "NuclearLaunchDetected")


def test_the_score_counts_minerals_and_vespene_of_every_kind() -> None:
    response = sc_pb.ResponseObservation()
    score = response.observation.score
    score.score = 1234
    kinds = ("none", "army", "economy", "technology", "upgrade")
    for number, kind in enumerate(kinds):
        setattr(score.score_details.killed_minerals, kind, 10**number)
        setattr(score.score_details.killed_vespene, kind, 2 * 10**number)
        setattr(score.score_details.lost_minerals, kind, 4 * 10**number)
    assert read_snapshot(response, EpisodeInfo(facts_of("multi"))).score == PlayerScore(
        total=1234, killed=33333, lost=44444
    )


def test_who_died_and_what_was_refused_adds_up_until_an_agent_is_asked() -> None:
    response = sc_pb.ResponseObservation()
    response.observation.raw_data.event.dead_units.extend((3, 4))
    response.action_errors.add(unit_tag=5, ability_id=23, result=error_pb2.CantTargetAirUnits)
    earlier = ActionError(1, 2, "NotEnoughMinerals")
    seen = read_snapshot(response, EpisodeInfo(facts_of("multi")), dead=frozenset({1}), errors=(earlier,))
    assert seen.dead == {1, 3, 4}
    assert seen.errors == (earlier, ActionError(5, 23, "CantTargetAirUnits"))


@pytest.mark.parametrize(("result", "outcome"), [("Victory", "win"), ("Defeat", "loss"), ("Tie", "draw")])
def test_the_result_is_that_of_the_player(result: str, outcome: str) -> None:
    response = sc_pb.ResponseObservation()
    response.observation.player_common.player_id = 2
    response.player_result.add(player_id=1, result=sc_pb.Undecided)
    response.player_result.add(player_id=2, result=sc_pb.Result.Value(result))
    assert read_snapshot(response, EpisodeInfo(facts_of("multi")), ended=True).outcome == outcome


def test_while_it_plays_there_is_no_result() -> None:
    assert see().outcome is None


def test_grids_of_the_moment_keep_their_bytes() -> None:
    response = sc_pb.ResponseObservation()
    assert (see().creep, see().visibility) == (NO_GRID, NO_GRID)
    size = common_pb2.Size2DI(x=8, y=1)
    state = response.observation.raw_data.map_state
    state.creep.CopyFrom(common_pb2.ImageData(bits_per_pixel=1, size=size, data=b"\x80"))
    state.visibility.CopyFrom(common_pb2.ImageData(bits_per_pixel=8, size=size, data=b"\2" * 8))
    seen = read_snapshot(response, EpisodeInfo(facts_of("multi")))
    assert seen.creep == Grid(8, 1, 1, b"\x80")
    assert seen.visibility == Grid(8, 1, 8, b"\2" * 8)


def test_a_snapshot_does_not_change_with_its_message() -> None:
    response = sc_pb.ResponseObservation()
    response.observation.raw_data.units.add(tag=1, health=10, alliance=raw_pb2.Self)
    seen = read_snapshot(response, EpisodeInfo(facts_of("multi")))
    response.observation.raw_data.units[0].health = 5
    assert seen.units[1].health == 10
    assert dataclasses.replace(seen, abilities={1: frozenset({23})}).units is seen.units


# --- the episode ------------------------------------------------------------------------------------------------


def test_an_episode_has_its_map_and_the_sizes_of_pictures() -> None:
    message = sc_pb.ResponseGameInfo()
    raw, options = message.start_raw, message.options
    raw.map_size.x, raw.map_size.y = 96, 60
    raw.playable_area.p0.y, raw.playable_area.p1.x, raw.playable_area.p1.y = 23, 96, 52
    raw.start_locations.add(x=20.50004, y=30.5)
    raw.placement_grid.CopyFrom(common_pb2.ImageData(bits_per_pixel=1, size=common_pb2.Size2DI(x=8, y=1), data=b"\xff"))
    options.feature_layer.width = 24
    options.feature_layer.resolution.x = options.feature_layer.resolution.y = 128
    options.feature_layer.minimap_resolution.x = options.feature_layer.minimap_resolution.y = 64
    found = read_info(message, facts_of("multi"))
    assert (found.size, found.playable) == ((96, 60), (0, 23, 96, 52))
    assert found.starts == (WorldPoint(20.5, 30.5),)
    assert (found.placement, found.pathing) == (Grid(8, 1, 1, b"\xff"), NO_GRID)
    assert found.pictures == PictureSizes((128, 128), (64, 64), 24, 0)
    frame = found.frame(Frames(minimap=48))
    assert (frame.width, frame.height, frame.playable, frame.minimap_size) == (96, 60, (0, 23, 96, 52), 48)
