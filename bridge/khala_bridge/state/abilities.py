"""What own units can be told to do now, as the game itself says it: a question for its query, and the answer read.

The query of the SC2 API looks at everything that stands in the way of a use: tech, cost, supply, energy, cooldown,
power, buffs. It names abilities by their special ids; text actions often end in a general one, so that both are handed
on. What is sure without it, where the game was not asked, is here as well. Pure: `khala_bridge.game.pysc2_game` asks
the question once for an observation.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from s2clientprotocol import query_pb2

from khala_bridge.catalogue.functions import general
from khala_bridge.knowledge import ability_of, is_armed, upgrades

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from khala_bridge.catalogue.functions import Function
    from khala_bridge.state import Snapshot

ATTACK = 3674
"""The general ability to attack."""


def question(snapshot: Snapshot) -> query_pb2.RequestQuery:
    """Asks about every own unit, those in the making too: they can be called off.

    Costs count: what the player cannot pay is not available.
    """
    asked = [query_pb2.RequestQueryAvailableAbilities(unit_tag=unit.tag) for unit in snapshot.own]
    return query_pb2.RequestQuery(abilities=asked, ignore_resource_requirements=False)


def available(answer: query_pb2.ResponseQuery) -> Mapping[int, frozenset[int]]:
    """By tag of a unit, the ids of its abilities, each as itself and in its general form."""
    return {one.unit_tag: _both(tuple([a.ability_id for a in one.abilities])) for one in answer.abilities}


@functools.lru_cache(maxsize=4096)
def _both(abilities: tuple[int, ...]) -> frozenset[int]:
    return frozenset((*abilities, *map(general, abilities)))


def is_attack(function: Function) -> bool:
    """Whether a function attacks; scanning goes by the same general ability, and is for those without a weapon."""
    return ATTACK in (function.ability_id, function.general_id) and function.stem != "Scan_Move"


def unmet(function: Function | None, unit_type: str, researched: Collection[str]) -> str | None:
    """Why units of a type surely cannot do something, as the end of a sentence; None if the game has to be asked."""
    if function is None:
        return None
    if is_attack(function) and not is_armed(unit_type):
        return f"{unit_type} has no weapon"
    facts = ability_of(function.ability_id, unit_type)
    requires = sorted(facts.requires) if facts else []
    missing = [need for need in requires if need in upgrades() and need not in researched]
    return f"{missing[0]} is not researched" if missing else None
