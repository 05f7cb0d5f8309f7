"""Prices: what a player pays for the product of an ability.

The tables keep most prices with the product (``made_by``); ``add_price`` brings them to the abilities once, when a
catalog is loaded, so that one rule of affording holds for all. ``payments`` takes them and gives them back.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType, Upgrade

Cost = tuple[float, float]

BY_PRODUCT: Final = frozenset({"train", "build", "build_addon", "summon", "warp_in", "arm", "structure_morph"})
"""Effects with the price in their product's ``made_by``."""
BUILD_REACH: Final = 0.5
"""How far from a structure's body its builder may stand when it places it (an estimate)."""


def add_price(ability: Ability, units: Mapping[str, UnitType], upgrades: Mapping[str, Upgrade]) -> Ability:
    """Return an ability, with missing price, supply, time and builder's reach filled in from its product.

    An ability whose product is not in the version's tables does nothing.
    """
    if ability.effect == "research":
        return _add_research_price(ability, upgrades.get(ability.upgrade))
    product = units.get(ability.unit)
    if ability.effect not in BY_PRODUCT:
        return ability
    if product is None:
        return dataclasses.replace(ability, effect="")
    ways = [way for way in product.made_by if way.ability == ability.id]
    if not ways or ability.minerals or ability.vespene:
        return ability
    way = ways[0]
    reach = product.radius + BUILD_REACH if ability.effect == "build" and not ability.range else ability.range
    minerals, vespene = way.cost
    return dataclasses.replace(
        ability,
        minerals=minerals,
        vespene=vespene,
        count=way.count,
        supply=product.supply * way.count,
        loops=ability.loops or way.loops,
        range=reach,
    )


def _add_research_price(ability: Ability, upgrade: Upgrade | None) -> Ability:
    if upgrade is None or not ability.loops:
        return dataclasses.replace(ability, effect="")
    if ability.minerals or ability.vespene:
        return ability
    minerals, vespene = upgrade.cost
    return dataclasses.replace(ability, minerals=minerals, vespene=vespene)


def cost_of(ability: Ability) -> Cost:
    """Return minerals and vespene."""
    return float(ability.minerals), float(ability.vespene)
