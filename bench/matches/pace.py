"""Measure what quick and slow agents get done in one match in real time, and what the slow cost the quick.

Four agents of a full game, each in a process of its own on the bus, sleep before they answer. The same match is played
again with four agents of 0.2 s. By agent, and for the steps of the host:

    decisions     answers that took effect                 over     median time of an answer beyond the agent's sleep
    age           game loops from observation to effect    steps    steps that the game made meanwhile, median
    late          answers that missed the deadline         past     how late steps began, in ms, median

The exit code is not 0 if an answer of the agent that is quick in both matches, or a step, takes more than 1 ms longer
at the median with slow agents beside it.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import statistics
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.command_line import make_parser
from bench.tables import print_table
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import LOOPS_PER_S, Report
from khala_protocol.recording import Recording
from khala_protocol.trust import trust_named
from khala_sc2.playing.local import play
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_protocol.messages import AgentReport, Briefing, Observation

TASK = "simple64_sceb"
SLEEPS_S = (0.2, 1.0, 5.0, 20.0)
GAME_S = 80.0
STEP_LOOPS = 8
MOST_MS = 1.0
"""Highest cost of slow agents for the others, at the median."""
SLEEPER = "bench.matches.pace:sleeper"
SLEEPS_VARIABLE = "KHALA_BENCH_SLEEPS"
"""In the environment of the agents: seconds by name, as JSON."""


async def sleeper(briefing: Briefing, observation: Observation) -> str:  # noqa: ARG001  # the form of a policy
    """Decide nothing, after a sleep; the policy of the agents."""
    await asyncio.sleep(json.loads(os.environ[SLEEPS_VARIABLE])[briefing.agent])
    return "Analysis: I slept."


@dataclass(frozen=True)
class AgentFigures:
    """What one agent got done."""

    agent: str
    sleep_s: float
    decisions: int
    over_ms: float
    age_p50_loops: float
    age_p95_loops: float
    steps_later: float
    late: int


@dataclass(frozen=True)
class Figures:
    """One match."""

    agents: tuple[AgentFigures, ...]
    steps: int
    past_ms: float
    """How late its steps began, at the median, compared with the most punctual one."""
    lag_s: float


async def measure(sleeps_s: Sequence[float], game_s: float, directory: Path, *, speed: float = 1.0) -> Figures:
    """Play a match with an agent for each of these sleeps."""
    task = load_task(TASK)
    few = tuple(agent.model_copy(update={"talks_to": None, "ask": "always"}) for agent in task.agents[: len(sleeps_s)])
    task = change(
        task.model_copy(update={"agents": few}),
        rule="realtime", speed=speed, step_loops=STEP_LOOPS, max_wait_s=60,
        max_steps=math.ceil(game_s * LOOPS_PER_S / STEP_LOOPS),
    )  # fmt: skip
    sleeps = dict(zip((agent.name for agent in task.agents), sleeps_s, strict=True))
    os.environ[SLEEPS_VARIABLE] = json.dumps(sleeps)
    trust_named(SLEEPER)
    config = MatchConfig(task=task, run="pace", record=directory / "pace.mcap")
    (result,) = await play(config, {config.task.side: Minds(policy=SLEEPER)}, directory, game="simulator")
    recording = Recording.open(directory / "pace.mcap")
    reports = list(recording.of(Report))
    agents = tuple(_figures(name, sleep_s, reports) for name, sleep_s in sleeps.items())
    return Figures(agents, result.steps, 1000 * statistics.median(_past_s(recording, speed)), result.lag_s)


def _figures(name: str, sleep_s: float, reports: Sequence[Report]) -> AgentFigures:
    found = [(report.step, agent) for report in reports for agent in report.agents if agent.agent == name]
    taken = [(step, agent) for step, agent in found if agent.latency_s is not None]
    ages = sorted(agent.age_loops for _, agent in taken)
    return AgentFigures(
        agent=name,
        sleep_s=sleep_s,
        decisions=len(taken),
        over_ms=1000 * statistics.median((agent.latency_s or 0.0) - sleep_s for _, agent in taken),
        age_p50_loops=statistics.median(ages),
        age_p95_loops=ages[int(0.95 * len(ages))],
        steps_later=statistics.median(step - _step_of(step, agent) for step, agent in taken),
        late=sum(agent.status == "late" and agent.fate != "dropped" for _, agent in found),
    )


def _step_of(step: int, agent: AgentReport) -> int:
    return step if agent.asked_step is None else agent.asked_step


def _past_s(recording: Recording, speed: float) -> Iterator[float]:
    """Yield how late each step began, beside the lag, compared with the most punctual one."""
    began = [
        (sample.log_time_ns / 1e9 - _took_s(sample.message) - sample.message.timings.lag_s, sample.message.game_loop)
        for sample in recording
        if isinstance(sample.message, Report)
    ]
    past_s = [at_s - loop / (LOOPS_PER_S * speed) for at_s, loop in began[:-1]]  # the last step may be a short one
    yield from (late_s - min(past_s) for late_s in past_s)


def _took_s(report: Report) -> float:
    timings = report.timings
    return timings.observe_s + timings.publish_s + timings.wait_s + timings.act_s + timings.game_s


def violations(mixed: Figures, quick: Figures) -> list[str]:
    """Return what slow agents cost the quick one and the game, where it is too much."""
    costs_ms = {
        f"an answer of {mixed.agents[0].agent}": mixed.agents[0].over_ms - quick.agents[0].over_ms,
        "a step": mixed.past_ms - quick.past_ms,
    }
    return [f"{what} took {ms:.1f} ms longer with slow agents" for what, ms in costs_ms.items() if ms > MOST_MS]


def show(title: str, figures: Figures) -> None:
    """Print the figures of one match."""
    rows = [
        (agent.agent, f"{agent.sleep_s:g} s", agent.decisions, f"{agent.over_ms:.2f}", f"{agent.age_p50_loops:g}",
         f"{agent.age_p95_loops:g}", f"{agent.steps_later:g}", agent.late)
        for agent in figures.agents
    ]  # fmt: skip
    columns = ("agent", "sleeps", "decisions", "over ms", "age p50", "age p95", "steps later", "late")
    print_table(columns, rows, title=title)
    print(f"{figures.steps} steps, begun {figures.past_ms:.2f} ms late at the median; lag {figures.lag_s:.3f} s")


def main() -> None:
    """Measure both matches, print tables or a JSON object, and fail if the slow agents cost the quick one too much."""
    parser = make_parser(__doc__)
    parser.add_argument("--game-s", type=float, default=GAME_S, help="length of a match, in seconds of the game")
    options = parser.parse_args()
    found: dict[str, Figures] = {}
    for title, sleeps_s in {"mixed": SLEEPS_S, "all quick": SLEEPS_S[:1] * len(SLEEPS_S)}.items():
        with tempfile.TemporaryDirectory() as directory:
            found[title] = asyncio.run(measure(sleeps_s, options.game_s, Path(directory)))
    broken = violations(found["mixed"], found["all quick"])
    if options.json:
        print(json.dumps({title: asdict(figures) for title, figures in found.items()} | {"violations": broken}))
    else:
        for title, figures in found.items():
            show(title, figures)
    if broken:
        raise SystemExit("\n".join(broken))
