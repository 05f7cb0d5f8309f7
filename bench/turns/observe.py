"""Measure a turn between PySC2 and the bus: the observations and joint actions of armies.

`observe` is everything from a snapshot to views and text of one agent with its teams, all units in sight of all
teams, half of them hurt since the turn before. `unseen` is what a snapshot costs at which no agent looks. `act` is
everything from the text of a reply, with three calls for each team, to commands. No game runs; the snapshots are made
here.

The last rows are a full game's twelve agents with 15 teams and 100 units, half of them enemies: in one place, where
every team sees all of them, and at four places, as in a fight of many fronts. The aim is 8 ms.
"""

from __future__ import annotations

import dataclasses
import json
import statistics
import time
from typing import TYPE_CHECKING, Any

from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table
from khala_bridge.act import Actor
from khala_bridge.catalogue.functions import general
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.observe import Observer
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_orchestrator.config import load_task
from khala_protocol.garbage import tidy_memory
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterator

BATTLES = {  # task: own units, enemy units
    "2s3z": ({"Stalker": 2, "Zealot": 3}, {"Stalker": 2, "Zealot": 3}),
    "1c3s5z": ({"Colossus": 1, "Stalker": 3, "Zealot": 5}, {"Colossus": 1, "Stalker": 3, "Zealot": 5}),
    "3s5z_vs_3s6z": ({"Stalker": 3, "Zealot": 5}, {"Stalker": 3, "Zealot": 6}),
    "2c_vs_64zg": ({"Colossus": 2}, {"Zergling": 64}),
}
ROUNDS = 200

GROUPS = {  # a full game's combat groups: teams and their types, as in the paper's appendix D
    "CombatGroup0": {"Zealot-1": "Zealot"},
    "CombatGroup1": {"Stalker-1": "Stalker"},
    "CombatGroup2": {"Immortal-1": "Immortal", "Colossus-1": "Colossus", "Archon-1": "Archon"},
    "CombatGroup3": {"VoidRay-1": "VoidRay", "Carrier-1": "Carrier"},
    "CombatGroup4": {"Observer": "Observer"},
    "CombatGroup5": {"HighTemplar-1": "HighTemplar"},
    "CombatGroup6": {"Sentry-1": "Sentry"},
    "CombatGroup7": {"Adept-1": "Adept"},
    "CombatGroup8": {"Phoenix-1": "Phoenix"},
    "CombatGroup9": {"WarpPrism": "WarpPrism"},
}
FULL_GAME = (
    {
        "Zealot": 10, "Stalker": 12, "Immortal": 3, "Colossus": 2, "Archon": 2, "VoidRay": 3, "Carrier": 1,
        "Observer": 1, "HighTemplar": 3, "Sentry": 3, "Adept": 5, "Phoenix": 4, "WarpPrism": 1,
    },
    {"Zergling": 24, "Roach": 12, "Hydralisk": 8, "Mutalisk": 6},
)  # fmt: skip


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
    response, info = messages(own, foes, loop)
    return read_snapshot(response, read_info(info, facts_of("multi")))


def messages(
    own: dict[str, int], foes: dict[str, int], loop: int, size: int = 32
) -> tuple[sc_pb.ResponseObservation, sc_pb.ResponseGameInfo]:
    response = sc_pb.ResponseObservation()
    info = sc_pb.ResponseGameInfo()
    observation = response.observation
    observation.game_loop = loop
    hurt = float(loop % 2 * 7)
    observation.raw_data.units.extend(army(own, raw_pb2.Self, 0x400, hurt) + army(foes, raw_pb2.Enemy, 0x800, hurt))
    for corner in (info.start_raw.map_size, info.start_raw.playable_area.p1):
        corner.x = corner.y = size
    return response, info


def full_game() -> TaskConfig:
    """Return the agents of a full game with standard control: Commander, Developer and ten combat groups."""
    leaders = [
        AgentConfig(name=name, role=name, kind=kind, teams=(TeamConfig(name="Empty", kind="side", actions=actions),))
        for name, kind, actions in (
            ("Commander", "commander", ("No_Operation",)),
            ("Developer", "developer", ("group:train/protoss", "group:research/protoss")),
        )
    ]
    fighters = [
        AgentConfig(
            name=name,
            role=name,
            teams=tuple(TeamConfig(name=team, unit_types=(unit,)) for team, unit in teams.items()),
            actions=dict.fromkeys(teams.values(), ("group:basic", "group:skill")),
        )
        for name, teams in GROUPS.items()
    ]
    return TaskConfig(name="full_game", map="2s3z", task="Destroy the enemy.", agents=(*leaders, *fighters))


