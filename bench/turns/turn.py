"""Measure what a step costs beyond the model, for 1 to 128 agents at an endpoint of fixed latency.

Host, agents (in two processes) and endpoint share this machine; observations are those of a real battle, 2s3z in its
sixth second, and every agent has all of the units. The same run also measures the first implementation: threads that
poll (`original.py`). The parts are those of the agent whose reply came last:

    before    until its observation was made and published       http     the request beyond the endpoint's latency
    bus       the way to it and back, with coding               merge    speech, recognition and translation of all
    agent     prompt, parsing and sending, without HTTP         build    views and texts of all agents, within `before`
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table
from bench.turns.endpoint import endpoint
from bench.turns.original import step_s
from khala_bridge.act import Actor
from khala_bridge.observe import Observer
from khala_bridge.state.teams import Team, TeamRoster
from khala_orchestrator.config import MatchConfig, load_task
from khala_orchestrator.match.cards import briefing
from khala_orchestrator.match.turn import Question, Turn
from khala_orchestrator.publish.announce import Announcer
from khala_orchestrator.roster import Roster as Attendance
from khala_orchestrator.roster import Seat
from khala_protocol.access import router_settings
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.certificates import certify_agent, files_of, make_authority
from khala_protocol.codec import decode_as
from khala_protocol.garbage import tidy_memory
from khala_protocol.keys import Topic, every_agent
from khala_protocol.keys import parse as parse_key
from khala_protocol.messages import ModelCall, Observation, Run
from khala_protocol.speech import parse
from khala_sc2.playing import games
from khala_sc2.playing.children import Children
from khala_sc2.playing.hosting import game_of
from khala_sc2.playing.local import shares
from khala_sc2.playing.local_bus import LOOPBACK, local_endpoint

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.observe import SideObservation
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import AgentConfig, TaskConfig
    from khala_orchestrator.match.turn import Answer, Answers
    from khala_protocol.bus import Bus, Sample, Subscription

GOALS_MS = {1: 8, 8: 15, 32: 40, 128: 130}
PARTS = ("before", "bus", "agent", "http", "merge", "build")
AGENT_PROCESSES = 2
LATENCY_S = 1.0
BATTLE_STEPS = 12


@dataclass
class Measured:
    """One number of agents, measured."""

    agents: int
    step_s: list[float] = field(default_factory=list)
    parts_s: dict[str, list[float]] = field(default_factory=lambda: {part: [] for part in PARTS})
    original_s: list[float] = field(default_factory=list)
    observation_bytes: int = 0
    link: str = "tcp"

    def row(self, latency_s: float) -> dict[str, Any]:
        """Return medians, and the 99th percentile of a step, in milliseconds, without the endpoint's latency."""
        row: dict[str, Any] = {
            "link": self.link,
            "agents": self.agents,
            "over": 1000 * (statistics.median(self.step_s) - latency_s),
            "p99": 1000 * (float(np.percentile(self.step_s, 99)) - latency_s),
        }
        row |= {part: 1000 * statistics.median(values) for part, values in self.parts_s.items()}
        row["original"] = 1000 * (statistics.median(self.original_s) - latency_s) if self.original_s else 0.0
        return row | {"goal": GOALS_MS.get(self.agents, 0), "observation_bytes": self.observation_bytes}


