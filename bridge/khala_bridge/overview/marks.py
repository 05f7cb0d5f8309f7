"""A unit as a mark on the map: numbers in the minimap frame, rounded, and bits for what it is.

A mark takes 5 µs, since a whole game has hundreds of units in each step; its positions are exact to a thousandth of a
cell, which is 3 mm on a map of 200 world units.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.knowledge import is_structure, is_worker
from khala_bridge.observe.army import is_of_army
from khala_protocol.messages import UnitFlag, UnitMark

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.frames import MapFrame, WorldPoint
    from khala_bridge.state import Unit

_TURN = 2 * math.pi
_NOWHERE = (-1.0, -1.0)
_OF_TYPE = {is_structure: UnitFlag.STRUCTURE, is_worker: UnitFlag.WORKER, is_of_army: UnitFlag.ARMY}
# plain numbers: an operation on flags takes twenty times as long
ARMY = int(UnitFlag.ARMY)
WORKER = int(UnitFlag.WORKER)
_FLYING, _BURROWED, _CLOAKED = int(UnitFlag.FLYING), int(UnitFlag.BURROWED), int(UnitFlag.CLOAKED)
_HALLUCINATION, _UNPOWERED = int(UnitFlag.HALLUCINATION), int(UnitFlag.UNPOWERED)
_REMEMBERED, _FIRES = int(UnitFlag.REMEMBERED), int(UnitFlag.FIRES)


class Pen(NamedTuple):
    """Draws marks at the scale of a map."""

    scale: float
    """Cells of the minimap in a world unit."""
    north: float
    """Height of the map in world units, from which y counts down."""

    @classmethod
    def of(cls, frame: MapFrame) -> Pen:
        """Return the pen of a map."""
        return cls(frame.minimap_size / max(frame.width, frame.height, 1.0), frame.height)

    def place(self, pos: WorldPoint) -> tuple[float, float]:
        """Return a place of the world in the minimap frame."""
        return round(pos[0] * self.scale, 3), round((self.north - pos[1]) * self.scale, 3)

    def length(self, units: float) -> float:
        """Return a length in world units in the minimap frame."""
        return round(units * self.scale, 3)

    def mark(self, unit: Unit, known: Mapping[int, Unit], *, seen_by: int, fires: bool) -> UnitMark:
        """Return the mark of a unit.

        Args:
            unit: as somebody knows it.
            known: all units by tag, for what it is aimed at.
            seen_by: sides that see it, as bits.
            fires: whether it has fired since the scene before.
        """
        x, y = self.place(unit.pos)
        order = unit.orders[0] if unit.orders else None
        target = (order.target_unit_tag if order else 0) or unit.engaged_target_tag
        to = order.target_world_space_pos if order else None
        if to is None and order and order.target_unit_tag in known:
            to = known[order.target_unit_tag].pos
        to_x, to_y = self.place(to) if to is not None else _NOWHERE
        return UnitMark(
            unit.tag,
            unit.name,
            unit.owner,
            x,
            y,
            self.length(unit.radius),
            round(-unit.facing % _TURN, 2),
            round(unit.health, 1),
            unit.health_max,
            round(unit.shield, 1),
            unit.shield_max,
            round(unit.energy, 1),
            round(unit.build_progress, 2),
            flags(unit) | _FIRES * fires,
            seen_by,
            order.name if order else "",
            target,
            to_x,
            to_y,
        )


def flags(unit: Unit) -> int:
    """Return what a unit is, as `UnitFlag`, apart from whether it fires."""
    found = _of_type(unit.name)
    if unit.is_flying:
        found |= _FLYING
    if unit.is_burrowed:
        found |= _BURROWED
    if unit.is_cloaked:
        found |= _CLOAKED
    if unit.is_hallucination:
        found = found & ~ARMY | _HALLUCINATION
    if unit.is_remembered:
        found |= _REMEMBERED
    if unit.is_own and not unit.is_powered and unit.build_progress >= 1 and unit.facts and unit.facts.needs_power:
        found |= _UNPOWERED
    return found


@functools.cache
def _of_type(name: str) -> int:
    return sum(int(flag) for holds, flag in _OF_TYPE.items() if holds(name))
