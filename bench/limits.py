"""Check the ratios that must not get worse: `python -m bench limits`, or `make limits`. Three minutes.

Both sides of a ratio are measured in the same run, in turns, so that a slow or busy machine treats them the same;
no limit is of an absolute time. A limit is broken if the whole interval of 95 % is beyond it, and then the exit code
is 1. `python -m bench limits bus` checks those of one measurement, `--json` prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from bench.command_line import make_parser
from bench.ratios import mean_ratio
from bench.run import figures_of
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bench.figures import Figure
    from khala.experiment.statistics import Interval

LIMITED: Final[Mapping[str, tuple[str, ...]]] = {
    "bus": ("--agents", "8", "32", "--scale", "1"),
    "engines": (),
    "floors": (),
}
"""By measurement, the options of a short run that has its limited figures."""
COLUMNS: Final[Mapping[str, Literal["left", "right"]]] = {
    "measurement": "left", "ratio": "left", "measured": "right", "95 %": "right", "limit": "right", "": "left",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Judged:
    """A limited figure, and whether it is good enough."""

    bench: str
    figure: Figure
    ratio: Interval

    @property
    def verdict(self) -> Literal["kept", "at the limit", "broken", "skipped"]:
        """`at the limit` is worse than the limit by no more than chance would explain."""
        worst, figure = self.figure.limit, self.figure
        if figure.skipped or self.ratio.value is None or worst is None:
            return "skipped"
        less = figure.better == "less"
        if self.ratio.low > worst if less else self.ratio.high < worst:
            return "broken"
        return "at the limit" if (self.ratio.value > worst if less else self.ratio.value < worst) else "kept"


def judge(bench: str, figures: Sequence[Figure]) -> Iterator[Judged]:
    """Yield the limited ones of some figures."""
    for figure in figures:
        if figure.limit is not None:
            yield Judged(bench, figure, mean_ratio(figure.values))


def rows(judged: Sequence[Judged]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of a table of `COLUMNS`."""
    for judgement in judged:
        at = "at most" if judgement.figure.better == "less" else "at least"
        value = "" if judgement.ratio.value is None else f"{judgement.ratio.value:.2f}"
        sure = f"{judgement.ratio.low:.2f} to {judgement.ratio.high:.2f}" if math.isfinite(judgement.ratio.high) else ""
        yield judgement.bench, judgement.figure.name, value, sure, f"{at} {judgement.figure.limit:g}", judgement.verdict


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the ratios, and return 1 if a limit is broken."""
    parser = make_parser(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(LIMITED)}; all if none is given")
    given = parser.parse_args(arguments)
    if unknown := [name for name in given.names if name not in LIMITED]:
        parser.error(f"{unknown[0]!r} has no limits; {', '.join(LIMITED)} have")
    judged = [
        judgement for name in given.names or LIMITED for judgement in judge(name, figures_of(name, LIMITED[name]))
    ]
    broken = [judgement for judgement in judged if judgement.verdict == "broken"]
    if given.json:
        print(json.dumps([_row(judgement) for judgement in judged]))
    else:
        print_table(COLUMNS, rows(judged))
        for why in dict.fromkeys(judgement.figure.skipped for judgement in judged if judgement.figure.skipped):
            print(f"* skipped: {why}")
    for judgement in broken:
        print(
            f"{judgement.bench}: {judgement.figure.name} is beyond its limit of {judgement.figure.limit:g}",
            file=sys.stderr,
        )
    return 1 if broken else 0


def _row(judgement: Judged) -> dict[str, object]:
    return {
        "measurement": judgement.bench, "ratio": judgement.figure.name, "measured": judgement.ratio.value, "limit": judgement.figure.limit,
        "values": judgement.figure.values, "verdict": judgement.verdict, "skipped": judgement.figure.skipped,
    }  # fmt: skip
