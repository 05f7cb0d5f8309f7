"""Measure how long the processes of a match live after their host is killed at a random moment.

    python -m bench orphans --kills 20

Every process is found by its environment, in `/proc`: Linux only. The exit code is 1 if one was left after `GONE_S`.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.command_line import make_parser

if TYPE_CHECKING:
    from collections.abc import Sequence

LATEST_S = 10.0
GONE_S = 5.0
GIVEN_UP_S = 30.0
LOOK_S = 0.01


@dataclass(frozen=True, slots=True)
class Killed:
    """One killed match."""

    after_s: float
    children: int
    """Processes next to the host when it was killed."""
    gone_s: float
    """Until none of them was left."""


def processes_of(mark: str) -> set[int]:
    """Return the processes that have this text among the variables of their environment."""
    found = set()
    for entry in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark.encode() in entry.read_bytes().split(b"\0"):
                found.add(int(entry.parent.name))
    return found


def kill_after(seconds: float, directory: Path, cache: Path) -> Killed:
    """Start a match of two agents, kill its host, and wait until its processes are gone."""
    command = [sys.executable, "-m", "khala_sc2", "run", "2s3z_pair", "--latency", "0.1", "--episodes", "9"]
    environ = os.environ | {"TMPDIR": str(directory), "KHALA_CACHE": str(cache)}
    with subprocess.Popen(command, cwd=directory, env=environ, stderr=subprocess.DEVNULL) as host:
        while not processes_of(f"TMPDIR={directory}") - {host.pid} and host.poll() is None:
            time.sleep(LOOK_S)
        time.sleep(seconds)
        children = processes_of(f"TMPDIR={directory}") - {host.pid}
        host.kill()
        began_s = time.monotonic()
    while processes_of(f"TMPDIR={directory}") and time.monotonic() - began_s < GIVEN_UP_S:
        time.sleep(LOOK_S)
    return Killed(seconds, len(children), time.monotonic() - began_s)


def measure(kills: int, seed: int) -> list[Killed]:
    """Kill as many matches, one after the other."""
    moments = random.Random(seed)
    found = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(kills):
            with tempfile.TemporaryDirectory() as directory:
                found.append(kill_after(moments.uniform(0.0, LATEST_S), Path(directory), Path(cache)))
    return found


def is_good(found: Sequence[Killed], gone_s: float = GONE_S) -> bool:
    """Return whether there were processes to end, and all of them were gone in time."""
    return any(killed.children for killed in found) and all(killed.gone_s <= gone_s for killed in found)


def main() -> None:
    """Measure, and print each kill and the summary, or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    found = measure(arguments.kills, arguments.seed)
    gone_s = [killed.gone_s for killed in found]
    code = 0 if is_good(found) else 1
    if arguments.json:
        print(json.dumps({"gone_s": gone_s, "after_s": [killed.after_s for killed in found]}))
        raise SystemExit(code)
    for killed in found:
        print(f"killed after {killed.after_s:5.2f} s: {killed.children} children, gone after {killed.gone_s:.2f} s")
    print(f"{len(found)} kills: median {statistics.median(gone_s):.2f} s, longest {max(gone_s):.2f} s")
    raise SystemExit(code)
