"""What each decision of a side was worth, from the reports of a recording.

    value(s)         = value destroyed - value lost in step s, in minerals + vespene
    reward(d)        = sum of value(s) for every step s from decision d up to the next decision of the side
    reward_to_go(d)  = reward(d) + gamma · reward_to_go(next decision of the side)

A decision of the side is a step in which one of its agents was shown an observation whose reply counted; agents that
decide in the same step share its reward. So the rewards of an episode sum up to the values of its result, from its
first decision on. Reports of old recordings have no values: then the episode's stands at its last decision.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_protocol.messages import Report

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_protocol.messages import AgentStatus, Result
    from khala_protocol.recording import Recording

COUNTED: frozenset[AgentStatus] = frozenset({"ok", "fallback"})
"""Statuses of a reply that the host acted on."""


class Reward(NamedTuple):
    """What one decision was worth; None where the recording does not say."""

    reward: float | None
    to_go: float | None


UNKNOWN = Reward(None, None)


@dataclass(slots=True)
class _Episode:
    """The steps of one side's episode."""

    values: dict[int, float | None] = field(default_factory=dict)
    decided: set[int] = field(default_factory=set)

    def add(self, report: Report) -> None:
        self.values[report.step] = value_of(report)
        for agent in report.agents:
            if agent.status in COUNTED:
                self.decided.add(report.step if agent.asked_step is None else agent.asked_step)

    def rewards(self, result: Result | None, gamma: float) -> dict[int, Reward]:
        steps = sorted(self.decided)
        values = self._by_decision(steps, result)
        if values is None:
            return dict.fromkeys(steps, UNKNOWN)
        to_go = 0.0
        found = {}
        for step, value in zip(reversed(steps), reversed(values), strict=True):
            to_go = value + gamma * to_go
            found[step] = Reward(value, to_go)
        return found

    def _by_decision(self, steps: Sequence[int], result: Result | None) -> list[float] | None:
        known = {step: value for step, value in self.values.items() if value is not None}
        if len(known) == len(self.values):
            ends = [*steps[1:], max(known, default=0) + 1]
            return [
                sum(known.get(step, 0.0) for step in range(first, end)) for first, end in zip(steps, ends, strict=True)
            ]
        if result is None:
            return None
        return [*[0.0] * (len(steps) - 1), result.killed.value - result.lost.value]


def value_of(report: Report) -> float | None:
    """Return value destroyed - value lost in a step, in minerals + vespene; None if the report does not say."""
    if report.killed_value is None or report.lost_value is None:
        return None
    return report.killed_value - report.lost_value


def rewards(recording: Recording, gamma: float) -> Mapping[tuple[str, int], Mapping[int, Reward]]:
    """Return the rewards by side and episode, and there by the step of the decision.

    Args:
        recording: of a match.
        gamma: discount from one decision of the side to its next, 0 to 1.
    """
    episodes: dict[tuple[str, int], _Episode] = defaultdict(_Episode)
    for report in recording.of(Report):
        episodes[report.side, report.episode].add(report)
    results = {(result.side, result.episode): result for result in recording.results}
    return {place: episode.rewards(results.get(place), gamma) for place, episode in episodes.items()}
