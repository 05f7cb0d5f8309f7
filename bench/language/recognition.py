"""Measure how much of the meaning of a corpus of replies is understood.

    python -m bench recognition            a table
    python -m bench recognition --misses   and every reply that is not read as a person would read it

The corpus (`tests/bridge/corpus/*.yaml`) holds replies as models write them, and what a reasonable person would
understand: calls with team, name and arguments, messages, channels, and the rejections. It was written by
hand, before the reader was measured with it. `found` is the share of the meant calls and words that are read exactly;
`invented` is what was read and not meant, including calls that are only mentioned, negated or taken back.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Literal

import yaml
from pydantic import BaseModel, ConfigDict
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bench.command_line import make_parser
from bench.paths import TESTS
from bench.tables import print_table
from khala_bridge.act import Actor
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.observe import Observer
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.task.config import AgentConfig, TaskConfig
from khala_bridge.task.maps import MapSpec
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.observe.observation import SideObservation

CORPUS = TESTS / "bridge" / "corpus"
AGENT = "CombatGroup1"
OWN = {
    0x100040001: "Stalker",
    0x100080001: "Stalker",
    0x1000C0001: "Zealot",
    0x100100001: "Zealot",
    0x100140001: "Immortal",
}
FOES = {0x1001C0001: "Zealot", 0x100200001: "Roach", 0x100240001: "Hydralisk"}
DEAD = 0x1002C0001
BLINK = 87
ACTIONS = (
    *("No_Operation", "Hold_Position", "Stop", "Move_Screen", "Move_Minimap", "Attack_Unit"),
    *("Select_Unit_Move_Screen", "Select_Unit_Move_Minimap", "Select_Unit_Attack_Unit"),
)
BLINKS = ("Ability_Blink_Screen", "Select_Unit_Blink_Screen")


class Entry(BaseModel):
    """One reply, and its meaning."""

    model_config = ConfigDict(extra="forbid")

    title: str
    reply: str
    roster: Literal["one", "many"] = "many"
    """Whether the agent has one team of Stalkers, or teams of Stalkers, Zealots and an Immortal."""
    calls: tuple[str, ...] = ()
    """`Stalker-1 <Attack_Unit(0x1)>`, in the order of the text."""
    messages: tuple[str, ...] = ()
    """`Commander: hold the ramp`."""
    listens: tuple[str, ...] = ()
    rejections: tuple[str, ...] = ()
    """Reason and words: `malformed <Stop(`."""
    not_meant: tuple[str, ...] = ()
    """Calls in the text that are not orders."""


@dataclass
class Reading:
    """The reader's result for a reply."""

    calls: list[str]
    messages: list[str]
    listens: list[str]
    rejections: list[str]


@dataclass
class Score:
    """How well replies were read."""

    replies: int = 0
    meant: int = 0
    """Calls, messages and channels that the replies mean."""
    found: int = 0
    invented: int = 0
    rejections: int = 0
    """Rejections that the replies require."""
    rejected: int = 0
    exact: int = 0
    """Replies that are read exactly as they are meant, with the right rejections."""
    not_meant: int = 0
    misses: list[str] = field(default_factory=list)

    def add(self, entry: Entry, reading: Reading) -> None:
        """Count one reply."""
        self.replies += 1
        self.not_meant += len(entry.not_meant)
        pairs = (entry.calls, reading.calls), (entry.messages, reading.messages), (entry.listens, reading.listens)
        for meant, read in pairs:
            both = (Counter(meant) & Counter(read)).total()
            self.meant += len(meant)
            self.found += both
            self.invented += len(read) - both
        self.rejections += len(entry.rejections)
        self.rejected += (Counter(entry.rejections) & Counter(reading.rejections)).total()
        said = (*pairs, (entry.rejections, reading.rejections))
        if all(list(meant) == read for meant, read in said):
            self.exact += 1
        else:
            self.misses.append(
                f"{entry.title}\n" + "".join(f"    {list(m)}\n    {r}\n" for m, r in said if list(m) != r)
            )


