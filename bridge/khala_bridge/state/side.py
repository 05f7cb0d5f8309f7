"""The units of the player's side, sorted by their purpose: workers, army, town halls, producers.

A reading of a snapshot that the rules share. It decides nothing.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_bridge.catalogue.functions import functions, general
from khala_bridge.frames import WorldPoint
from khala_bridge.names import buff_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.knowledge import UnitFacts
    from khala_bridge.state import Snapshot, Unit

NO_ARMY = frozenset({"Queen", "QueenBurrowed"})
"""Armed units that stay at home: they heal, spread creep and make larvae."""


UNBORN = frozenset({"Larva", "Cocoon", "BanelingCocoon", "BroodLordCocoon", "RavagerCocoon", "LurkerCocoon"})
"""Types that are to become a unit, and do nothing until then."""


def kind(unit: Unit) -> UnitFacts | None:
    """Return the facts about the type of a unit."""
    return unit.facts


def name(unit: Unit) -> str:
    """Return the name of the type of a unit."""
    return unit.name


def place(unit: Unit) -> WorldPoint:
    """Return the position of a unit."""
    return WorldPoint(unit.pos.x, unit.pos.y)


def is_structure(unit: Unit) -> bool:
    """Return True if a unit is a structure."""
    known = kind(unit)
    return known is not None and known.structure


def is_worker(unit: Unit) -> bool:
    """Return True if a unit gathers and builds."""
    known = kind(unit)
    return known is not None and known.worker and name(unit) != "MULE"


def finished(units: Iterable[Unit]) -> list[Unit]:
    """Return the finished ones of some units."""
    return [unit for unit in units if unit.build_progress >= 1]


def of_types(snapshot: Snapshot, types: Iterable[str]) -> list[Unit]:
    """Return the own units of some types, finished or not, by ascending tags."""
    wanted = frozenset(types)
    return [unit for unit in snapshot.own if name(unit) in wanted]


def workers(snapshot: Snapshot) -> list[Unit]:
    """Return the own workers, by ascending tags."""
    return [unit for unit in finished(snapshot.own) if is_worker(unit)]


def army(snapshot: Snapshot, *, home: bool = False) -> list[Unit]:
    """Return the own units that fight or help to fight and can move, by ascending tags.

    No workers, structures, larvae and Overlords; no rooted units (a sieged tank, a burrowed Lurker), and none that act
    and vanish by themselves (Interceptors, Broodlings). Queens only at `home`.
    """
    return [unit for unit in finished(snapshot.own) if _fights(kind(unit)) and (home or name(unit) not in NO_ARMY)]


def _fights(known: UnitFacts | None) -> bool:
    return known is not None and not (known.structure or known.worker) and known.speed > 0 and known.supply > 0


def enemies_in_reach(snapshot: Snapshot, of: Iterable[Unit]) -> list[Unit]:
    """Return the enemy units and structures in sight that any of some own units can shoot at, by ascending tags.

    A Zealot cannot hit an Overlord: flyers over an army on the ground are not targets. Neither are Larvae and eggs.
    """
    enemies = [u for u in snapshot.units.values() if u.is_enemy and name(u) not in UNBORN]
    ours = {unit.name: unit.facts for unit in of}
    known = [facts for facts in ours.values() if facts is not None]
    if len(known) < len(ours) or not any(facts.weapons for facts in known):
        return enemies
    return [unit for unit in enemies if unit.facts is None or any(facts.hits(unit.planes) for facts in known)]


def is_armed(unit: Unit) -> bool:
    """Return True if a unit fights and is not a worker."""
    known = kind(unit)
    return known is None or (bool(known.weapons) and not known.worker)


def enemy_structures(snapshot: Snapshot) -> list[Unit]:
    """Return the known enemy structures, also those remembered under the fog, by ascending tags."""
    found = (u for u in snapshot.known.values() if u.is_enemy and is_structure(u))
    return sorted(found, key=lambda unit: unit.tag)


def own_structures(snapshot: Snapshot) -> list[Unit]:
    """Return the own structures, finished or not, by ascending tags."""
    return [unit for unit in snapshot.own if is_structure(unit)]


def bears_resources(unit: Unit) -> bool:
    """Return True if a worker carries resources."""
    return any(buff_name(buff).startswith("Carry") for buff in unit.buff_ids)


def is_doing(unit: Unit, *abilities: int) -> bool:
    """Return True if a unit's present order is one of these abilities, special or general."""
    return bool(unit.orders) and _among(unit.orders[0].ability_id, abilities)


@functools.lru_cache(4096)
def _among(ability: int, wanted: tuple[int, ...]) -> bool:
    return ability in wanted or general(ability) in wanted


def ability(function: str) -> int:
    """Return the ability that a function of PySC2 stands for."""
    return functions()[function].ability_id
