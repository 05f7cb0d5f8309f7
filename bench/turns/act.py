"""Measure the time from replies of about 2 kB to checked commands.

One agent has five teams of four units and may use every text action of the catalogue, including other races'.
The game has reported what each unit can do now. `read` is the reply's text → calls, `check` is calls → commands:
names, teams and arguments, who may do it now, at what, and the accounts of the turn. `wrong` is a reply of the same
length with two of three calls refused, including the search for what was most likely meant. The times are of the
processor: nothing waits here, and other programs disturb them less.
"""

from __future__ import annotations

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
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import general
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.observe import Observer
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.task.config import AgentConfig, TaskConfig
from khala_bridge.task.maps import MapSpec
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterator

AGENT = "Commander"
TEAMS = ("Stalker", "Zealot", "Immortal", "HighTemplar", "Sentry")
UNITS_PER_TEAM = 4
FOES = 40
FIRST_OWN, FIRST_FOE = 0x400, 0x800
CALLS = ("<Attack_Unit({foe})>", "<Move_Screen([{x}, 9.5])>", "<Select_Unit_Attack_Unit({own}, {foe})>")
WRONG = ("<Atack_Unit({foe})>", "<Move_Screen([{x}, 9.5])>", "<Attack_Unit(0x200c0021)>")
ROUNDS = 300


def scene() -> tuple[Actor, Any]:
    """Return an actor, and what its agent sees."""
    actions = [action for action in catalogue().values() if action.subject != "side"]
    base = tuple(action.name for action in catalogue().values() if action.subject == "side")
    agent = AgentConfig.model_validate(
        {
            "name": AGENT,
            "role": "",
            "teams": [
                *({"name": f"{name}-1", "unit_types": [name]} for name in TEAMS),
                {"name": "Base", "kind": "side", "actions": base},
            ],
            "actions": {name: tuple(a.name for a in actions if a.fits(name)) for name in knowledge()},
            "max_actions": len(CALLS),
        }
    )
    spec = MapSpec(file="none.SC2Map", race="protoss", opponent="zerg")
    task = TaskConfig(name="act", task="", own_map=spec, agents=(agent,))
    return Actor(task), Observer(task).observe(snapshot())


def snapshot() -> Snapshot:
    """Return a snapshot of five teams of four, and forty enemies around them."""
    response = sc_pb.ResponseObservation()
    info = sc_pb.ResponseGameInfo()
    units = response.observation.raw_data.units
    own = [name for name in TEAMS for _ in range(UNITS_PER_TEAM)]
    armies = ((own, raw_pb2.Self, FIRST_OWN), (["Roach"] * FOES, raw_pb2.Enemy, FIRST_FOE))
    for names, alliance, first in armies:
        for place, name in enumerate(names):
            unit = units.add(
                tag=tag_of(first + place),
                unit_type=knowledge()[name].id,
                alliance=raw_pb2.Alliance.ValueType(alliance),
                display_type=raw_pb2.Visible,
                health=40,
                health_max=160,
                build_progress=1,
            )
            unit.pos.x, unit.pos.y = 60.0 + place % 8, 60.0 + place // 8
    for size in (info.start_raw.map_size, info.start_raw.playable_area.p1):
        size.x = size.y = 128
    abilities = {unit.tag: every_form(own[i]) for i, unit in enumerate(units[: len(own)])}
    return read_snapshot(response, read_info(info, facts_of("multi")), abilities=abilities)


def every_form(unit_type: str) -> frozenset[int]:
    """Return all abilities of a type, as themselves and in their general form."""
    known = knowledge()[unit_type].ability_ids
    return frozenset((*known, *map(general, known)))


def tag_of(index: int) -> int:
    """Return the tag of the unit of this number, as the game forms them."""
    return (index << 18) + 1


def reply(calls: tuple[str, ...]) -> str:
    """Return an agent's reply: an analysis, then three calls for each team."""
    thoughts = "the Roaches come nearer and their first row is hurt, so all teams take it down. "
    lines = ["Analysis: " + thoughts * 14, "Actions:"]
    for place, name in enumerate(TEAMS):
        own, foe = hex(tag_of(FIRST_OWN + place * UNITS_PER_TEAM)), hex(tag_of(FIRST_FOE + place))
        lines += [f"    Team {name}-1:", *("        " + call.format(own=own, foe=foe, x=place) for call in calls)]
    lines += ["Communications:", "    <MessageTo(Commander2, '''we take the first row''')>"]
    return "\n".join(lines)


def measure(calls: tuple[str, ...]) -> dict[str, Any]:
    """Return the figures of one kind of reply."""
    actor, observation = scene()
    text = reply(calls)
    read_ms, check_ms = [], []
    joint = actor.joint(observation, {AGENT: parse(text)})
    for _ in range(ROUNDS):
        began = time.process_time()
        speech = parse(text)
        read = time.process_time()
        joint = actor.joint(observation, {AGENT: speech})
        check_ms.append(1000 * (time.process_time() - read))
        read_ms.append(1000 * (read - began))
    both = [read + check for read, check in zip(read_ms, check_ms, strict=True)]
    return {
        "actions": len(observation.agents[AGENT].agent.catalogue()),
        "kB": round(len(text) / 1000, 1),
        "calls": len(joint.accepted[AGENT]),
        "refused": len(joint.rejections[AGENT]),
        "read_ms": round(statistics.median(read_ms), 3),
        "check_ms": round(statistics.median(check_ms), 3),
        "all_ms": round(statistics.median(both), 3),
        "all_p95_ms": round(statistics.quantiles(both, n=20)[-1], 3),
    }


def measures(found: Any) -> Iterator[Figure]:
    """Yield what each kind of reply costs."""
    for name, row in found.items():
        yield Figure(f"a reply to commands, {name}", "ms of processor time", (row["all_ms"],))


def main() -> None:
    """Print the figures."""
    given = make_parser(__doc__).parse_args()
    results = {"right": measure(CALLS), "wrong": measure(WRONG)}
    if given.json:
        print(json.dumps(results))
        return
    print_table(("reply", *results["right"]), [(name, *result.values()) for name, result in results.items()])
