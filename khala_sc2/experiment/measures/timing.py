"""How long decisions took, and how old they were when they took effect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from khala_protocol.messages import Result


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Time of the decisions that arrived, as the result has it; all None if none arrived, or without a result."""

    latency_p50_s: float | None
    """Median of the seconds from observation to reply, on the host's clock."""
    latency_p95_s: float | None
    """95th percentile of the same."""
    age_p50_loops: float | None
    """Median of the game loops from observation to effect."""
    age_p95_loops: float | None
    """95th percentile of the same."""

    @classmethod
    def of(cls, result: Result | None) -> Self:
        """Return the group."""
        return cls(
            latency_p50_s=result.latency_p50_s if result else None,
            latency_p95_s=result.latency_p95_s if result else None,
            age_p50_loops=result.age_p50_loops if result else None,
            age_p95_loops=result.age_p95_loops if result else None,
        )
