"""Calls that contradict what the agent knew or could know, by kind of contradiction."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Hallucinations:
    """Hallucinations. The kinds and `not_hallucinated` add up to `rejected`."""

    calls: int
    """Calls said: `accepted`, `rejected`, and messages that had a recipient."""
    input_conflicting: int
    """Rejected calls that break the rules of the prompt."""
    context_conflicting: int
    """Rejected calls that contradict the observation that they answer, or earlier ones."""
    fact_conflicting: int
    """Rejected calls that contradict how the game works or what is possible in it."""
    not_hallucinated: int
    """Rejected calls that are none of these: limits, deadlines, errors of the game, the default reply, and
    `outdated`."""
    outdated: int
    """Rejected calls that the answered observation still allowed, and that time made wrong: none with the clock
    `frozen`."""
    hallucinated_share: float | None
    """Hallucinations of all kinds / `calls`, 0 to 1; null without calls."""
