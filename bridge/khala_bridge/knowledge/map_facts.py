"""The facts that hold on one map: what judgements and the host's own choices may know of types, abilities and upgrades.

Units have other weapons and numbers on a map that depends on other data. So the facts are an object: the game makes it
for its map, every snapshot carries it (`Snapshot.facts`), and whoever judges takes it from there. The functions of
`khala_bridge.knowledge.load` take a version, whose default is the multiplayer's: they serve documents, catalogues and
names, which are the same on every map. `tests/bridge/rules/test_map_facts.py` keeps them out of judgements.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_bridge.knowledge.facts import version_of
from khala_bridge.knowledge.load import abilities, buffs, knowledge, upgrades

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.knowledge.facts import DataSet
    from khala_bridge.knowledge.model import AbilityFacts, BuffFacts, UnitFacts, UpgradeFacts


class MapFacts:
    """The facts of one data set of a version; equal only to itself, so that it can be part of the key of a cache."""

    def __init__(self, version: str) -> None:
        """Read the facts of a version, `4.10/void`. `facts_of` does it once for each data set."""
        self.version = version
        """For functions that take a version."""
        self.units: Mapping[str, UnitFacts] = knowledge(self.version)
        """By name."""
        self.abilities: Mapping[int, AbilityFacts] = abilities(self.version)
        """By number."""
        self.upgrades: Mapping[str, UpgradeFacts] = upgrades(self.version)
        """By name."""
        self.buffs: Mapping[str, BuffFacts] = buffs(self.version)
        """By name."""
        self._stand_ins: dict[str, frozenset[str]] = {}

    def ability_of(self, number: int, unit_type: str) -> AbilityFacts | None:
        """Return the facts of an ability, special or general, for units of one type; None if they do not have it.

        `ability_of(EFFECT_STIM, "Marine")` returns the Marine's Stim, and so does the special ability's own number.
        """
        facts = self.abilities.get(number)
        if facts is None:
            return None
        cases = [self.abilities[special] for special in facts.special] or [facts]
        return next((case for case in cases if unit_type in case.users), None)

    def stand_ins(self, name: str) -> frozenset[str]:
        """Return the types that meet a requirement of this structure: itself, and a Hive for a Lair."""
        if name not in self._stand_ins:
            self._stand_ins[name] = frozenset({name, *(k.name for k in self.units.values() if name in k.counts_as)})
        return self._stand_ins[name]

    def is_structure(self, unit_type: str) -> bool:
        """Return True if a type is a structure; unknown types are not."""
        known = self.units.get(unit_type)
        return known is not None and known.structure

    def is_armed(self, unit_type: str) -> bool:
        """Return True if a type has a weapon or is unknown."""
        known = self.units.get(unit_type)
        return known is None or bool(known.weapons)


@functools.cache
def facts_of(data_set: DataSet) -> MapFacts:
    """Return the facts that hold on maps with these data, `TaskConfig.map_data` or `MapSpec.data`."""
    return MapFacts(version_of(data_set))
