"""Ask the rules of `khala_bridge.auto` in the middle of a game on the simulator, and measure the cost of an answer.

    python -m bench.macro            a table
    python -m bench.macro --json     one JSON object on stdout

A base, an army of 40 and an enemy are put on the map of a melee game. Every action is asked 40 times with its own
snapshot (`new ms`: the land of that moment is made first) and once more with the same one (`ms`). Medians of the
processor's time, so that a busy machine does not count. The aim is 1 ms.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import time
from typing import Any

from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.auto import RULES, NotAvailable, RuleRequest
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.knowledge import knowledge
from khala_bridge.state import EpisodeInfo, Snapshot, read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_bridge.state.ground import land_of
from khala_bridge.state.means import ledger_of
from khala_simulator.process.client import Client, interface

MAPS = ("Simple64", "Simple128")
ACTIONS = (
    "Build_Pylon", "Build_Gateway", "Build_PhotonCannon", "Build_Nexus", "Build_Assimilator", "Train_Zealot",
    "Research_ProtossGroundWeapons", "Warp_Stalker", "ChronoBoost_Military", "All_Units_Attack", "All_Units_Defend",
    "Worker_Scan",
)  # fmt: skip
UNITS = (
    ("Pylon", 8, -3, 1), ("WarpGate", 7.5, 1.5, 1), ("Gateway", 10.5, 1.5, 1), ("Forge", 10.5, -2.5, 1),
    ("CyberneticsCore", 10.5, -5.5, 1),
)  # fmt: skip
ARMY = (("Stalker", 12, 0, 40), ("Probe", 2, -4, 20))
TIMES = 40


def scene(map_name: str) -> Snapshot:
    """Return the middle of a game, in which everything can be paid."""
    client = Client()
    client.play(map_name, interface(screen=0), seed=1)
    info = read_info(client.ask(game_info=sc_pb.RequestGameInfo()).game_info)
    start = land_of(read_snapshot(client.observe(), info)).own_halls[0].pos
    inward = 1 if start.x < info.size[0] / 2 else -1
    for cheat in (debug_pb2.all_resources, debug_pb2.food):
        client.debug(debug_pb2.DebugCommand(game_state=cheat))
    for name, dx, dy, count in (*UNITS, *ARMY):
        at = common_pb2.Point2D(x=start.x + inward * dx, y=start.y + dy)
        made = debug_pb2.DebugCreateUnit(unit_type=knowledge()[name].id, owner=1, pos=at, quantity=count)
        client.debug(debug_pb2.DebugCommand(create_unit=made))
        client.step(4)
    return look(client, info)


def look(client: Client, info: EpisodeInfo) -> Snapshot:
    response = client.observe()
    answer = client.ask(query=question(read_snapshot(response, info))).query
    return read_snapshot(response, info, abilities=available(answer))


def ask(action: str, snapshot: Snapshot) -> tuple[float, str]:
    """Return the time of an answer, in milliseconds, and whether it was orders."""
    found = catalogue()[action]
    assert found.rule is not None
    asked = RuleRequest(found, snapshot, ledger_of(snapshot))
    asked.ledger.supply = 50
    began = time.process_time()
    try:
        RULES[found.rule](asked)
        answer = "orders"
    except NotAvailable as impossible:
        answer = impossible.message
    return 1000 * (time.process_time() - began), answer


def measure(shown: Snapshot, action: str) -> dict[str, Any]:
    new, same, answer = [], [], ""
    for _ in range(TIMES):
        snapshot = dataclasses.replace(shown)
        new.append(ask(action, snapshot)[0])
        took, answer = ask(action, snapshot)
        same.append(took)
    return {"new ms": round(statistics.median(new), 2), "ms": round(statistics.median(same), 2), "answer": answer}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json", action="store_true", help="one JSON object on stdout")
    asked = options.parse_args()
    results = {}
    for name in MAPS:
        shown = scene(name)
        results[name] = {action: measure(shown, action) for action in ACTIONS}
    if asked.json:
        print(json.dumps(results))
        return
    print(f"{'map':>10}  {'action':>30}  {'new ms':>7}  {'ms':>6}  answer")
    for name, by_action in results.items():
        for action, row in by_action.items():
            print(f"{name:>10}  {action:>30}  {row['new ms']:>7}  {row['ms']:>6}  {row['answer'][:60]}")


if __name__ == "__main__":
    main()
