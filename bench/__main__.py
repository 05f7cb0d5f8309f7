"""Measure what the project claims, keep the figures, and compare them.

    python -m bench                              every measurement; figures go to bench/results/DATE-COMMIT.json
    python -m bench turn bus                     some of them, which print their tables
    python -m bench turn --tls                   one of them with its own options, see python -m bench.turn --help
    python -m bench --times 3 --out a.json turn  measure it three times, and keep the figures in a file
    python -m bench compare A B                  by which factors two results differ, and how sure that is
    python -m bench history                      the page and the pictures of all results that are kept
    python -m bench limits                       fail if a ratio of one run is beyond its limit

Options of this command stand before the names. Each measurement is a module that runs in a process of its own, one
after the other; all together take hours, those of which figures are kept ten minutes a time. They are most reliable on
an otherwise idle machine.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from bench import compare, history, limits, results
from bench.run import KEPT, PRINTED, figures_of, show
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bench.figures import Figure

TOOLS = {"compare": compare.main, "history": history.main, "limits": limits.main}
COLUMNS: Final[Mapping[str, Literal["left", "right"]]] = {
    "measurement": "left", "figure": "left", "median": "right", "least": "right", "most": "right", "unit": "left",
}  # fmt: skip
TIMES: Final = 3
"""Runs whose figures are kept: the least that says how much runs scatter."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, help=f"runs of each whose figures are kept; {TIMES} if none is named")
    parser.add_argument("--out", type=Path, help="file of figures; bench/results/DATE-COMMIT.json if none is named")
    parser.add_argument("words", nargs=argparse.REMAINDER, metavar="NAME", help="measurements, and options of one")
    given = parser.parse_args(arguments)
    if given.words and given.words[0] in TOOLS:
        return TOOLS[given.words[0]](given.words[1:]) or 0
    names = list(itertools.takewhile(lambda word: word in {*KEPT, *PRINTED}, given.words))
    options = given.words[len(names) :]
    if options and len(names) != 1:
        if options[0].startswith("-"):
            parser.error(f"{options[0]} is an option of one measurement: name it before, such as `turn {options[0]}`")
        known = ", ".join((*KEPT, *PRINTED, *TOOLS))
        parser.error(f"there is no measurement {options[0]!r}; there are {known}")
    if given.times is not None and given.times < 1:
        parser.error(f"{given.times} times is no measurement: give 1 or more")
    keeping = not names or given.times is not None or given.out is not None
    if keeping and (without := [name for name in names if name not in KEPT]):
        parser.error(f"{without[0]} has no figures that can be kept: run it without --times and --out")
    code = keep(names or KEPT, options, given.times or TIMES, given.out) if keeping else 0
    for name in PRINTED if not names else () if keeping else names:
        print(f"\n== python -m bench.{name}", flush=True)
        show(name, options)
    return code


def keep(names: Sequence[str], options: Sequence[str], times: int, out: Path | None) -> int:
    """Measure in turns, so that hours of a busy machine fall on all; print the figures, and write them.

    Return 1 if a run failed, else 0.
    """
    found = results.begun()
    runs: dict[str, list[list[Figure]]] = {name: [] for name in names}
    failed: list[str] = []
    for number, name in itertools.product(range(times), names):
        print(f"\n== python -m bench.{name} ({number + 1} of {times})", flush=True)
        try:
            runs[name].append(figures_of(name, options))
        except subprocess.CalledProcessError as error:  # what took an hour is kept nevertheless
            failed.append(f"{name} ({number + 1} of {times}): exit code {error.returncode}")
    series = tuple(one for name in names for one in results.join(name, runs[name]))
    print_table(COLUMNS, rows(series))
    print(f"written to {results.write(found.model_copy(update={'figures': series}), out)}")
    for each in failed:
        print(f"failed, and without figures: {each}", file=sys.stderr)
    return 1 if failed else 0


def rows(figures: Sequence[results.Series]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of a table of `COLUMNS`: the median of the runs, the least and the most."""
    for one in figures:
        of_runs = one.per_run
        cells = [f"{of(of_runs):.4g}" if of_runs else "" for of in (statistics.median, min, max)]
        yield one.bench, one.name, *cells, one.unit if of_runs else one.skipped


if __name__ == "__main__":
    sys.exit(main())
