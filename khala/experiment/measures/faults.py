"""What kept agents from deciding by themselves: people who wrote to them, models and connections that failed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala.experiment.measures.evidence import Step


@dataclass(frozen=True, kw_only=True)
class Faults:
    """People and faults. Several rows are comparable only where these are alike."""

    advice: int
    """Messages from outside the match, by people or programs."""
    fallbacks: int
    """Decisions that the policy failed to make, so that the task's default reply stood in."""
    fallback_reasons: str
    """Their reasons and how many of each, `http 500: 2; timeout: 1`; empty without any."""
    late: int
    """Decisions that did not arrive before the deadline."""
    gone: int
    """Decisions whose agent went away while it was asked."""
    malformed: int
    """Decisions that were not a valid reply."""
    ignored: int
    """Replies that were not executed because they were duplicates, late or foreign."""
    incidents: int
    """Failures that were overcome or not, such as an agent that was away, or a match that was resumed."""
    lag_s: float
    """With the clock `realtime`, seconds that the game was behind the wall clock at the end."""


class FaultTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._reasons: Counter[str] = Counter()
        self._lag_s = 0.0

    def add(self, step: Step) -> None:
        """Take in a step."""
        self._counts["advice"] += len(step.report.advisers)
        self._counts["incidents"] += len(step.report.incidents)
        self._lag_s = step.report.timings.lag_s
        for agent in step.report.agents:
            self._counts[agent.status] += 1
            self._counts["ignored"] += agent.ignored
            if agent.status == "fallback":
                self._reasons[agent.detail or "unknown"] += 1

    def total(self) -> Faults:
        """Return the group."""
        return Faults(
            advice=self._counts["advice"],
            fallbacks=self._counts["fallback"],
            fallback_reasons="; ".join(f"{reason}: {number}" for reason, number in sorted(self._reasons.items())),
            late=self._counts["late"],
            gone=self._counts["gone"],
            malformed=self._counts["malformed"],
            ignored=self._counts["ignored"],
            incidents=self._counts["incidents"],
            lag_s=self._lag_s,
        )
