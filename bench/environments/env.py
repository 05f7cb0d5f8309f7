"""Measure steps a second of numeric environments: ours, SMAC's package on the simulator, and SMAClite.

    python -m bench env                                                     ours alone
    python -m bench env --smac ~/smac --smaclite ~/smaclite --smaclite-python ~/lite/bin/python
    python -m bench env --maps 2s3z corridor --seconds 10 --rounds 5 --json

The paths are checkouts of https://github.com/oxwhirl/smac and https://github.com/uoe-agents/smaclite; the Python for
the second has what it asks for. Each environment has a process (SMAC's has the game's beside it). They are
measured in turn, one and eight at a time, in several rounds of one run, since machines are not idle: the steps are
those of all together, the processor time is that of a step, with all of its processes, and the medians of the rounds
count.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.command_line import make_parser
from bench.environments.smac import package_root
from bench.figures import Figure
from bench.paths import ROOT
from khala_sc2.playing import games

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Sequence

WORKER = Path(__file__).with_name("env_worker.py")


@dataclass(frozen=True, slots=True)
class Row:
    """What one kind of environment did on a map."""

    map: str
    kind: str
    envs: int
    steps_per_s: float
    cpu_ms: float
    """Processor time of a step."""


@dataclass(frozen=True, slots=True)
class Kind:
    """How a kind of environment is started."""

    name: str
    python: str = sys.executable
    path: str = str(ROOT)

    def start(self, map_name: str, seed: int) -> subprocess.Popen[str]:
        """Start one; it says `ready`."""
        environment = {**os.environ, "PYTHONPATH": self.path, "OMP_NUM_THREADS": "1"}
        environment["SC2PATH"] = str(games.find("simulator")[0])
        command = [self.python, "-P", str(WORKER), self.name, map_name, str(seed)]
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment,
        )


def measures(found: Any) -> list[Figure]:
    """Return the figures of what `--json` prints."""
    return [
        figure
        for row in found["rows"]
        for name in [f"{row['map']}, {row['kind']}, {row['envs']} at once"]
        for figure in (
            Figure(f"{name}: steps", "1/s", (row["steps_per_s"],), better="more"),
            Figure(f"{name}: processor time of a step", "ms", (row["cpu_ms"],)),
        )
    ]


def kinds_of(options: argparse.Namespace) -> Iterator[Kind]:
    """Yield the kinds that the command line names."""
    yield Kind("khala")
    if options.smac:
        yield Kind("smac", path=f"{package_root(options.smac)}:{ROOT}")
    if options.smaclite:
        yield Kind("smaclite", python=str(options.smaclite_python), path=str(options.smaclite.absolute()))


def measure(map_name: str, kinds: Sequence[Kind], count: int, seconds: float, rounds: int) -> list[Row]:
    """Return a row for each kind: so many environments at once, the kinds in turn."""
    with ExitStack() as stack:
        started = {
            kind.name: [stack.enter_context(kind.start(map_name, seed)) for seed in range(1, count + 1)]
            for kind in kinds
        }
        for name, workers in started.items():
            for worker in workers:
                if _line(worker) != "ready\n":
                    raise SystemExit(f"an environment of {name} did not start: run {WORKER} {name} {map_name} 1")
        taken: dict[str, list[tuple[float, float]]] = {name: [] for name in started}
        for _ in range(rounds):
            for name, workers in started.items():
                taken[name].append(_round(workers, seconds))
        for worker in (worker for workers in started.values() for worker in workers):
            assert worker.stdin is not None
            worker.stdin.close()
    return [
        Row(map_name, name, count, *(round(statistics.median(column), 2) for column in zip(*rows, strict=True)))
        for name, rows in taken.items()
    ]


def _round(workers: Sequence[subprocess.Popen[str]], seconds: float) -> tuple[float, float]:
    """Return steps a second of all workers together, and the processor time of a step in ms."""
    for worker in workers:
        assert worker.stdin is not None
        worker.stdin.write(f"{seconds}\n")
        worker.stdin.flush()
    played = [json.loads(_line(worker)) for worker in workers]
    steps = sum(play["steps"] for play in played)
    return sum(play["steps"] / play["wall_s"] for play in played), sum(play["cpu_s"] for play in played) / steps * 1000


def _line(worker: subprocess.Popen[str]) -> str:
    assert worker.stdout is not None
    return worker.stdout.readline()


def main() -> None:
    """Measure what the command line asks for."""
    parser = make_parser(__doc__)
    parser.add_argument("--maps", nargs="+", default=["2s3z", "10m_vs_11m"])
    parser.add_argument("--seconds", type=float, default=5.0, help="of a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--smac", type=Path, help="a checkout of SMAC")
    parser.add_argument("--smaclite", type=Path, help="a checkout of SMAClite")
    parser.add_argument("--smaclite-python", type=Path, default=Path(sys.executable))
    parser.add_argument("--at-once", type=int, nargs="+", default=[1, 8], help="how many environments play at a time")
    options = parser.parse_args()
    kinds = list(kinds_of(options))
    if not options.json:
        print("| map | environment | at once | steps/s | CPU ms a step |\n|---|---|---:|---:|---:|")
    rows = []
    for map_name in options.maps:
        for count in options.at_once:
            for row in measure(map_name, kinds, count, options.seconds, options.rounds):
                rows.append(asdict(row))
                text = f"| {row.map} | {row.kind} | {row.envs} | {row.steps_per_s:.0f} | {row.cpu_ms:.2f} |"
                if not options.json:
                    print(text, flush=True)
    if options.json:
        print(json.dumps({"rows": rows}))
