"""Play many decisions in a row over the real bus, and measure what grows and what slows down.

    python -m bench soak --decisions 20000 --agents 8

Host, game and two processes of agents, which decide by a function that orders nothing: all that is left is what Khala
itself does. The match has ten episodes of the same length; after each of them the memory of every process and the size
of the recording are noted. The overhead of a step is the time to observe, to publish, to wait for the replies and to
act, without the game; the last tenth is compared with the first. The exit code is 1 if a decision was not `ok`, if the
overhead grew by more than `MOST_GROWTH`, or a process by more than `MOST_GROWN_MB` after the first three tenths.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.command_line import make_parser
from bench.memory import rss_mb
from bench.survival.orphans import processes_of
from bench.survival.processes import Processes, free_port
from bench.tables import print_table
from khala_orchestrator.config import change, load_task
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_sc2.playing.local import shares

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator, Mapping, Sequence

    from khala_protocol.bus import Sample, Subscription
    from khala_protocol.messages import Briefing, Observation

RUN = "soak"
TASK = "simple64_sceb"
TENTHS = 10
STEP_LOOPS = 8
"""A tenth of 250 steps is 90 s of the game, in which no enemy comes: all tenths are alike."""
AGENT_PROCESSES = 2
MOST_GROWTH = 1.25
MOST_GROWN_MB = 40.0
PATIENCE_S = 120.0


@dataclass(frozen=True, slots=True)
class Mark:
    """The state of things after a tenth."""

    decisions: int
    wall_s: float
    rss_mb: Mapping[str, float]
    recording_mb: float


@dataclass(frozen=True, slots=True)
class Soaked:
    """The outcome of all tenths."""

    marks: Sequence[Mark]
    overhead_ms: Sequence[float]
    """Median of a step, by tenth."""
    game_ms: Sequence[float]
    not_ok: int
    decisions: int
    orphans: int

    @property
    def grown_mb(self) -> Mapping[str, float]:
        """What each process grew by from the third tenth on: until then caches and pools fill."""
        return {name: mb - self.marks[2].rss_mb[name] for name, mb in self.marks[-1].rss_mb.items()}

    def is_good(self, most_growth: float = MOST_GROWTH, most_grown_mb: float = MOST_GROWN_MB) -> bool:
        """Return whether nothing grew, slowed down or failed; a short match, or a busy machine, may do more of it."""
        steady = self.overhead_ms[-1] <= most_growth * self.overhead_ms[0]
        return steady and not self.not_ok and not self.orphans and max(self.grown_mb.values()) <= most_grown_mb


async def decide(briefing: Briefing, observation: Observation) -> str:  # noqa: ARG001  # an agent that does nothing
    """Order nothing."""
    return "Actions:"


class Soak:
    """A match of many steps, in processes of its own."""

    def __init__(self, processes: Processes, agents: int, steps: int) -> None:
        self._processes = processes
        self._endpoint = f"tcp/127.0.0.1:{free_port()}"
        fields = change(load_task(TASK), max_steps=steps, step_loops=STEP_LOOPS).model_dump(mode="json")
        chosen = fields["agents"] = fields["agents"][:agents]
        self.names = [agent["name"] for agent in chosen]
        for agent in chosen:
            agent["ask"] = "always"
            agent["talks_to"] = [name for name in agent["talks_to"] if name in self.names]
        self._task = processes.directory / f"{RUN}.yaml"
        self._task.write_text(json.dumps(fields))  # JSON is YAML
        self._by_name: dict[str, subprocess.Popen[bytes]] = {}

    async def play(self) -> Iterator[Mark]:
        """Play the match; return a mark for each tenth."""
        out = self._processes.directory / "runs"
        self._start("host", "host", str(self._task), "--run", RUN, "--listen", self._endpoint, "--out", str(out),
                    "--episodes", str(TENTHS))  # fmt: skip
        bus = await open_bus(BusConfig(connect=(self._endpoint,), connect_timeout_s=30))
        results = await bus.subscribe(run_key(RUN, Topic.RESULT), Delivery.STATE)
        for number, share in enumerate(shares(self.names, AGENT_PROCESSES)):
            self._start(f"agents {number}", "agent", *share, "--run", RUN, "--connect", self._endpoint,
                        "--policy", "bench.survival.soak:decide")  # fmt: skip
        began = time.monotonic()
        marks = list[Mark]()
        while len(marks) < TENTHS:
            await self._next(results)
            size = sum(path.stat().st_size for path in (out / RUN).glob("*.mcap"))
            marks.append(Mark(len(marks) + 1, time.monotonic() - began, self._memory(), size / 2**20))
            print(marks[-1], file=sys.stderr)
        await bus.close()
        await asyncio.to_thread(self._by_name["host"].wait, PATIENCE_S)
        return iter(marks)

    async def _next(self, results: Subscription[Sample]) -> None:
        """Wait for a result, as long as no process fails."""
        result = asyncio.ensure_future(anext(results))
        while not (await asyncio.wait({result}, timeout=1.0))[0]:
            if failed := [name for name, process in self._by_name.items() if process.poll()]:
                raise SystemExit(f"{failed[0]} failed: {self._processes.last_words(failed[0])}")

    def _start(self, name: str, *arguments: str) -> None:
        self._by_name[name] = self._processes.start(name, *arguments)

    def _memory(self) -> dict[str, float]:
        ours = {process.pid: name for name, process in self._by_name.items()}
        there = sorted(processes_of(f"TMPDIR={self._processes.directory}"))
        return {ours.get(pid, "game"): rss_mb(pid) for pid in there}


async def measure(decisions: int, agents: int) -> Soaked:
    """Play a match with this number of decisions."""
    steps = -(-decisions // agents // TENTHS)
    with tempfile.TemporaryDirectory() as directory, Processes(Path(directory)) as processes:
        marks = list(await Soak(processes, agents, steps).play())
        reports = list(Recording.open(Path(directory) / "runs" / RUN / "recording.mcap").of(Report))
    tenths = [[report.timings for report in reports if report.episode == tenth] for tenth in range(TENTHS)]
    outcomes = [agent.status for report in reports for agent in report.agents]
    return Soaked(
        [Mark(steps * agents * mark.decisions, mark.wall_s, mark.rss_mb, mark.recording_mb) for mark in marks],
        [statistics.median(1000 * (t.observe_s + t.publish_s + t.wait_s + t.act_s) for t in tenth) for tenth in tenths],
        [statistics.median(1000 * t.game_s for t in tenth) for tenth in tenths],
        sum(status != "ok" for status in outcomes),
        len(outcomes),
        processes.orphans,
    )


def rows(soaked: Soaked) -> Iterator[tuple[object, ...]]:
    """Yield a row for each tenth."""
    for mark, overhead_ms, game_ms in zip(soaked.marks, soaked.overhead_ms, soaked.game_ms, strict=True):
        memory = (f"{mark.rss_mb[name]:.0f}" for name in soaked.marks[0].rss_mb)
        rest = f"{overhead_ms:.1f}", f"{game_ms:.1f}", f"{mark.recording_mb:.1f}"
        yield mark.decisions, f"{mark.wall_s:.0f}", *memory, *rest


def main() -> None:
    """Measure, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--decisions", type=int, default=20_000)
    parser.add_argument("--agents", type=int, default=8)
    arguments = parser.parse_args()
    soaked = asyncio.run(measure(arguments.decisions, arguments.agents))
    memory = (f"{name} MB" for name in soaked.marks[0].rss_mb)
    columns = ("decisions", "wall s", *memory, "overhead ms", "game ms", "recording MB")
    file = sys.stderr if arguments.json else sys.stdout
    print_table(columns, rows(soaked), title=f"{soaked.decisions} decisions, {TASK}", file=file)
    each_bytes = soaked.marks[-1].recording_mb * 2**20 / soaked.decisions
    grown = ", ".join(f"{name} {mb:+.1f} MB" for name, mb in soaked.grown_mb.items())
    print(f"{each_bytes:.0f} bytes of recording a decision; {soaked.not_ok} not ok; from the third tenth on: {grown}",
          file=sys.stderr)  # fmt: skip
    if arguments.json:
        print(json.dumps(asdict(soaked)))
    raise SystemExit(0 if soaked.is_good() else 1)
