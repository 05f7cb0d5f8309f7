"""Play one task under the four rules of the clock, and check that it comes out the same twice.

The scripted model plays through its HTTP endpoint, in one process with the host, the game beside it. Under `frozen`,
`budget` and `token` each match is played twice, with an endpoint that answers at once and with one that takes its time:
the hashes over all observations must be equal. Each recorded match, `realtime` included, is then played again from its
recording: no observation may differ. The exit code is not 0 if a promise is broken.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import statistics
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from bench.command_line import make_parser
from bench.tables import print_table
from khala_agents.build import Workshop
from khala_agents.config import WorkerSpec
from khala_agents.scripted.endpoint import Behaviour, Endpoint
from khala_agents.worker import run_workers
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.clock_rule import ClockRule
from khala_protocol.keys import Topic
from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_sc2.playing import games
from khala_sc2.playing.hosting import game_of
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_protocol.messages import Result

RULES: tuple[ClockRule, ...] = get_args(ClockRule)
LATENCIES_S = (0.0, 0.3)
FATES = ("fresh", "stale", "adapted", "refused", "dropped")


@dataclass(frozen=True)
class Played:
    """One recorded match."""

    latency_s: float
    result: Result
    hash: str
    """Over all observations, in their order."""
    ages_loops: tuple[int, ...]
    differences: int
    """Observations that differ when its recording is played again."""


@dataclass(frozen=True)
class Row:
    """One rule with one seed: a match for each latency."""

    rule: ClockRule
    seed: int
    played: tuple[Played, ...]

    def violations(self) -> list[str]:
        """Return the promises that were broken."""
        where = f"{self.rule}, seed {self.seed}"
        found = [f"{where}: {play.differences} observations of the replay differ" for play in self.played
                 if play.differences]  # fmt: skip
        if self.rule != "realtime" and len({play.hash for play in self.played}) > 1:
            found.append(f"{where}: the game depends on how long the endpoint took")
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return the figures; those of the match are of the slower endpoint."""
        last = self.played[-1]
        fates = sum((Counter(found) for found in last.result.fates.values()), Counter[str]())
        return {
            "rule": self.rule,
            "seed": self.seed,
            "outcome": last.result.outcome,
            "kd": last.result.kd,
            "game_s": last.result.game_s,
            "lag_s": last.result.lag_s,
            "decisions": len(last.ages_loops),
            "fates": {fate: fates[fate] for fate in FATES},
            "age_loops": statistics.median(last.ages_loops) if last.ages_loops else 0,
            "hashes": [play.hash for play in self.played],
            "differences": sum(play.differences for play in self.played),
        }


async def play(config: MatchConfig, path: Path, latency_s: float) -> Played:
    """Play a match with the scripted model, and its recording once more."""
    broker = MemoryBroker()
    run = config.run
    sc2path, name = games.find("simulator")
    config = config.model_copy(update={"record": path, "game": name})
    async with Endpoint(Behaviour(latency_s=latency_s)) as endpoint, game_of(config, sc2path) as game:
        workshop = Workshop(overrides={"base_url": endpoint.base_url, "model": "skilled"})
        policies = {agent.name: workshop.policy(WorkerSpec(model="scripted")) for agent in config.task.agents}
        workers = asyncio.create_task(run_workers(broker.session(), run, config.task.side, policies))
        (result,) = await host(config, game, broker.session())
        await workers
    recording = Recording.open(path)
    decided = (agent for report in recording.of(Report) for agent in report.agents if agent.fate is not None)
    ages = tuple(agent.age_loops for agent in decided)
    return Played(latency_s, result, _hash(recording), ages, len(await replay_host(path)))


async def measure(
    task: str, seeds: Iterable[int], directory: Path, *, rules: Sequence[ClockRule] = RULES, **changes: Any
) -> list[Row]:
    """Play a task under each rule with each seed; `changes` are those of `khala_orchestrator.config.change`."""
    rows = []
    for seed in seeds:
        for rule in rules:
            config = MatchConfig(task=change(load_task(task), rule=rule, **changes), run="clocks", seed=seed)
            latencies_s = LATENCIES_S[-1:] if rule == "realtime" else LATENCIES_S
            played = [await play(config, directory / f"{rule}-{seed}-{s}.mcap", s) for s in latencies_s]
            rows.append(Row(rule, seed, tuple(played)))
    return rows


def _hash(recording: Recording) -> str:
    found = hashlib.sha256()
    for sample in recording:
        if sample.address is not None and sample.address.topic is Topic.OBSERVATION:
            found.update(sample.payload)
    return found.hexdigest()[:16]


def cells(row: Row) -> tuple[object, ...]:
    """Return a row of the table."""
    found = row.as_dict()
    twice = "" if len(row.played) < 2 else "same" if len(set(found["hashes"])) == 1 else "differs"
    kd = "none lost" if found["kd"] is None else f"{found['kd']:.2f}"
    return (
        row.rule, row.seed, found["outcome"], kd, f"{found['game_s']:.1f}", f"{found['lag_s']:.2f}",
        found["decisions"], *found["fates"].values(), f"{found['age_loops']:g}", twice,
        "same" if not found["differences"] else f"{found['differences']} differ",
    )  # fmt: skip


def main() -> None:
    """Play, print a table or a JSON object, and fail if a promise is broken."""
    parser = make_parser(__doc__)
    parser.add_argument("--task", default="2s3z_pair")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        rows = asyncio.run(measure(options.task, options.seeds, Path(directory)))
    violations = [violation for row in rows for violation in row.violations()]
    if options.json:
        print(json.dumps({"rows": [row.as_dict() for row in rows], "violations": violations}))
    else:
        columns = ("rule", "seed", "outcome", "K/D", "game s", "lag s", "decisions", *FATES, "age", "twice", "replay")
        print_table(columns, map(cells, rows))
    if violations:
        raise SystemExit("\n".join(violations))
