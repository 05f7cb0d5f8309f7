"""Play the rows, print a table, and end with 1 if one of them got through a door."""

from __future__ import annotations

import argparse
import asyncio
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING

import bench.doors
from bench.doors.commands import missing
from bench.doors.registry import ROWS
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bench.doors.rows import Row


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.doors",
        description=bench.doors.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--door", help="play only rows whose door begins so")
    parser.add_argument("--list", action="store_true", help="list the rows without playing them")
    parser.add_argument("--check", action="store_true", help="end with 1 if a command has no rows, and play nothing")
    given = parser.parse_args(arguments)
    if given.check:
        return _check()
    rows = [row for row in ROWS if row.door.startswith(given.door or "")]
    if not rows:
        parser.error(f"no door begins with {given.door!r}; there are {', '.join(dict.fromkeys(r.door for r in ROWS))}")
    if given.list:
        print_table({"door": "left", "kind": "left", "what": "left"}, [(row.door, row.kind, row.what) for row in rows])
        return 0
    found = [(row, *_played(row)) for row in rows]
    print_table(
        {"door": "left", "kind": "left", "what": "left", "": "left", "s": "right"},
        [(row.door, row.kind, row.what, said or "held", f"{took_s:.1f}") for row, said, took_s in found],
    )
    through = [row for row, said, _ in found if said]
    print(f"{len(found)} rows, {len(through)} got through")
    return 1 if through else 0


def _check() -> int:
    """Print the commands without rows, and return 1 if there are any."""
    for name in (left_out := missing(ROWS)):
        print(
            f"bench/doors has no rows for `{name}`, or a reason in commands.py that is none any more", file=sys.stderr
        )
    return 1 if left_out else 0


def _played(row: Row) -> tuple[str, float]:
    """Return how a row got through, "" if it was held, and the seconds it took; a row that raises got through."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="khala-doors-") as directory:
        try:
            said = asyncio.run(row.play(Path(directory)))
        except Exception as error:  # noqa: BLE001  # whatever it is, the other rows are played as well
            traceback.print_exc()
            said = f"{type(error).__name__}: {error}"
    took_s = time.perf_counter() - began
    print(f"{'GOT THROUGH' if said else 'held':12} {row.door}: {row.what}", file=sys.stderr, flush=True)
    return said, took_s


if __name__ == "__main__":
    sys.exit(main())