class Bench:
    """The host's side of a turn, with the real parts around a constant snapshot."""

    def __init__(self, bus: Bus, run: str, task: TaskConfig, snapshot: Snapshot, agents: int) -> None:
        self.bus, self.run, self.snapshot = bus, run, snapshot
        self.task = crowd(task, agents)
        self.seats = [Seat(task.side, agent.name) for agent in self.task.agents]
        self.observer = Observer(self.task, Everybodys)
        self.actor = Actor(self.task)
        self.exchanges: dict[str, bytes] = {}
        self.arrived = asyncio.Event()

    async def measure(self, steps: int, children: Children, options: list[str]) -> Measured:
        """Start the agents, and play `steps` steps and one to warm up."""
        names = [seat.agent for seat in self.seats]
        for number, share in enumerate(shares(names, AGENT_PROCESSES)):
            await children.start(f"{self.run}-{number}", "agent", *share, "--run", self.run, *options)
        measured = Measured(len(names))
        async with (
            Announcer(self.bus, self.run, self.seats) as announcer,
            Attendance(self.bus, self.run, self.seats) as roster,
            Turn(self.bus, self.run, roster) as turn,
        ):
            log = await self.bus.subscribe(every_agent(self.run, Topic.EXCHANGE), Delivery.LOG, depth=4096)
            listening = asyncio.create_task(self._listen(log))
            await announcer.run(_card(self.run, self.task))
            for agent in self.task.agents:
                await announcer.brief(briefing(self.task, agent, self.run, 0))
            await roster.assemble(self.seats, 120)
            tidy_memory()  # as a host does when a match begins
            for number in range(steps + 1):
                await self._step(turn, number, measured if number else Measured(0))
            await log.close()
            await listening
        return measured

    async def _step(self, turn: Turn, number: int, measured: Measured) -> None:
        began = time.perf_counter()
        seen = self.observer.observe(self.snapshot)
        answers = await turn.ask(self._questions(seen, number, measured))
        asked = time.perf_counter()
        assert {answer.status for answer in answers.by_seat.values()} == {"ok"}
        speeches = {seat.agent: parse(answer.text or "") for seat, answer in answers.by_seat.items()}
        self.actor.joint(seen, speeches)
        ended = time.perf_counter()
        measured.step_s.append(ended - began)
        await self._told()
        for part, value in self._last(answers, asked - began).items():
            measured.parts_s[part].append(value)
        measured.parts_s["build"].append(asked - began - answers.publish_s - answers.wait_s)
        measured.parts_s["merge"].append(ended - asked)

    def original_s(self, base_url: str, steps: int) -> list[float]:
        """Return the durations of the same steps in the way of the original."""
        seen = self.observer.observe(self.snapshot)

        def build() -> Iterator[str]:
            nonlocal seen
            seen = self.observer.observe(self.snapshot)
            return (agent.text for agent in seen.agents.values())

        def act(replies: list[str]) -> None:
            speeches = {seat.agent: parse(reply) for seat, reply in zip(self.seats, replies, strict=True)}
            self.actor.joint(seen, speeches)

        return step_s(base_url, "silent", build, act, steps)

    def _last(self, answers: Answers, ask_s: float) -> dict[str, float]:
        """Return the parts of the agent whose reply came last."""

        def arrival(item: tuple[Seat, Answer]) -> float:
            return item[1].latency_s or 0.0

        seat, answer = max(answers.by_seat.items(), key=arrival)
        assert answer.reply is not None and answer.latency_s is not None
        request = decode_as(ModelCall, self.exchanges[seat.agent])
        return {
            "before": ask_s - answer.latency_s,  # until its own observation was made and put
            "bus": answer.latency_s - answer.reply.latency_s,
            "agent": answer.reply.latency_s - request.latency_s,
            "http": request.latency_s - LATENCY_S,
        }

    def _questions(self, side: SideObservation, number: int, measured: Measured) -> Iterator[Question]:
        for seen in side.agents.values():
            observation = Observation(
                run=self.run, agent=seen.agent.name, side=self.task.side, episode=0, step=number,
                game_loop=8 * number, answer_within_s=30, text=seen.text, view=seen.view,
            )  # fmt: skip
            measured.observation_bytes = measured.observation_bytes or len(observation.model_dump_json())
            yield Question(observation)

    async def _listen(self, log: Subscription[Sample]) -> None:
        async for sample in log:
            self.exchanges[parse_key(sample.key).agent or ""] = sample.payload  # as a host does, which only records it
            self.arrived.set()

    async def _told(self) -> None:
        """Wait until the exchanges of the step are here; they may be a moment later than the replies."""
        while len(self.exchanges) < len(self.seats):
            self.arrived.clear()
            async with asyncio.timeout(10):
                await self.arrived.wait()


class Everybodys(TeamRoster):
    """The first agent's units for every agent: any number of agents, each with a whole battle to see."""

    def __init__(self, agents: Sequence[AgentConfig]) -> None:
        super().__init__(agents[:1])
        self._first = agents[0].name

    def teams(self, agent: str) -> tuple[Team, ...]:
        return tuple(replace(team, agent=agent) for team in super().teams(self._first))

    def idle_teams(self, agent: str) -> tuple[str, ...]:  # noqa: ARG002  # all have the same
        return super().idle_teams(self._first)


def crowd(task: TaskConfig, agents: int) -> TaskConfig:
    """Return the task with copies of its agent."""
    (first,) = task.agents
    copies = (first.model_copy(update={"name": f"Agent{number}"}) for number in range(agents))
    return task.model_copy(update={"agents": tuple(copies), "communication": False})


