"""What kept agents from deciding by themselves: people who wrote to them, models and connections that failed."""

from __future__ import annotations

from dataclasses import dataclass


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
