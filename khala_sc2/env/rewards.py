"""What a step of a match in words is worth to a side.

A reward is a function of the reports of the steps since the agents were asked before, and of the result if the episode
is over; `khala_sc2.env.parallel_env` takes one of yours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from khala_sc2.dataset.rewards import value_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_protocol.messages import Report, Result

SideReward: TypeAlias = "Callable[[Sequence[Report], Result | None], float]"

WIN: Final = 1.0
VALUE: Final = 1000.0
"""Minerals and vespene that are worth as much as a win; all of an army of SMAC's 2s3z has 850."""


def battle(reports: Sequence[Report], result: Result | None) -> float:
    """Return what was destroyed - what was lost, in thousands of minerals and vespene; +1 for a win, -1 for a loss."""
    value = sum(value_of(report) or 0.0 for report in reports) / VALUE
    ends = {"win": WIN, "loss": -WIN}
    return value + (ends.get(result.outcome, 0.0) if result else 0.0)
