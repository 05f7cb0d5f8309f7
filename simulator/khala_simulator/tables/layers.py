"""Layers: where units of a type move."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType


class Layer(IntEnum):
    """Where a unit moves: on the ground, on the ground and its cliffs, or in the air."""

    WALK = 0
    GLIDE = 1
    AIR = 2


def layer_of(unit: UnitType) -> Layer:
    """Return the layer on which units of this type move."""
    if unit.flying:
        return Layer.AIR
    return Layer.GLIDE if unit.mover in ("colossus", "cliffjumper") else Layer.WALK
