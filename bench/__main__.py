"""Measure what the project claims, keep the figures, and compare them.

    python -m bench                              every benchmark; figures go to bench/results/DATE-COMMIT.json
    python -m bench turn bus                     some of them, which print their tables
    python -m bench turn --tls                   one of them with its own options, see python -m bench turn --help
    python -m bench --times 3 --out a.json turn  measure it three times, and keep the figures in a file
    python -m bench --list                       what each of them measures, and the claim that it backs
    python -m bench compare A B                  by which factors two results differ, and how sure that is
    python -m bench history                      the page and the pictures of all results that are kept
    python -m bench limits                       fail if a ratio of one run is beyond its limit

Options of this command stand before the names. Several benchmarks run one after the other, each in a process of its
own. All together take hours, those of which figures are kept ten minutes a time. They are most reliable on an otherwise
idle machine.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from bench.registry import BENCHMARKS, having

if TYPE_CHECKING:
    from collections.abc import Sequence

TIMES: Final = 3
"""Runs whose figures are kept: the least that says how much runs scatter."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = make_parser(__doc__, json=False)
    parser.prog = "python -m bench"
    parser.epilog = "\n".join(f"{name:17} {benchmark.measures}" for name, benchmark in BENCHMARKS.items())
    parser.add_argument("--list", action="store_true", help="list the benchmarks and the claims that they back")
    parser.add_argument("--times", type=int, help=f"runs of each whose figures are kept; {TIMES} if none is named")
    parser.add_argument("--out", type=Path, help="file of figures; bench/results/DATE-COMMIT.json if none is named")
    parser.add_argument("words", nargs="...", metavar="NAME", help="benchmarks, and options of one")
    given = parser.parse_args(arguments)
    if given.list:
        return print_list()
    kept, printed, alone = having("figures"), having("table"), having("alone")
    if given.words and given.words[0] in alone:
        names = given.words[:1]
    else:
        names = list(itertools.takewhile(lambda word: word in {*kept, *printed}, given.words))
    options = given.words[len(names) :]
    if options and len(names) != 1:
        if options[0].startswith("-"):
            parser.error(f"{options[0]} is an option of one benchmark: name it before, such as `turn {options[0]}`")
        if options[0] in alone:
            parser.error(f"{options[0]} runs alone: name no other")
        parser.error(f"there is no benchmark {options[0]!r}; there are {', '.join(BENCHMARKS)}")
    if given.times is not None and given.times < 1:
        parser.error(f"{given.times} times is no measurement: give 1 or more")
    keeping = not names or given.times is not None or given.out is not None
    if keeping and (without := [name for name in names if name not in kept]):
        parser.error(f"{without[0]} has no figures that can be kept: run it without --times and --out")
    if len(names) == 1 and not keeping:
        return run_here(names[0], options)

    from bench import run  # noqa: PLC0415  # half a second, which a help and a single benchmark need not

    code = run.keep(names or kept, options, given.times or TIMES, given.out) if keeping else 0
    for name in printed if not names else () if keeping else names:
        run.show(name)
    return code


def run_here(name: str, options: Sequence[str]) -> int:
    """Run a benchmark in this process, as if its module were the command."""
    sys.argv = [f"python -m bench {name}", *options]
    return BENCHMARKS[name].load().main() or 0


def print_list() -> int:
    """Print every benchmark, its part in the whole, and its claim."""
    for name, benchmark in BENCHMARKS.items():
        part = f"{benchmark.part}, limits" if benchmark.limited is not None else benchmark.part
        print(f"{name:17} {part:16} {benchmark.claim}\n{'':17} {benchmark.measures}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
