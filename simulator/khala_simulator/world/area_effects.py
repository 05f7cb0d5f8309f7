"""Area effects: effects on the ground for a time, such as a storm, a scan or a bile on its way.

One is a value in ``world.area_effects`` until it ends; ``systems.area_effects`` calls its rule at every period. The
value holds what the API shows of it (``effect``, the places, the radius); the rule holds what it does.
"""

from __future__ import annotations

from dataclasses import dataclass, field

Point = tuple[float, float]


@dataclass(slots=True)
class AreaEffect:
    """One effect on the ground.

    Args:
        rule: Name of the rule that runs it, in ``skills.registry.AREA_EFFECTS``.
        effect: The API's effect id, 0 when clients do not see it.
        owner: The owner of the unit that made it.
        points: Where it is, world units; the first is its middle.
        radius: World units.
        begun: Loop at which it came.
        end: Loop at which it ends.
        due: Loop at which its rule runs next.
        period: Loops between two runs.
        ability: The ability that made it, for its numbers.
        source: Tag of the unit that made it, 0 for none.
        target: Tag of the unit that it follows or meets, 0 for none.
        count: Runs so far; the rule's own counter.
        sights: Radius in which its owner sees, 0 for none.
        detects: Whether its owner sees cloaked units there.
    """

    rule: str
    owner: int
    points: list[Point]
    radius: float
    begun: int
    end: float
    effect: int = 0
    due: float = 0.0
    period: float = 1.0
    ability: int = 0
    source: int = 0
    target: int = 0
    count: int = 0
    sights: float = 0.0
    detects: bool = False
    memory: dict[str, float] = field(default_factory=dict)

    @property
    def at(self) -> Point:
        """Its middle."""
        return self.points[0]
