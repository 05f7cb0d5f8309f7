"""The same commands through both executors: protos of the raw one, tours of the screen one."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2, error_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.act import Actor, JointAction, executor_of
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.catalogue.functions import functions
from khala_bridge.compat import actions as pysc2
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Observer
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from s2clientprotocol import raw_pb2

    from khala_bridge.act import Command, Executor, PlanResult, PlanStep
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Make = Callable[..., raw_pb2.Unit]
    Snap = Callable[..., Snapshot]

S1, S2, FOE = 0x100040001, 0x100080001, 0x100180001
ALL = frozenset(int(function.id) for function in pysc2.FUNCTIONS)
REPLIES = ("<Attack_Unit(0x100180001)>", "<Select_Unit_Move_Screen(0x100080001, [13, 12])>")
"""All attack; then one walks, once it has attacked."""


class Table:
    """A game on a table: it has a camera and a selection, and nothing moves."""

    def __init__(self, unit: Make, snapshot: Snap, **fields: Any) -> None:
        self._unit, self._snapshot, self._fields = unit, snapshot, fields
        self.camera = (16.0, 16.0)
        self.places = {S1: (10.0, 10.0), S2: (12.0, 11.0), FOE: (15.0, 10.0)}
        self.types: dict[int, str] = {}
        self.traits: dict[int, dict[str, Any]] = {FOE: {"alliance": "enemy"}}
        self.selected: set[int] = set()
        self.groups: dict[int, set[int]] = {}
        self.steps: list[PlanStep] = []
        self.stuck = False
        """Whether the camera stays where it is, as at the edge of a map."""

    def put(self, tag: int, kind: str, x: float, y: float, **traits: Any) -> int:
        """Add a unit, and return its tag."""
        self.places[tag], self.types[tag], self.traits[tag] = (x, y), kind, traits
        return tag

    def now(self) -> Snapshot:
        units = [
            self._unit(
                tag,
                self.types.get(tag, "Stalker"),
                *place,
                is_selected=tag in self.selected,
                **self.traits.get(tag, {}),
            )
            for tag, place in self.places.items()
        ]
        return self._snapshot(units, camera=self.camera, **{"functions": ALL} | self._fields)

    def play(self, executor: Executor, joint: JointAction | Sequence[Command], loops: int = 8) -> PlanResult:
        commands = joint.commands if isinstance(joint, JointAction) else joint
        plan = executor.plan(commands, self.now(), loops)
        step = next(plan)
        while True:
            self.steps.append(step)
            for action in step.actions:
                self._carry_out(action)
            try:
                step = plan.send(self.now())
            except StopIteration as done:
                played: PlanResult = done.value
                return played

    def functions(self) -> list[tuple[str, list[Any]]]:
        """Return every PySC2 function that was called, with its arguments."""
        calls = [action for step in self.steps for action in step.actions if not isinstance(action, sc_pb.Action)]
        return [(pysc2.FUNCTIONS[call.function].name, [list(map(int, a)) for a in call.arguments]) for call in calls]

    def moves(self) -> list[tuple[float, float]]:
        """Return where the camera was sent."""
        sent = [action for step in self.steps for action in step.actions if isinstance(action, sc_pb.Action)]
        centres = [action.action_raw.camera_move.center_world_space for action in sent]
        return [(centre.x, centre.y) for centre in centres]

    def _carry_out(self, action: Any) -> None:
        if isinstance(action, sc_pb.Action):
            centre = action.action_raw.camera_move.center_world_space
            self.camera = self.camera if self.stuck else (centre.x, centre.y)
            return
        arguments = [list(map(int, a)) for a in action.arguments]
        match pysc2.FUNCTIONS[action.function].name:
            case "select_point":
                self._click(arguments[0][0], *arguments[1])
            case "select_control_group":
                (how,), (group,) = arguments
                if how:
                    self.groups[group] = set(self.selected)
                self.selected = set(self.groups.get(group, ()))
            case "select_warp_gates":
                self.selected = self._own("WarpGate")
            case "select_larva":
                self.selected = self._own("Larva")
            case "select_idle_worker":
                self.selected = {min(self._own("Probe"))}
            case "select_army":
                self.selected = self._own("Stalker")

    def _own(self, kind: str) -> set[int]:
        mine = {t for t in self.places if self.traits.get(t, {}).get("alliance", "own") == "own"}
        return {tag for tag in mine if self.types.get(tag, "Stalker") == kind}

    def _click(self, how: int, px: int, py: int) -> None:
        """Hit the unit that was put on the table last, of those under the pixel."""
        x = (px + 0.5 - 64) * 24 / 128 + self.camera[0]
        y = self.camera[1] - (py + 0.5 - 64) * 24 / 128
        reach = {tag: self.traits.get(tag, {}).get("radius", 0.0) + 0.14 for tag in self.places}
        under = [tag for tag, place in self.places.items() if math.dist(place, (x, y)) <= reach[tag]]
        hit = set(under[-1:])
        for top in hit.copy():
            same = self._own(self.types.get(top, "Stalker"))
            if how in {2, 3} and top in same:
                hit = {tag for tag in same if self._on_screen(tag)}
        self.selected = hit if how in {0, 2} else self.selected | hit if how == 3 else self.selected ^ hit

    def _on_screen(self, tag: int) -> bool:
        return max(abs(self.places[tag][0] - self.camera[0]), abs(self.places[tag][1] - self.camera[1])) < 12


@pytest.fixture
def table(unit: Make, snapshot: Snap) -> Callable[..., Table]:
    def make(**fields: Any) -> Table:
        return Table(unit, snapshot, **fields)

    return make


@pytest.fixture
def joint(task: Callable[..., TaskConfig]) -> Callable[..., JointAction]:
    """Return the joint action of replies to a table, of an agent with one team of Stalkers; the later ones wait."""

    def decide(table: Table, *replies: str, **team: Any) -> JointAction:
        config = task("3s_vs_3z")
        agent = config.agents[0]
        teams = (agent.teams[0].model_copy(update=team),)
        verbs = ("Attack_Unit", "Move_Screen", "Move_Minimap", "Select_Unit_Move_Screen", "Stop", "Hold_Position")
        config = config.model_copy(
            update={"agents": (agent.model_copy(update={"teams": teams, "actions": {"Stalker": verbs}}),)}
        )
        seen = Observer(config).observe(table.now())
        first, *more = (Actor(config).joint(seen, {agent.name: parse(reply)}) for reply in replies or REPLIES)
        later = (replace(command, queued=True) for joint in more for command in joint.commands)
        return replace(first, commands=(*first.commands, *later))

    return decide


def order(action: sc_pb.Action) -> tuple[int, list[int], int, tuple[float, float] | None, bool]:
    command = action.action_raw.unit_command
    point = command.target_world_space_pos
    place = (point.x, point.y) if command.HasField("target_world_space_pos") else None
    return command.ability_id, list(command.unit_tags), command.target_unit_tag, place, command.queue_command


# --- raw ----------------------------------------------------------------------------------------------------------


def test_the_raw_executor_plays_a_joint_action_in_one_step(table: Any, joint: Any) -> None:
    game = table()
    played = game.play(RawExecutor(), joint(game))
    (step,) = game.steps
    assert step.loops == 8
    assert [order(action) for action in step.actions] == [
        (3674, [S1, S2], FOE, None, False),
        (3794, [S2], 0, (11.0, 10.0), True),
    ]
    assert played.functions == (
        "Attack_unit(now, [0x100040001, 0x100080001], 0x100180001)",
        "Move_pt(queued, [0x100080001], [11.0, 10.0])",
    )
    assert played.refusals == ()


def test_what_units_do_without_being_told_is_switched_by_tags(table: Any, joint: Any) -> None:
    game = table()
    (stop,) = joint(game, "<Stop()>").commands
    played = game.play(RawExecutor(), [replace(stop, function=functions()["Effect_Heal_autocast"])])
    ((action,),) = (step.actions for step in game.steps)
    toggle = action.action_raw.toggle_autocast
    assert (toggle.ability_id, list(toggle.unit_tags)) == (386, [S1, S2])
    assert not action.action_raw.HasField("unit_command")
    assert played.functions == ("Effect_Heal_autocast([0x100040001, 0x100080001])",)


def test_orders_of_the_host_come_last_and_nobody_is_told_of_their_refusal(table: Any, joint: Any) -> None:
    game = table()
    (stop,) = joint(game, "<Stop()>", control_group=None).commands
    host = replace(stop, said=None, function=functions()["HoldPosition_quick"], units=(S2,))
    lost = replace(host, units=(0x900000001,))
    played = game.play(ScreenExecutor(), [lost, host, stop])
    assert [name for name, _ in game.functions() if name.endswith("quick")] == ["Stop_quick", "HoldPosition_quick"]
    assert played.refusals == ()
    errors = (sc_pb.ActionError(unit_tag=S2, ability_id=3793, result=error_pb2.CantTargetThatUnit),)
    assert table(errors=errors).play(RawExecutor(), [host]).refusals == ()


def test_without_commands_both_executors_only_let_time_pass(table: Any) -> None:
    for executor in (RawExecutor(), ScreenExecutor()):
        game = table()
        game.play(executor, JointAction())
        assert [(step.actions, step.loops) for step in game.steps] == [((), 8)]


def test_an_error_of_the_game_becomes_a_rejection_of_the_call(table: Any, joint: Any) -> None:
    errors = [
        sc_pb.ActionError(unit_tag=S2, ability_id=3794, result=error_pb2.CantFindPlacementLocation),
        sc_pb.ActionError(unit_tag=S1, ability_id=23, result=error_pb2.CantTargetThatUnit),
        sc_pb.ActionError(unit_tag=77, ability_id=23, result=error_pb2.CantTargetThatUnit),
    ]
    game = table(errors=tuple(errors))
    played = game.play(RawExecutor(), joint(game))
    assert [(r.agent, r.rejection.reason, r.rejection.text, r.rejection.message) for r in played.refusals] == [
        (
            "CombatGroupSmac",
            "refused_by_game",
            "<Attack_Unit(0x100180001)>",
            "The game refused Attack_Unit: cant target that unit.",
        ),
        (
            "CombatGroupSmac",
            "refused_by_game",
            "<Select_Unit_Move_Screen(0x100080001, [13, 12])>",
            "The game refused Select_Unit_Move_Screen: cant find placement location.",
        ),
    ]


def test_what_units_did_by_themselves_is_no_refusal_of_their_order(table: Any, joint: Any) -> None:
    heal = functions()["Effect_Heal_screen"].ability_id
    game = table(errors=(sc_pb.ActionError(unit_tag=S1, ability_id=heal, result=error_pb2.RequiresHealTarget),))
    assert not game.play(RawExecutor(), joint(game)).refusals


# --- screen -------------------------------------------------------------------------------------------------------

BOTH = ("select_point", [[2], [64, 64]])
CLICKS = [("select_point", [[0], [64, 64]]), ("select_point", [[1], [74, 58]])]
ATTACK, MOVE = ("Attack_screen", [[0], [90, 64]]), ("Move_screen", [[1], [69, 64]])
ONE = ("select_point", [[0], [74, 58]])
SET = ("select_control_group", [[1], [4]])
STRANGER = 0x100300001
"""A Stalker of nobody's team: it is still being built."""