def crowd(places: int, loop: int) -> Snapshot:
    """Return 100 units at some places, those of a type spread over all of them, with their usual abilities."""
    response, info = messages(*FULL_GAME, loop, size=128)
    for index, unit in enumerate(response.observation.raw_data.units):
        place = index % places
        unit.pos.x, unit.pos.y = 24 + 64 * (place % 2) + index % 10, 24 + 64 * (place // 2) + index // 10
    made = read_snapshot(response, read_info(info, facts_of("multi")))
    able = {unit.tag: frozenset(knowledge()[unit.name].ability_ids) for unit in made.own}
    generals = {tag: numbers | frozenset(map(general, numbers)) for tag, numbers in able.items()}
    return dataclasses.replace(made, abilities=generals)


def unseen_ms(task: TaskConfig, snapshots: list[Snapshot]) -> float:
    """Return the cost of an observation at which no agent looks."""
    observer = Observer(task)
    took_ms = []
    for round_ in range(ROUNDS):
        began = time.perf_counter()
        observer.observe(snapshots[round_ % 2])
        took_ms.append(1000 * (time.perf_counter() - began))
    return round(statistics.median(took_ms), 3)


def measure_full_game(places: int) -> dict[str, Any]:
    """Return the cost of one observation of all twelve agents."""
    observer = Observer(full_game())
    snapshots = [crowd(places, loop) for loop in (0, 1)]
    observe_ms = []
    observation = observer.observe(snapshots[1])
    tidy_memory()  # as a host does when a match begins
    for round_ in range(ROUNDS):
        began = time.perf_counter()
        observation = observer.observe(snapshots[round_ % 2])
        tuple(observation.agents.values())  # they are made when they are asked for
        observe_ms.append(1000 * (time.perf_counter() - began))
    return {
        "units": len(snapshots[0].units),
        "teams": sum(len(agent.teams) for agent in observation.agents.values()),
        "text_kB": round(sum(len(agent.text) for agent in observation.agents.values()) / 1000, 1),
        "observe_ms": round(statistics.median(observe_ms), 2),
        "observe_p95_ms": round(statistics.quantiles(observe_ms, n=20)[-1], 2),
        "unseen_ms": unseen_ms(full_game(), snapshots),
        "act_ms": "",
    }


def measure(name: str) -> dict[str, Any]:
    task = load_task(name)
    observer = Observer(task)
    actor = Actor(task)
    snapshots = [snapshot(*BATTLES[name], loop) for loop in (0, 1)]
    observe_ms, act_ms = [], []
    observation = observer.observe(snapshots[1])
    (agent,) = observation.agents.values()
    for round_ in range(ROUNDS):
        began = time.perf_counter()
        observation = observer.observe(snapshots[round_ % 2])
        (agent,) = observation.agents.values()  # made when it is asked for
        seen = time.perf_counter()
        reply = "Actions:\n" + "\n".join(
            f"Team {team.name}:\n" + f"<Attack_Unit({team.enemies[0].tag})>\n" * task.max_actions
            for team in agent.view.teams
        )
        said = time.perf_counter()
        joint = actor.joint(observation, {agent.agent.name: parse(reply)})
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
        "unseen_ms": unseen_ms(task, snapshots),
        "act_ms": round(statistics.median(act_ms), 2),
    }


def measures(found: Any) -> Iterator[Figure]:
    """Yield what the observation of a side costs, and what is done with the replies to it."""
    for name, row in found.items():
        yield Figure(f"views and texts, {name}", "ms", (row["observe_ms"],))
        if row["act_ms"] != "":
            yield Figure(f"replies to commands, {name}", "ms", (row["act_ms"],))


def main() -> None:
    given = make_parser(__doc__).parse_args()
    results = {name: measure(name) for name in BATTLES}
    results |= {"12 in one place": measure_full_game(1), "12 at four": measure_full_game(4)}
    if given.json:
        print(json.dumps(results))
        return
    print_table(("battle", *results["2s3z"]), [(name, *result.values()) for name, result in results.items()])
