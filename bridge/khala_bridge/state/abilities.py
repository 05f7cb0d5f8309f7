"""The abilities that own units can use now, by the game itself: makes the query and reads the answer.

The query of the SC2 API checks everything that can prevent a use: tech, cost, supply, energy, cooldown, power, buffs.
It names abilities by their special ids; text actions often end in a general one, so both are returned. Pure:
`khala_bridge.game.pysc2_game` sends the query once for an observation. `khala_bridge.rules` works out why the game
says no.
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
    """Return the query about every own unit, also those under construction, which can be cancelled.

    Costs count: abilities that the player cannot pay for are not available.
    """
    asked = [query_pb2.RequestQueryAvailableAbilities(unit_tag=unit.tag) for unit in snapshot.own]
    return query_pb2.RequestQuery(abilities=asked, ignore_resource_requirements=False)


def available(answer: query_pb2.ResponseQuery) -> Mapping[int, frozenset[int]]:
    """Return the ids of each unit's abilities by its tag, each as itself and in its general form."""
    return {ability.unit_tag: _both(tuple([a.ability_id for a in ability.abilities])) for ability in answer.abilities}


@functools.lru_cache(maxsize=4096)
def _both(abilities: tuple[int, ...]) -> frozenset[int]:
    return frozenset((*abilities, *map(general, abilities)))
