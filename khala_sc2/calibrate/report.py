"""A comparison of two calibrations in Markdown, ready for an issue. It decides nothing; `compare` does."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from khala_bridge.calibrate.catalogue import PROBES
from khala_sc2.calibrate.estimates import estimates
from khala_sc2.experiment.numbers import difference_with, number, p_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_bridge.calibrate.record import Calibration
    from khala_sc2.calibrate.compare import CalibrationComparison, NumberDifference

MOST_ROWS = 40
"""Of one probe in the report; the files have all."""


def write(a: Calibration, b: Calibration, found: CalibrationComparison) -> str:
    """Return the report."""
    return "\n".join([*_head(a, b, found), *_differences(found), *_missing(found), *_estimates(found)]) + "\n"


def _head(a: Calibration, b: Calibration, found: CalibrationComparison) -> Iterator[str]:
    yield "# Calibration: two games compared\n"
    yield "| | game | version | build | data | seed | platform | Khala |\n|---|---|---|---|---|---|---|---|"
    for name, file in (("A", a), ("B", b)):
        data = file.data_version[:8]
        cells = (name, file.game, file.version, file.build, data, file.seed, file.platform, file.khala)
        yield f"| {' | '.join(map(str, cells))} |"
    yield ""
    yield (
        f"{found.exact} measurements that the game repeats were compared digit by digit, and {found.random} that have "
        f"chance in them by their means (permutation test, Holm's correction, level 5 %). "
        f"**{len(found.differences)} differ.**\n"
    )
    if found.unused:
        yield f"{found.unused} with chance in them have too few samples to be compared.\n"
    yield from (f"* `{name}` was not compared: {why}" for name, why in found.not_compared.items())


def _differences(found: CalibrationComparison) -> Iterator[str]:
    about = {probe.id: probe for probe in PROBES}
    for name, group in groupby(found.differences, key=lambda difference: difference.probe):
        rows = list(group)
        yield f"\n## `{name}`: {len(rows)}\n"
        if name in about:
            yield f"{about[name].measures} Settles: {about[name].settles}\n"
        yield from (_exact if rows[0].test is None else _random)(rows)
        if len(rows) > MOST_ROWS:
            yield f"\n… and {len(rows) - MOST_ROWS} more."


def _exact(rows: list[NumberDifference]) -> Iterator[str]:
    yield f"| | A | B | B - A ({rows[0].unit}) |\n|---|---:|---:|---:|"
    for row in rows[:MOST_ROWS]:
        difference = row.b.mean - row.a.mean
        yield f"| {row.name} | {number(row.a.mean)} | {number(row.b.mean)} | {number(difference, signed=True)} |"


def _random(rows: list[NumberDifference]) -> Iterator[str]:
    yield f"| | A | B | B - A ({rows[0].unit}), 95 % | p, corrected |\n|---|---:|---:|---:|---:|"
    for row in rows[:MOST_ROWS]:
        assert row.test is not None
        sides = (f"{number(side.mean)} (n = {side.n}, sd {number(side.sd)})" for side in (row.a, row.b))
        yield f"| {row.name} | {' | '.join(sides)} | {difference_with(row.test.effect)} | {p_value(row.p)} |"


def _missing(found: CalibrationComparison) -> Iterator[str]:
    if found.missing:
        yield "\n## Measured in one game only\n"
    for probe, group in groupby(found.missing, key=lambda number: number.probe):
        rows = list(group)
        for which, of_a in (("A", True), ("B", False)):
            if names := [row.name for row in rows if row.only_in_a is of_a]:
                more = f" and {len(names) - MOST_ROWS} more" if len(names) > MOST_ROWS else ""
                yield f"* `{probe}`, only {which}: {', '.join(names[:MOST_ROWS])}{more}"


def _estimates(found: CalibrationComparison) -> Iterable[str]:
    """Name what of the simulator is a guess that these differences could settle."""
    probes = {difference.probe for difference in found.differences}
    concerned = [estimate for estimate in estimates() if estimate.probe in probes]
    if not concerned:
        return []
    rows = [f"| `{estimate.probe}` | {estimate.where} | {estimate.what} |" for estimate in concerned]
    return [
        "\n## Estimates of the simulator that these probes settle\n",
        "| probe | where | what |\n|---|---|---|",
        *rows,
    ]
