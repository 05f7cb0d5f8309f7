"""Break a running match in every known way, and check in its recording that every turn held.

    python -m bench faults                         1 000 faults of every kind
    python -m bench faults --routers 100           restarts of the router alone, with agents that answer at once
    python -m bench faults --faults 300 --seed 7   fewer, others

Host, game, router and the two agents are processes of their own; each link goes through a relay that can cut it. The
agents ask a scripted model that fails for a part of the requests, and a saboteur on the bus answers in their names:
those two faults happen at every step, the others one after the other. Every decision carries its agent, episode and
step in a message to the other agent, so that the recording tells which decision was executed when. The exit code is 1
if one was executed twice, in another step or for another agent, if more than 5 % of the steps were over `LATE_S` past
their deadline or one over `TOO_LATE_S`, if the match did not go on after a fault, or if a process was left. All steps
are judged, by what the host waited less what it says that it was held for a required agent that was away; and it may
be held only while a fault takes someone away (`AWAY`).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import re
import resource
import signal
import statistics
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from bench.command_line import make_parser
from bench.survival.processes import Processes, free_port, until_listening
from bench.tables import print_table
from khala_agents.build import Workshop
from khala_agents.config import WorkerSpec
from khala_agents.policy import Policy
from khala_agents.scripted.endpoint import Behaviour, Endpoint
from khala_agents.scripted.faults import InjectedFaults
from khala_orchestrator.config import task_files
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import Observation, Reply, Report
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    import subprocess
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence

    from khala_agents.policy import Context
    from khala_protocol.bus import Bus
    from khala_protocol.messages import Briefing, Timings

RUN = "faults"
TASK = "2s3z_pair"
SIDE = "blue"
AGENTS = ("Stalkers", "Zealots")
MODEL = "KHALA_BENCH_MODEL"
"""The variable with the address of the scripted model."""
LEASE_S = BusConfig().lease_s
"""So long after its last sign of life an agent counts as gone."""
MAX_WAIT_S = 1.0
GRACE_S = 60.0
LATE_S = 0.02
TOO_LATE_S = 0.15
MOST_LATE = 0.05
ANSWER_S = 1.0
"""After the restart of a router all have answered within this time."""
RECOVERY_S = 30.0
"""A match that has not gone on after so long is lost: a game that hangs is noticed after 10 s, or 20 of its steps."""
CALM_STEPS = 10
"""Between two faults, so that what each of them does can be told apart."""
START_S = 120.0
"""The same for all processes to start at once."""
FULL_DISK_S = 90.0
"""A match with a full disk has ended by itself after so long."""
ENDPOINT = {"500": 0.06, "429": 0.05, "stall": 0.02, "reset": 0.05, "half": 0.03, "garbage": 0.05, "nonsense": 0.04}
SABOTAGE = 0.6
"""Part of the observations to which the saboteur answers, too."""
BEYOND = "agent stopped beyond its lease"
AWAY = {"agent killed", BEYOND, "agent's link cut", "host's link cut", "router restarted"}
"""Faults for which the host may be held: an agent is away, or seems to be."""
AFTERWARDS_S = 5.0
"""So long after such a fault is over an agent may be away once more: links are made again one after the other."""

MARK = re.compile(r"(\w+) (\d+) (\d+) (?:policy|model|late|duplicate|malformed|for another agent)")
"""See `mark`."""


# --- agents -----------------------------------------------------------------------------------------


def mark(observation: Observation, who: str) -> str:
    """Return a message that says which decision this is, and who made it."""
    other = AGENTS[observation.agent == AGENTS[0]]
    said = f"{observation.agent} {observation.episode} {observation.step} {who}"
    return f"\nCommunications:\n    <MessageTo({other}, '''{said}''')>\n"


async def decide(briefing: Briefing, observation: Observation) -> str:  # noqa: ARG001  # an agent that is always there
    """Order nothing, and say which decision it is."""
    return "Actions:\n" + mark(observation, "policy")


class Marked(Policy):
    """An agent with the scripted model, whose decisions say which they are."""

    def __init__(self) -> None:
        workshop = Workshop(overrides={"base_url": os.environ[MODEL]})
        self._inner = workshop.policy(WorkerSpec(model="scripted"))

    async def decide(self, context: Context) -> str:
        """Return the model's words and the mark."""
        said = await self._inner.decide(context)
        return str(said) + mark(context.observation, "model")

    async def prepare(self, briefing: Briefing) -> None:
        """Prepare the model's policy."""
        await self._inner.prepare(briefing)

    async def close(self) -> None:
        """Close the model's policy."""
        await self._inner.close()


