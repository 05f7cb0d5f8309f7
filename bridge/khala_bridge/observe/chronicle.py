"""A side's memory of an episode: the enemies that it has seen, who died when, and a log of what happened.

The game reports what is in sight and what has died. This module remembers which enemies were there, and how many of
each type. An enemy that dies out of sight counts as alive, as a player would assume. It takes in every snapshot, also
those at which no agent looks; so it reads the snapshot itself and makes no views, which take 50 times as long.
`khala_bridge.observe.side` makes views of it, `khala_bridge.observe.changes` what is new to an agent.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import takewhile
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.knowledge import is_structure
from khala_bridge.observe.body import to_tenth
from khala_protocol.messages import LOOPS_PER_S, EnemyCount, Event

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.frames import MapFrame
    from khala_bridge.observe.events import EventKind
    from khala_bridge.state import Snapshot, Unit
    from khala_protocol.messages import Alliance

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
MINUTE_LOOPS = round(60 * LOOPS_PER_S)
COUNTED_ANYWAY = frozenset({"Larva", "Egg", "Cocoon"})
"""Of these, the ones whose number matters to producers."""


class Entry(NamedTuple):
    """What one observation of the side brought."""

    number: int
    """Of the observation, from 0."""
    events: tuple[Event, ...]
    """Events of the side since the observation before."""
    alerts: tuple[str, ...]
    """The game's alerts, by the API's names."""
    dead: frozenset[int]
    """Tags of the units that died since then."""
    fallen: tuple[Unit, ...]
    """The player's own units among them, as they were at the observation before."""


@dataclass(slots=True)
class Sighting:
    """An enemy unit as it was last seen."""

    unit: Unit
    seen: int
    """Number of the last observation that showed it."""
    loop: int
    """Game loop of that observation."""
    dead: bool = False


class Account(NamedTuple):
    """What a side had spent and used at a moment."""

    loop: int
    spent: tuple[float, float]
    """Minerals and vespene since the episode began."""
    supply_used: int


@dataclass(slots=True)
class Chronicle:
    """The memory of one episode."""

    number: int = -1
    """Of the last observation; the first one is 0."""
    loop: int = 0
    """Game loop of the last observation."""
    accounts: deque[Account] = field(default_factory=deque)
    """One for each observation of the last minute, the earliest first."""
    died: dict[int, int] = field(default_factory=dict)
    """By tag of a dead unit, the game loop of the observation that reported its death."""
    _enemies: dict[int, Sighting] = field(default_factory=dict)
    _own: dict[int, Unit] = field(default_factory=dict)
    """Own units at the last observation, by tag."""
    _finished: set[tuple[int, str]] = field(default_factory=set)
    """Tags and types of the own units that were finished at some observation, whether they are in sight or not."""
    _upgrades: frozenset[str] = frozenset()
    _log: list[Entry] = field(default_factory=list)
    """Of the observations that brought something."""

    def note(self, snapshot: Snapshot) -> None:
        """Take in an observation."""
        self.number += 1
        self.loop = snapshot.game_loop
        self._keep_account(snapshot)
        before, self._own = self._own, {unit.tag: unit for unit in snapshot.own}
        new = self._new_enemies(snapshot)
        killed = self._kills(snapshot.dead)
        built = (unit for tag, unit in self._own.items() if self._is_new(unit, before.get(tag)))
        made = [_event(unit, "finished", "own") for unit in built]
        events: tuple[Event, ...] = ()
        if self.number:
            learnt = [name for name in snapshot.upgrades if name not in self._upgrades]
            researched = [Event(what="researched", tag="", type=name, alliance="own") for name in learnt]
            gone = (unit for tag, unit in before.items() if tag in snapshot.dead and _is_done(unit))
            lost = [_event(unit, "died", "own") for unit in gone]
            events = (*made, *researched, *lost, *killed, *new)
        self._upgrades = frozenset(snapshot.upgrades)
        fallen = tuple(before[tag] for tag in sorted(snapshot.dead & before.keys()))
        if events or snapshot.alerts or snapshot.dead:
            self._log.append(Entry(self.number, events, snapshot.alerts, snapshot.dead, fallen))
        for tag in sorted(snapshot.dead):
            self.died.setdefault(tag, snapshot.game_loop)

    def _keep_account(self, snapshot: Snapshot) -> None:
        self.accounts.append(Account(snapshot.game_loop, snapshot.score.spent, snapshot.player.food_used))
        while self.accounts[0].loop < snapshot.game_loop - MINUTE_LOOPS:
            self.accounts.popleft()

    def _is_new(self, unit: Unit, before: Unit | None) -> bool:
        """Return True if an own unit is finished for the first time.

        A worker that leaves a geyser, or a unit its transport, comes back as what it was; a siege tank in another mode
        was finished at the observation before.
        """
        if not _is_done(unit) or (unit.tag, unit.name) in self._finished:
            return False
        self._finished.add((unit.tag, unit.name))
        return before is None or not _is_done(before)

    def since(self, number: int) -> Sequence[Entry]:
        """Return what happened after an observation, the earliest first; after -1 is all of the episode."""
        return list(takewhile(lambda entry: entry.number > number, reversed(self._log)))[::-1]

    def _new_enemies(self, snapshot: Snapshot) -> list[Event]:
        """Return events for new enemies, and remember all that are in sight."""
        new = []
        for tag, unit in snapshot.units.items():
            if not unit.is_enemy or unit.name in PASSING or unit.is_hallucination:
                continue
            if tag not in self._enemies:
                new.append(_event(unit, "appeared", "enemy"))
            self._enemies[tag] = Sighting(unit, self.number, snapshot.game_loop)
        return new

    def _kills(self, dead: frozenset[int]) -> list[Event]:
        killed = []
        for tag in sorted(dead & self._enemies.keys()):
            known = self._enemies[tag]
            if not known.dead:
                known.dead = True
                killed.append(_event(known.unit, "died", "enemy"))
        return killed

    @property
    def sightings(self) -> Iterator[Sighting]:
        """Every enemy that was seen and did not die in sight, in the order in which they were seen first."""
        return (known for known in self._enemies.values() if not known.dead)

    def enemies(self, world: MapFrame) -> tuple[EnemyCount, ...]:
        """Return the known number of each type of enemy; units before structures, each in alphabetical order."""
        by_type: dict[str, list[Sighting]] = {}
        for known in self._enemies.values():
            by_type.setdefault(known.unit.name, []).append(known)
        return tuple(self._enemy_count(name, by_type[name], world) for name in sorted(by_type, key=_units_first))

    def _enemy_count(self, name: str, known: Sequence[Sighting], world: MapFrame) -> EnemyCount:
        alive = [enemy for enemy in known if not enemy.dead]
        last = max(alive, key=lambda enemy: enemy.seen) if alive else None
        return EnemyCount(
            type=name,
            seen=len(known),
            in_sight=sum(enemy.seen == self.number for enemy in alive),
            dead=len(known) - len(alive),
            minimap=to_tenth(world.minimap(*last.unit.pos), world.minimap_size) if last else None,
            unseen_s=round((self.loop - last.loop) / LOOPS_PER_S, 1) if last else 0.0,
        )


def _event(unit: Unit, what: EventKind, alliance: Alliance) -> Event:
    return Event(what=what, tag=hex(unit.tag), type=unit.name, alliance=alliance)


def _is_done(unit: Unit) -> bool:
    """Return True if an own unit is finished, as its view says it, and worth an event."""
    return unit.name not in PASSING and round(unit.build_progress, 2) >= 1


def _units_first(name: str) -> tuple[bool, str]:
    return is_structure(name), name