@pytest.mark.parametrize("kind", ["group", "select_all_type"])
@pytest.mark.parametrize(
    ("stranger", "group", "functions"),
    [
        (False, 4, [BOTH, SET, ATTACK, ONE, MOVE]),
        (False, None, [BOTH, ATTACK, ONE, MOVE]),
        (True, 4, [*CLICKS, SET, ATTACK, ONE, MOVE]),
        (True, None, [*CLICKS, ATTACK, ONE, MOVE]),
    ],
)
def test_the_screen_executor_selects_a_team_and_nobody_else(
    kind: str, stranger: bool, group: int | None, functions: Sequence[Any], table: Any, joint: Any
) -> None:
    game = table()
    if stranger:
        game.put(STRANGER, "Stalker", 14, 14, build_progress=0.5)
    played = game.play(ScreenExecutor(), joint(game, kind=kind, control_group=group), loops=30)
    assert game.functions() == list(functions)
    assert game.camera == (10, 10)
    assert [step.loops for step in game.steps] == [1] * (len(functions) + 1) + [30 - len(functions) - 1]
    assert played.functions[0] == "camera_move([10.0, 10.0])"
    assert played.refusals == ()


def test_who_is_selected_already_is_not_selected_again(table: Any, joint: Any) -> None:
    game = table()
    game.selected = {S1, S2}
    game.play(ScreenExecutor(), joint(game, "<Stop()>", control_group=None))
    assert [name for name, _ in game.functions()] == ["Stop_quick"]


