"""Kill the host of a match at random moments, and check that the match ends as if nothing had happened.

    python -m bench resume --kills 20

Host, agents, scripted model and router are processes of their own; agents and router stay. Each match is killed
`KILLS_A_MATCH` times, and resumed with `khala host --resume`. In half of the matches the host is its own router, so
that all links go with it. A match is equal if every agent saw, at every step, byte for byte what it saw in the match
that was not disturbed; with the clock `realtime`, where the moment of an arrival decides, if the game can be played
again from the recording without a difference. Then each other clock once, agents with a memory, and agents with a
memory that were started again meanwhile. The exit code is 1 if a match was not resumed or not equal.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import itertools
import json
import random
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.command_line import make_parser
from bench.survival.processes import Processes, free_port, until_listening
from bench.tables import print_table
from khala_orchestrator.config import load_task
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import decode_as
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import ModelCall, Observation, Report
from khala_protocol.recording import Recording
from khala_sc2.playing.local import shares
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Collection, Iterator, Sequence

    from khala_protocol.bus import Bus, Sample, Subscription

RUN = "resume"
TASK = "pvz_task5_level1"
STEPS = 40
KILLS_A_MATCH = 4
PATIENCE_S = 90.0
"""The longest time for anything that is waited for."""
AGENT_PROCESSES = 2


@dataclass(frozen=True, slots=True)
class Case:
    """How one match is played."""

    name: str = "frozen"
    kills: int = KILLS_A_MATCH
    clock: str = "frozen"
    own_router: bool = False
    memory: int = 0
    restart: bool = False
    """Whether the agents are killed with the host, and started again."""


@dataclass(frozen=True, slots=True)
class Kill:
    """One killed host."""

    case: str
    step: int
    """The last step that was over."""
    replay_s: float
    """From the new host's run card to the next question to the first agent, or to the end of a step that had none."""
    away_s: float
    """From the kill to the next step that was over."""
    equal: bool
    prompts: int
    """Prompts of the whole match that were not those of the undisturbed one."""

    @property
    def steps_per_s(self) -> float:
        """Steps that were played again in a second."""
        return (self.step + 1) / self.replay_s


@dataclass(frozen=True, slots=True)
class Whole:
    """What a match showed to its agents and to their models."""

    digest: str
    steps: tuple[int, ...]
    prompts: dict[tuple[int, str], str]

    @classmethod
    def of(cls, path: Path) -> Whole:
        """Read a recording."""
        recording = Recording.open(path)
        seen = sorted((seen.step, seen.agent, seen.model_dump_json()) for seen in recording.of(Observation))
        calls = {(call.step, call.agent): repr(call.prompt) for call in recording.of(ModelCall)}
        steps = tuple(report.step for report in recording.of(Report))
        return cls(hashlib.sha256("".join(text for *_, text in seen).encode()).hexdigest(), steps, calls)

    def other_prompts(self, other: Whole) -> int:
        """Return how many prompts differ, of those that both have."""
        return sum(self.prompts[at] != other.prompts[at] for at in self.prompts.keys() & other.prompts.keys())


@dataclass(frozen=True, slots=True)
class Resumed:
    """The outcome of all matches.

    Attributes:
        failed: what went wrong with the matches that did not end.
        orphans: processes that were left.
    """

    kills: Sequence[Kill]
    failed: Sequence[str]
    orphans: int

    @property
    def unequal(self) -> int:
        """Kills of matches that did not end as if nothing had happened."""
        return sum(not kill.equal for kill in self.kills)

    @property
    def is_good(self) -> bool:
        """Whether every match was resumed, and ended as if nothing had happened."""
        return not (self.failed or self.unequal or self.orphans)


