"""Measure battles for training, one and many at once: ours, SMAC's package on the simulator, SMAClite and SMAX.

    python -m bench env                                                     ours alone
    python -m bench env --smac ~/smac --smaclite ~/smaclite --smaclite-python ~/lite/bin/python
    python -m bench env --smax-python ~/jax/bin/python --envs 64            a Python that has `jaxmarl`
    python -m bench env --maps 2s3z --envs 64 --seconds 5 --rounds 5 --json

The paths are checkouts of https://github.com/oxwhirl/smac and https://github.com/uoe-agents/smaclite; the Python for
the second has what it asks for. The kinds play in turn in each round, since machines are not idle; medians of the
rounds count. `batch` is our `vector_env` with two worker processes. `single`, SMAC and SMAClite are one environment
after the other with a list for each agent, as training loops without a batch have them; SMAC has the game's processes
beside it. SMAC and SMAClite are measured with at most 64 battles. Processor time is that of all processes of a kind,
and so is memory.
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
MAPS = ("2s3z", "3s5z_vs_3s6z", "27m_vs_30m")
ENVS = (1, 8, 64, 1024)
MANY = 64
"""More battles at once than this are for kinds that are made for it."""


@dataclass(frozen=True, slots=True)
class Row:
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


@dataclass(frozen=True, slots=True)
class Kind:
    """How the process of a kind is started."""

    name: str
    python: str = sys.executable
    path: str = str(ROOT)
    most: int | None = None
    """Battles at once, if there is a limit."""

    def start(self, map_name: str, envs: int) -> subprocess.Popen[str]:
        """Start it; it says `ready`."""
        environment = {**os.environ, "PYTHONPATH": self.path, "OMP_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"}
        environment["SC2PATH"] = str(games.find("simulator")[0])
        return subprocess.Popen(
            [self.python, "-P", str(WORKER), self.name, map_name, str(envs)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment,
        )


def kinds_of(options: argparse.Namespace) -> Iterator[Kind]:
    """Yield the kinds that the command line names."""
    yield Kind("batch")
    yield Kind("single")
    if options.smac:
        yield Kind("smac", path=f"{package_root(options.smac)}:{ROOT}", most=MANY)
    if options.smaclite:
        yield Kind("smaclite", str(options.smaclite_python), str(options.smaclite.absolute()), MANY)
    if options.smax_python:
        yield Kind("smax", options.smax_python)


def measures(found: Any) -> Iterator[Figure]:
    """Yield the figures of what `--json` prints."""
    for row in found["rows"]:
        name = f"{row['map']}, {row['kind']}, {row['envs']} battles"
        yield Figure(f"{name}: steps", "1/s", (row["steps_per_s"],), better="more")
        yield Figure(f"{name}: processor time of a step", "ms", (row["cpu_ms"],))


def measure(map_name: str, kinds: Sequence[Kind], envs: int, seconds: float, rounds: int) -> Iterator[Row]:
    """Yield a row for each kind, which play in turn."""
    with ExitStack() as stack:
        started = {kind.name: stack.enter_context(kind.start(map_name, envs)) for kind in kinds}
        for kind, process in started.items():
            if _line(process) != "ready\n":
                raise SystemExit(f"{kind} did not start: run {WORKER} {kind} {map_name} {envs} with its Python")
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
        yield Row(map_name, kind, envs, round(speed), round(cpu_ms, 4), round(rows[-1]["memory_mb"], 1))


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
    parser.add_argument("--smac", type=Path, help="a checkout of SMAC")
    parser.add_argument("--smaclite", type=Path, help="a checkout of SMAClite")
    parser.add_argument("--smaclite-python", type=Path, default=Path(sys.executable), help="with its requirements")
    parser.add_argument("--smax-python", help="a Python that has jaxmarl")
    options = parser.parse_args()
    kinds = list(kinds_of(options))
    if not options.json:
        print("| map | battles | kind | steps/s | CPU ms a step | MB in all |\n|---|---:|---|---:|---:|---:|")
    rows = []
    for map_name in options.maps:
        for envs in options.envs:
            chosen = [kind for kind in kinds if kind.most is None or envs <= kind.most]
            for row in measure(map_name, chosen, envs, options.seconds, options.rounds):
                rows.append(asdict(row))
                line = f"| {row.map} | {row.envs} | {row.kind} | {row.steps_per_s:.0f} | {row.cpu_ms:.3f} |"
                if not options.json:
                    print(f"{line} {row.memory_mb:.0f} |", flush=True)
    if options.json:
        print(json.dumps({"rows": rows}))
