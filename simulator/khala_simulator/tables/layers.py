"""Layers: on what units of a type move."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType


class Layer(IntEnum):
    """On what a unit moves: the ground, the ground and its cliffs, or the air."""

    WALK = 0
    GLIDE = 1
    AIR = 2


def layer_of(unit: UnitType) -> Layer:
    """The layer on which units of this type move."""
    if unit.flying:
        return Layer.AIR
    return Layer.GLIDE if unit.mover in ("colossus", "cliffjumper") else Layer.WALK
