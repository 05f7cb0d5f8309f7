"""Where two calibrations differ: to the last digit where the game repeats itself, beyond chance where it does not.

Of a random measurement, the means are compared by a permutation test, and p is corrected for all of them (Holm). Above:
`report`, which words it. Below: `khala_sc2.experiment.statistics`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from khala_sc2.experiment.statistics import RESAMPLES, Comparison, compare_values, holm, p_of_values

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.calibrate.record import Calibration, Measured, Values

LEVEL: Final = 0.05
"""How often two runs of the same game differ in anything random, by chance."""
FEWEST: Final = 6
"""Samples of each side for a comparison of means."""
MOST_COMPARISONS: Final = int(LEVEL * (RESAMPLES + 1) / 2)
"""With more of them, the least p that a permutation test can find would not be below the level."""


@dataclass(frozen=True, slots=True)
class NumberDifference:
    """One measurement in which two games differ."""

    probe: str
    name: str
    unit: str
    a: Values
    b: Values
    test: Comparison | None = None
    """Of a random one: the effect is the mean of `b` minus that of `a`."""
    p: float = 0.0
    """Corrected for many comparisons; 0 for an exact one."""


@dataclass(frozen=True, slots=True)
class Missing:
    """A measurement that only one of the games gave."""

    probe: str
    name: str
    only_in_a: bool


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """What a comparison found."""

    exact: int
    """Measurements compared digit by digit."""
    random: int
    """Measurements of which the means were compared."""
    unused: int
    """Random ones with too few samples on a side."""
    differences: tuple[NumberDifference, ...]
    missing: tuple[Missing, ...]
    not_compared: dict[str, str]
    """Probes that failed, or that a file does not have, with the reason."""


def compare(a: Calibration, b: Calibration) -> CalibrationComparison:
    """Compare two calibrations; differences are in the order of the probes of `a`."""
    found: list[NumberDifference] = []
    random: list[NumberDifference] = []
    missing: list[Missing] = []
    exact = unused = 0
    both = {name: (probe, b.probes[name]) for name, probe in a.probes.items() if name in b.probes}
    fit = {name: pair for name, pair in both.items() if not (pair[0].failed or pair[1].failed)}
    for probe, (first, other) in fit.items():
        missing += _missing(probe, first, other)
        for name in first.values.keys() & other.values.keys():
            difference = NumberDifference(probe, name, first.unit, first.values[name], other.values[name])
            if first.exact:
                exact += 1
                if abs(difference.a.mean - difference.b.mean) > max(first.resolution, 1e-6):
                    found.append(difference)
            elif min(difference.a.n, difference.b.n) < FEWEST:
                unused += 1
            else:
                random.append(difference)
    found += _beyond_chance(random)
    order = {name: rank for rank, name in enumerate(a.probes)}
    return CalibrationComparison(
        exact=exact,
        random=len(random),
        unused=unused,
        differences=tuple(sorted(found, key=lambda difference: (order[difference.probe], difference.name))),
        missing=tuple(missing),
        not_compared=dict(_not_compared(a, b)),
    )


def _beyond_chance(random: list[NumberDifference]) -> Iterator[NumberDifference]:
    p_values = holm([p_of_values(difference.b.samples, difference.a.samples) for difference in random])
    for difference, p in zip(random, p_values, strict=True):
        if p is not None and p <= LEVEL:
            test = compare_values(difference.b.samples, difference.a.samples)
            yield replace(difference, test=test, p=p)


def _missing(probe: str, first: Measured, other: Measured) -> Iterator[Missing]:
    for name in sorted(first.values.keys() ^ other.values.keys()):
        yield Missing(probe, name, name in first.values)


def _not_compared(a: Calibration, b: Calibration) -> Iterator[tuple[str, str]]:
    for name in dict.fromkeys((*a.probes, *b.probes)):
        for which, probes in (("A", a.probes), ("B", b.probes)):
            if name not in probes:
                yield name, f"not in {which}"
            elif probes[name].failed:
                yield name, f"failed in {which}: {probes[name].failed}"