def test_a_control_group_is_recalled_once_it_is_set_and_set_again_when_a_unit_joins(table: Any, joint: Any) -> None:
    executor, stop = ScreenExecutor(), "Actions:\n<Stop()>"
    tours = []
    groups: dict[int, set[int]] = {}
    for places in ((S1,), (S1,), (S1, S2)):
        game = table()
        game.groups = groups
        game.places = {tag: place for tag, place in game.places.items() if tag in (*places, FOE)}
        game.play(executor, joint(game, stop, control_group=4))
        tours.append([name for name, _ in game.functions()])
    assert tours == [
        ["select_point", "select_control_group", "Stop_quick"],
        ["select_control_group", "Stop_quick"],
        ["select_point", "select_control_group", "Stop_quick"],
    ]


def test_a_new_episode_begins_with_empty_control_groups(table: Any, joint: Any) -> None:
    executor = ScreenExecutor()
    for _ in range(2):
        executor.begin()
        game = table()
        game.play(executor, joint(game, "<Stop()>", control_group=4))
        assert game.functions()[-2] == SET


def test_the_camera_goes_to_a_unit_that_is_off_the_screen(table: Any, joint: Any) -> None:
    game = table()
    game.places[S2] = (30.0, 11.0)
    game.play(ScreenExecutor(), joint(game, "<Stop()>", control_group=None))
    assert game.moves() == [(10, 10), (30, 11)]
    assert game.selected == {S1, S2}


