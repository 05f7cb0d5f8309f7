"""What actions do, when and how they are reported, and that no action is an error of usage."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import common_pb2, debug_pb2, error_pb2, raw_pb2, spatial_pb2, ui_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.casting import is_modelled
from khala_simulator.api import game
from khala_simulator.api.abilities import usable
from khala_simulator.maps.game_map import load_map
from khala_simulator.process.client import Client, command, interface
from khala_simulator.process.status import Status
from khala_simulator.tables.abilities import Ability
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tick import advance, new_game
from khala_simulator.world.world import World

OBSERVER, STALKER, ZEALOT, PROBE, PHOENIX, NEXUS = 82, 74, 73, 84, 78, 59
BLINK, GENERAL_BLINK = 1442, 3687
GENERAL_STOP, GENERAL_HOLD, GENERAL_MOVE, GENERAL_PATROL, GENERAL_ATTACK = 3665, 3793, 3794, 3795, 3674
ABILITIES = tuple({a.id: a for card in load_catalog().cards for a in card if is_modelled(a)}.values())
Result = error_pb2.ActionResult
Point = spatial_pb2.ActionSpatialUnitSelectionPoint
Group = ui_pb2.ActionControlGroup
Panel = ui_pb2.ActionMultiPanel
Worker = ui_pb2.ActionSelectIdleWorker


def make(unit_type: int, owner: int, *points: tuple[float, float]) -> list[debug_pb2.DebugCommand]:
    units = [
        debug_pb2.DebugCreateUnit(unit_type=unit_type, owner=owner, pos=common_pb2.Point2D(x=x, y=y), quantity=1)
        for x, y in points
    ]
    return [debug_pb2.DebugCommand(create_unit=unit) for unit in units]


def stage(*units: debug_pb2.DebugCommand, options: sc.InterfaceOptions | None = None) -> Client:
    """Return a game with these units instead of the map's own."""
    client = Client()
    first = client.play(options=options)
    tags = [unit.tag for unit in first.observation.raw_data.units]
    client.debug(*units, debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags)))
    client.step()
    return client


def tags(client: Client, unit_type: int | None = None, alliance: int = raw_pb2.Self) -> list[int]:
    units = client.observe().observation.raw_data.units
    return [u.tag for u in units if u.alliance == alliance and unit_type in (None, u.unit_type)]


def selected(client: Client) -> list[int]:
    return [unit.tag for unit in client.observe().observation.raw_data.units if unit.is_selected]


def click(ability: int, pixel: tuple[int, int] | None = None, *, minimap: bool = False) -> sc.Action:
    action = sc.Action()
    order = action.action_feature_layer.unit_command
    order.ability_id = ability
    if pixel is not None:
        target = order.target_minimap_coord if minimap else order.target_screen_coord
        target.x, target.y = pixel
    return action


def select_point(pixel: tuple[int, int], how: Any = Point.Select) -> sc.Action:
    action = sc.Action()
    point = action.action_feature_layer.unit_selection_point
    point.type = how
    point.selection_screen_coord.x, point.selection_screen_coord.y = pixel
    return action


def select_box(p0: tuple[int, int], p1: tuple[int, int], *, add: bool = False) -> sc.Action:
    action = sc.Action()
    drag = action.action_feature_layer.unit_selection_rect
    box = drag.selection_screen_coord.add()
    (box.p0.x, box.p0.y), (box.p1.x, box.p1.y) = p0, p1
    drag.selection_add = add
    return action


def ui(**panel: Any) -> sc.Action:
    return sc.Action(action_ui=ui_pb2.ActionUI(**panel))


# commands -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "target", "specific"),
    [
        (1, (20.0, 16.0), 1),
        (GENERAL_STOP, None, 4), (4, None, 4),
        (GENERAL_MOVE, (20.0, 16.0), 16), (16, (20.0, 16.0), 16),
        (GENERAL_PATROL, (20.0, 16.0), 17), (17, (20.0, 16.0), 17),
        (GENERAL_HOLD, None, 18), (18, None, 18),
        (GENERAL_ATTACK, (20.0, 16.0), 23), (23, (20.0, 16.0), 23),
    ],
)  # fmt: skip
def test_a_command_is_reported_with_its_specific_ability(
    asked: int, target: tuple[float, float] | None, specific: int
) -> None:
    client = stage(*make(STALKER, 1, (16, 16), (14, 16)))
    assert client.act(command(asked, tags(client), point=target)) == [Result.Value("Success")]
    (echo,) = client.step().actions
    assert echo.action_raw.unit_command.ability_id == specific
    assert list(echo.action_raw.unit_command.unit_tags) == tags(client)
    assert echo.action_feature_layer.unit_command.ability_id == specific


