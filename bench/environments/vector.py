"""Measure many battles at once: our batch, our single environments in turn, and SMAX.

    python -m bench vector                                             ours
    python -m bench vector --smax-python ~/jax/bin/python              beside SMAX: a Python that has `jaxmarl`
    python -m bench vector --maps 2s3z --envs 64 --seconds 5 --rounds 5 --json

The kinds play in turn in each round, since machines are not idle; medians of the rounds count. `single` is one
`StarCraft2Env` after the other with a list for each agent, as training loops without a batch have them. Processor time
is that of all processes of a kind, and so is memory.
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
from bench.figures import Figure
from bench.paths import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

WORKER = Path(__file__).with_name("vector_worker.py")
MAPS = ("2s3z", "3s5z_vs_3s6z", "27m_vs_30m")
ENVS = (1, 8, 64, 1024)


@dataclass(frozen=True, slots=True)
class VectorRow:
    """What one kind did with some battles of a map."""

    map: str
    kind: str
    envs: int
    steps_per_s: float
    """Of all battles together."""
    cpu_ms: float
    """Processor time of a step of one battle."""
    memory_mb: float
    """Of all processes of the kind."""


def measures(found: Any) -> Iterator[Figure]:
    """Yield the figures of what `--json` prints."""
    for row in found["rows"]:
        name = f"{row['map']}, {row['kind']}, {row['envs']} battles"
        yield Figure(f"{name}: steps", "1/s", (row["steps_per_s"],), better="more")
        yield Figure(f"{name}: processor time of a step", "ms", (row["cpu_ms"],))


def start(kind: str, python: str, map_name: str, envs: int) -> subprocess.Popen[str]:
    """Start a kind, which says `ready`."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"}
    return subprocess.Popen(
        [python, "-P", str(WORKER), kind, map_name, str(envs)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment,
    )


def measure(map_name: str, pythons: dict[str, str], envs: int, seconds: float, rounds: int) -> Iterator[VectorRow]:
    """Yield a row for each kind, which play in turn."""
    with ExitStack() as stack:
        started = {kind: stack.enter_context(start(kind, python, map_name, envs)) for kind, python in pythons.items()}
        for kind, process in started.items():
            if _line(process) != "ready\n":
                raise SystemExit(f"{kind} did not start: run {pythons[kind]} {WORKER} {kind} {map_name} {envs}")
        played: dict[str, list[dict[str, float]]] = {kind: [] for kind in started}
        for _ in range(rounds):
            for kind, process in started.items():
                assert process.stdin is not None
                process.stdin.write(f"{seconds}\n")
                process.stdin.flush()
                played[kind].append(json.loads(_line(process)))
        for process in started.values():
            assert process.stdin is not None
            process.stdin.close()
    for kind, rows in played.items():
        speed = statistics.median(row["steps"] / row["wall_s"] for row in rows)
        cpu_ms = statistics.median(row["cpu_s"] / row["steps"] * 1000 for row in rows)
        yield VectorRow(map_name, kind, envs, round(speed), round(cpu_ms, 4), round(rows[-1]["memory_mb"], 1))


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def main() -> None:
    """Measure what the command line asks for."""
    parser = make_parser(__doc__)
    parser.add_argument("--maps", nargs="+", default=list(MAPS))
    parser.add_argument("--envs", type=int, nargs="+", default=list(ENVS), help="how many battles at once")
    parser.add_argument("--seconds", type=float, default=3.0, help="of a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--smax-python", help="a Python that has jaxmarl")
    options = parser.parse_args()
    pythons = {"batch": sys.executable, "single": sys.executable}
    if options.smax_python:
        pythons["smax"] = options.smax_python
    if not options.json:
        print("| map | battles | kind | steps/s | CPU ms a step | MB in all |\n|---|---:|---|---:|---:|---:|")
    rows = []
    for map_name in options.maps:
        for envs in options.envs:
            for row in measure(map_name, pythons, envs, options.seconds, options.rounds):
                rows.append(asdict(row))
                line = f"| {row.map} | {row.envs} | {row.kind} | {row.steps_per_s:.0f} | {row.cpu_ms:.3f} |"
                if not options.json:
                    print(f"{line} {row.memory_mb:.0f} |", flush=True)
    if options.json:
        print(json.dumps({"rows": rows}))
