"""A type in a few lines, for prompts: what it is, its body, its weapons, and its counters.

Pure functions of names, cached: a page asks for the same types at every step. The lines are not indented; the first
one is the heading of the others. `khala_bridge.knowledge.lookup` has the full text for people.
"""

from __future__ import annotations

import functools
from itertools import chain, zip_longest
from typing import TYPE_CHECKING, Final

from khala_bridge.knowledge.facts import VERSION
from khala_bridge.knowledge.improve import improve
from khala_bridge.knowledge.load import knowledge
from khala_bridge.knowledge.words import number as n

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.knowledge.model import UnitFacts, WeaponFacts

MOST: Final = 6
"""Number of types that are named as counters if the caller does not say which ones matter."""
HITS: Final = {"any": "ground and air", "ground": "ground", "air": "air"}


@functools.lru_cache(4096)
def short(
    name: str,
    among: frozenset[str] | None = None,
    researched: frozenset[str] = frozenset(),
    version: str = VERSION,
) -> tuple[str, ...]:
    """Return a type as lines: `Stalker: Mobile ranged walker …`, its body, its weapons, its counters.

    `among` are the types that matter now, those in sight: only these are named as counters, in an order of their own.
    Without it some units of each race are named. `researched` are the upgrades of its owner, in all numbers, `version`
    the facts that hold on the map. There are no lines about an unknown type.
    """
    kind = improve(name, researched, version)
    if kind is None:
        return ()
    about = f"{name}: {kind.about}" if kind.about else name
    return (about, body(kind), *map(weapon, kind.weapons), *_matchups(kind, among))


@functools.lru_cache(4096)
def advice(name: str, researched: frozenset[str] = frozenset(), version: str = VERSION) -> tuple[str, ...]:
    """Return lines about the use of an own type, and its abilities apart from moving and attacking: `Blink: …`."""
    kind = improve(name, researched, version)
    if kind is None:
        return ()
    uses = [f"Use: {kind.uses}"] if kind.uses else []
    return (*uses, *(f"{title}: {said}" for title, said in kind.abilities.items()))


def body(kind: UnitFacts) -> str:
    """Return the body in words: `armored, mechanical, on the ground; health 80, shield 80, armor 1, speed 4.13`."""
    plane = "flying" if kind.flying else "on the ground"
    parts = [f"{', '.join((*kind.attributes, plane))}; health {n(kind.health)}"]
    numbers = (("shield", kind.shield), ("armor", kind.armor), ("energy up to", kind.energy))
    parts += [f"{what} {n(value)}" for what, value in numbers if value]
    on_creep = f" ({n(kind.speed * kind.creep)} on creep)" if kind.creep != 1 else ""
    parts.append(f"speed {n(kind.speed)}{on_creep}" if kind.speed else "does not move")
    if kind.detects:
        parts.append(f"detects within {n(kind.detects)}")
    parts += [word for word, is_so in (("cloaked", kind.cloaked), ("burrowed", kind.burrowed)) if is_so]
    return ", ".join(parts)


def weapon(own: WeaponFacts) -> str:
    """Return a weapon in words: `hits ground, range 6, damage 13 (+5 against armored) every 1.34 s, …`."""
    times = f" x {own.attacks}" if own.attacks > 1 else ""
    bonus = "".join(f" (+{n(more)} against {what})" for what, more in own.bonus.items())
    nearest = f" but not nearer than {n(own.min_range)}" if own.min_range else ""
    then = " once the tentacle is back, at most" if own.returns else ","
    better = "".join(f" ({_tenths(own.per_second_against(what))} against {what})" for what in own.bonus)
    splash = f", splash within {n(own.splash)}" if own.splash else ""
    return (
        f"hits {HITS[own.targets]}, range {n(own.range)}{nearest}, damage {n(own.damage)}{bonus}{times} "
        f"every {n(own.period_s)} s{then} {_tenths(own.per_second)} damage per second{better}{splash}"
    )


def _tenths(value: float) -> str:
    return n(round(value, 1))


def _matchups(kind: UnitFacts, among: frozenset[str] | None) -> Iterator[str]:
    """Yield its counters: `good against Reaper, VoidRay; beaten by Immortal, Marauder`; nothing if none is known."""
    sides = (("good against", kind.counters), ("beaten by", kind.countered_by))
    chosen = ((what, _chosen(names, among)) for what, names in sides)
    said = [f"{what} {', '.join(names)}" for what, names in chosen if names]
    if said:
        yield "; ".join(said)


def _chosen(names: tuple[str, ...], among: frozenset[str] | None) -> tuple[str, ...]:
    if among is not None:
        return tuple(name for name in names if name in among)
    races: dict[str, list[str]] = {}
    for kind in (knowledge()[name] for name in names):
        if kind.melee and not kind.structure:
            races.setdefault(kind.race, []).append(kind.name)
    in_turn = chain.from_iterable(zip_longest(*races.values()))
    return tuple(name for name in in_turn if name)[:MOST]
