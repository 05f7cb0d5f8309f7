"""Makes observations and joint actions of armies, and says what a turn costs between PySC2 and the bus.

    python bench/observe.py            a table
    python bench/observe.py --json     one JSON object on stdout

`observe` is everything from a snapshot to views and text of one agent with its teams, all units in sight of all
teams, half of them hurt since the turn before. `act` is everything from the text of a reply, with three calls for
each team, to commands. No game runs; the snapshots are made here.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from typing import Any

from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bridge.act import Actor
from bridge.knowledge import knowledge
from bridge.observe import Observer
from bridge.snapshot import Snapshot
from orchestrator.config import load_task
from protocol.speech import parse

BATTLES = {  # task: own units, enemy units
    "2s3z": ({"Stalker": 2, "Zealot": 3}, {"Stalker": 2, "Zealot": 3}),
    "1c3s5z": ({"Colossus": 1, "Stalker": 3, "Zealot": 5}, {"Colossus": 1, "Stalker": 3, "Zealot": 5}),
    "2c_vs_64zg": ({"Colossus": 2}, {"Zergling": 64}),
}
ROUNDS = 200


def army(units: dict[str, int], alliance: int, first: int, hurt: float) -> list[raw_pb2.Unit]:
    names = [name for name, count in units.items() for _ in range(count)]
    made = []
    for place, name in enumerate(names):
        known = knowledge()[name]
        unit = raw_pb2.Unit(
            tag=(first + place << 18) + 1,
            unit_type=known.id,
            alliance=raw_pb2.Alliance.ValueType(alliance),
            display_type=raw_pb2.Visible,
            cloak=raw_pb2.NotCloaked,
            health=known.health - hurt * (place % 2),
            health_max=known.health,
            shield=known.shield,
            shield_max=known.shield,
            build_progress=1,
        )
        unit.pos.x, unit.pos.y = 12 + place % 8 + (alliance == raw_pb2.Enemy) * 4, 12 + place // 8
        made.append(unit)
    return made


def snapshot(own: dict[str, int], foes: dict[str, int], loop: int) -> Snapshot:
    response, info = sc_pb.ResponseObservation(), sc_pb.ResponseGameInfo()
    observation = response.observation
    observation.game_loop = loop
    hurt = float(loop % 2 * 7)
    observation.raw_data.units.extend(army(own, raw_pb2.Self, 0x400, hurt) + army(foes, raw_pb2.Enemy, 0x800, hurt))
    for size in (info.start_raw.map_size, info.start_raw.playable_area.p1):
        size.x = size.y = 32
    return Snapshot(response=response, info=info)


def measure(name: str) -> dict[str, Any]:
    task = load_task(name)
    observer, actor = Observer(task), Actor(task)
    snapshots = [snapshot(*BATTLES[name], loop) for loop in (0, 1)]
    observe_ms, act_ms = [], []
    sight = observer.observe(snapshots[1])
    (agent,) = sight.agents.values()
    for round_ in range(ROUNDS):
        began = time.perf_counter()
        sight = observer.observe(snapshots[round_ % 2])
        seen = time.perf_counter()
        (agent,) = sight.agents.values()
        reply = "Actions:\n" + "\n".join(
            f"Team {team.name}:\n" + f"<Attack_Unit({team.enemies[0].tag})>\n" * task.max_actions
            for team in agent.view.teams
        )
        said = time.perf_counter()
        joint = actor.joint(sight, {agent.agent.name: parse(reply)})
        act_ms.append(1000 * (time.perf_counter() - said))
        observe_ms.append(1000 * (seen - began))
        assert len(joint.commands) == task.max_actions * len(agent.teams)
    quantile = statistics.quantiles(observe_ms, n=20)[-1]
    return {
        "units": len(snapshots[0].units),
        "teams": len(agent.teams),
        "text_kB": round(len(agent.text) / 1000, 1),
        "observe_ms": round(statistics.median(observe_ms), 2),
        "observe_p95_ms": round(quantile, 2),
        "act_ms": round(statistics.median(act_ms), 2),
    }


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json", action="store_true", help="one JSON object on stdout")
    results = {name: measure(name) for name in BATTLES}
    if options.parse_args().json:
        print(json.dumps(results))
        return
    columns = list(results["2s3z"])
    print("  ".join(f"{column:>14}" for column in ("battle", *columns)))
    for name, result in results.items():
        print("  ".join(f"{value:>14}" for value in (name, *(result[column] for column in columns))))


if __name__ == "__main__":
    main()
