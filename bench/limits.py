"""Check the ratios that must not get worse: `make limits`, in three minutes.

Both sides of a ratio are measured in the same run, in turns, so that a slow or busy machine treats them the same;
no limit is of an absolute time. A limit is broken if the whole interval of 95 % is beyond it, and then the exit code
is 1. `python -m bench limits bus` checks those of one benchmark.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from bench.command_line import make_parser
from bench.ratios import mean_ratio
from bench.registry import BENCHMARKS
from bench.run import figures_of
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bench.figures import Figure
    from khala_sc2.experiment.statistics import Interval

LIMITED: Final = {name: benchmark.limited for name, benchmark in BENCHMARKS.items() if benchmark.limited is not None}
"""By measurement, the options of a short run that has its limited ratios."""
COLUMNS: Final = ("measurement", "ratio", "measured", "95 %", "limit", "")


@dataclass(frozen=True, slots=True)
class Ratio:
    """A limited figure, and whether it is good enough."""

    bench: str
    figure: Figure
    measured: Interval

    @property
    def verdict(self) -> Literal["kept", "at the limit", "broken", "skipped"]:
        """`at the limit` is worse than the limit by no more than chance would explain."""
        worst = self.figure.limit
        measured = self.measured
        if self.figure.skipped or measured.value is None or worst is None:
            return "skipped"
        less = self.figure.better == "less"
        if measured.low > worst if less else measured.high < worst:
            return "broken"
        return "at the limit" if (measured.value > worst if less else measured.value < worst) else "kept"

    @property
    def cells(self) -> tuple[str, ...]:
        """A row of the table."""
        at = "at most" if self.figure.better == "less" else "at least"
        measured = self.measured
        value = "" if measured.value is None else f"{measured.value:.2f}"
        sure = f"{measured.low:.2f} to {measured.high:.2f}" if math.isfinite(measured.high) else ""
        return self.bench, self.figure.name, value, sure, f"{at} {self.figure.limit:g}", self.verdict

    def as_dict(self) -> dict[str, object]:
        """Return the ratio as JSON has it."""
        figure = self.figure
        return {
            "measurement": self.bench, "ratio": figure.name, "measured": self.measured.value, "limit": figure.limit,
            "values": figure.values, "verdict": self.verdict, "skipped": figure.skipped,
        }  # fmt: skip


def judge(bench: str, figures: Sequence[Figure]) -> Iterator[Ratio]:
    """Yield the limited ones of some figures."""
    for figure in figures:
        if figure.limit is not None:
            yield Ratio(bench, figure, mean_ratio(figure.values))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the ratios, and return 1 if a limit is broken."""
    parser = make_parser(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(LIMITED)}; all if none is given")
    given = parser.parse_args(arguments)
    if unknown := [name for name in given.names if name not in LIMITED]:
        parser.error(f"{unknown[0]!r} has no limits; {', '.join(LIMITED)} have")
    ratios = [ratio for name in given.names or LIMITED for ratio in judge(name, figures_of(name, LIMITED[name]))]
    broken = [ratio for ratio in ratios if ratio.verdict == "broken"]
    if given.json:
        print(json.dumps([ratio.as_dict() for ratio in ratios]))
    else:
        print_table(COLUMNS, (ratio.cells for ratio in ratios), left=("ratio", ""))
        for why in dict.fromkeys(ratio.figure.skipped for ratio in ratios if ratio.figure.skipped):
            print(f"* skipped: {why}")
    for ratio in broken:
        print(f"{ratio.bench}: {ratio.figure.name} is beyond its limit of {ratio.figure.limit:g}", file=sys.stderr)
    return 1 if broken else 0
