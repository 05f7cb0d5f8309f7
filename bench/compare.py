"""Compare two results, figure by figure: by which factor B differs from A, and how sure that is.

    python -m bench compare before.json after.json       two files
    python -m bench compare fb0531d8 2026-11-23          the newest of bench/results of a commit, or of a date
    python -m bench compare A B --only turn bus          figures of some measurements
    python -m bench compare A B --json                   one JSON object on stdout

The factor is that of geometric means over runs, with Welch's interval of 95 %. An interval needs at least two runs on
each side (`python -m bench --times 3`): values inside of one run scatter less than runs do, and would promise too much.
`yardstick` is work that no commit changes, so its factor is that of the machine.
"""

from __future__ import annotations

import json
import math
import statistics
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from bench.ratios import ratio_of_means
from bench.results import find, read
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bench.figures import Better
    from bench.results import Results
    from khala_sc2.experiment.statistics import Interval

COLUMNS: Final = ("measurement", "figure", "A", "B", "unit", "B / A", "95 %", "")
QUIET: Final = 0.5
"""Load up to which a machine counts as quiet."""


@dataclass(frozen=True, slots=True)
class Change:
    """How one figure differs."""

    bench: str
    name: str
    unit: str
    better: Better
    a: float
    b: float
    factor: Interval
    """B divided by A."""

    @property
    def verdict(self) -> str:
        """`better` or `worse` if the interval does not hold 1, else nothing."""
        if self.factor.low <= 1 <= self.factor.high:
            return ""
        return "better" if (self.factor.low > 1) == (self.better == "more") else "worse"


def changes(a: Results, b: Results, only: Sequence[str] = ()) -> Iterator[Change]:
    """Yield how the figures differ that both have, in the order of `b`."""
    before = {series.key: series.per_run for series in a.figures}
    for series in b.figures:
        old = before.get(series.key, [])
        new = series.per_run
        if (only and series.bench not in only) or not old or not new:
            continue
        yield Change(
            series.bench, series.name, series.unit, series.better,
            a=_mean(old), b=_mean(new), factor=ratio_of_means(new, old),
        )  # fmt: skip


def _mean(values: Sequence[float]) -> float:
    """Return the geometric mean, of which factors are; of values that have none, the median."""
    return statistics.geometric_mean(values) if min(values) > 0 else statistics.median(values)


def remarks(a: Results, b: Results, found: Sequence[Change]) -> Iterator[str]:
    """Yield what a reader must know before believing the factors."""
    if a.machine != b.machine:
        yield f"the machines differ, so factors are not those of the code: A {a.machine}; B {b.machine}"
    for name, results in (("A", a), ("B", b)):
        if results.load > QUIET:
            yield f"{name} began on a machine with a load of {results.load:g}: measure it again when nothing else runs"
    missing = {series.key for series in a.figures} ^ {series.key for series in b.figures}
    if missing:
        yield f"{len(missing)} figures are in one of the two alone, and are left out"
    if sure := [change for change in found if math.isfinite(change.factor.high)]:
        yield f"of {len(sure)} figures that are the same, {len(sure) / 20:.1f} would stand out by chance"
    if len(sure) < len(found):
        yield "figures without an interval were measured in one run of A or B; `python -m bench --times 3` makes three"


def rows(found: Sequence[Change]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of a table of `COLUMNS`."""
    for change in found:
        factor = "" if change.factor.value is None else f"{change.factor.value:.3f}"
        sure = f"{change.factor.low:.3f} to {change.factor.high:.3f}" if math.isfinite(change.factor.high) else ""
        yield change.bench, change.name, f"{change.a:.4g}", f"{change.b:.4g}", change.unit, factor, sure, change.verdict


def _finite(factor: Interval) -> dict[str, float | None]:
    """Return an interval as JSON has it, which knows no infinity."""
    return {name: value if math.isfinite(value or 0) else None for name, value in asdict(factor).items()}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print how two results differ."""
    parser = make_parser(__doc__)
    parser.add_argument("a", help="a file, or the beginning of a commit or a date")
    parser.add_argument("b", help="the same")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="measurements to compare")
    given = parser.parse_args(arguments)
    a, b = read(find(given.a)), read(find(given.b))
    found = list(changes(a, b, given.only))
    if given.json:
        each = [asdict(change) | {"factor": _finite(change.factor), "verdict": change.verdict} for change in found]
        print(json.dumps({"a": a.title, "b": b.title, "remarks": list(remarks(a, b, found)), "changes": each}))
        return
    print(f"A: {a.title}; {a.machine}\nB: {b.title}; {b.machine}\n")
    print_table(COLUMNS, rows(found), left=("figure", "unit", ""))
    print("".join(f"\n* {remark}" for remark in remarks(a, b, found)))