class CountedFaults(InjectedFaults):
    """Faults of the endpoint, counted."""

    def __init__(self, rates: Mapping[str, float], seed: int) -> None:
        super().__init__(rates, seed=seed)
        self.counted: Counter[str] = Counter()

    def pick(self, prompt: str) -> str | None:
        """Return the fault of this request, or None."""
        fault = super().pick(prompt)
        if fault is not None:
            self.counted[f"endpoint: {fault}"] += 1
        return fault


class Saboteur:
    """One that answers in the names of others: there are no keys on this bus."""

    def __init__(self, bus: Bus, dice: random.Random) -> None:
        self.counted: Counter[str] = Counter()
        self._bus, self._dice = bus, dice

    async def play(self, agent: str) -> None:
        """Answer some observations of an agent, until cancelled."""
        seen = await self._bus.subscribe(agent_key(RUN, SIDE, agent, Topic.OBSERVATION), Delivery.STATE)
        keys = {name: agent_key(RUN, SIDE, name, Topic.REPLY) for name in AGENTS}
        out = {name: await self._bus.publisher(key, Delivery.SPEECH) for name, key in keys.items()}
        before: Observation | None = None
        async for sample in seen:
            observation = decode_as(Observation, sample.payload)
            if self._dice.random() < SABOTAGE:
                kind = self._dice.choice(["malformed", "late", "duplicate", "for another agent"])
                await asyncio.sleep(self._dice.uniform(0, 0.03))
                other = AGENTS[agent == AGENTS[0]]
                forged = encode(_reply(observation, kind))
                if kind == "malformed":
                    await out[agent].put(forged[: self._dice.randrange(len(forged))])
                elif kind == "late" and before is not None:
                    await out[agent].put(encode(_reply(before, kind)))
                elif kind == "duplicate":
                    await out[agent].put(forged)
                    await out[agent].put(forged)
                else:
                    await out[other].put(forged)
                self.counted[f"reply: {kind}"] += 1
            before = observation


def _reply(seen: Observation, who: str) -> Reply:
    return Reply(
        run=RUN, side=SIDE, agent=seen.agent, episode=seen.episode, step=seen.step,
        text="Actions:\n" + mark(seen, who),
    )  # fmt: skip


# --- links ------------------------------------------------------------------------------------------


