"""Measure how fast this machine is at the moment, by a piece of work that no change of the project touches.

It is what hosts, agents and games mostly do: objects of Python, small arrays of numpy, JSON. `python -m bench compare`
shows its factor beside the others, which says how much of them is the machine.
"""

from __future__ import annotations

import json
import statistics
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.command_line import make_parser
from bench.figures import Figure

if TYPE_CHECKING:
    from collections.abc import Iterator

ROUNDS = 20
UNITS = 100


def work() -> float:
    """Do it once, and return something that depends on all of it."""
    places = np.arange(2 * UNITS, dtype=np.float64).reshape(UNITS, 2)
    total = 0.0
    for step in range(UNITS):
        apart = np.hypot(*(places - places[step]).T)
        near = np.flatnonzero(apart < 40)
        rows = [{"tag": hex(int(row)), "far": round(float(apart[row]), 2)} for row in near]
        total += sum(row["far"] for row in json.loads(json.dumps(rows)))
    return total


def measure(rounds: int = ROUNDS) -> dict[str, Any]:
    """Return the milliseconds of processor time of each round, after one to warm up."""
    work()
    took_ms = []
    for _ in range(rounds):
        began_s = time.process_time()
        work()
        took_ms.append(1000 * (time.process_time() - began_s))
    return {"took_ms": took_ms}


def measures(found: Any) -> Iterator[Figure]:
    """Yield the one figure."""
    yield Figure("the same work", "ms of processor time", tuple(found["took_ms"]))


def main() -> None:
    """Print the figure."""
    parser = make_parser(__doc__)
    given = parser.parse_args()
    found = measure()
    print(json.dumps(found) if given.json else f"{statistics.median(found['took_ms']):.2f} ms")