class Stage:
    """The processes around a host: scripted model, router, agents."""

    def __init__(self, processes: Processes, model: str, case: Case) -> None:
        self._processes = processes
        self._model = model
        self._case = case
        self._port = free_port()
        self.endpoint = f"tcp/127.0.0.1:{self._port}"
        self.out = Path(tempfile.mkdtemp(dir=processes.directory))
        self.agents: list[subprocess.Popen[bytes]] = []

    async def begin(self) -> subprocess.Popen[bytes]:
        """Start the match and return its host; whoever finds no router for 5 s gives up, so the router is first."""
        if not self._case.own_router:
            self._router = self._processes.start("router", "router", "--listen", self.endpoint)
            await until_listening(self._port)
        host = self.host(resume=False)
        await until_listening(self._port)
        self.start_agents()
        return host

    def start_agents(self) -> None:
        """Start the agents."""
        names = [agent.name for agent in load_task(TASK).agents]
        options = ["--run", RUN, "--connect", self.endpoint, "--base-url", self._model]
        options += ["--memory", str(self._case.memory)]
        for share in shares(names, AGENT_PROCESSES):
            self.agents.append(self._processes.start("agents", "agent", *share, *options))

    def host(self, *, resume: bool) -> subprocess.Popen[bytes]:
        """Start the host, or resume the match."""
        link = ["--listen" if self._case.own_router else "--connect", self.endpoint]
        what = ["--resume", str(self.out / RUN)] if resume else [TASK, "--run", RUN, "--max-steps", str(STEPS)]
        what += [] if resume else ["--clock", self._case.clock]
        return self._processes.start("host", "host", *what, *link, "--out", str(self.out))

    def recording(self) -> Path:
        """Return the newest recording."""
        return max((self.out / RUN).glob("recording*.mcap"), key=lambda path: path.stat().st_mtime)

    def end(self) -> None:
        """End agents and router."""
        for agent in self.agents:
            self._processes.end(agent)
        if not self._case.own_router:
            self._processes.end(self._router)


