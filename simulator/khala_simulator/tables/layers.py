"""Layers: where units of a type move."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType


ONE_CELL: Final = 0.5
"""Larger bodies do not fit a gap of one cell."""


class Layer(IntEnum):
    """Where a unit moves: on the ground, on the ground and its cliffs, in the air, or on ground two cells wide."""

    WALK = 0
    GLIDE = 1
    AIR = 2
    WIDE = 3


def layer_of(unit: UnitType) -> Layer:
    """Return the layer on which units of this type move."""
    if unit.flying:
        return Layer.AIR
    if unit.mover in ("colossus", "cliffjumper"):
        return Layer.GLIDE
    return Layer.WIDE if inner_body(unit) > ONE_CELL else Layer.WALK


def inner_body(unit: UnitType) -> float:
    """Return the radius of the part of a body that has to fit between walls.

    The catalog's inner radius, which is larger than the whole body only for the Roach.
    """
    return unit.separation if unit.inner is None else min(unit.inner, unit.radius)
