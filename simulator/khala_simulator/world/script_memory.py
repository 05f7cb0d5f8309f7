"""What a map's script remembers during a game: the points that it drew, the units in regions, the counted units.

Part of the world's state. Above: ``world``, which holds one, and ``systems.triggers``, the only one that changes it.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class ScriptMemory:
    """The memory of one game's script; units are identified by their tags."""

    points: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Where the randomly drawn named points are."""
    inside: dict[int, frozenset[int]] = field(default_factory=dict)
    """By trigger, the units that were in its region when it was last looked at."""
    groups: dict[str, list[int]] = field(default_factory=dict)
    """Units of a named group, replaced each time the group is made."""
    made: set[int] = field(default_factory=set)
    """Units whose making has been noticed, or that were there from the start."""
    selections: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    """Player and units that the script selected, in order; interfaces read it from where they left off."""

    def content(self) -> tuple[object, ...]:
        """Return everything in a fixed order, for the digest of the world."""
        inside = [(trigger, sorted(tags)) for trigger, tags in sorted(self.inside.items())]
        return sorted(self.points.items()), inside, sorted(self.groups.items()), sorted(self.made), self.selections
