"""Measure how many times as many game loops the compiled engine plays as the interpreted one, in one run.

    python -m bench engines                     a table
    python -m bench engines --rounds 5          each engine plays five times, in turns

Each round is `python -m bench simulator_engine` in a process of its own, once with KHALA_ENGINE=compiled and once with
KHALA_ENGINE=python, so that a noisy machine treats both the same. Without a compiled engine nothing is measured.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING, Any, Final

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table
from khala_simulator.native.engine import VARIABLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

ENGINES: Final = ("compiled", "python")
BATTLES: Final[Mapping[str, float]] = {"llm_smac/2s3z": 6.0, "armies of 100": 3.0}
"""What is played, by the name of its row in `python -m bench simulator_engine`: the least ratio that is good enough."""
PLAYED: Final = ("--maps", "llm_smac/2s3z", "--sizes", "200")
WHICH: Final = "from khala_simulator.native.engine import check, engine; check(); print(engine())"
MISSING: Final = "were not compiled"
"""What the simulator says where there is no compiled engine; all else is an error of it."""


def why_not() -> str:
    """Return why there is no compiled engine here, or nothing if there is one.

    Raises:
        SystemExit: there is one, and it cannot be loaded.
    """
    tried = subprocess.run([sys.executable, "-c", WHICH], env=_environ("compiled"), capture_output=True, text=True)  # noqa: PLW1510  # its failure is an answer
    if not tried.returncode:
        return ""
    words = (tried.stderr.strip().splitlines() or ["it says nothing"])[-1]
    if MISSING not in words:
        raise SystemExit(f"the compiled engine cannot be loaded: {words}")
    return f"there is no compiled engine here, so it is compared with nothing ({words})"


def measure(rounds: int, seconds: float) -> dict[str, Any]:
    """Return the loops a second of each battle, by engine, one of each round; and why nothing was measured."""
    loops: dict[str, dict[str, list[float]]] = {name: {engine: [] for engine in ENGINES} for name in BATTLES}
    skipped = why_not()
    for _ in range(0 if skipped else rounds):
        for engine in ENGINES:
            command = [sys.executable, "-m", "bench", "simulator_engine", "--json", "--seconds", str(seconds), *PLAYED]
            said = subprocess.run(command, env=_environ(engine), stdout=subprocess.PIPE, check=True).stdout
            rows = json.loads(said)["rows"]
            for name in BATTLES:
                loops[name][engine].append(rows[name]["loops_per_s"])
    return {"loops_per_s": loops, "skipped": skipped}


def _environ(engine: str) -> dict[str, str]:
    return {**os.environ, VARIABLE: engine}


def measures(found: Any) -> Iterator[Figure]:
    """Yield the ratio of each battle, of every round."""
    for name, loops in found["loops_per_s"].items():
        ratios = tuple(compiled / pure for compiled, pure in zip(*(loops[engine] for engine in ENGINES), strict=True))
        yield Figure(
            f"compiled / pure, {name}", "times", ratios, "more", limit=BATTLES[name], skipped=found["skipped"]
        )  # fmt: skip


def main() -> None:
    """Print the ratios."""
    parser = make_parser(__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="how often each engine plays")
    parser.add_argument("--seconds", type=float, default=1.0, help="processor time of a battle")
    given = parser.parse_args()
    found = measure(given.rounds, given.seconds)
    if given.json:
        print(json.dumps(found))
        return
    if found["skipped"]:
        print(found["skipped"])
        return
    rows = []
    for name, loops in found["loops_per_s"].items():
        compiled, pure = (statistics.median(loops[engine]) for engine in ENGINES)
        rows.append((name, f"{compiled:.0f}", f"{pure:.0f}", f"{compiled / pure:.2f}"))
    print_table(("loops a second", *ENGINES, "ratio"), rows)