def test_the_camera_comes_back_to_the_team_for_a_target_on_its_screen(table: Any, joint: Any) -> None:
    game = table()
    game.places[S2] = (30.0, 11.0)
    game.play(ScreenExecutor(), joint(game, "<Select_Unit_Move_Screen(0x100080001, [4, 5])>", control_group=None))
    assert game.moves() == [(10, 10), (30, 11), (10, 10)]
    assert game.functions()[-1] == ("Move_screen", [[0], [21, 26]])


def test_the_camera_goes_to_a_target_that_is_far_away(table: Any, joint: Any) -> None:
    game = table()
    (stop,) = joint(game, "<Stop()>", control_group=None).commands
    far = replace(stop, function=functions()["Attack_screen"], target=WorldPoint(28.0, 28.0))
    game.play(ScreenExecutor(), [far])
    assert game.moves() == [(10, 10), (28, 28)]
    assert game.functions()[-1] == ("Attack_screen", [[0], [64, 64]])


def test_a_point_of_the_minimap_is_clicked_on_the_minimap(table: Any, joint: Any) -> None:
    game = table()
    game.play(ScreenExecutor(), joint(game, "<Move_Minimap([40.9, 12.2])>", control_group=None))
    assert game.functions()[-1] == ("Move_minimap", [[0], [40, 12]])