@pytest.mark.parametrize(
    ("units", "specific", "takers"),
    [((OBSERVER,), 19, 1), ((STALKER,), 23, 1), ((STALKER, OBSERVER), 23, 2), ((STALKER, NEXUS), 23, 1)],
)
def test_attack_is_a_scan_move_for_those_without_a_weapon(units: tuple[int, ...], specific: int, takers: int) -> None:
    client = stage(*[one for unit in units for one in make(unit, 1, (16.5, 16.5))])
    client.act(command(GENERAL_ATTACK, tags(client), point=(20.0, 20.0)))
    (echo,) = client.step().actions
    assert echo.action_raw.unit_command.ability_id == specific
    assert len(echo.action_raw.unit_command.unit_tags) == takers


FOE = -1
"""Stands for the tag of the enemy."""


@pytest.mark.parametrize(
    ("ability", "who", "aim", "result"),
    [
        (GENERAL_ATTACK, "own", {"point": (20, 20)}, "Success"),
        (GENERAL_ATTACK, "own", {"target": FOE}, "Success"),
        (GENERAL_ATTACK, "own", {}, "MustTargetVisibleLocation"),
        (GENERAL_ATTACK, "own", {"point": (float("nan"), 3)}, "MustTargetVisibleLocation"),
        (GENERAL_ATTACK, "own", {"point": (float("inf"), 3)}, "MustTargetVisibleLocation"),
        (GENERAL_ATTACK, "own", {"point": (-900, 1e30)}, "Success"),
        (GENERAL_ATTACK, "own", {"target": 12345}, "MustTargetVisibleUnit"),
        (GENERAL_ATTACK, "own", {"target": 2**64 - 1}, "MustTargetVisibleUnit"),
        (GENERAL_ATTACK, "enemy", {"point": (20, 20)}, "YouCantControlThatUnit"),
        (GENERAL_ATTACK, "nobody", {"point": (20, 20)}, "Error"),
        (GENERAL_ATTACK, "dead", {"point": (20, 20)}, "Error"),
        (GENERAL_STOP, "own", {"point": (20, 20)}, "Error"),
        (GENERAL_HOLD, "own", {"target": FOE}, "Error"),
        (99999, "own", {"point": (20, 20)}, "NotSupported"),
        (-5, "own", {}, "NotSupported"),
        (0, "own", {}, "NotSupported"),
        (1442, "own", {"point": (20, 20)}, "NotSupported"),
    ],
)
def test_a_command_that_makes_no_sense_has_a_result_and_is_no_fault(
    ability: int, who: str, aim: dict[str, Any], result: str
) -> None:
    client = stage(*make(ZEALOT, 1, (16, 16)), *make(ZEALOT, 2, (24, 16)))
    (enemy,) = tags(client, alliance=raw_pb2.Enemy)
    addressed = {"own": tags(client), "enemy": [enemy], "nobody": [], "dead": [2**63 + 5, 4295229440]}[who]
    aim = {key: enemy if value == FOE else value for key, value in aim.items()}
    action = command(ability, addressed, **aim)
    assert [Result.Name(code) for code in client.act(action)] == [result]
    seen = client.step()
    assert [Result.Name(error.result) for error in seen.action_errors] == ([] if result == "Success" else [result])
    assert len(seen.actions) == (result == "Success")
    assert not client.step().action_errors


def test_a_zealot_cannot_attack_what_flies() -> None:
    client = stage(*make(ZEALOT, 1, (16, 16)), *make(PHOENIX, 2, (20, 16)))
    (phoenix,) = tags(client, alliance=raw_pb2.Enemy)
    assert client.act(command(GENERAL_ATTACK, tags(client), target=phoenix)) == [Result.Value("CantTargetAirUnits")]


