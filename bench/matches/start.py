"""Measure what a match costs before its first observation: help, imports, a whole command, and memory.

    python -m bench start                        a table
    python -m bench start --times 9 --json       more repetitions; one JSON object

`cpu` is user and system time of the process and of all that it has waited for, `wall` the time on the clock; both are
the least of some runs. On a busy machine only `cpu` and the numbers of modules can be compared. `first` is the time
from the command to the first observation, `whole` to its end. Memory is PSS, in which pages that processes share count
once, at its highest while twelve agents play.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psutil

from bench.command_line import make_parser
from bench.figures import Figure
from khala_protocol.keys import Topic, parse
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

GOAL_HELP_S = 0.25
GOAL_MATCH_S = 2.5
GOAL_MB = 350
IMPORTS = {
    "khala_sc2.cli": "every command",
    "khala_agents.commands": "agents",
    "khala_bridge.game.pysc2_game": "PySC2 and the bridge",
    "khala_sc2.playing.local": "the host",
}
COUNT = "; import sys; print(len(sys.modules))"
MATCH = ("run", "2s3z_pair", "--max-steps", "1", "--latency", "0")
TWELVE = ("run", "simple64_sceb", "--max-steps", "8", "--latency", "0.2")
LOOK_S = 0.1


def time_command(command: Sequence[str], times: int) -> dict[str, Any]:
    """Return processor and wall time of a command, each the least of some runs, and what the last one printed."""
    cpu_s = []
    wall_s = []
    said = ""
    for _ in range(times):
        began_s = time.perf_counter()
        before = os.times()
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        after = os.times()
        wall_s.append(time.perf_counter() - began_s)
        cpu_s.append(sum(after[2:4]) - sum(before[2:4]))
    return {"cpu_s": round(min(cpu_s), 3), "wall_s": round(min(wall_s), 3), "said": said}


def of_help(times: int) -> dict[str, Any]:
    """Return what `khala --help` takes."""
    took = time_command([sys.executable, "-m", "khala_sc2", "--help"], times)
    return {"cpu_s": took["cpu_s"], "wall_s": took["wall_s"]}


def of_imports(times: int) -> list[dict[str, Any]]:
    """Return what importing each of the modules takes, a new process for each."""
    rows = []
    for module, what in IMPORTS.items():
        took = time_command([sys.executable, "-c", f"import {module}{COUNT}"], times)
        rows.append({"module": module, "for": what, "modules": int(took.pop("said"))} | took)
    return rows


def of_match(times: int, directory: Path) -> dict[str, Any]:
    """Return what a match of one step takes, and when its first observation was out."""
    first_s, took = [], []
    for number in range(times):
        began_s = time.time()
        run = ["--run", f"m{number}", "--out", str(directory)]
        took.append(time_command([sys.executable, "-m", "khala_sc2", *MATCH, *run], 1))
        recording = Recording.open(directory / f"m{number}" / "recording.mcap")
        seen = next(sample for sample in recording if parse(sample.key).topic is Topic.OBSERVATION)
        first_s.append(seen.log_time_ns / 1e9 - began_s)
    least = {name: min(run[name] for run in took) for name in ("cpu_s", "wall_s")}
    return {"command": f"khala {' '.join(MATCH)}", "first_s": round(min(first_s), 3)} | least


def of_memory(directory: Path) -> list[dict[str, Any]]:
    """Return the processes of a match of twelve agents at the moment when they held most."""
    command = [sys.executable, "-m", "khala_sc2", *TWELVE, "--run", "twelve", "--out", str(directory)]
    most: list[dict[str, Any]] = []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as host:
        while host.poll() is None:
            found = held(psutil.Process(host.pid))
            most = max(most, found, key=lambda rows: sum(row["pss_mb"] for row in rows))
            time.sleep(LOOK_S)
    if host.returncode:
        raise SystemExit(f"khala {' '.join(TWELVE)} ended with code {host.returncode}")
    return most


def held(host: psutil.Process) -> list[dict[str, Any]]:
    """Return what a process and its children hold; those that end meanwhile are left out."""
    rows = []
    try:
        for process in [host, *host.children(recursive=True)]:
            memory = process.memory_full_info()
            if memory.pss:
                rows.append({"process": _name(process), "pss_mb": memory.pss >> 20, "rss_mb": memory.rss >> 20})
    except psutil.Error:
        return []
    return rows


def _name(process: psutil.Process) -> str:
    line = " ".join(process.cmdline())
    known = {
        "khala_simulator": "game",
        "khala_sc2.playing.spare": "agents",
        "khala agent": "agents",
        "khala llm": "endpoint",
    }
    return next((name for mark, name in known.items() if mark in line), "host")


def measures(found: Any) -> Iterator[Figure]:
    """Yield times, numbers of modules and memory."""
    yield Figure("khala --help", "s", (found["help"]["wall_s"],))
    yield Figure("khala --help, processor time", "s", (found["help"]["cpu_s"],))
    for row in found["imports"]:
        yield Figure(f"import {row['module']}, processor time", "s", (row["cpu_s"],))
        yield Figure(f"modules of {row['module']}", "modules", (row["modules"],))
    yield Figure("a match of one step", "s", (found["match"]["wall_s"],))
    yield Figure("a match of one step, processor time", "s", (found["match"]["cpu_s"],))
    yield Figure("until the first observation", "s", (found["match"]["first_s"],))
    yield Figure("memory of a match of twelve agents", "MB", (sum(row["pss_mb"] for row in found["memory"]),))


def main() -> None:
    """Run the command line."""
    parser = make_parser(__doc__)
    parser.add_argument("--times", type=int, default=5, help="of each that is timed")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        found = {
            "help": of_help(options.times),
            "imports": of_imports(options.times),
            "match": of_match(options.times, Path(directory)),
            "memory": of_memory(Path(directory)),
        }
    print(json.dumps(found)) if options.json else show(found)


def show(found: Any) -> None:
    """Print a table."""
    print(f"{'':34} {'cpu s':>6} {'wall s':>7} {'modules':>8}")
    print(f"{f'khala --help (goal {GOAL_HELP_S:g} s)':34} {found['help']['cpu_s']:6.2f} {found['help']['wall_s']:7.2f}")
    for row in found["imports"]:
        name = f"import {row['module']}"
        print(f"{name:34} {row['cpu_s']:6.2f} {row['wall_s']:7.2f} {row['modules']:8}  {row['for']}")
    match = found["match"]
    print(f"{f'a match of one step (goal {GOAL_MATCH_S:g} s)':34} {match['cpu_s']:6.2f} {match['wall_s']:7.2f}")
    print(f"{'until its first observation':34} {'':6} {match['first_s']:7.2f}")
    print(f"\n{'twelve agents':34} {'PSS MB':>6} {'RSS MB':>7}")
    for row in found["memory"]:
        print(f"{row['process']:34} {row['pss_mb']:6} {row['rss_mb']:7}")
    total = sum(row["pss_mb"] for row in found["memory"])
    print(f"{f'all (goal {GOAL_MB} MB)':34} {total:6}")
