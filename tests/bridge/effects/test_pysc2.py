"""Both executors through PySC2 as it is, in a game of its own process: each kind of function, each way to select."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import pytest
from s2clientprotocol import common_pb2, debug_pb2

from khala_bridge.act import Actor
from khala_bridge.act.plan import PlanResult, PlanStep
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.compat import actions as pysc2
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.knowledge import knowledge
from khala_bridge.names import order_name, unit_name
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_bridge.task.maps import known_maps
from khala_protocol.speech import parse
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.act import Executor
    from khala_bridge.act.plan import Plan
    from khala_bridge.state import Snapshot

pytestmark = pytest.mark.game

OWN, FOE = 1, 2


class Play(NamedTuple):
    """Units beside the own base, words for them, and the expected result."""

    units: tuple[tuple[str, int, float, float], ...]
    """Type, owner, and place as seen from the base, towards the middle of the map."""
    action: str
    arguments: str
    """With `{Roach}` for the tag of a unit of that type."""
    way: tuple[str, ...]
    """What the screen executor calls, without the camera."""
    order: str
    """Order that units have afterwards, or the type of a new one."""


PLAYS = {
    "quick": Play(
        (("Stalker", OWN, 9, 9),), "Hold_Position", "", ("select_point", "HoldPosition_quick"), "HoldPosition"
    ),
    "minimap": Play((("Stalker", OWN, 9, 9),), "Move_Minimap", "[32, 32]", ("select_point", "Move_minimap"), "Move"),
    "a target on the screen": Play(
        (("Medivac", OWN, 9, 9), ("Zealot", OWN, 13, 12)),
        "Move_Unit",
        "{Zealot}",
        ("select_point", "Move_screen"),
        "Move",
    ),
    "a place on the screen": Play(
        (("Sentry", OWN, 9, 9),),
        "Ability_ForceField_Screen",
        "[15, 12]",
        ("select_point", "Effect_ForceField_screen"),
        "ForceField",
    ),
    "all of a type": Play(
        (("Zealot", OWN, 9, 9), ("Zealot", OWN, 11, 9), ("Zealot", OWN, 9, 12)),
        "Hold_Position",
        "",
        ("select_point", "HoldPosition_quick"),
        "HoldPosition",
    ),
    "one that is far from the others": Play(
        (("Zealot", OWN, 9, 9), ("Zealot", OWN, 30, 12)),
        "Hold_Position",
        "",
        ("select_point", "select_point", "HoldPosition_quick"),
        "HoldPosition",
    ),
    "the army": Play(
        tuple(("Zealot", OWN, 6 + 6 * i, 10) for i in range(6)),
        "Hold_Position",
        "",
        ("select_army", "HoldPosition_quick"),
        "HoldPosition",
    ),
    "a WarpGate": Play(
        (("WarpGate", OWN, 10, 4), ("WarpGate", OWN, 4, 10), ("Pylon", OWN, 8, 8)),
        "Warp_Zealot",
        "",
        ("select_warp_gates", "TrainWarp_Zealot_screen"),
        "Zealot",
    ),
    "a Larva": Play(
        (("Hatchery", OWN, 12, 12), ("Larva", OWN, 12, 16), ("Larva", OWN, 13, 16)),
        "Train_Drone",
        "",
        ("select_point", "select_larva", "Train_Drone_quick"),
        "Cocoon",
    ),
    "the only idle worker": Play(
        (("SCV", OWN, 9, 9),),
        "Build_SupplyDepot_Screen",
        "[16, 12]",
        ("select_idle_worker", "Build_SupplyDepot_screen"),
        "Build_SupplyDepot",
    ),
    "what is done without being told": Play(
        (("Medivac", OWN, 9, 9),), "Effect_Heal_Autocast", "", ("select_point", "Effect_Heal_autocast"), ""
    ),
}


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PySC2Game]:
    sc2path = install(tmp_path_factory.mktemp("sc2"))
    game = PySC2Game(GameConfig(sc2path=sc2path, map=known_maps()["Simple64"], seed=3, limit_loops=600))
    yield game
    game.close()


@pytest.mark.parametrize("executor", [RawExecutor(), ScreenExecutor()], ids=["raw", "screen"])
@pytest.mark.parametrize("name", PLAYS)
def test_words_are_played_through_pysc2(name: str, executor: Executor, game: PySC2Game) -> None:
    play = PLAYS[name]
    now = _set_up(game, play)
    before = _seen(now)
    played, now = _say(game, play, executor, now)
    assert played.refusals == ()
    if play.order:
        assert play.order in _seen(now) - before
    called = tuple(function.split("(")[0] for function in played.functions)
    if isinstance(executor, ScreenExecutor):
        assert tuple(name for name in called if name != "camera_move") == play.way
    else:
        assert len(called) == 1


def test_a_team_is_recalled_by_its_control_group(game: PySC2Game) -> None:
    play, executor = PLAYS["all of a type"], ScreenExecutor()
    now = _set_up(game, play._replace(units=(*play.units, ("Medivac", OWN, 12, 12))))
    first, now = _say(game, play, executor, now, control_group=3)
    assert "select_control_group(set, 3)" in first.functions
    (turn,) = game.act([_select_others()])
    second, _ = _say(game, play, executor, turn.snapshot, control_group=3)
    assert [call for call in second.functions if not call.startswith("camera")] == [
        "select_control_group(recall, 3)",
        "HoldPosition_quick(now)",
    ]


def _select_others() -> Plan:
    yield PlanStep((pysc2.FUNCTIONS.select_army("select"),), 1)
    return PlanResult()


def test_what_units_can_do_is_asked_once_an_observation_and_not_after_the_end(game: PySC2Game) -> None:
    (now,) = game.reset()
    assert now.abilities is not None
    assert now.abilities.keys() == {unit.tag for unit in now.own}
    while not now.ended:
        (turn,) = game.act([RawExecutor().plan([], now, 200)])
        now = turn.snapshot
    assert now.abilities is None


def _set_up(game: PySC2Game, play: Play) -> Snapshot:
    """Return a new episode with additional units, and money."""
    (now,) = game.reset()
    base = next(unit for unit in now.own if unit_name(unit.unit_type) == "Nexus").pos
    x0, y0, x1, y1 = now.info.playable
    toward_x = 1 if base.x < (x0 + x1) / 2 else -1
    toward_y = 1 if base.y < (y0 + y1) / 2 else -1
    commands = [debug_pb2.DebugCommand(game_state=debug_pb2.all_resources)]
    for kind, owner, x, y in play.units:
        order = debug_pb2.DebugCreateUnit(unit_type=knowledge()[kind].id, owner=owner, quantity=1)
        order.pos.CopyFrom(common_pb2.Point2D(x=base.x + toward_x * x, y=base.y + toward_y * y))
        commands.append(debug_pb2.DebugCommand(create_unit=order))
    game._env._controllers[0].debug(commands)
    (turn,) = game.act([RawExecutor().plan([], now, 4)])
    return turn.snapshot


def _say(
    game: PySC2Game, play: Play, executor: Executor, now: Snapshot, control_group: int | None = None
) -> tuple[PlanResult, Snapshot]:
    """Play a reply of an agent and some loops."""
    kinds = tuple(dict.fromkeys(kind for kind, owner, _, _ in play.units if owner == OWN))
    if play.action.startswith(("Warp_", "Train_")):
        team = TeamConfig(name="Team", kind="side", actions=(play.action,))
        agent = AgentConfig(name="Agent", role="", kind="developer", admits="any", teams=(team,))
    else:
        team = TeamConfig(name="Team", unit_types=kinds, control_group=control_group)
        agent = AgentConfig(
            name="Agent", role="", admits="any", teams=(team,), actions=dict.fromkeys(kinds, (play.action,))
        )
    task = TaskConfig(name="plays", map="Simple64", task="", agents=(agent,))
    tags = {unit_name(unit.unit_type): hex(unit.tag) for unit in now.units.values()}
    reply = f"Actions:\n<{play.action}({play.arguments.format(**tags)})>"
    joint = Actor(task).joint(Observer(task).observe(now), {"Agent": parse(reply)})
    assert joint.rejections["Agent"] == ()
    (turn,) = game.act([executor.plan(joint.commands, now, 24)])
    return turn.played, turn.snapshot


def _seen(now: Snapshot) -> set[str]:
    """Return the names of own units' orders, and of all units' types."""
    orders = {order_name(order.ability_id) for unit in now.own for order in unit.orders}
    return orders | {unit_name(unit.unit_type) for unit in now.units.values()}
