"""Play every attack and every quirk of the outside world against every door of Khala.

    python -m bench doors                       all rows, as a table; the exit code is 1 if one of them gets through
    python -m bench doors --door "khala view"   those of one door
    python -m bench doors --kind fault          those of one kind: attack, quirk or fault
    python -m bench doors --jobs 2              in two processes
    python -m bench doors --list                what would be played
    python -m bench doors --check               the commands without rows; `make check` runs it

A door is where something comes in that its owner did not write: a command that reads a file, a server, an endpoint that
answers. `rows` says what a row is, `commands` lists the doors of the command line, `registry` says which module has the
rows of which door, `playing` plays them, and each other module has rows.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import TYPE_CHECKING, get_args

from bench.command_line import make_parser
from bench.doors.commands import missing
from bench.doors.ending import end_on_sigterm
from bench.doors.registry import DOORS, load_rows
from bench.doors.rows import Kind
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bench.doors.playing import Outcome
    from bench.doors.rows import Row

SLOWEST = 5
"""Rows whose times are printed at the end."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--door", default="", help="play only rows whose door begins so")
    parser.add_argument("--kind", choices=get_args(Kind), help="play only rows of this kind")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes that play rows; 1 if not given")
    parser.add_argument("--list", action="store_true", help="list the rows without playing them")
    parser.add_argument("--check", action="store_true", help="end with 1 if a command has no rows, and play nothing")
    given = parser.parse_args(arguments)
    if given.check:
        return check()
    rows = load_rows(given.door)
    numbers = [number for number, row in enumerate(rows) if given.kind in (None, row.kind)]
    if not numbers:
        known = ", ".join(dict.fromkeys(door for doors in DOORS.values() for door in doors))
        parser.error(f"there is no such row at a door that begins with {given.door!r}; there are {known}")
    if given.jobs < 1:
        parser.error(f"--jobs {given.jobs}: take 1 or more")
    if given.list:
        chosen = (rows[number] for number in numbers)
        print_table(("door", "kind", "what"), [(row.door, row.kind, row.what) for row in chosen], left=("kind", "what"))
        return 0
    end_on_sigterm()
    return run(rows, numbers, given.jobs)


def check() -> int:
    """Print the commands without rows, and return 1 if there are any."""
    left_out = missing(door for doors in DOORS.values() for door in doors)
    for name in left_out:
        print(
            f"bench/doors: `{name}` has no rows, or a reason in commands.py that no longer holds; write a row that "
            "comes through it, or delete the reason",
            file=sys.stderr,
        )
    return 1 if left_out else 0


def run(rows: Sequence[Row], numbers: Sequence[int], jobs: int = 1) -> int:
    """Play some of the rows, print how they fared, and return 1 if one of them got through."""
    from bench.doors.playing import play_all  # noqa: PLC0415  # a check or a list plays nothing

    began = time.perf_counter()
    found: dict[int, Outcome] = {}
    for number, outcome in play_all(rows, numbers, jobs):
        found[number] = outcome
        row = rows[number]
        words = f"{len(found)} of {len(numbers)}  {outcome.word:11}  {row.door}: {row.what}"
        print(words, file=sys.stderr, flush=True)
        if outcome.through:
            print(outcome.noise, end="", file=sys.stderr, flush=True)
    played = [(rows[number], found[number]) for number in sorted(found)]
    print_table(
        ("door", "kind", "what", "", "s"),
        [
            (row.door, row.kind, row.what, outcome.through or outcome.skipped or "held", f"{outcome.took_s:.1f}")
            for row, outcome in played
        ],
        left=("kind", "what", ""),
    )
    slowest = sorted(played, key=lambda pair: -pair[1].took_s)[:SLOWEST]
    print(f"slowest: {', '.join(f'{outcome.took_s:.1f} s {row.door}: {row.what}' for row, outcome in slowest)}")
    print(f"{summary(played)}; {time.perf_counter() - began:.0f} s")
    return 1 if any(outcome.through for _, outcome in played) else 0


def summary(played: Sequence[tuple[Row, Outcome]]) -> str:
    """Return the numbers of rows of each kind, and how many of them got through or were skipped."""
    kinds = Counter(row.kind for row, _ in played)
    through = sum(bool(outcome.through) for _, outcome in played)
    skipped = sum(bool(outcome.skipped) for _, outcome in played)
    counts = ", ".join(f"{kinds[kind]} {kind}{'' if kinds[kind] == 1 else 's'}" for kind in get_args(Kind))
    return f"{len(played)} rows: {counts}; {through} got through" + (f", {skipped} skipped" if skipped else "")