def test_queued_commands_wait_and_stop_clears_them() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    mine = tags(client)
    client.act(command(16, mine, point=(20, 16)), command(16, mine, point=(20, 20), queue=True))
    (unit,) = client.step().observation.raw_data.units
    assert [order.target_world_space_pos.y for order in unit.orders] == [16, 20]
    client.act(command(GENERAL_STOP, mine))
    (unit,) = client.step().observation.raw_data.units
    assert not unit.orders


def test_an_empty_action_is_accepted_and_not_reported() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    assert client.act(sc.Action()) == [Result.Value("Success")]
    assert not client.step().actions


# time and form of the report ------------------------------------------------------------------------------------------


def test_an_action_takes_effect_and_is_reported_one_loop_later_and_once() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    loop = client.observe().observation.game_loop
    client.act(command(GENERAL_MOVE, tags(client), point=(20, 16)))
    before = client.observe()
    assert not before.actions
    assert not before.observation.raw_data.units[0].orders
    after = client.step()
    assert [action.game_loop for action in after.actions] == [loop]
    assert after.observation.raw_data.units[0].orders[0].ability_id == 16
    assert not client.step().actions


def test_several_actions_are_done_and_reported_in_their_order() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    mine = tags(client)
    client.act(command(16, mine, point=(20, 16)), command(18, mine), command(23, mine, point=(12, 16)))
    seen = client.step(4)
    assert [action.action_raw.unit_command.ability_id for action in seen.actions] == [16, 18, 23]
    assert [order.ability_id for order in seen.observation.raw_data.units[0].orders] == [23]


