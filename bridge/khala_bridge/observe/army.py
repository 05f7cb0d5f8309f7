"""The armies of both sides by place: own units with what they do, enemies as they were last seen.

Functions of a scene, of the episode's places and of its chronicle; for agents that lead.
"""

from __future__ import annotations

import functools
import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.knowledge import is_structure, is_worker, race_of
from khala_bridge.observe.body import to_tenth
from khala_bridge.observe.chronicle import PASSING
from khala_bridge.state.ground import land_of
from khala_protocol.messages import LOOPS_PER_S, Army, ArmyPart, Toll

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_bridge.observe.chronicle import Chronicle, Entry, Sighting
    from khala_bridge.observe.places import Places
    from khala_bridge.observe.scene import SideScene
    from khala_bridge.state import Unit
    from khala_protocol.messages import OrderView

TOGETHER = 10.0
"""World units within which units between places are one part of the army; about half a screen."""
FAR = 20.0
"""World units from all own town halls at which a worker's goal is a scout's."""
FORGOTTEN_S = 180.0
"""Seconds after which an enemy unit may be anywhere; its structures stay where they are."""
LIVES_OF_ITS_OWN = frozenset({"Overlord", "OverlordTransport", "Larva", "Egg", "MULE"})
"""Types that are neither army nor scouts by themselves."""


class _Seen(NamedTuple):
    """A unit somewhere, whoever owns it."""

    unit: Unit
    x: float
    y: float
    unseen_s: float = 0.0


def army(scene: SideScene, places: Places, chronicle: Chronicle) -> Army:
    """Return the parts of the own army, its scouts, and the enemy's armed units."""
    own = [unit for unit in scene.snapshot.own if _fights(unit) and unit.build_progress >= 1]
    goals = {unit.tag: goal for unit in scene.snapshot.own if (goal := _scouting(scene, unit)) is not None}
    scouts = [unit for unit in scene.snapshot.own if unit.tag in goals]
    return Army(
        parts=tuple(_parts(scene, places, [_as_seen(unit) for unit in own])),
        scouts=tuple(_parts(scene, places, [_as_seen(unit) for unit in scouts])),
        enemies=tuple(_enemies(scene, places, chronicle)),
        value=round(sum(map(_value, own))),
    )


def toll(chronicle: Chronicle, log: Sequence[Entry], since_loop: int) -> Toll:
    """Return what both sides lost in a part of the log that begins at a game loop."""
    events = [event for entry in log for event in entry.events if event.what == "died"]
    return Toll(
        since_s=round((chronicle.loop - since_loop) / LOOPS_PER_S, 1),
        lost=_counts(event.type for event in events if event.alliance == "own"),
        killed=_counts(event.type for event in events if event.alliance == "enemy"),
    )


@functools.cache
def is_of_army(name: str) -> bool:
    """Return True if units of a type are an army: they move, and do not gather; also casters and transports."""
    if race_of(name) is None or is_structure(name) or is_worker(name):
        return False
    return name not in PASSING | LIVES_OF_ITS_OWN


def _fights(unit: Unit) -> bool:
    return is_of_army(unit.name) and not unit.is_hallucination


def _value(unit: Unit) -> float:
    return unit.facts.value if unit.facts else 0.0


def _is_armed(unit: Unit) -> bool:
    """Return True if a unit has a weapon, or its type is unknown."""
    return unit.facts is None or bool(unit.facts.weapons)


def _as_seen(unit: Unit) -> _Seen:
    return _Seen(unit, unit.pos.x, unit.pos.y)


def _counts(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items()))


# --- parts ----------------------------------------------------------------------------------------------------


def _parts(scene: SideScene, places: Places, units: Sequence[_Seen]) -> list[ArmyPart]:
    """Return units by place, those between places by nearness; the most valuable part first."""
    parts = [_part(scene, name, group) for name, group in _group(places, units)]
    return sorted(parts, key=lambda part: (-part.value, part.minimap))


