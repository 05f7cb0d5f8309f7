"""How long decisions took, and how old they were when they took effect."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Time of the decisions that arrived."""

    latency_p50_s: float | None
    """Median of the seconds from observation to reply on the host's clock; null if none arrived."""
    latency_p95_s: float | None
    """95th percentile of the same."""
    age_p50_loops: float | None
    """Median of the game loops from observation to effect; null if none arrived."""
    age_p95_loops: float | None
    """95th percentile of the same."""
