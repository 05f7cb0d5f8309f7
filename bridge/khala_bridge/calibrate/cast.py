"""Which unit types the probes use, by PySC2's names, and how large they are.

The lists come from the facts of one version, so that two games are asked about the same types; a type that a game does
not know is left out when it is made.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

from khala_bridge.knowledge.facts import VERSION, unit_facts

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab
    from khala_bridge.knowledge.model import UnitFacts

RACES: Final = ("terran", "protoss", "zerg")

_PASSING = frozenset({
    "AdeptPhaseShift", "BanelingCocoon", "BroodLordCocoon", "Broodling", "BroodlingEscort", "Changeling",
    "ChangelingMarine", "ChangelingMarineShield", "ChangelingZealot", "ChangelingZergling", "ChangelingZerglingWings",
    "DisruptorPhased", "InfestedTerran", "Interceptor", "KD8Charge", "Larva", "Locust", "LocustFlying", "LurkerCocoon",
    "MULE", "OverlordTransportCocoon", "OverseerCocoon", "StasisTrap",
})  # fmt: skip
"""Types that do not stay as they are, or that their makers command."""
_SPECIAL_ATTACK = frozenset({"Baneling", "BroodLord", "Carrier", "HighTemplar", "Mothership", "PhotonCannon"})
"""Types that die of their attack, send others, choose by themselves, or need power; `Sentry` and others are plain."""


def fact(kind: str) -> UnitFacts:
    """Return what is known of a type, for sizes and costs that both games of a comparison take from here."""
    return unit_facts(VERSION)[kind]


@functools.cache
def melee_types() -> tuple[str, ...]:
    """Return every type of a race that stays as it is."""
    return tuple(
        name
        for name, kind in sorted(unit_facts(VERSION).items())
        if kind.melee and kind.race in RACES and name not in _PASSING
    )


@functools.cache
def mobile() -> tuple[str, ...]:
    """Return the types that move by an order."""
    return tuple(name for name in melee_types() if fact(name).speed and not fact(name).burrowed)


@functools.cache
def armed_types() -> tuple[str, ...]:
    """Return the types that attack by an order, again and again."""
    return tuple(name for name in melee_types() if fact(name).weapons and name not in _SPECIAL_ATTACK)


@functools.cache
def targets() -> tuple[str, ...]:
    """Return the types that can be hit and lose no life by themselves."""
    return tuple(name for name in melee_types() if fact(name).planes and not fact(name).needs_creep)


@functools.cache
def sturdy(attacker: str) -> str:
    """Return a type that an attacker can hit and that survives a while."""
    return "Nexus" if any(weapon.targets != "air" for weapon in fact(attacker).weapons) else "Battlecruiser"


def reach(attacker: str) -> float:
    """Return the distance between edges at which a unit surely fires: within its range and beyond its least range."""
    weapons = fact(attacker).weapons
    return max(max(weapon.min_range for weapon in weapons) + 0.5, min(min(weapon.range for weapon in weapons) / 2, 1.0))


def apart(kind: str, other: str, gap: float) -> float:
    """Return the distance between the middles of two units whose edges are `gap` apart."""
    return fact(kind).radius + fact(other).radius + gap


def known(lab: Lab, kinds: tuple[str, ...]) -> list[str]:
    """Return those types that the game has."""
    return [kind for kind in kinds if lab.has(kind)]
