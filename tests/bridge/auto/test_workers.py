"""What the host does by itself: gathering, training workers, WarpGates; and what it leaves alone."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.auto.workers import automatic
from khala_bridge.names import unit_name
from khala_bridge.rules import Cost
from khala_bridge.state.ground import land_of
from khala_bridge.state.means import ledger_of
from khala_bridge.task.config import AutoConfig
from khala_orchestrator.config import all_tasks, change
from khala_simulator.process.client import command

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.auto import RuleOrder
    from tests.bridge.auto.conftest import Game

RICH = (debug_pb2.all_resources, debug_pb2.food)


def auto(game: Game, *ordered: int, **on: bool) -> list[RuleOrder]:
    return automatic(AutoConfig(**on), game.snapshot, game.ledger, frozenset(ordered))


def idle(game: Game) -> list[int]:
    """Stop every worker."""
    tags = [unit.tag for unit in game.own("Probe")]
    game.client.act(command(3665, tags))
    game.play(1)
    return tags


def target(game: Game, order: RuleOrder) -> str:
    assert isinstance(order.target, int)
    return unit_name(game.snapshot.units[order.target].unit_type)


def test_shipped_full_games_train_workers_by_default_and_the_rhythm_of_the_paper_does_in_every_task() -> None:
    tasks = list(all_tasks())
    by_default = {task.name for task in tasks if task.auto.train_workers}
    assert by_default == {task.name for task in tasks if task.name.startswith("simple64_")} != set()
    assert all(task.auto.gather for task in tasks if task.name in by_default)
    assert all(change(task, rhythm="paper").auto.train_workers for task in tasks)
    assert AutoConfig() == AutoConfig(gather=False, train_workers=False, warpgates=False)


def test_nothing_is_done_that_is_not_switched_on(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    idle(game)
    assert auto(game) == []


def test_idle_workers_gather(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    tags = idle(game)
    orders = auto(game, gather=True)
    assert [order.units[0] for order in orders] == sorted(tags)
    assert {target(game, order) for order in orders} <= {"MineralField", "MineralField750"}
    assert set(game.do(orders)) == {"Success"}
    game.play(50)
    assert auto(game, gather=True) == []


def test_whom_an_agent_ordered_is_left_alone(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    first, second, *_ = idle(game)
    game.ledger.take(second)
    ordered = {order.units[0] for order in auto(game, first, gather=True)}
    assert not {first, second} & ordered


def test_gas_gets_its_share_and_never_more_than_three(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(*RICH, debug_pb2.fast_build)
    game.do(game.say("Build_Assimilator"))
    while not [unit for unit in game.own("Assimilator") if unit.build_progress >= 1]:
        game.play(16)
    moved = 0
    for _ in range(12):
        orders = auto(game, gather=True)
        moved += len(orders)
        game.do(orders)
        game.play(22)
    assert game.own("Assimilator")[0].assigned_harvesters == moved == 2  # 2 of 3 is fuller than 10 of 16
    game.put("Probe", 46, 14, count=8)
    for _ in range(12):
        game.do(auto(game, gather=True))
        game.play(22)
    assert game.own("Assimilator")[0].assigned_harvesters == 3


def test_full_bases_give_workers_to_others(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    base = next(b.place for b in land_of(game.snapshot).bases if b.place.x < 20 and b.place.y < 20)
    game.put("Nexus", *base)
    game.put("Probe", 46, 14, count=8)
    for _ in range(6):
        game.do(auto(game, gather=True))
        game.play(22)
    old, new = sorted(game.own("Nexus"), key=lambda unit: -unit.pos.x)
    assert old.assigned_harvesters <= 16
    assert new.assigned_harvesters >= 3


@pytest.mark.parametrize(
    ("race", "worker", "function"),
    [
        ("protoss", "Probe", "Train_Probe_quick"),
        ("terran", "SCV", "Train_SCV_quick"),
        ("zerg", "Drone", "Train_Drone_quick"),
    ],
)
def test_town_halls_train_workers_one_at_a_time(
    make_game: Callable[..., Game], race: str, worker: str, function: str
) -> None:
    game = make_game("Flat64", race)
    (order,) = auto(game, train_workers=True)
    assert order.function.name == function
    assert game.ledger.minerals == 0
    assert game.do([order]) == ["Success"]
    game.play(2)
    assert auto(game, train_workers=True) == []
    game.play(300)
    assert len(game.own(worker)) == 13


def test_agents_minerals_come_first(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.ledger.pay(Cost(40, 0, 0))
    assert auto(game, train_workers=True) == []


def test_no_more_workers_than_there_is_work_for(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(*RICH)
    game.put("Probe", 46, 14, count=4)
    game.do(auto(game, gather=True))
    game.play(20)
    assert game.own("Nexus")[0].assigned_harvesters == 16
    assert auto(game, train_workers=True) == []


def test_free_gateways_become_warpgates(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(*RICH)
    game.put("Pylon", 44, 20)
    game.put("Gateway", 41.5, 20.5)
    assert auto(game, warpgates=True) == []
    gateway = game.own("Gateway")[0].tag
    with_upgrade = {**(game.snapshot.abilities or {}), gateway: frozenset({1518})}
    game.snapshot = replace(game.snapshot, abilities=with_upgrade)
    (order,) = auto(game, warpgates=True)
    assert (order.function.name, order.units) == ("Morph_WarpGate_quick", (gateway,))
    game.ledger = ledger_of(game.snapshot)
    assert auto(game, gateway, warpgates=True) == []
