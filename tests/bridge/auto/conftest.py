"""Games of the simulator to try rules in: a rule's orders are carried out, and the game shows the result."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2, debug_pb2, error_pb2, query_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.auto import RULES, NotAvailable, RuleRequest
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import functions
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.names import unit_name
from khala_bridge.state import Snapshot, Unit, read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_bridge.state.grid import NO_GRID
from khala_bridge.state.means import ledger_of
from khala_simulator.process.client import Client, command, interface

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.auto import RuleOrder
    from khala_bridge.frames import WorldPoint

RACES = {"protoss": common_pb2.Protoss, "terran": common_pb2.Terran, "zerg": common_pb2.Zerg}
FREE = (debug_pb2.all_resources, debug_pb2.tech_tree, debug_pb2.food, debug_pb2.fast_build)


class Game:
    """A melee game against an idle computer player."""

    def __init__(self, map_name: str, race: str, enemy: str, seed: int) -> None:
        self.client = Client()
        self.fed = False
        self.creep = NO_GRID
        self.client.ask(
            create_game=sc.RequestCreateGame(
                local_map=sc.LocalMap(map_path=map_name),
                player_setup=[
                    sc.PlayerSetup(type=sc.Participant),
                    sc.PlayerSetup(type=sc.Computer, race=RACES[enemy], difficulty=sc.VeryEasy),
                ],
                random_seed=seed,
            )
        )
        self.client.ask(join_game=sc.RequestJoinGame(race=RACES[race], options=interface(screen=0)))
        self.info = read_info(self.client.ask(game_info=sc.RequestGameInfo()).game_info, facts_of("multi"))
        self.see()

    def see(self) -> Snapshot:
        """Look at the game, and begin a new turn with a new ledger."""
        self.response = response = self.client.observe()
        blind = read_snapshot(response, self.info, creep=self.creep)
        self.creep = blind.creep
        answer = self.client.ask(query=question(blind)).query
        self.snapshot = dataclasses.replace(blind, abilities=available(answer))
        self.ledger = ledger_of(self.snapshot)
        if self.fed:  # the game's cheat does not show in its supply
            self.ledger.supply = 100.0
        return self.snapshot

    def play(self, loops: int) -> Snapshot:
        """Play some loops."""
        self.client.step(loops)
        return self.see()

    def cheat(self, *states: debug_pb2.DebugGameState.ValueType) -> Snapshot:
        """Switch on the game's own cheats: resources, tech, supply, fast building."""
        self.client.debug(*(debug_pb2.DebugCommand(game_state=state) for state in states or FREE))
        self.fed = self.fed or debug_pb2.food in (states or FREE)
        return self.play(1)

    def put(self, name: str, x: float, y: float, *, owner: int = 1, count: int = 1) -> int:
        """Put a unit somewhere, and return the tag of the newest of its type."""
        create = debug_pb2.DebugCommand(create_unit=debug_pb2.DebugCreateUnit(
            unit_type=knowledge()[name].id, owner=owner, pos=common_pb2.Point2D(x=x, y=y), quantity=count
        ))  # fmt: skip
        before = set(self.snapshot.units)
        self.client.debug(create)
        self.play(2)
        return max((u.tag for u in self.units(name) if u.tag not in before), default=0)

    def energize(self, name: str) -> Snapshot:
        """Fill the energy of every own unit of a type."""
        for unit in self.own(name):
            value = debug_pb2.DebugSetUnitValue(
                unit_value=debug_pb2.DebugSetUnitValue.Energy, value=unit.energy_max, unit_tag=unit.tag
            )
            self.client.debug(debug_pb2.DebugCommand(unit_value=value))
        return self.play(1)

    def units(self, name: str) -> list[Unit]:
        """Return the present units of a type, of all players."""
        return [unit for unit in self.snapshot.units.values() if unit_name(unit.unit_type) == name]

    def own(self, name: str) -> list[Unit]:
        """Return the own units of a type."""
        return [unit for unit in self.snapshot.own if unit_name(unit.unit_type) == name]

    # --- rules ------------------------------------------------------------------------------------------------

    def say(self, action: str, **given: Any) -> list[RuleOrder]:
        """Return the answer of an action's rule; `units`, `tag` and `point` are given as far as the call names them."""
        found = catalogue()[action]
        assert found.rule is not None
        return RULES[found.rule](RuleRequest(found, self.snapshot, self.ledger, **given))

    def refusal(self, action: str, **given: Any) -> NotAvailable:
        """Return the sentence of an action's rule that finds nothing."""
        with pytest.raises(NotAvailable) as raised:
            self.say(action, **given)
        return raised.value

    def do(self, orders: Sequence[RuleOrder]) -> list[str]:
        """Carry orders out; return the game's result of each."""
        actions = [
            command(
                order.function.ability_id, order.units, queue=order.queued,
                **({"target": order.target} if isinstance(order.target, int) else {"point": order.target}),
            )
            for order in orders
        ]  # fmt: skip
        return [error_pb2.ActionResult.Name(result) for result in self.client.act(*actions)]

    def may_stand(self, function: str, point: WorldPoint) -> str:
        """Return the game's verdict on a place for the product of a function."""
        asked = query_pb2.RequestQueryBuildingPlacement(
            ability_id=functions()[function].ability_id, target_pos=common_pb2.Point2D(x=point.x, y=point.y)
        )
        answer = self.client.ask(query=query_pb2.RequestQuery(placements=[asked])).query.placements[0]
        return error_pb2.ActionResult.Name(answer.result)


@pytest.fixture(scope="session")
def make_game() -> Callable[..., Game]:
    def make(map_name: str = "Simple64", race: str = "protoss", *, enemy: str = "terran", seed: int = 1) -> Game:
        return Game(map_name, race, enemy, seed)

    return make
