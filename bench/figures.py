"""What a measurement says: figures that are kept, compared and limited.

A module of `bench` takes part with two things: `--json`, and a function `measures` that makes figures of the object
that `--json` prints. Above it: `bench.results` keeps figures, `bench.limits` judges them. It imports next to nothing:
the processes of a measurement import it, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Better: TypeAlias = Literal["more", "less"]


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure of one run of a measurement."""

    name: str
    """Of all figures of its measurement it alone has this name, in every commit."""
    unit: str
    values: tuple[float, ...]
    """As often as it was measured in the run; empty if it could not be."""
    better: Better = "less"
    limit: float | None = None
    """Of a ratio whose two sides were measured in the same run: the worst value that is good enough."""
    skipped: str = ""
    """Why it could not be measured, and what to do so that it can."""
