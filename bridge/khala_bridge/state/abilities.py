"""What own units can be told to do now, as the game itself says it: a question for its query, and the answer read.

The query of the SC2 API looks at everything that stands in the way of a use: tech, cost, supply, energy, cooldown,
power, buffs. It names abilities by their special ids; text actions often end in a general one, so that both are handed
on. Pure: `khala_bridge.game.pysc2_game` asks the question once for an observation. `khala_bridge.rules` works out why
the game says no.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from s2clientprotocol import query_pb2

from khala_bridge.catalogue.functions import general

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.state import Snapshot


def question(snapshot: Snapshot) -> query_pb2.RequestQuery:
    """Ask about every own unit, those in the making too: they can be called off.

    Costs count: what the player cannot pay is not available.
    """
    asked = [query_pb2.RequestQueryAvailableAbilities(unit_tag=unit.tag) for unit in snapshot.own]
    return query_pb2.RequestQuery(abilities=asked, ignore_resource_requirements=False)


def available(answer: query_pb2.ResponseQuery) -> Mapping[int, frozenset[int]]:
    """Return by tag of a unit, the ids of its abilities, each as itself and in its general form."""
    return {one.unit_tag: _both(tuple([a.ability_id for a in one.abilities])) for one in answer.abilities}


@functools.lru_cache(maxsize=4096)
def _both(abilities: tuple[int, ...]) -> frozenset[int]:
    return frozenset((*abilities, *map(general, abilities)))
