"""What kept agents from deciding by themselves: people who wrote to them, models and connections that failed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_sc2.experiment.measures.evidence import SideStep


@dataclass(frozen=True, kw_only=True)
class Faults:
    """People and faults. Several rows are comparable only where these are alike."""

    advice: int
    """Messages from outside the match, by people or programs."""
    undecided: int
    """Decisions that agents did not make themselves."""
    undecided_because: str
    """Their causes and how many of each, `empty: 3; http 500: 2; timeout: 1`; empty without any."""
    fallbacks: int
    """Of these, decisions that another policy made in the agent's place."""
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
        self._causes: Counter[str] = Counter()
        self._lag_s = 0.0

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        self._counts["advice"] += len(step.report.advisers)
        self._counts["incidents"] += len(step.report.incidents)
        self._lag_s = step.report.timings.lag_s
        for agent in step.report.agents:
            self._counts[agent.status] += 1
            self._counts["ignored"] += agent.ignored
            if agent.status != "ok":
                self._causes[agent.detail or agent.status] += 1

    def total(self) -> Faults:
        """Return the group."""
        return Faults(
            advice=self._counts["advice"],
            undecided=self._causes.total(),
            undecided_because="; ".join(f"{cause}: {number}" for cause, number in sorted(self._causes.items())),
            fallbacks=self._counts["fallback"],
            late=self._counts["late"],
            gone=self._counts["gone"],
            malformed=self._counts["malformed"],
            ignored=self._counts["ignored"],
            incidents=self._counts["incidents"],
            lag_s=self._lag_s,
        )
