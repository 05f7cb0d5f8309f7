"""For any action on any map: rules answer with orders or say why not, and raise nothing else."""

from __future__ import annotations

import random

import pytest
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.auto import RULES, NotAvailable, RuleRequest
from khala_bridge.auto.workers import automatic
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import facts_of
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_bridge.state.means import ledger_of
from khala_bridge.task.config import AutoConfig
from khala_simulator.process.client import Client, interface

MAPS = (
    "llm_pysc2/pvz_task1_level1", "llm_pysc2/pvz_task3_level2", "llm_pysc2/pvz_task8_level3", "llm_smac/2s3z",
    "llm_smac/2c_vs_64zg", "SMAC_Maps/MMM", "mini_games/BuildMarines", "mini_games/CollectMineralsAndGas",
    "mini_games/DefeatRoaches", "Melee/Simple64", "Melee/Flat32",
)  # fmt: skip
ACTIONS = [action for action in catalogue().values() if action.rule]


def scene(name: str) -> Snapshot:
    client = Client()
    alone = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_path=name), player_setup=[sc.PlayerSetup(type=sc.Participant)], random_seed=1
    )
    if client.create(name).error:
        client.ask(create_game=alone)
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    response = client.step(40)
    info = read_info(client.ask(game_info=sc.RequestGameInfo()).game_info, facts_of("multi"))
    answer = client.ask(query=question(read_snapshot(response, info))).query
    return read_snapshot(response, info, abilities=available(answer))


@pytest.mark.parametrize("name", MAPS)
def test_no_rule_fails(name: str) -> None:
    snapshot, chance = scene(name), random.Random(name)
    width, height = snapshot.info.size
    own, everybody = [unit.tag for unit in snapshot.own], [*snapshot.units, 0x123]
    answered, said = 0, set[str]()
    for action in ACTIONS:
        rule = RULES[action.rule or ""]
        units = (chance.choice(own),) if own and chance.random() < 0.5 else ()
        point = WorldPoint(chance.uniform(-5, width + 5), chance.uniform(-5, height + 5))
        for rich in (False, True):
            ledger = ledger_of(snapshot)
            if rich:
                ledger.minerals = ledger.vespene = ledger.supply = 9999.0
            try:
                orders = rule(RuleRequest(action, snapshot, ledger, units, chance.choice(everybody), point))
            except NotAvailable as impossible:
                said.add(impossible.message)
                continue
            answered += 1
            assert all(order.units for order in orders)
            assert all(tag in own for order in orders for tag in order.units)
    everything = AutoConfig(gather=True, train_workers=True, warpgates=True)
    automatic(everything, snapshot, ledger_of(snapshot), frozenset())
    assert answered or not own
    assert all(message.endswith(".") and message[0] != " " for message in said)