def judgements(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the abilities whose use is judged from now on, in order.

    The engine, which judges again when a unit begins, stands still.
    """
    asked: list[int] = []
    refusal = casting.refusal

    def counted(world: World, slot: int, ability: Ability, *, free: bool = False) -> ActionResult:
        asked.append(ability.id)
        return refusal(world, slot, ability, free=free)

    def stand_still(world: World, loops: int) -> None:
        world.loop += loops

    monkeypatch.setattr(casting, "refusal", counted)
    monkeypatch.setattr(game, "advance", stand_still)
    return asked


def blinkers(count: int) -> Client:
    everything = debug_pb2.DebugCommand(game_state=debug_pb2.tech_tree)
    return stage(everything, *make(STALKER, 1, *[(16.0 + 2 * n, 16.0) for n in range(count)]))


@pytest.mark.parametrize("asked", [GENERAL_BLINK, BLINK])
def test_an_order_is_judged_once(monkeypatch: pytest.MonkeyPatch, asked: int) -> None:
    client = blinkers(1)
    order = command(asked, tags(client), point=(20.0, 20.0))
    judged = judgements(monkeypatch)
    assert client.act(order) == [Result.Value("Success")]
    client.ask(step=sc.RequestStep(count=1))
    assert judged == [BLINK]


def test_an_order_is_judged_again_if_another_has_taken_effect_since(monkeypatch: pytest.MonkeyPatch) -> None:
    client = blinkers(2)
    orders = [command(GENERAL_BLINK, [tag], point=(20.0, 20.0)) for tag in tags(client)]
    judged = judgements(monkeypatch)
    assert client.act(*orders) == [Result.Value("Success")] * 2
    assert judged == [BLINK] * 2
    client.ask(step=sc.RequestStep(count=1))
    assert judged == [BLINK] * 3


def test_a_raw_command_is_also_told_as_a_click() -> None:
    client = stage(*make(STALKER, 1, (16, 16)), *make(ZEALOT, 2, (24, 24)))
    (foe,) = tags(client, alliance=raw_pb2.Enemy)
    client.act(command(23, tags(client), target=foe))
    (echo,) = client.step().actions
    assert echo.action_raw.unit_command.target_unit_tag == foe
    pixel = echo.action_feature_layer.unit_command.target_screen_coord
    assert (pixel.x, pixel.y) == (106, 21)


def test_a_click_beyond_the_screen_is_told_as_one_on_the_minimap() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    client.act(command(16, tags(client), point=(31.2, 31.2)))
    (echo,) = client.step().actions
    pixel = echo.action_feature_layer.unit_command.target_minimap_coord
    assert (pixel.x, pixel.y) == (62, 1)


@pytest.mark.parametrize(
    ("options", "forms"),
    [
        (interface(), {"action_raw", "action_feature_layer"}),
        (interface(screen=0), {"action_raw"}),
    ],
)
def test_reports_have_the_forms_of_the_interface(options: sc.InterfaceOptions, forms: set[str]) -> None:
    client = stage(*make(STALKER, 1, (16, 16)), options=options)
    client.act(command(16, tags(client), point=(20, 20)))
    (echo,) = client.step().actions
    assert {field.name for field, _ in echo.ListFields()} == forms | {"game_loop"}


def test_a_click_is_also_told_as_the_raw_command_that_it_was() -> None:
    client = stage(*make(STALKER, 1, (16, 16), (14, 16)))
    client.act(ui(select_army=ui_pb2.ActionSelectArmy()), click(GENERAL_ATTACK, (80, 32)))
    _, echo = client.step().actions
    raw = echo.action_raw.unit_command
    assert raw.ability_id == 23
    assert list(raw.unit_tags) == tags(client)
    assert (raw.target_world_space_pos.x, raw.target_world_space_pos.y) == pytest.approx((19.1, 21.9), abs=0.1)


def test_a_click_on_a_unit_means_the_unit() -> None:
    client = stage(*make(STALKER, 1, (16, 16)), *make(ZEALOT, 2, (19, 16)))
    client.act(ui(select_army=ui_pb2.ActionSelectArmy()), click(GENERAL_ATTACK, (81, 63)))
    (unit,) = (u for u in client.step().observation.raw_data.units if u.alliance == raw_pb2.Self)
    assert unit.orders[0].target_unit_tag == tags(client, alliance=raw_pb2.Enemy)[0]


def test_a_click_on_the_minimap_is_a_point_of_the_map() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    client.act(ui(select_army=ui_pb2.ActionSelectArmy()), click(GENERAL_MOVE, (60, 3), minimap=True))
    (unit,) = client.step().observation.raw_data.units
    point = unit.orders[0].target_world_space_pos
    assert (point.x, point.y) == (30.25, 30.25)


@pytest.mark.parametrize(("raw_affects_selection", "count"), [(True, 1), (False, 0)])
def test_a_raw_command_selects_its_units_when_the_client_wants_it(raw_affects_selection: bool, count: int) -> None:
    options = interface()
    options.raw_affects_selection = raw_affects_selection
    client = stage(*make(STALKER, 1, (16, 16), (12, 12)), options=options)
    client.act(command(16, tags(client)[:1], point=(20, 20)))
    client.step()
    assert selected(client) == tags(client)[:count]


# camera ---------------------------------------------------------------------------------------------------------------


def test_the_camera_moves_by_world_and_by_minimap_and_stays_on_the_map() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    moves = []
    for raw, pixel in (((10.0, 12.0), None), (None, (20, 40)), ((-50.0, 90.0), None)):
        action = sc.Action()
        if raw is not None:
            centre = action.action_raw.camera_move.center_world_space
            centre.x, centre.y = raw
        if pixel is not None:
            spot = action.action_feature_layer.camera_move.center_minimap
            spot.x, spot.y = pixel
        client.act(action)
        seen = client.step()
        camera = seen.observation.raw_data.player.camera
        moves.append((camera.x, camera.y))
        (echo,) = seen.actions
        told = echo.action_raw.camera_move.center_world_space
        assert (told.x, told.y) == (camera.x, camera.y)
        assert echo.action_feature_layer.HasField("camera_move")
    assert moves == [(10.0, 12.0), (10.25, 11.75), (0.0, 32.0)]


def test_a_camera_at_no_place_stays_where_it_is() -> None:
    client = stage(*make(STALKER, 1, (16, 16)))
    action = sc.Action()
    action.action_raw.camera_move.center_world_space.x = float("nan")
    assert client.act(action) == [Result.Value("MustTargetVisibleLocation")]
    camera = client.step().observation.raw_data.player.camera
    assert (camera.x, camera.y) == (16, 16)


# selection ------------------------------------------------------------------------------------------------------------

LEFT, RIGHT, FOE_AT = (14.0, 16.0), (18.0, 16.0), (16.0, 20.0)
ON_LEFT, ON_RIGHT, ON_FOE, ON_GROUND = (53, 64), (74, 64), (64, 42), (20, 20)


@pytest.fixture
def three() -> Client:
    """Return two own Stalkers, and an enemy Zealot."""
    return stage(*make(STALKER, 1, LEFT, RIGHT), *make(ZEALOT, 2, FOE_AT))


@pytest.mark.parametrize(
    ("clicks", "who"),
    [
        ([select_point(ON_LEFT)], "L"),
        ([select_point(ON_LEFT), select_point(ON_RIGHT)], "R"),
        ([select_point(ON_LEFT), select_point(ON_RIGHT, Point.Toggle)], "LR"),
        ([select_point(ON_LEFT), select_point(ON_LEFT, Point.Toggle)], ""),
        ([select_point(ON_LEFT, Point.AllType)], "LR"),
        ([select_point(ON_LEFT), select_point(ON_GROUND)], "L"),
        ([select_point(ON_FOE)], "F"),
        ([select_point(ON_FOE), select_point(ON_LEFT, Point.Toggle)], "L"),
        ([select_box((0, 0), (127, 127))], "LR"),
        ([select_box((127, 127), (0, 0))], "LR"),
        ([select_box((40, 50), (64, 80))], "L"),
        ([select_box((40, 50), (64, 80)), select_box((64, 50), (90, 80), add=True)], "LR"),
        ([select_point(ON_RIGHT), select_box((0, 0), (5, 5))], "R"),
        ([ui(select_army=ui_pb2.ActionSelectArmy())], "LR"),
        ([select_point(ON_RIGHT), ui(select_idle_worker=Worker(type=Worker.All))], "R"),
        ([select_point(ON_RIGHT), ui(select_larva=ui_pb2.ActionSelectLarva())], "R"),
        ([select_point(ON_RIGHT), ui(select_warp_gates=ui_pb2.ActionSelectWarpGates())], "R"),
    ],
)
def test_clicks_select(three: Client, clicks: list[sc.Action], who: str) -> None:
    left, right = sorted(tags(three))
    (foe,) = tags(three, alliance=raw_pb2.Enemy)
    for action in clicks:
        three.act(action)
    three.step()
    assert set(selected(three)) == {{"L": left, "R": right, "F": foe}[name] for name in who}


def test_a_box_around_units_and_structures_takes_the_units() -> None:
    client = stage(*make(STALKER, 1, (16, 10)), *make(NEXUS, 1, (16.5, 20.5)))
    client.act(select_box((0, 0), (127, 127)))
    client.step()
    assert selected(client) == tags(client, STALKER)
    client.act(select_box((0, 0), (127, 60)))
    client.step()
    assert selected(client) == tags(client, NEXUS)


def test_idle_workers_are_selected_one_after_the_other() -> None:
    client = stage(*make(PROBE, 1, (16, 10), (16, 20), (10, 10)))
    probes = tags(client)
    client.act(command(16, probes[2:], point=(25, 25)))
    chosen = []
    for how in (Worker.Set, Worker.Set, Worker.Add, Worker.All):
        client.act(ui(select_idle_worker=Worker(type=how)))
        client.step()
        chosen.append(selected(client))
    assert chosen == [probes[:1], probes[1:2], probes[:2], probes[:2]]


@pytest.mark.parametrize("how", [Group.Set, Group.Append, Group.SetAndSteal, Group.AppendAndSteal])
def test_control_groups_hold_units(three: Client, how: Any) -> None:
    three.act(
        ui(select_army=ui_pb2.ActionSelectArmy()),
        ui(control_group=Group(action=how, control_group_index=3)),
        select_point(ON_FOE),
        ui(control_group=Group(action=Group.Recall, control_group_index=3)),
    )
    (group,) = three.step().observation.ui_data.groups
    assert (group.control_group_index, group.leader_unit_type, group.count) == (3, STALKER, 2)
    assert selected(three) == tags(three)


@pytest.mark.parametrize(("how", "count"), [(Group.Set, 1), (Group.Append, 2)])
def test_a_group_is_replaced_or_added_to(three: Client, how: Any, count: int) -> None:
    three.act(
        select_point(ON_LEFT),
        ui(control_group=Group(action=Group.Set, control_group_index=0)),
        select_point(ON_RIGHT),
        ui(control_group=Group(action=how, control_group_index=0)),
    )
    assert three.step().observation.ui_data.groups[0].count == count


def test_a_stolen_unit_leaves_its_group() -> None:
    client = stage(*make(STALKER, 1, LEFT, RIGHT))
    client.act(
        ui(select_army=ui_pb2.ActionSelectArmy()),
        ui(control_group=Group(action=Group.Set, control_group_index=1)),
        select_point(ON_LEFT),
        ui(control_group=Group(action=Group.AppendAndSteal, control_group_index=2)),
    )
    groups = client.step().observation.ui_data.groups
    assert [(group.control_group_index, group.count) for group in groups] == [(1, 1), (2, 1)]


@pytest.mark.parametrize(
    ("how", "who"),
    [
        (Panel.SingleSelect, "Z"),
        (Panel.DeselectUnit, "SS"),
        (Panel.SelectAllOfType, "Z"),
        (Panel.DeselectAllOfType, "SS"),
    ],
)
def test_the_panel_of_many_units_selects_among_them(how: Any, who: str) -> None:
    client = stage(*make(STALKER, 1, LEFT, RIGHT), *make(ZEALOT, 1, (16, 12)))
    client.act(ui(select_army=ui_pb2.ActionSelectArmy()))
    panel = client.step().observation.ui_data.multi.units
    index = [unit.unit_type for unit in panel].index(ZEALOT)
    client.act(ui(multi_panel=Panel(type=how, unit_index=index)))
    client.step()
    left = {"S": STALKER, "Z": ZEALOT}
    units = client.observe().observation.raw_data.units
    assert [unit.unit_type for unit in units if unit.is_selected] == [left[name] for name in who]


def test_the_dead_leave_selection_and_groups(three: Client) -> None:
    left, right = tags(three)
    three.act(
        ui(select_army=ui_pb2.ActionSelectArmy()), ui(control_group=Group(action=Group.Set, control_group_index=0))
    )
    three.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=[left])))
    seen = three.step(2)
    assert selected(three) == [right]
    assert seen.observation.ui_data.groups[0].count == 1
    assert seen.observation.ui_data.single.unit.unit_type == STALKER


def test_the_panel_shows_one_or_many(three: Client) -> None:
    three.act(select_point(ON_LEFT))
    one = three.step().observation.ui_data
    assert one.WhichOneof("panel") == "single"
    assert len(one.single.unit.ListFields()) == 10
    assert (one.single.unit.health, one.single.unit.max_shields, one.single.unit.player_relative) == (80, 80, 1)
    three.act(ui(select_army=ui_pb2.ActionSelectArmy()))
    many = three.step().observation.ui_data
    assert many.WhichOneof("panel") == "multi"
    assert [unit.unit_type for unit in many.multi.units] == [STALKER, STALKER]
    three.act(select_point(ON_FOE))
    assert three.step().observation.ui_data.single.unit.player_relative == raw_pb2.Enemy


@pytest.mark.parametrize(
    "action",
    [
        ui(control_group=Group(action=Group.Recall, control_group_index=10)),
        ui(control_group=Group(action=Group.Set, control_group_index=4_000_000)),
        ui(multi_panel=Panel(type=Panel.SingleSelect, unit_index=500)),
        ui(multi_panel=Panel(type=Panel.SingleSelect, unit_index=-1)),
        ui(cargo_panel=ui_pb2.ActionCargoPanelUnload(unit_index=0)),
        ui(production_panel=ui_pb2.ActionProductionPanelRemoveFromQueue(unit_index=9)),
        ui(toggle_autocast=ui_pb2.ActionToggleAutocast(ability_id=2)),
    ],
)
def test_panels_that_are_not_there_are_no_fault(three: Client, action: sc.Action) -> None:
    assert three.act(action) == [Result.Value("Error")]
    assert not three.step().actions


# abilities ------------------------------------------------------------------------------------------------------------


def test_abilities_are_those_of_the_selection(three: Client) -> None:
    assert not three.observe().observation.abilities
    three.act(select_point(ON_LEFT))
    abilities = three.step().observation.abilities
    assert [(a.ability_id, a.requires_point) for a in abilities] == [
        (1, True), (4, False), (16, True), (17, True), (18, False), (23, True),
    ]  # fmt: skip
    three.act(select_point(ON_FOE))
    assert not three.step().observation.abilities


def test_what_requires_a_point_is_what_pysc2_expects() -> None:
    pytest.importorskip("khala_bridge.compat")
    from pysc2.lib import actions

    for ability in ABILITIES:
        if ability.id not in actions.ABILITY_IDS:
            continue  # PySC2 only warns of those
        kinds = actions.POINT_REQUIRED_FUNCS[ability.requires_point]
        functions = actions.ABILITY_IDS[ability.id]
        assert any(function.function_type in kinds for function in functions), ability.id
        assert {function.general_id for function in functions} <= {0, ability.general}, ability.id


# chat -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channel", [sc.ActionChat.Broadcast, sc.ActionChat.Team])
def test_a_player_hears_himself(three: Client, channel: Any) -> None:
    three.act(sc.Action(action_chat=sc.ActionChat(channel=channel, message="gg")))
    seen = three.step()
    assert [(chat.player_id, chat.message) for chat in seen.chat] == [(1, "gg")]
    assert not three.step().chat


# nonsense -------------------------------------------------------------------------------------------------------------

ids = st.one_of(st.sampled_from([a.id for a in ABILITIES] + [a.general for a in ABILITIES]), st.integers(-9, 2**31 - 1))
coordinates = st.floats(width=32)
pixels = st.integers(-(2**31), 2**31 - 1)
spots = st.builds(lambda x, y: common_pb2.PointI(x=x, y=y), pixels, pixels)
some_tags = st.one_of(st.integers(0, 2**64 - 1), st.sampled_from([(1 << 32) | (slot << 18) for slot in range(1, 12)]))


def _raw(ability: int, who: list[int], x: float, y: float, target: int, kind: int) -> sc.Action:
    aims: list[dict[str, Any]] = [{}, {"point": (x, y)}, {"target": target}]
    return command(ability, who, **aims[kind])


raw_actions = st.builds(
    _raw, ids, st.lists(some_tags, max_size=4), coordinates, coordinates, some_tags, st.integers(0, 2)
)
spatial_actions = st.builds(
    lambda part: sc.Action(action_feature_layer=part),
    st.one_of(
        st.builds(
            lambda a, p: spatial_pb2.ActionSpatial(
                unit_command=spatial_pb2.ActionSpatialUnitCommand(ability_id=a, target_screen_coord=p)
            ),
            ids, spots,
        ),
        st.builds(
            lambda a, p: spatial_pb2.ActionSpatial(
                unit_command=spatial_pb2.ActionSpatialUnitCommand(ability_id=a, target_minimap_coord=p)
            ),
            ids, spots,
        ),
        st.builds(
            lambda p: spatial_pb2.ActionSpatial(
                camera_move=spatial_pb2.ActionSpatialCameraMove(center_minimap=p)
            ),
            spots,
        ),
        st.builds(
            lambda p, how: spatial_pb2.ActionSpatial(
                unit_selection_point=Point(selection_screen_coord=p, type=how)
            ),
            spots, st.integers(1, 4),
        ),
        st.builds(
            lambda p, q, add: spatial_pb2.ActionSpatial(
                unit_selection_rect=spatial_pb2.ActionSpatialUnitSelectionRect(
                    selection_screen_coord=[common_pb2.RectangleI(p0=p, p1=q)], selection_add=add
                )
            ),
            spots, spots, st.booleans(),
        ),
    ),
)  # fmt: skip
ui_actions = st.one_of(
    st.builds(
        lambda a, i: ui(control_group=Group(action=a, control_group_index=i)),
        st.integers(1, 5),
        st.integers(0, 2**32 - 1) | st.integers(0, 9),
    ),
    st.builds(lambda a, i: ui(multi_panel=Panel(type=a, unit_index=i)), st.integers(1, 4), pixels | st.integers(0, 9)),
    st.builds(lambda add: ui(select_army=ui_pb2.ActionSelectArmy(selection_add=add)), st.booleans()),
    st.builds(lambda t: ui(select_idle_worker=Worker(type=t)), st.integers(1, 4)),
    st.just(ui(select_larva=ui_pb2.ActionSelectLarva())),
    st.just(sc.Action()),
)


@given(st.lists(st.lists(raw_actions | spatial_actions | ui_actions, max_size=5), min_size=1, max_size=6))
def test_no_action_breaks_a_game(rounds: list[list[sc.Action]]) -> None:
    client = Client()
    client.play()
    for actions in rounds:
        assert len(client.act(*actions)) == len(actions)
        seen = client.step(2)
        for unit in seen.observation.raw_data.units:
            assert 0 <= unit.pos.x <= 32
            assert 0 <= unit.pos.y <= 32
    assert client.session.status is Status.in_game


# transports -----------------------------------------------------------------------------------------------------------

TRANSPORTS = {
    "Medivac": "Marine",
    "Bunker": "Marine",
    "CommandCenter": "SCV",
    "WarpPrism": "Zealot",
    "OverlordTransport": "Zergling",
    "NydusNetwork": "Zergling",
}
SMART, LOAD, LOAD_ALL, UNLOAD_UNIT = 1, 3668, 3663, 3796


@pytest.mark.parametrize(("carrier", "passenger"), TRANSPORTS.items(), ids=TRANSPORTS)
def test_pysc2_warns_of_no_ability_of_a_loaded_transport(
    carrier: str, passenger: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    features = pytest.importorskip("khala_bridge.compat").features
    client = Client()
    client.play("Melee/Flat64", interface(screen=64, minimap=64))
    tags = {name: made(client, name) for name in (carrier, passenger)}
    if carrier == "CommandCenter":  # takes workers only, and all that are near
        client.act(command(LOAD_ALL, [tags[carrier]]))
    else:
        client.act(command(LOAD, [tags[carrier]], target=tags[passenger]))
    client.step(60)
    client.act(command(SMART, [tags[carrier]], point=(32, 32)))  # raw commands select their units
    seen = client.step(4).observation
    assert [len(unit.passengers) for unit in seen.raw_data.units if unit.tag == tags[carrier]] == [1]

    warnings: list[tuple[object, ...]] = []
    monkeypatch.setattr(features.logging, "warning", lambda *said: warnings.append(said))
    info = client.ask(game_info=sc.RequestGameInfo()).game_info
    layers = features.AgentInterfaceFormat(feature_dimensions=features.Dimensions(64, 64))
    reader = features.features_from_game_info(info, agent_interface_format=layers)
    assert reader.available_actions(seen)
    assert not warnings

    client.act(command(UNLOAD_UNIT, [tags[carrier]]))  # it is not offered, and still there
    after = client.step(40).observation.raw_data.units
    assert [len(unit.passengers) for unit in after if unit.tag == tags[carrier]] == [0]


@pytest.mark.slow
def test_no_unit_offers_an_ability_that_pysc2_does_not_know() -> None:
    known = pytest.importorskip("khala_bridge.compat").actions.ABILITY_IDS
    catalog, unknown = load_catalog(), set[tuple[str, int]]()
    world = new_game(load_map("Melee/Flat128"), seed=1)
    for number, unit in enumerate(catalog.units):
        if number % 30 == 0:  # not too many in one place
            world = new_game(load_map("Melee/Flat128"), seed=1)
            world.players[1].minerals = world.players[1].vespene = 99_999.0
            for switch in ("free", "tech_tree", "food", "cooldown"):
                commands.debug_switch(world, 1, switch)
            commands.debug_upgrade(world, 1)
        if unit.resource:
            continue
        (slot,) = commands.debug_create(world, unit.id, 1, (64.5, 64.5))
        for loops in (1, 5):
            advance(world, loops)
            offered = usable(world, slot, free=True) if world.alive[slot] else []
            unknown |= {(unit.name, ability.id) for ability in offered if ability.id not in known}
            busy = next((a for a in offered if a.effect in {"train", "research", "morph", "burrow"}), None)
            if busy is not None:  # what is made or changes can be cancelled
                casting.use(world, [slot], busy)
    assert not unknown


def made(client: Client, name: str) -> int:
    """Return the tag of a new unit of the player in the middle of the map."""
    before = {unit.tag for unit in client.observe().observation.raw_data.units}
    kind = load_catalog().unit(name).id
    order = debug_pb2.DebugCreateUnit(unit_type=kind, owner=1, pos=common_pb2.Point2D(x=32, y=32), quantity=1)
    client.debug(debug_pb2.DebugCommand(create_unit=order))
    units = client.step(2).observation.raw_data.units
    return next(unit.tag for unit in units if unit.unit_type == kind and unit.tag not in before)