@pytest.mark.parametrize(
    ("kind", "function", "units", "way"),
    [
        ("WarpGate", "TrainWarp_Zealot_screen", 1, ["select_warp_gates", "TrainWarp_Zealot_screen"]),
        ("WarpGate", "Rally_Building_screen", 1, ["select_point", "Rally_Building_screen"]),
        ("Larva", "Train_Drone_quick", 1, ["select_point", "select_larva", "Train_Drone_quick"]),
        ("Larva", "Stop_quick", 1, ["select_point", "Stop_quick"]),
        ("Probe", "Build_Pylon_screen", 1, ["select_idle_worker", "Build_Pylon_screen"]),
        ("Probe", "Stop_quick", 2, ["select_point", "Stop_quick"]),
        ("Stalker", "Stop_quick", 7, ["select_army", "Stop_quick"]),
    ],
)
def test_the_hand_takes_the_short_way_where_there_is_one(
    kind: str, function: str, units: int, way: list[str], table: Any, joint: Any
) -> None:
    game = table(player={"idle_worker_count": 1, "army_count": 9})
    (stop,) = joint(game, "<Stop()>", control_group=None).commands
    tags = [game.put(0x200000001 + (i << 18), kind, 6 + 2 * i, 15) for i in range(max(2, units))]
    game.put(0x300000001, "Hatchery", 8, 12)
    if kind == "Stalker":
        tags += [S1, S2]
    chosen = tuple(tags) if kind == "Stalker" else tuple(tags[:units])
    target = None if function.endswith("quick") else WorldPoint(12.0, 7.0)
    played = game.play(ScreenExecutor(), [replace(stop, function=functions()[function], units=chosen, target=target)])
    assert [name for name, _ in game.functions()] == way
    assert played.refusals == ()


def test_a_target_is_clicked_where_nobody_stands_over_it(table: Any, joint: Any) -> None:
    game = table()
    game.traits[FOE]["radius"] = 0.6
    wanted = joint(game, "<Attack_Unit(0x100180001)>", control_group=None)
    game.put(0x100500001, "Overlord", 15.3, 10.0, radius=0.5)
    game.play(ScreenExecutor(), wanted)
    name, (_, (px, py)) = game.functions()[-1]
    x, y = (px + 0.5 - 64) * 24 / 128 + 10, 10 - (py + 0.5 - 64) * 24 / 128
    assert name == "Attack_screen"
    assert math.dist((x, y), (15.0, 10.0)) < 0.6
    assert math.dist((x, y), (15.3, 10.0)) > 0.5


def test_an_order_to_a_place_is_clicked_on_the_ground_beside_who_stands_there(table: Any, joint: Any) -> None:
    game = table()
    game.put(0x100500001, "Zealot", 13.0, 8.0, radius=0.5)
    wanted = joint(game, "<Move_Screen([15, 14])>", control_group=None)
    game.play(ScreenExecutor(), wanted)
    _, (_, (px, py)) = game.functions()[-1]
    x, y = (px + 0.5 - 64) * 24 / 128 + 10, 10 - (py + 0.5 - 64) * 24 / 128
    assert 0.5 < math.dist((x, y), (13.0, 8.0)) < 1.0


@pytest.mark.parametrize(("seen", "clicked"), [("Stalker", True), ("Overlord", False)])
def test_what_covers_a_target_is_seen_on_the_feature_layers(seen: str, clicked: bool, table: Any, joint: Any) -> None:
    kind, owner = (74, 4) if seen == "Stalker" else (106, 1)
    game = table(change=_layers(kind, owner))
    wanted = joint(game, "<Attack_Unit(0x100180001)>", control_group=None)
    game.put(0x100500001, "Overlord", 15.0, 10.0, radius=1.0)
    plan = ScreenExecutor().plan(wanted.commands, game.now(), 8)
    step = next(plan)
    called: list[str] = []
    played = None
    while played is None:
        for action in step.actions:
            game._carry_out(action)
            called += [] if isinstance(action, sc_pb.Action) else [pysc2.FUNCTIONS[action.function].name]
        try:
            step = plan.send(game.now())
        except StopIteration as done:
            played = done.value
    assert ("Attack_screen" in called) == clicked
    said = [refusal.rejection.message for refusal in played.refusals]
    covered = "The game refused Attack_Unit: the target cannot be clicked, something stands over it."
    assert said == ([] if clicked else [covered])