class Watch:
    """When the host did what, as the bus shows it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.step = -1
        """The newest step that is over."""
        self.card_s = self.asked_s = self.over_s = 0.0
        """Moments of the run card, the first question after it, and the first step after that."""
        self._changed = asyncio.Event()

    async def follow(self) -> None:
        """Follow the match until cancelled."""
        first = load_task(TASK).agents[0].name
        cards = await self._bus.subscribe(run_key(RUN, Topic.RUN), Delivery.STATE)
        asked = await self._bus.subscribe(agent_key(RUN, "blue", first, Topic.OBSERVATION), Delivery.STATE)
        reports = await self._bus.subscribe(run_key(RUN, Topic.REPORT), Delivery.LOG)
        async with asyncio.TaskGroup() as group:
            group.create_task(self._cards(cards))
            group.create_task(self._note_questions(asked))
            group.create_task(self._reports(reports))

    async def until_step(self, step: int, host: subprocess.Popen[bytes], processes: Processes) -> None:
        """Return when a step is over.

        Raises:
            RuntimeError: the host ends before, or takes too long.
        """
        async with asyncio.timeout(PATIENCE_S):
            while self.step < step:
                if host.poll() is not None:
                    said = processes.last_words("host")
                    raise RuntimeError(f"the host ended with code {host.returncode} at step {self.step}: {said}")
                self._changed.clear()
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._changed.wait(), 0.5)

    def kill(self, case: str, step: int, killed_s: float) -> Kill:
        """Return how the match went on after its host was killed; `equal` and `prompts` are yet to be found."""
        went_on_s = self.asked_s or self.over_s  # an agent that still thinks is not asked
        return Kill(case, step, went_on_s - self.card_s, self.over_s - killed_s, equal=False, prompts=0)

    async def _cards(self, cards: Subscription[Sample]) -> None:
        async for _ in cards:
            self.card_s = time.monotonic()

    async def _note_questions(self, observations: Subscription[Sample]) -> None:
        async for _ in observations:
            self.asked_s = self.asked_s or time.monotonic()

    async def _reports(self, reports: Subscription[Sample]) -> None:
        async for sample in reports:
            self.step = decode_as(Report, sample.payload).step
            self.over_s = self.over_s or time.monotonic()
            self._changed.set()


async def play(processes: Processes, model: str, case: Case, moments: Sequence[float]) -> tuple[Path, list[Kill]]:
    """Play a match, and kill its host at these moments, counted in steps; `equal` and `prompts` are yet to be found."""
    stage = Stage(processes, model, case)
    host = await stage.begin()
    kills = []
    bus = await open_bus(BusConfig(connect=(stage.endpoint,), connect_timeout_s=PATIENCE_S))
    watch = Watch(bus)
    following = asyncio.create_task(watch.follow())
    try:
        for moment in moments:
            await watch.until_step(int(moment), host, processes)
            await asyncio.sleep((moment % 1) * 0.1)  # a step takes about 0.1 s
            step = watch.step
            killed_s = time.monotonic()
            host.kill()
            host.wait()
            watch.asked_s = watch.over_s = 0.0
            if case.restart:
                for agent in stage.agents:
                    agent.kill()
                stage.start_agents()
            host = stage.host(resume=True)
            await watch.until_step(step + 1, host, processes)
            kills.append(watch.kill(case.name, step, killed_s))
        code = await asyncio.to_thread(host.wait, PATIENCE_S)
        if code:
            raise RuntimeError(f"the host ended with code {code}: {processes.last_words('host')}")
    finally:
        following.cancel()
        await asyncio.wait([following])
        await bus.close()
        await asyncio.to_thread(stage.end)
    return stage.recording(), kills


def cases(kills: int) -> Iterator[Case]:
    """Yield the matches to play: as many kills with the clock `frozen`, and each other case once."""
    places = itertools.cycle((False, True))
    for first in range(0, kills, KILLS_A_MATCH):
        own = next(places)
        yield Case("own router" if own else "frozen", min(KILLS_A_MATCH, kills - first), own_router=own)
    for clock in ("budget", "token", "realtime"):
        yield Case(clock, 1, clock)
    yield Case("memory", 1, memory=3)
    yield Case("memory, new agents", 1, memory=3, restart=True)


async def measure(kills: int, seed: int, only: Collection[str] | None = None) -> Resumed:
    """Kill that many hosts, and one in each other case; play these cases `only`, by their names."""
    dice = random.Random(seed)
    found: list[Kill] = []
    failed: list[str] = []
    with tempfile.TemporaryDirectory() as directory, Processes(Path(directory)) as processes:
        ready = Path(directory) / "llm.json"
        processes.start("llm", "llm", "--port", "0", "--ready-file", str(ready))
        while not ready.exists():  # noqa: ASYNC110  # another process writes it
            await asyncio.sleep(0.1)
        model = json.loads(ready.read_text())["base_url"]
        whole: dict[tuple[str, int], Whole] = {}
        for case in (case for case in cases(kills) if only is None or case.name in only):
            if (case.clock, case.memory) not in whole:
                path, _ = await play(processes, model, case, ())
                print(f"{case.name}: undisturbed", file=sys.stderr)
                whole[case.clock, case.memory] = Whole.of(path)
            moments = sorted(dice.uniform(1, STEPS - 5) for _ in range(case.kills))
            try:
                path, seen = await play(processes, model, case, moments)
            except (RuntimeError, TimeoutError) as error:
                failed.append(f"{case.name}, killed at {moments}: {str(error) or 'nothing happened for too long'}")
                continue
            found += await _judge(seen, Whole.of(path), whole[case.clock, case.memory], case, path)
            print(f"{case.name}: {found[-1]}", file=sys.stderr)
    return Resumed(found, failed, processes.orphans)


async def _judge(seen: Sequence[Kill], played: Whole, whole: Whole, case: Case, path: Path) -> list[Kill]:
    equal = played.digest == whole.digest if case.clock != "realtime" else not await replay_host(path)
    complete = played.steps == tuple(range(STEPS))
    prompts = 0 if case.clock == "realtime" else played.other_prompts(whole)
    return [Kill(kill.case, kill.step, kill.replay_s, kill.away_s, equal and complete, prompts) for kill in seen]


def rows(found: Sequence[Kill]) -> Iterator[tuple[object, ...]]:
    """Yield a row for each kill."""
    for kill in found:
        figures = f"{kill.replay_s:.2f}", f"{kill.steps_per_s:.0f}", f"{kill.away_s:.1f}"
        yield kill.case, kill.step, *figures, "yes" if kill.equal else "NO", kill.prompts


def main() -> None:
    """Measure, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--only", nargs="+", metavar="CASE", choices=sorted({case.name for case in cases(20)}))
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    resumed = asyncio.run(measure(arguments.kills, arguments.seed, arguments.only))
    print_table(
        ("case", "killed after step", "replay s", "steps/s", "away s", "equal", "other prompts"),
        rows(resumed.kills),
        title=f"hosts killed in a match of {STEPS} steps ({TASK})",
        file=sys.stderr if arguments.json else sys.stdout,
    )
    for line in resumed.failed:
        print(line, file=sys.stderr)
    print(
        f"{len(resumed.kills)} resumed, {len(resumed.failed)} matches failed, {resumed.unequal} not equal, "
        f"{resumed.orphans} orphans",
        file=sys.stderr,
    )
    if arguments.json:
        print(json.dumps(asdict(resumed)))
    raise SystemExit(0 if resumed.is_good else 1)
