"""What is known of unit types: a typed reading of `bridge/data/knowledge/*.yaml`.

Facts of the game version that is named there, without upgrades. Health and shields of a unit in an observation come
from the game itself; here is what the game does not say of an enemy.
"""

from __future__ import annotations

import functools
from typing import Literal

from pydantic import Field

from bridge import data
from protocol.messages import Frozen

RACES = ("protoss", "terran", "zerg")


class Weapon(Frozen):
    """One weapon of a unit type."""

    targets: Literal["ground", "air", "any"]
    range: float
    """World units between the edges of the two units."""
    damage: float
    """Of one hit, before armor."""
    attacks: int = 1
    """Hits per shot."""
    period_s: float
    """Seconds between two shots."""
    bonus: dict[str, float] = Field(default_factory=dict)
    """Damage that is added against an attribute."""

    @property
    def per_second(self) -> float:
        """Damage per second against a target without armor and without the attribute of a bonus."""
        return self.damage * self.attacks / self.period_s


class UnitType(Frozen):
    """What is known of one type."""

    id: int
    about: str
    abilities: dict[str, str] = Field(default_factory=dict)
    attributes: tuple[str, ...] = ()
    flying: bool = False
    health: float
    shield: float = 0
    energy: float = 0
    armor: float = 0
    speed: float = 0
    """World units per second."""
    sight: float = 0
    supply: float = 0
    minerals: float = 0
    vespene: float = 0
    weapons: tuple[Weapon, ...] = ()

    @property
    def value(self) -> float:
        """Minerals and vespene that it costs."""
        return self.minerals + self.vespene


@functools.cache
def knowledge() -> dict[str, UnitType]:
    """Every known type by the name that PySC2 gives it."""
    return {name: kind for race in RACES for name, kind in data.table(f"knowledge/{race}.yaml", UnitType).items()}


def is_armed(unit_type: str) -> bool:
    """Whether a type has a weapon; a type that is not known is taken to have one."""
    known = knowledge().get(unit_type)
    return known is None or bool(known.weapons)
