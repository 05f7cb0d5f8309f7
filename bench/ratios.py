"""How sure a ratio of two times or two rates is.

Times and rates scatter by factors, so that their logarithms are nearly normal; intervals are of these, by Student's
distribution, which holds with three runs, too, where a bootstrap has next to nothing to draw from.
"""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING

from scipy import stats  # type: ignore[import-untyped]

from khala_sc2.experiment.statistics import CONFIDENCE, Interval

if TYPE_CHECKING:
    from collections.abc import Sequence


def mean_ratio(ratios: Sequence[float]) -> Interval:
    """Return the geometric mean of ratios with Student's interval of their logarithms.

    Raises:
        ValueError: one is not positive.
    """
    n = len(ratios)
    if not n:
        return Interval(None, 0.0, math.inf, 0)
    logs = [math.log(ratio) for ratio in ratios]
    middle = statistics.fmean(logs)
    if n == 1:
        return Interval(math.exp(middle), 0.0, math.inf, 1)
    width = float(stats.t.ppf((1 + CONFIDENCE) / 2, n - 1)) * statistics.stdev(logs) / math.sqrt(n)
    return Interval(math.exp(middle), math.exp(middle - width), math.exp(middle + width), n)


def ratio_of_means(over: Sequence[float], under: Sequence[float]) -> Interval:
    """Return the ratio of two geometric means, which are not paired, with Welch's interval of the logarithms.

    With one value on a side nothing is known of how it scatters, and the interval is 0 to infinity. Values that are not
    positive have no ratio.
    """
    n = min(len(over), len(under))
    if not n or min(*over, *under) <= 0:
        return Interval(None, 0.0, math.inf, n)
    a, b = ([math.log(value) for value in values] for values in (over, under))
    ratio = math.exp(statistics.fmean(a) - statistics.fmean(b))
    if n == 1:
        return Interval(ratio, 0.0, math.inf, n)
    if len(set(a)) == len(set(b)) == 1:  # counts, such as those of modules: nothing scatters
        return Interval(ratio, ratio, ratio, n)
    found = stats.ttest_ind(a, b, equal_var=False).confidence_interval(CONFIDENCE)
    return Interval(ratio, math.exp(found.low), math.exp(found.high), n)
