"""A side's memory of an episode: the enemies that it has seen, and its units at the last observation.

The game reports what is in sight and what has died. This module remembers which enemies were there, and how many of
each type. An enemy that dies out of sight counts as alive, as a player would assume. `khala_bridge.observe.side` makes
views of it; below are bodies.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.knowledge import knowledge
from khala_bridge.observe.events import event
from khala_bridge.state import Alliance
from khala_protocol.messages import EnemyCount, Event

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_bridge.observe.body import Body
    from khala_protocol.messages import Point, UnitView

PASSING = frozenset(
    {
        "Larva",
        "Egg",
        "Cocoon",
        "Broodling",
        "Interceptor",
        "Locust",
        "LocustFlying",
        "AdeptPhaseShift",
        "DisruptorPhased",
        "ForceField",
        "KD8Charge",
        "CreepTumor",
        "CreepTumorQueen",
        "CreepTumorBurrowed",
        "PointDefenseDrone",
        "Changeling",
        "ChangelingZealot",
        "ChangelingMarine",
        "ChangelingMarineShield",
        "ChangelingZergling",
        "ChangelingZerglingWings",
    }
)
"""Types that come and go by themselves: no event reports them."""
COUNTED_ANYWAY = frozenset({"Larva", "Egg", "Cocoon"})
"""Of these, the ones whose number matters to producers."""


@dataclass(slots=True)
class _Known:
    """An enemy unit as it was last seen."""

    name: str
    minimap: Point
    seen: int
    """Number of the last observation that showed it."""
    dead: bool = False


@dataclass(slots=True)
class Chronicle:
    """The memory of one episode."""

    _enemies: dict[int, _Known] = field(default_factory=dict)
    _finished: dict[int, UnitView] = field(default_factory=dict)
    """Own units at the last observation, by tag."""
    _upgrades: frozenset[str] = frozenset()
    _count: int = 0
    """Number of observations so far."""
    events: tuple[Event, ...] = ()
    """Events of the side between the last two observations."""

    def note(self, bodies: Mapping[int, Body], upgrades: Sequence[str], dead: Iterable[int]) -> None:
        """Take in an observation."""
        gone = frozenset(dead)
        own = {tag: body.view for tag, body in bodies.items() if body.is_own and body.name not in PASSING}
        finished = {tag: view for tag, view in own.items() if view.build_progress >= 1}
        new = self._new_enemies(bodies)
        killed = self._killed(gone)
        if self._count:
            made = [event("finished", view, "own") for tag, view in finished.items() if tag not in self._finished]
            lost = [event("died", view, "own") for tag, view in self._finished.items() if tag in gone]
            learnt = [name for name in upgrades if name not in self._upgrades]
            researched = [Event(what="researched", tag="", type=name, alliance="own") for name in learnt]
            self.events = (*made, *researched, *lost, *killed, *new)
        self._finished, self._upgrades = finished, frozenset(upgrades)
        self._count += 1

    def _new_enemies(self, bodies: Mapping[int, Body]) -> list[Event]:
        """Return events for new enemies, and remember all that are in sight."""
        new = []
        for tag, body in bodies.items():
            if body.alliance is not Alliance.ENEMY or body.name in PASSING or body.view.hallucination:
                continue
            if tag not in self._enemies:
                new.append(event("appeared", body.view, "enemy"))
            self._enemies[tag] = _Known(body.name, body.view.minimap, self._count)
        return new

    def _killed(self, dead: frozenset[int]) -> list[Event]:
        killed = []
        for tag in sorted(dead & self._enemies.keys()):
            known = self._enemies[tag]
            if not known.dead:
                known.dead = True
                killed.append(Event(what="died", tag=hex(tag), type=known.name, alliance="enemy"))
        return killed

    def enemies(self) -> tuple[EnemyCount, ...]:
        """Return the known number of each type of enemy; units before structures, each in alphabetical order."""
        by_type: dict[str, list[_Known]] = {}
        for known in self._enemies.values():
            by_type.setdefault(known.name, []).append(known)
        return tuple(self._counted(name, by_type[name]) for name in sorted(by_type, key=_units_first))

    def _counted(self, name: str, known: Sequence[_Known]) -> EnemyCount:
        alive = [enemy for enemy in known if not enemy.dead]
        return EnemyCount(
            type=name,
            seen=len(known),
            in_sight=sum(enemy.seen == self._count - 1 for enemy in alive),
            dead=len(known) - len(alive),
            minimap=max(alive, key=lambda enemy: enemy.seen).minimap if alive else None,
        )


def _units_first(name: str) -> tuple[bool, str]:
    return is_structure(name), name


@functools.cache
def is_worker(name: str) -> bool:
    """Return True if a type of unit gathers; unknown types do not."""
    known = knowledge().get(name)
    return known is not None and known.worker


@functools.cache
def is_structure(name: str) -> bool:
    """Return True if a type is a structure; unknown types are not."""
    known = knowledge().get(name)
    return known is not None and known.structure
