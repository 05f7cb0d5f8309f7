"""How fast a model was: the `pace` of a model file, from the requests of a recording.

The seconds of a request are taken as `Pace` counts them: a constant, and so many for each token read and written. The
three numbers are those with the least squares that are not negative. Above it: `khala replay --pace`.
"""

from __future__ import annotations

import itertools
import statistics
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_protocol.messages import ModelCall, Pace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

UNMEASURED_PER_S = 1e9
"""Tokens in a second where a token cost no time that can be seen."""


class MeasuredPace(NamedTuple):
    """The pace of one model at one endpoint."""

    model: str
    endpoint: str
    calls: int
    pace: Pace
    error_s: float
    """Half of the calls are nearer than this to what the pace says."""


def measured_paces(calls: Iterable[ModelCall]) -> Iterator[MeasuredPace]:
    """Yield the pace of each model that answered, in the order of its first answer."""
    by_model: dict[tuple[str, str], list[ModelCall]] = defaultdict(list)
    for call in calls:
        if call.status == "ok" and call.usage.prompt_tokens:
            by_model[call.model, call.endpoint].append(call)
    for (model, endpoint), answered in by_model.items():
        pace = fit(answered)
        errors_s = [
            abs(pace.seconds(call.usage.model_copy(update={"requests": 1})) - call.latency_s) for call in answered
        ]
        yield MeasuredPace(model, endpoint, len(answered), pace, statistics.median(errors_s))


def fit(calls: Iterable[ModelCall]) -> Pace:
    """Return the pace that fits these calls best."""
    rows = [(1.0, call.usage.prompt_tokens, call.usage.completion_tokens, call.latency_s) for call in calls]
    table = np.array(rows, dtype=np.float64)
    constant_s, read_s, write_s = least_squares(table[:, :3], table[:, 3])
    return Pace(latency_s=_round(constant_s), read_tokens_per_s=_per_s(read_s), write_tokens_per_s=_per_s(write_s))


def least_squares(columns: Floats, wanted: Floats) -> Floats:
    """Return the numbers, none negative, with which the columns come nearest to what is wanted.

    The best one has some columns at 0, and is the unbounded best one of the others: with three columns all eight
    choices are tried.
    """
    number = columns.shape[1]
    choices = (c for size in range(number + 1) for c in itertools.combinations(range(number), size))
    tried = (_least_squares(columns, wanted, list(chosen)) for chosen in choices)
    possible = (solution for solution in tried if solution.min() >= 0)
    return min(possible, key=lambda solution: float(((columns @ solution - wanted) ** 2).sum()))


def _least_squares(columns: Floats, wanted: Floats, chosen: list[int]) -> Floats:
    found = np.zeros(columns.shape[1])
    if chosen:
        found[chosen] = np.linalg.lstsq(columns[:, chosen], wanted, rcond=None)[0]
    return found


def _per_s(seconds: float) -> float:
    return _round(min(1 / seconds, UNMEASURED_PER_S)) if seconds else UNMEASURED_PER_S


def _round(number: float) -> float:
    """Return a number with the three digits that a measurement is good for."""
    return float(f"{number:.3g}")


def yaml(found: MeasuredPace) -> str:
    """Return the lines for the model file."""
    return (
        f"# {found.model} at {found.endpoint}: {found.calls} calls, half of them within {found.error_s:.3f} s of this\n"
        "pace:\n" + "".join(f"  {name}: {value:.10g}\n" for name, value in found.pace.model_dump().items())
    )
