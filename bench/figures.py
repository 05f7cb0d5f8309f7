"""What a measurement says: figures with a name and a unit. The processes of a measurement import it, so it is small."""

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