class Relay:
    """A link to the router that can be cut. An asynchronous context manager."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._open: set[asyncio.StreamWriter] = set()
        self._server: asyncio.Server | None = None
        self._port = free_port()

    @property
    def endpoint(self) -> str:
        """Where to connect."""
        return f"tcp/127.0.0.1:{self._port}"

    async def __aenter__(self) -> Self:
        await self.mend()
        return self

    async def __aexit__(self, *error: object) -> None:
        self.cut()

    async def mend(self) -> None:
        """Take links again."""
        self._server = await asyncio.start_server(self._join, "127.0.0.1", self._port)

    def cut(self) -> None:
        """Break all links, and refuse new ones."""
        if self._server is not None:
            self._server.close()
        for writer in self._open:
            writer.transport.abort()
        self._open.clear()

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._to)
        except OSError:
            writer.transport.abort()
            return
        self._open |= {writer, back}
        await asyncio.gather(_pour(reader, back), _pour(there, writer))
        self._open -= {writer, back}


async def _pour(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
    writer.transport.abort()


# --- the match --------------------------------------------------------------------------------------


def is_answered(report: Report) -> bool:
    """Return whether something came from both agents: also that a model failed."""
    return all(agent.status not in {"late", "gone"} for agent in report.agents)


@dataclass
class Fault:
    """One injected fault that took time."""

    kind: str
    began_ns: int
    undone_ns: int = 0
    """The process was started again, or the link was back."""
    recovered_ns: int = 0
    """The end of the first step that both agents answered after that, as the host recorded it."""


@dataclass
class Arena:
    """A match that goes on until it is ended, and the means to disturb it."""

    processes: Processes
    dice: random.Random
    agent: str
    """The policy of the agents."""
    max_wait_s: float
    recovery_s: float
    faults: list[Fault] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    """Faults after which the match did not go on."""
    port: int = field(default_factory=free_port)
    relays: dict[str, Relay] = field(default_factory=dict)
    running: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    _good: asyncio.Event = field(default_factory=asyncio.Event)
    _good_after_ns: int = 0
    _good_ns: int = 0

    @property
    def out(self) -> Path:
        """Directory of the run."""
        return self.processes.directory / "runs"

    async def start(self, name: str) -> None:
        """Start the router, the host, or an agent; the first one is followed by its listening."""
        link = self.relays[name].endpoint if name in self.relays else ""
        match name:
            case "router":
                what = ["router", "--listen", f"tcp/127.0.0.1:{self.port}"]
            case "host":
                task = ["--resume", str(self.out / RUN)] if (self.out / RUN).exists() else [
                    TASK, "--run", RUN, "--max-wait", str(self.max_wait_s), "--grace", str(GRACE_S),
                    "--episodes", "100000",
                ]  # fmt: skip
                what = ["host", *task, "--connect", link, "--out", str(self.out), "--assemble", str(START_S)]
            case _:
                what = ["agent", name, "--run", RUN, "--connect", link, "--policy", self.agent]
        self.running[name] = self.processes.start(name, *what)
        if name == "router":
            await until_listening(self.port)

    async def follow(self, bus: Bus) -> None:
        """Look at reports until cancelled."""
        async for sample in await bus.subscribe(run_key(RUN, Topic.REPORT), Delivery.LOG):
            report = decode_as(Report, sample.payload)
            if is_answered(report):
                self._good_ns = time.time_ns()
                if self._good_ns > self._good_after_ns:
                    self._good.set()

    async def steady(self, within_s: float | None = None) -> None:
        """Wait for a step that both agents answered from now on."""
        self._good.clear()
        self._good_after_ns = time.time_ns()
        async with asyncio.timeout(within_s or self.recovery_s):
            await self._good.wait()

    async def inject(self, kind: str, way: Callable[[], Awaitable[int]]) -> None:
        """Disturb the match, and wait until it goes on calmly; `way` returns when the disturbance was over."""
        fault = Fault(kind, time.time_ns())
        try:
            fault.undone_ns = await way()
            await self.steady()
            fault.recovered_ns = self._good_ns
        except TimeoutError:
            self.lost.append(kind)
            print(self.processes.last_words("host"), file=sys.stderr)
            fault.recovered_ns = time.time_ns()
        self.faults.append(fault)
        print(f"{kind}: {(fault.recovered_ns - fault.began_ns) / 1e9:.1f} s {' '.join(self.lost)}", file=sys.stderr)
        await self._calm(kind)

    async def _calm(self, after: str) -> None:
        try:
            for _ in range(0 if self.lost else CALM_STEPS):
                await self.steady()
        except TimeoutError:
            self.lost.append(f"some steps after: {after}")

    async def kill(self, name: str, pause_s: float = 0.0) -> int:
        """Kill a process, and start it again."""
        self.running[name].kill()
        self.running[name].wait()
        await asyncio.sleep(pause_s)
        await self.start(name)
        return time.time_ns()

    async def stop(self, name: str, seconds: float) -> int:
        """Stop a process, and have it go on."""
        self.running[name].send_signal(signal.SIGSTOP)
        await asyncio.sleep(seconds)
        self.running[name].send_signal(signal.SIGCONT)
        return time.time_ns()

    async def cut(self, name: str, seconds: float) -> int:
        """Cut a link, and mend it."""
        self.relays[name].cut()
        await asyncio.sleep(seconds)
        await self.relays[name].mend()
        return time.time_ns()

    async def game(self, how: signal.Signals) -> int:
        """Send a signal to the game."""
        for pid in self.processes.strangers():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, how)
        return time.time_ns()

    async def double(self) -> int:
        """Start an agent a second time for a while; return when it has left."""
        name = self.dice.choice(AGENTS)
        second = self.processes.start(name, "agent", name, "--run", RUN, "--connect", self.relays[name].endpoint,
                                      "--policy", self.agent)  # fmt: skip
        await asyncio.sleep(4)
        await asyncio.to_thread(self.processes.end, second)
        return time.time_ns()

    def recording(self) -> Recording:
        """Return the newest recording, which holds the whole match."""
        newest = max((self.out / RUN).glob("recording*.mcap"), key=lambda path: path.stat().st_mtime)
        return Recording.open(newest)


@contextlib.asynccontextmanager
async def arena(
    processes: Processes, dice: random.Random, agent: str, max_wait_s: float, recovery_s: float
) -> AsyncIterator[Arena]:
    """Begin a match, and end it."""
    match = Arena(processes, dice, agent, max_wait_s, recovery_s)
    async with contextlib.AsyncExitStack() as stack:
        for name in ("host", *AGENTS):
            match.relays[name] = await stack.enter_async_context(Relay(match.port))
        for name in ("router", "host", *AGENTS):
            await match.start(name)
        bus = await open_bus(BusConfig(connect=(f"tcp/127.0.0.1:{match.port}",)))
        stack.push_async_callback(bus.close)
        following = asyncio.create_task(match.follow(bus))
        await match.steady(START_S)
        yield match
        following.cancel()
        for name in ("host", *AGENTS, "router"):
            await asyncio.to_thread(processes.end, match.running[name])


# --- the verdict ------------------------------------------------------------------------------------


@dataclass
class Verdict:
    """What the recording of a match says."""

    counted: Counter[str]
    recovery_s: Mapping[str, Sequence[float]]
    lost: Sequence[str]
    steps: int = 0
    held: int = 0
    """Steps in which the host was held for an agent that was away."""
    held_for_nothing: int = 0
    """Those of them in which nobody was taken away."""
    statuses: Counter[str] = field(default_factory=Counter)
    twice: int = 0
    late: int = 0
    foreign: int = 0
    past_deadline: int = 0
    worst_past_s: float = 0.0
    orphans: int = 0

    def is_good(self, most_late: float = MOST_LATE, too_late_s: float = TOO_LATE_S) -> bool:
        """Return whether nothing was violated; a slow machine may have more steps late, and by more."""
        wrong = self.twice or self.late or self.foreign or self.lost or self.orphans or self.held_for_nothing
        return not wrong and self.past_deadline < most_late * self.steps and self.worst_past_s <= too_late_s


def judge(recording: Recording, faults: Sequence[Fault], max_wait_s: float, verdict: Verdict) -> Verdict:
    """Add what a recording says."""
    executed: Counter[tuple[str, str, str]] = Counter()
    for sample in recording:
        report = sample.message
        if not isinstance(report, Report):
            continue
        verdict.steps += 1
        verdict.statuses.update(agent.status for agent in report.agents)
        for message in report.messages:
            found = MARK.fullmatch(message.text)
            if found is None:  # words of the model
                continue
            agent, episode, step = found.groups()
            executed[agent, episode, step] += 1
            verdict.foreign += agent != message.sender
            verdict.late += (int(episode), int(step)) != (report.episode, report.step)
        past_s = report.timings.wait_s - report.timings.held_s - max_wait_s
        verdict.past_deadline += past_s > LATE_S
        verdict.worst_past_s = max(verdict.worst_past_s, past_s)
        if report.timings.held_s:
            verdict.held += 1
            verdict.held_for_nothing += not _someone_was_away(sample.log_time_ns, report.timings, faults)
    verdict.twice = sum(times > 1 for times in executed.values())
    return verdict


def _someone_was_away(reported_ns: int, timings: Timings, faults: Sequence[Fault]) -> bool:
    """Return whether a fault took someone away while the host waited in a step."""
    began_ns = reported_ns - int(1e9 * (timings.wait_s + timings.act_s + timings.game_s + AFTERWARDS_S))
    away = (fault for fault in faults if fault.kind in AWAY)
    return any(fault.began_ns <= reported_ns and began_ns <= fault.recovered_ns for fault in away)


# --- what is measured -------------------------------------------------------------------------------


def ways(match: Arena, endpoint: Endpoint | None) -> dict[str, Callable[[], Awaitable[int]]]:
    """Return how each kind of fault that takes time is made."""
    dice = match.dice

    async def away() -> int:
        assert endpoint is not None
        await endpoint.__aexit__()
        await asyncio.sleep(dice.uniform(1, 3))
        await endpoint.__aenter__()
        return time.time_ns()

    return {
        "agent killed": lambda: match.kill(dice.choice(AGENTS)),
        "agent stopped": lambda: match.stop(dice.choice(AGENTS), dice.choice([0.3, 1.5])),
        BEYOND: lambda: match.stop(dice.choice(AGENTS), LEASE_S + 1.5),
        "agent's link cut": lambda: match.cut(dice.choice(AGENTS), dice.uniform(0.05, 3)),
        "host's link cut": lambda: match.cut("host", dice.uniform(0.05, 3)),
        "router restarted": lambda: match.kill("router", dice.uniform(0, 1)),
        "endpoint away": away,
        "two processes of one agent": match.double,
        "game killed": lambda: match.game(signal.SIGKILL),
        "game hangs": lambda: match.game(signal.SIGSTOP),
        "host killed": lambda: match.kill("host"),
    }


SLOW = {"game hangs": 1, "game killed": 2, "host killed": 3, "two processes of one agent": 3, "agent killed": 6}
"""How many of 1 000 faults are of these kinds; 8 of each other one that takes time."""


async def everything(
    processes: Processes, faults: int, seed: int, only: Sequence[str] | None, recovery_s: float
) -> Verdict:
    """Inject faults of every kind until there were enough."""
    dice = random.Random(seed)
    failing = CountedFaults(ENDPOINT, seed)
    endpoint = Endpoint(Behaviour(faults=failing, retry_after_s=0.2), port=free_port())
    async with endpoint:
        os.environ[MODEL] = endpoint.base_url
        async with arena(processes, dice, "bench.survival.faults:Marked", MAX_WAIT_S, recovery_s) as match:
            async with _sabotage(match) as saboteur:
                kinds = only or ways(match, endpoint)
                todo = [kind for kind in kinds for _ in range(-(-SLOW.get(kind, 8) * faults // 1000))]
                dice.shuffle(todo)
                for kind in todo:
                    await match.inject(kind, ways(match, endpoint)[kind])
                while not match.lost and _sum(failing.counted, saboteur.counted, match.faults) < faults:
                    await match.steady()
            counted = failing.counted + saboteur.counted
        return _judge(match, counted)


async def routers(processes: Processes, restarts: int, seed: int) -> Verdict:
    """Restart the router again and again."""
    dice = random.Random(seed)
    async with arena(processes, dice, "bench.survival.faults:decide", 15.0, RECOVERY_S) as match:
        for _ in range(restarts):
            await asyncio.sleep(dice.uniform(0, 0.3))
            await match.inject("router restarted", lambda: match.kill("router", dice.uniform(0, 0.5)))
    verdict = _judge(match, Counter())
    slow = [f"answer after {took_s:.1f} s" for took_s in verdict.recovery_s["router restarted"] if took_s > ANSWER_S]
    lost = [f"{times} {status}" for status, times in verdict.statuses.items() if status != "ok"]
    verdict.lost = [*verdict.lost, *slow, *lost]
    return verdict


@contextlib.asynccontextmanager
async def _sabotage(match: Arena) -> AsyncIterator[Saboteur]:
    bus = await open_bus(BusConfig(connect=(f"tcp/127.0.0.1:{match.port}",)))
    saboteur = Saboteur(bus, match.dice)
    playing = [asyncio.create_task(saboteur.play(agent)) for agent in AGENTS]
    yield saboteur
    for task in playing:
        task.cancel()
    await asyncio.wait(playing)
    await bus.close()


def _sum(*counted: Any) -> int:
    return sum(each.total() if isinstance(each, Counter) else len(each) for each in counted)


def _judge(match: Arena, counted: Counter[str]) -> Verdict:
    recording = match.recording()
    good_ns = [
        sample.log_time_ns for sample in recording if isinstance(sample.message, Report) and is_answered(sample.message)
    ]
    for fault in match.faults:
        if fault.undone_ns:
            fault.recovered_ns = next((at for at in good_ns if at > fault.undone_ns), fault.recovered_ns)
    kinds = dict.fromkeys(fault.kind for fault in match.faults)
    times_s = {
        kind: [
            (fault.recovered_ns - fault.undone_ns) / 1e9
            for fault in match.faults
            if fault.kind == kind and fault.undone_ns
        ]
        for kind in kinds
    }
    counted = counted + Counter(fault.kind for fault in match.faults)
    return judge(recording, match.faults, match.max_wait_s, Verdict(counted, times_s, match.lost))


def full_disk(processes: Processes, rule: str) -> bool:
    """Return whether a host whose disk is full does what the task says, by a limit on the size of its files."""
    out = processes.directory / f"full-{rule}"
    task = processes.directory / f"{rule}.yaml"
    shipped = next(path for path in task_files() if path.stem == TASK)
    task.write_text(f"extends: {shipped}\nname: full\nfaults: {{recording_lost: {rule}}}\nmax_steps: 20\n")
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    host = processes.start("full", "host", str(task), "--run", "full", "--listen", endpoint, "--out", str(out))
    resource.prlimit(host.pid, resource.RLIMIT_FSIZE, (30_000, 30_000))
    asyncio.run(until_listening(port))
    agent = processes.start("full-agent", "agent", *AGENTS, "--run", "full", "--connect", endpoint,
                            "--policy", "bench.survival.faults:decide")  # fmt: skip
    code = host.wait(FULL_DISK_S)
    processes.end(agent)
    said = "recording" in processes.last_words("full")
    return said and (code == 0 if rule == "go_on" else code not in {0, 3})


def rows(verdict: Verdict) -> Iterator[tuple[object, ...]]:
    """Yield a row for each kind of fault."""
    for kind, times in sorted(verdict.counted.items()):
        seconds = verdict.recovery_s.get(kind)
        yield kind, times, *((f"{statistics.median(seconds):.2f}", f"{max(seconds):.2f}") if seconds else ("", ""))


def summary(verdict: Verdict) -> str:
    """Return the judgement in words."""
    return (
        f"executed twice {verdict.twice}, in another step {verdict.late}, for another agent {verdict.foreign}; "
        f"{verdict.past_deadline} of {verdict.steps} steps over {1000 * LATE_S:g} ms past the deadline, the longest "
        f"{1000 * verdict.worst_past_s:.0f} ms; {verdict.held} held for an agent that was away, "
        f"{verdict.held_for_nothing} for nobody; answers {dict(verdict.statuses)}; "
        f"not gone on: {', '.join(verdict.lost) or 'never'}; {verdict.orphans} orphans"
    )


def measure(
    faults: int,
    restarts: int | None = None,
    seed: int = 1,
    only: Sequence[str] | None = None,
    recovery_s: float = RECOVERY_S,
) -> Verdict:
    """Inject faults; return what came of it."""
    with tempfile.TemporaryDirectory() as directory, Processes(Path(directory)) as processes:
        if restarts is not None:
            verdict = asyncio.run(routers(processes, restarts, seed))
        else:
            verdict = asyncio.run(everything(processes, faults, seed, only, recovery_s))
            for rule in ("end", "go_on"):
                verdict.counted["disk full"] += 1
                verdict.lost = [*verdict.lost, *([] if full_disk(processes, rule) else [f"disk full: {rule}"])]
    verdict.orphans = processes.orphans
    return verdict


def main() -> None:
    """Measure, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--faults", type=int, default=1000)
    parser.add_argument("--routers", type=int, metavar="N", help="restart the router N times, and nothing else")
    parser.add_argument("--only", nargs="+", metavar="KIND", help="of the faults that take time, only these")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    verdict = measure(arguments.faults, arguments.routers, arguments.seed, arguments.only)
    file = sys.stderr if arguments.json else sys.stdout
    title = f"{verdict.counted.total()} faults in {verdict.steps} steps"
    print_table(("fault", "times", "goes on after, median s", "longest s"), rows(verdict), title=title, file=file)
    print(summary(verdict), file=file)
    if arguments.json:
        print(json.dumps(verdict.__dict__, default=list))
    raise SystemExit(0 if verdict.is_good() else 1)
