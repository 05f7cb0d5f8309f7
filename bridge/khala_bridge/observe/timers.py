"""How long until an own ability is ready again, and until an effect on the ground ends: what the game does not tell.

The game says which abilities are ready and which effects are there. This module remembers since when; the facts say
how long it takes. So a time is at most one observation of the side too long, and never too short.
`khala_bridge.observe.observer`, above, keeps one for each episode, `khala_bridge.observe.scene` asks it.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Hashable

    from khala_bridge.knowledge import MapFacts
    from khala_bridge.state import Snapshot, Unit

BARRIERS = frozenset({"ForceField"})
"""Types of units that are effects on the ground to those who see them."""
_ABILITY_OF = {"ScannerSweep": "Effect_Scan"}
"""Abilities whose names differ from those of their effects."""
_HOLDING = frozenset(
    {"FungalGrowth", "GravitonBeam", "NeuralParasite", "RavenScramblerMissile", "OracleStasisTrapTarget"}
)
"""Buffs under which a unit can do nothing, whether its abilities are ready or not."""


class Timers:
    """When own abilities were ready for the last time, and effects on the ground there for the first."""

    def __init__(self) -> None:
        """Know nothing."""
        self._loop = 0
        self._ready: dict[tuple[int, int], int] = {}
        """By tag and ability, the loop of the last observation at which it was ready."""
        self._there: dict[Hashable, int] = {}
        """By effect, the loop of the first observation that showed it."""

    def note(self, snapshot: Snapshot) -> None:
        """Take in an observation."""
        loop = self._loop = snapshot.game_loop
        able = snapshot.abilities or {}
        for unit in snapshot.own:
            for ability in _cooldowns(snapshot.facts, unit.name):
                if ability in able.get(unit.tag, ()):
                    self._ready[unit.tag, ability] = loop
        there: list[Hashable] = [(effect.effect_id, effect.places) for effect in snapshot.effects]
        there += [unit.tag for unit in snapshot.units.values() if unit.name in BARRIERS]
        self._there = {effect: self._there.get(effect, loop) for effect in there}

    def ready_in_s(self, facts: MapFacts, unit: Unit, ability: int) -> float | None:
        """Return the time until an ability that is not ready now is ready again; None if that is not known."""
        cooldown_s = _cooldowns(facts, unit.name).get(ability)
        ready = self._ready.get((unit.tag, ability))
        if cooldown_s is None or ready is None or not _HOLDING.isdisjoint(unit.buffs):
            return None
        return self._left_s(cooldown_s, ready)

    def effect_left_s(self, facts: MapFacts, effect: Hashable, name: str) -> float | None:
        """Return the time until an effect ends; None if that is not known.

        Args:
            facts: that hold on the map.
            effect: its number and places; the tag of a barrier.
            name: of the effect.
        """
        lasts_s = _duration_s(facts, name)
        return None if lasts_s is None else self._left_s(lasts_s, self._there.get(effect, self._loop))

    def _left_s(self, whole_s: float, since: int) -> float | None:
        left_s = round(whole_s - (self._loop - since) / LOOPS_PER_S, 1)
        return left_s if left_s > 0 else None


@functools.cache
def _cooldowns(of_map: MapFacts, unit_type: str) -> dict[int, float]:
    """Return the cooldowns of a type's abilities that nothing else keeps from being ready, in seconds.

    An ability that costs energy, or that a structure must pay for, may be not ready for that reason.
    """
    found = {}
    for facts in of_map.abilities.values():
        if unit_type in facts.users and facts.cooldown_s and not facts.energy and facts.does != "warp_in":
            found[facts.id] = facts.cooldown_s
            if facts.general is not None:
                found[facts.general] = facts.cooldown_s
    return found


@functools.cache
def _duration_s(of_map: MapFacts, name: str) -> float | None:
    """Return how long an effect on the ground lasts; None if the facts do not say."""
    wanted = _ABILITY_OF.get(name, f"Effect_{name}")
    figures = next((facts.figures for facts in of_map.abilities.values() if facts.name == wanted), {})
    if "searches" in figures:
        return figures["searches"] * figures["search_period_s"]
    return figures.get("duration_s", figures.get("delay_s"))