def _group(places: Places, units: Sequence[_Seen]) -> list[tuple[str, list[_Seen]]]:
    named: dict[str, list[_Seen]] = {}
    loose: list[tuple[str, list[_Seen]]] = []
    for unit in units:
        if name := places.name_of((unit.x, unit.y)):
            named.setdefault(name, []).append(unit)
        elif near := next((g for _, g in loose if math.dist((g[0].x, g[0].y), (unit.x, unit.y)) <= TOGETHER), None):
            near.append(unit)
        else:
            loose.append(("", [unit]))
    return [*named.items(), *loose]


def _part(scene: SideScene, name: str, group: Sequence[_Seen]) -> ArmyPart:
    x, y = (sum(values) / len(group) for values in ([seen.x for seen in group], [seen.y for seen in group]))
    return ArmyPart(
        place=name,
        minimap=to_tenth(scene.world.minimap(x, y), scene.world.minimap_size),
        units=_counts(seen.unit.name for seen in group),
        doing=_doing(scene, [seen.unit for seen in group]),
        value=round(sum(_value(seen.unit) for seen in group)),
        unseen_s=round(min(seen.unseen_s for seen in group), 1),
    )


def _doing(scene: SideScene, units: Sequence[Unit]) -> str:
    """Return what most of some own units do, and how many do something else: `idle; 3 of them Attack to [4, 7]`."""
    said = Counter(_order(scene, unit) for unit in units if unit.is_own).most_common(2)
    return "; ".join(order if not place else f"{count} of them {order}" for place, (order, count) in enumerate(said))


def _order(scene: SideScene, unit: Unit) -> str:
    orders: Sequence[OrderView] = scene.bodies[unit.tag].view.orders if unit.tag in scene.bodies else ()
    if not orders:
        return "idle"
    first = orders[0]
    if first.minimap is not None:
        x, y = (round(value) for value in first.minimap)
        return f"{first.name} to [{x}, {y}]"
    return first.name


# --- scouts ---------------------------------------------------------------------------------------------------


def _scouting(scene: SideScene, unit: Unit) -> tuple[float, float] | None:
    """Return where an own unit goes that scouts: a worker that walks far from home, or an unarmed unit."""
    if is_structure(unit.name) or not unit.orders or (_fights(unit) and _is_armed(unit)):
        return None
    first = scene.bodies[unit.tag].view.orders[0]
    goal = unit.orders[0].target_world_space_pos
    if goal is None or not first.name.startswith(("Move", "Attack", "Patrol", "Scan_Move")):
        return None
    halls = [hall.pos for hall in land_of(scene.snapshot).own_halls]
    far = all(math.dist(goal, hall) > FAR for hall in halls)
    return goal if far and (is_worker(unit.name) or not _is_armed(unit)) else None


# --- enemies --------------------------------------------------------------------------------------------------


def _enemies(scene: SideScene, places: Places, chronicle: Chronicle) -> list[ArmyPart]:
    found = [
        _Seen(known.unit, known.unit.pos.x, known.unit.pos.y, unseen_s)
        for known in chronicle.sightings
        if _is_threat(known) and (unseen_s := (chronicle.loop - known.loop) / LOOPS_PER_S) <= FORGOTTEN_S
    ]
    halls = [hall.pos for hall in land_of(scene.snapshot).own_halls]
    parts = []
    for name, group in _group(places, found):
        away = min((math.dist((seen.x, seen.y), hall) for seen in group for hall in halls), default=None)
        in_sight = sum(not seen.unseen_s for seen in group)
        parts.append(_part(scene, name, group).but(away=None if away is None else round(away), in_sight=in_sight))
    return sorted(parts, key=lambda part: (part.away or 0.0, part.minimap))


def _is_threat(known: Sighting) -> bool:
    name = known.unit.name
    return _is_armed(known.unit) and not is_worker(name) and not is_structure(name)
