"""What a map's script remembers during a game: the points that it drew, who is inside what, whom it counted.

Part of the world's state. Above: ``world``, which holds one, and ``systems.triggers``, which alone changes it.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class ScriptMemory:
    """The memory of one game's script; units are told by their tags."""

    points: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Where the named points are that were drawn by chance."""
    inside: dict[int, frozenset[int]] = field(default_factory=dict)
    """By trigger, the units that were in its region when it was last looked at."""
    groups: dict[str, list[int]] = field(default_factory=dict)
    """Units that were made as a named group, each time anew."""
    made: set[int] = field(default_factory=set)
    """Units whose making has been noticed, or that were there from the start."""
    selections: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    """Player and units that the script selected, in order; interfaces read it from where they left off."""

    def content(self) -> tuple[object, ...]:
        """Everything in a fixed order, for the digest of the world."""
        inside = [(trigger, sorted(tags)) for trigger, tags in sorted(self.inside.items())]
        return sorted(self.points.items()), inside, sorted(self.groups.items()), sorted(self.made), self.selections
