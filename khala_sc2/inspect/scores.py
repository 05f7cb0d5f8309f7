"""The scores of an episode: whether it was won, the value that was killed and lost, and how much of it was legal.

An episode that says nothing about its agents is not scored: a part of the match failed, or a limit of inspect_ai ended
it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from inspect_ai.scorer import (
    CORRECT,
    INCORRECT,
    SampleScore,
    Score,
    accuracy,
    metric,
    scorer,
    stderr,
)

from khala_protocol.messages import Result
from khala_sc2.inspect.team import RESULT

if TYPE_CHECKING:
    from collections.abc import Callable

    from inspect_ai.scorer import Metric, Scorer, Target
    from inspect_ai.solver import TaskState


@metric
def kd() -> Metric:
    """Return the value killed for each value lost, over all samples; infinite if nothing was lost."""

    def ratio(scores: list[SampleScore]) -> float:
        return _ratio(_sum(scores, "killed"), _sum(scores, "lost"))

    return ratio


@metric
def legal() -> Metric:
    """Return the share of calls that were carried out, over all samples."""

    def share(scores: list[SampleScore]) -> float:
        accepted = _sum(scores, "accepted")
        return _ratio(accepted, accepted + _sum(scores, "refused"))

    return share


@scorer(metrics=[accuracy(), stderr()])
def win() -> Scorer:
    """Score whether the episode was won."""
    return _scorer(
        lambda result: Score(
            value=CORRECT if result.outcome == "win" else INCORRECT, answer=result.outcome, explanation=result.cause
        )
    )


@scorer(metrics=[kd()])
def value() -> Scorer:
    """Score the minerals and vespene that the enemy and the side lost."""
    return _scorer(lambda result: Score(value={"killed": result.killed.value, "lost": result.lost.value}))


@scorer(metrics=[legal()])
def legality() -> Scorer:
    """Score how many calls of the agents were carried out, and how many refused, with the reasons."""
    return _scorer(
        lambda result: Score(
            value={"accepted": result.accepted, "refused": sum(result.rejections.values())},
            explanation=", ".join(f"{reason}: {count}" for reason, count in result.rejections.items()),
        )
    )


def _scorer(of: Callable[[Result], Score]) -> Scorer:
    async def score(state: TaskState, target: Target) -> Score:  # noqa: ARG001  # the result says it all
        if state.store.get(RESULT) is None:
            return Score.unscored(reason="a limit ended the episode before its result")
        result = Result.model_validate(state.store.get(RESULT))
        return of(result) if result.valid else Score.unscored(reason=result.invalid_because)

    return score


def _sum(scores: list[SampleScore], key: str) -> float:
    return sum(float(score.score.as_dict()[key] or 0) for score in scores)


def _ratio(over: float, under: float) -> float:
    if under:
        return over / under
    return math.inf if over else math.nan