def _card(run: str, task: TaskConfig) -> Run:
    return Run(
        run=run, task=task.name, map_name=task.map_spec.name, map_sha256="", seed=0, episodes=1, game="none",
        executor="raw", clock=task.clock, agents=(), catalogue_sha256="", versions={},
    )  # fmt: skip


async def battle(task: TaskConfig) -> Snapshot:
    """Return a snapshot from the middle of a battle."""
    sc2path, _ = games.find("simulator")
    async with game_of(MatchConfig(task=task, run="bench"), sc2path) as game:
        (snapshot,) = await game.reset()
        for _ in range(BATTLE_STEPS):
            snapshot = (await game.act([[]], task.clock.step_loops))[0].snapshot
    return snapshot


def listener(keys: Path, task: TaskConfig, agents: int) -> BusConfig:
    """Return the configuration of a host that listens over TLS, with certificates and access rules for its agents."""
    make_authority(keys, ["127.0.0.1"])
    names = [(task.side, agent.name) for agent in crowd(task, agents).agents]
    for side, name in names:
        certify_agent(keys, side, name)
    rules = router_settings(names)
    return BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=files_of(keys, "router"), zenoh=rules)


async def measure(agents: list[int], steps: int, original_steps: int, *, tcp: bool, tls: bool) -> list[Measured]:
    """Measure every number of agents, ours, over TLS as well if asked for, and the original's way."""
    task = load_task("2s3z")
    snapshot = await battle(task)
    found = []
    async with contextlib.AsyncExitStack() as stack:
        logs = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        base_url = stack.enter_context(endpoint(LATENCY_S))
        here = LOOPBACK if tcp else stack.enter_context(local_endpoint())
        links = [BusConfig(mode="router", listen=(here,))]
        links += [listener(logs / "keys", task, max(agents))] if tls else []
        buses = [await open_bus(link) for link in links]
        for bus in buses:
            stack.push_async_callback(bus.close)
        for count, bus in ((count, bus) for count in agents for bus in buses):
            options = ["--side", task.side, "--connect", bus.endpoints[0], "--base-url", base_url]
            options += ["--tls", str(logs / "keys")] if bus is not buses[0] else []
            async with Children(logs) as workers:
                bench = Bench(bus, f"bench-{count}", task, snapshot, count)
                measured = await bench.measure(steps, workers, [*options, "--model-name", "silent"])
            measured.link = bus.endpoints[0].partition("/")[0]
            measured.original_s = await asyncio.to_thread(bench.original_s, base_url, original_steps)
            found.append(measured)
    return found


def measures(found: Any) -> Iterator[Figure]:
    """Yield what a step costs beyond the endpoint's latency."""
    for row in found["rows"]:
        place = f"{row['agents']} agents, {row['link'].partition('-')[0]}"
        yield Figure(f"a step beyond the model, {place}", "ms", (row["over"],))
        yield Figure(f"the slowest of a hundred steps beyond the model, {place}", "ms", (row["p99"],))
        if row["original"]:
            yield Figure(f"beyond the model / the original's way, {place}", "times", (row["over"] / row["original"],))


def main() -> None:
    """Measure, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--agents", type=int, nargs="+", default=list(GOALS_MS))
    parser.add_argument("--steps", type=int, default=10, help="100 or more for a 99th percentile that means something")
    parser.add_argument("--original-steps", type=int, default=8)
    parser.add_argument("--tcp", action="store_true", help="over loopback TCP instead of a unix socket")
    parser.add_argument("--tls", action="store_true", help="measure over TLS as well, with keys made for it")
    arguments = parser.parse_args()
    measured = asyncio.run(
        measure(arguments.agents, arguments.steps, arguments.original_steps, tcp=arguments.tcp, tls=arguments.tls)
    )
    rows = [turn.row(LATENCY_S) for turn in measured]
    columns = ("link", "agents", "over", "goal", "p99", *PARTS, "original")
    print_table(
        columns,
        [[f"{row[name]:.1f}" if isinstance(row[name], float) else row[name] for name in columns] for row in rows],
        title=f"a step's wall time over the endpoint's {LATENCY_S:g} s, medians in ms",
        file=sys.stderr if arguments.json else sys.stdout,
    )
    if arguments.json:
        print(json.dumps({"latency_s": LATENCY_S, "rows": rows}))
