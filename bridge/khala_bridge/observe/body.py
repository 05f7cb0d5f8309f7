"""A unit as every team of a side sees it: the part of its view that is the same for all teams.

Numbers of the game become names and rounded values here, once per unit and snapshot. `khala_bridge.observe.scene`,
above, finds a unit's position on each screen; below are frames and the unit of the state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from khala_bridge.state import Alliance
from khala_protocol.messages import LOOPS_PER_S, OrderView, UnitDetails, UnitView

if TYPE_CHECKING:
    from khala_bridge.frames import MapFrame
    from khala_bridge.state import Unit, UnitOrder
    from khala_protocol.messages import Point

_BLANK = UnitView(
    tag="", type="", alliance="neutral", screen=(0.0, 0.0), minimap=(0.0, 0.0), health=0.0, health_max=0.0
)  # copied with `but`, which takes a tenth of the time of a checked one


@dataclass(frozen=True, slots=True)
class Body:
    """A unit, and its view without an observer: `screen`, `distance` and `alliance` depend on the team."""

    tag: int
    x: float
    y: float
    name: str
    alliance: Alliance
    view: UnitView

    @property
    def is_own(self) -> bool:
        """True if it belongs to the player."""
        return self.alliance is Alliance.OWN


def body(unit: Unit, world: MapFrame) -> Body:
    """Return the body of a unit; only the player's own units have orders, passengers and weapons."""
    name, (x, y) = unit.name, unit.pos
    more = _own(unit, world) if unit.is_own else {}
    view = _BLANK.but(
        tag=hex(unit.tag),
        type=name,
        minimap=to_tenth(world.minimap(x, y), world.minimap_size),
        health=round(unit.health, 1),
        health_max=unit.health_max,
        shield=round(unit.shield, 1),
        shield_max=unit.shield_max,
        energy=round(unit.energy, 1),
        energy_max=unit.energy_max,
        build_progress=round(unit.build_progress, 2),
        flying=unit.is_flying,
        cloaked=unit.is_cloaked,
        hallucination=unit.is_hallucination,
        buffs=unit.buffs if unit.buff_ids else (),
        details=_details(unit),
        **more,
    )
    return Body(unit.tag, x, y, name, unit.alliance, view)


def _own(unit: Unit, world: MapFrame) -> dict[str, object]:
    """Return the fields that only the player's own units have."""
    orders = tuple([_order(order, world) for order in unit.orders])
    is_armed = unit.facts is None or bool(unit.facts.weapons)
    cooldown_s = round(unit.weapon_cooldown / LOOPS_PER_S, 2) if is_armed else None
    return {"orders": orders, "order": orders[0].name if orders else None, "weapon_cooldown_s": cooldown_s}


def _details(unit: Unit) -> UnitDetails | None:
    """Return the fields that only some units have."""
    found: dict[str, Any] = {}
    if unit.is_burrowed:
        found["burrowed"] = True
    if contents := unit.mineral_contents or unit.vespene_contents:
        found["contents"] = contents
    if unit.is_own:
        if unit.buff_duration_remain:
            found["left_s"] = round(unit.buff_duration_remain / LOOPS_PER_S, 1)
        if unit.cargo_space_max:
            found["cargo_max"] = unit.cargo_space_max
            found["passengers"] = tuple(sorted(unit.passengers))
        if unit.ideal_harvesters:
            found["harvesters"] = (unit.assigned_harvesters, unit.ideal_harvesters)
        if not unit.is_powered and unit.build_progress >= 1 and unit.facts and unit.facts.needs_power:
            found["unpowered"] = True
    return UnitDetails(**found) if found else None


_NO_ORDER = OrderView(name="")


def _order(order: UnitOrder, world: MapFrame) -> OrderView:
    found: dict[str, object] = {"name": order.name}
    if order.target_unit_tag:
        found["target"] = hex(order.target_unit_tag)
    elif (place := order.target_world_space_pos) is not None:
        found["minimap"] = to_tenth(world.minimap(place.x, place.y), world.minimap_size)
    if order.progress > 0:
        found["progress"] = round(order.progress, 2)
    return _NO_ORDER.but(**found)


def to_tenth(point: tuple[float, float], size: float) -> Point:
    """Return a value rounded to a tenth of a cell; a position stays within its frame, whose end is open."""
    return _tenth(point[0], size), _tenth(point[1], size)


def _tenth(value: float, size: float) -> float:
    near = round(value, 1) + 0.0  # no negative zero
    return round(size - 0.1, 1) if value < size <= near else near