def corpus() -> dict[str, list[Entry]]:
    """Return the replies by the name of their file."""
    return {
        file.stem: [Entry.model_validate(entry) for entry in yaml.safe_load(file.read_text("utf-8"))]
        for file in sorted(CORPUS.glob("*.yaml"))
    }


def read(entry: Entry) -> Reading:
    """Return the reader's result for a reply."""
    actor, observation = _scene(entry.roster)
    speech = parse(entry.reply)
    joint = actor.joint(observation, {AGENT: speech})
    return Reading(
        calls=list(joint.accepted[AGENT]),
        messages=[f"{message.recipient}: {message.text}" for message in speech.messages],
        listens=[listen.channel for listen in speech.listens],
        rejections=[f"{rejection.reason} {rejection.text}" for rejection in joint.rejections[AGENT]],
    )


def scores(files: Iterable[tuple[str, list[Entry]]]) -> dict[str, Score]:
    """Return how well the replies of each file were read."""
    found = {name: Score() for name, _ in files}
    for name, entries in files:
        for entry in entries:
            found[name].add(entry, read(entry))
    return found


@cache
def _scene(roster: str) -> tuple[Actor, SideObservation]:
    task = _task(("Stalker",) if roster == "one" else ("Stalker", "Zealot", "Immortal"))
    return Actor(task), Observer(task).observe(_snapshot())


def _task(types: tuple[str, ...]) -> TaskConfig:
    agent = AgentConfig.model_validate(
        {
            "name": AGENT,
            "role": "",
            "teams": [{"name": f"{name}-1", "unit_types": [name]} for name in types],
            "actions": {name: ACTIONS + BLINKS if name == "Stalker" else ACTIONS for name in types},
        }
    )
    return TaskConfig(
        name="corpus",
        task="",
        own_map=MapSpec(file="none.SC2Map", race="protoss", opponent="zerg"),
        agents=(agent,),
        max_actions=5,
    )


def _snapshot() -> Snapshot:
    response = sc_pb.ResponseObservation()
    info = sc_pb.ResponseGameInfo()
    raw = response.observation.raw_data
    for units, alliance, x in ((OWN, raw_pb2.Self, 32.0), (FOES, raw_pb2.Enemy, 36.0)):
        for place, (tag, name) in enumerate(units.items()):
            unit = raw.units.add(
                tag=tag,
                unit_type=knowledge()[name].id,
                alliance=raw_pb2.Alliance.ValueType(alliance),
                display_type=raw_pb2.Visible,
                health=40,
                health_max=160,
                build_progress=1,
            )
            unit.pos.x = x
            unit.pos.y = 32.0 + place
    raw.player.upgrade_ids.append(BLINK)
    for size in (info.start_raw.map_size, info.start_raw.playable_area.p1):
        size.x = size.y = 64
    return read_snapshot(response, read_info(info, facts_of("multi")), dead=frozenset({DEAD}))


def main() -> None:
    """Print the figures."""
    options = make_parser(__doc__)
    options.add_argument("--misses", action="store_true", help="show replies that are not read as meant")
    chosen = options.parse_args()
    found = scores(list(corpus().items()))
    columns = ("replies", "exact", "meant", "found", "invented", "rejections", "rejected", "not_meant")
    figures = {name: {column: getattr(score, column) for column in columns} for name, score in found.items()}
    figures["all"] = {column: sum(row[column] for row in figures.values()) for column in columns}
    if chosen.json:
        print(json.dumps(figures))
        return
    print_table(
        ("file", *columns, "found %"),
        [(name, *row.values(), f"{100 * row['found'] / max(row['meant'], 1):.1f}") for name, row in figures.items()],
    )
    for name, score in found.items() if chosen.misses else ():
        for miss in score.misses:
            print(f"{name}: {miss}")
