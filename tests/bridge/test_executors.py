"""The same commands through both executors: protos of the raw one, tours of the screen one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import error_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bridge.act import Actor, JointAction, executor_of
from bridge.act.raw import RawExecutor
from bridge.act.screen import ScreenExecutor
from bridge.compat import actions as pysc2
from bridge.observe import Observer
from protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from s2clientprotocol import raw_pb2

    from bridge.act import Executor, Played, Step
    from bridge.snapshot import Snapshot
    from bridge.task import TaskConfig

    Make = Callable[..., raw_pb2.Unit]
    Snap = Callable[..., Snapshot]

S1, S2, FOE = 0x100040001, 0x100080001, 0x100180001
ALL = frozenset(int(function.id) for function in pysc2.FUNCTIONS)
REPLY = """Actions:
Team Stalker-1:
<Attack_Unit(0x100180001)>
<Select_Unit_Move_Screen(0x100080001, [13, 12])>"""


class Table:
    """A game of one team on a table: it shows where the camera is and who is selected, and nothing moves."""

    def __init__(self, unit: Make, snapshot: Snap, **fields: Any) -> None:
        self._unit, self._snapshot, self._fields = unit, snapshot, fields
        self.camera = (16.0, 16.0)
        self.places = {S1: (10.0, 10.0), S2: (12.0, 11.0), FOE: (15.0, 10.0)}
        self.selected: set[int] = set()
        self.steps: list[Step] = []

    def now(self) -> Snapshot:
        units = [
            self._unit(
                tag,
                "Stalker",
                *place,
                alliance="enemy" if tag == FOE else "own",
                is_selected=tag in self.selected,
            )
            for tag, place in self.places.items()
        ]
        return self._snapshot(units, camera=self.camera, **{"functions": ALL} | self._fields)

    def play(self, executor: Executor, joint: JointAction, loops: int = 8) -> Played:
        plan = executor.plan(joint.commands, self.now(), loops)
        step = next(plan)
        while True:
            self.steps.append(step)
            self._carry_out(step)
            try:
                step = plan.send(self.now())
            except StopIteration as done:
                played: Played = done.value
                return played

    def functions(self) -> list[tuple[str, list[Any]]]:
        """Every PySC2 function that was called, with its arguments."""
        calls = [action for step in self.steps for action in step.actions if not isinstance(action, sc_pb.Action)]
        return [(pysc2.FUNCTIONS[call.function].name, [list(map(int, a)) for a in call.arguments]) for call in calls]

    def _carry_out(self, step: Step) -> None:
        for action in step.actions:
            if isinstance(action, sc_pb.Action):
                centre = action.action_raw.camera_move.center_world_space
                self.camera = (centre.x, centre.y)
            elif pysc2.FUNCTIONS[action.function].name == "select_point":
                self._click(*map(int, action.arguments[1]), add=int(action.arguments[0][0]) == 1)

    def _click(self, px: int, py: int, *, add: bool) -> None:
        x = (px + 0.5 - 64) * 24 / 128 + self.camera[0]
        y = self.camera[1] - (py + 0.5 - 64) * 24 / 128
        hit = {t for t, place in self.places.items() if abs(place[0] - x) < 0.3 and abs(place[1] - y) < 0.3}
        self.selected = self.selected | hit if add else hit


@pytest.fixture
def table(unit: Make, snapshot: Snap) -> Callable[..., Table]:
    def make(**fields: Any) -> Table:
        return Table(unit, snapshot, **fields)

    return make


@pytest.fixture
def joint(task: Callable[..., TaskConfig]) -> Callable[..., JointAction]:
    """The joint action of a reply to a table, of an agent with one team of Stalkers."""

    def decide(table: Table, reply: str = REPLY, **team: Any) -> JointAction:
        config = task("3s_vs_3z")
        agent = config.agents[0]
        teams = (agent.teams[0].model_copy(update=team),)
        verbs = ("Attack_Unit", "Move_Screen", "Move_Minimap", "Select_Unit_Move_Screen", "Stop", "Hold_Position")
        config = config.model_copy(
            update={"agents": (agent.model_copy(update={"teams": teams, "actions": {"Stalker": verbs}}),)}
        )
        return Actor(config).joint(Observer(config).observe(table.now()), {agent.name: parse(reply)})

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


# --- screen -------------------------------------------------------------------------------------------------------

CLICKS = [("select_point", [[0], [64, 64]]), ("select_point", [[1], [74, 58]])]
ATTACK, MOVE = ("Attack_screen", [[0], [90, 64]]), ("Move_screen", [[1], [69, 64]])
ONE = ("select_point", [[0], [74, 58]])


@pytest.mark.parametrize(
    ("team", "functions"),
    [
        (
            {"kind": "group", "control_group": 4},
            [*CLICKS, ("select_control_group", [[1], [4]]), ATTACK, ONE, MOVE],
        ),
        ({"kind": "group", "control_group": None}, [*CLICKS, ATTACK, ONE, MOVE]),
        ({"kind": "select_all_type"}, [("select_point", [[2], [64, 64]]), ATTACK, ONE, MOVE]),
    ],
)
def test_the_screen_executor_selects_a_team_by_its_kind(
    team: dict[str, Any], functions: Sequence[Any], table: Any, joint: Any
) -> None:
    game = table()
    played = game.play(ScreenExecutor(), joint(game, **team), loops=30)
    assert game.functions() == list(functions)
    assert game.camera == (10, 10)
    assert [step.loops for step in game.steps] == [1] * (len(functions) + 1) + [30 - len(functions) - 1]
    assert played.functions[0] == "camera_move([10.0, 10.0])"
    assert played.refusals == ()


def test_a_control_group_is_recalled_once_it_is_set_and_set_again_when_a_unit_joins(table: Any, joint: Any) -> None:
    executor, stop = ScreenExecutor(), "Actions:\n<Stop()>"
    tours = []
    for places in ((S1,), (S1,), (S1, S2)):
        game = table()
        game.places = {tag: place for tag, place in game.places.items() if tag in (*places, FOE)}
        game.play(executor, joint(game, stop, control_group=4))
        tours.append([name for name, _ in game.functions()])
    assert tours == [
        ["select_point", "select_control_group", "Stop_quick"],
        ["select_control_group", "Stop_quick"],
        ["select_point", "select_point", "select_control_group", "Stop_quick"],
    ]


def test_a_new_episode_begins_with_empty_control_groups(table: Any, joint: Any) -> None:
    executor = ScreenExecutor()
    for _ in range(2):
        executor.begin()
        game = table()
        game.play(executor, joint(game, "<Stop()>", control_group=4))
        assert game.functions()[-2] == ("select_control_group", [[1], [4]])


def test_the_camera_goes_to_a_unit_that_is_off_the_screen_and_comes_back(table: Any, joint: Any) -> None:
    game = table()
    game.places[S2] = (30.0, 11.0)
    game.play(ScreenExecutor(), joint(game, "<Stop()>", control_group=None))
    moves = [
        a.action_raw.camera_move.center_world_space
        for s in game.steps
        for a in s.actions
        if isinstance(a, sc_pb.Action)
    ]
    assert [(move.x, move.y) for move in moves] == [(10, 10), (30, 11), (10, 10)]
    assert game.selected == {S1, S2}


def test_a_point_of_the_minimap_is_clicked_on_the_minimap(table: Any, joint: Any) -> None:
    game = table()
    game.play(ScreenExecutor(), joint(game, "<Move_Minimap([40.9, 12.2])>", control_group=None))
    assert game.functions()[-1] == ("Move_minimap", [[0], [40, 12]])


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
        ({FOE: (31.0, 10.0)}, {}, "the target is not on the screen"),
        ({S1: None, S2: None}, {}, "its units are gone"),
    ],
)
def test_a_command_that_has_become_impossible_is_refused(
    change: dict[int, tuple[float, float] | None], fields: dict[str, Any], message: str, table: Any, joint: Any
) -> None:
    game = table(**fields)
    wanted = joint(game, "<Attack_Unit(0x100180001)>")
    places = game.places | change
    game.places = {tag: place for tag, place in places.items() if place is not None}
    played = game.play(ScreenExecutor(), wanted)
    assert [r.rejection.message for r in played.refusals] == [f"The game refused Attack_Unit: {message}."]
    assert "Attack_screen" not in [name for name, _ in game.functions()]


def test_a_task_chooses_its_executor(task: Callable[..., TaskConfig]) -> None:
    assert isinstance(executor_of(task(executor="raw")), RawExecutor)
    assert isinstance(executor_of(task(executor="screen")), ScreenExecutor)