def _layers(unit_type: int, owner: int) -> Callable[[sc_pb.ResponseObservation, sc_pb.ResponseGameInfo], None]:
    """Return feature layers that show this type of unit everywhere."""
    size = common_pb2.Size2DI(x=128, y=128)

    def change(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        renders = response.observation.feature_layer_data.renders
        types, owners = unit_type.to_bytes(4, "little") * 128 * 128, bytes([owner]) * 128 * 128
        renders.unit_type.CopyFrom(common_pb2.ImageData(bits_per_pixel=32, size=size, data=types))
        renders.player_relative.CopyFrom(common_pb2.ImageData(bits_per_pixel=8, size=size, data=owners))

    return change


def test_a_tour_ends_where_the_episode_ends_and_says_what_it_played(table: Any, joint: Any) -> None:
    for executor in (RawExecutor(), ScreenExecutor()):
        game = table(ended=True)
        played = game.play(executor, joint(game))
        assert len(game.steps) == 1
        assert played.functions[0].startswith(("Attack_unit(now", "camera_move("))


def test_a_tour_takes_as_long_as_it_needs(table: Any, joint: Any) -> None:
    game = table()
    game.play(ScreenExecutor(), joint(game), loops=2)
    assert {step.loops for step in game.steps} == {1}
    assert len(game.steps) > 2


@pytest.mark.parametrize(
    ("change", "fields", "message"),
    [
        ({}, {"functions": frozenset()}, "Attack_screen is not available to what is selected"),
        ({FOE: None}, {}, "the target is gone"),
        ({S1: None, S2: None}, {}, "its units are gone"),
        ({S1: (15.0, 10.0), S2: (15.0, 10.0)}, {}, "its units could not be selected, something stands over them"),
    ],
)
def test_a_command_that_has_become_impossible_is_refused(
    change: dict[int, tuple[float, float] | None], fields: dict[str, Any], message: str, table: Any, joint: Any
) -> None:
    game = table(**fields)
    wanted = joint(game, "<Attack_Unit(0x100180001)>", control_group=None)
    places = game.places | change
    game.places = {tag: place for tag, place in places.items() if place is not None}
    if (15.0, 10.0) in change.values():
        game.places[FOE] = game.places.pop(FOE)  # on top
    played = game.play(ScreenExecutor(), wanted)
    assert [r.rejection.message for r in played.refusals] == [f"The game refused Attack_Unit: {message}."]
    assert "Attack_screen" not in [name for name, _ in game.functions()]


def test_a_target_that_the_camera_does_not_reach_is_refused(table: Any, joint: Any) -> None:
    game = table()
    wanted = joint(game, "<Attack_Unit(0x100180001)>", control_group=None)
    game.camera, game.stuck, game.places[FOE] = (10.0, 10.0), True, (31.0, 31.0)
    played = game.play(ScreenExecutor(), wanted)
    said = "The game refused Attack_Unit: the target is beyond the reach of the camera."
    assert [refusal.rejection.message for refusal in played.refusals] == [said]


def test_a_team_among_whom_others_stand_is_not_told_with_them(table: Any, joint: Any) -> None:
    game = table()
    wanted = joint(game, "<Stop()>", control_group=None)
    game.put(STRANGER, "Stalker", 10, 10, build_progress=0.5)  # on top of a unit of the team, and hit in its place
    game.put(0x100400001, "Stalker", 12, 11, build_progress=0.5)
    played = game.play(ScreenExecutor(), wanted)
    said = "The game refused Stop: its units could not be selected, something stands over them."
    assert [refusal.rejection.message for refusal in played.refusals] == [said]
    assert "Stop_quick" not in [name for name, _ in game.functions()]


def test_a_task_chooses_its_executor(task: Callable[..., TaskConfig]) -> None:
    assert isinstance(executor_of(task(executor="raw")), RawExecutor)
    assert isinstance(executor_of(task(executor="screen")), ScreenExecutor)
