"""Prices: what a player is charged for what an ability makes, and what comes back.

The tables keep most prices with the product (``made_by``); ``priced`` brings them to the abilities once, when a
catalog is loaded, so that one rule of affording holds for all. Above: ``casting``, ``production``, ``construction``.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from simulator.abilities import Ability
    from simulator.records import UnitType, Upgrade
    from simulator.world import World

Cost = tuple[float, float]

BY_PRODUCT: Final = frozenset({"train", "build", "build_addon", "summon", "warp_in", "arm", "structure_morph"})
"""What is charged for as its product's ``made_by`` says."""
BUILD_REACH: Final = 0.5
"""How far from a structure's body its builder may stand when it places it (an estimate)."""
ALL: Final = 1.0
"""Share of the price that comes back for what was only in a queue."""
CANCELLED: Final = 0.75
"""Share that comes back for a structure whose construction is called off, and for a morph (mechanics: refunds)."""


def priced(
    abilities: Iterable[Ability], units: Mapping[str, UnitType], upgrades: Mapping[str, Upgrade]
) -> tuple[Ability, ...]:
    """The abilities with price, supply and time of what they make, and a builder's reach, where they have none.

    What makes nothing that the tables of the version know does nothing.
    """
    return tuple(_priced(ability, units, upgrades) for ability in abilities)


def _priced(ability: Ability, units: Mapping[str, UnitType], upgrades: Mapping[str, Upgrade]) -> Ability:
    if ability.does == "research":
        return _priced_research(ability, upgrades.get(ability.upgrade))
    product = units.get(ability.unit)
    if ability.does not in BY_PRODUCT:
        return ability
    if product is None:
        return dataclasses.replace(ability, does="")
    ways = [way for way in product.made_by if way.ability == ability.id]
    if not ways or ability.minerals or ability.vespene:
        return ability
    way = ways[0]
    reach = product.radius + BUILD_REACH if ability.does == "build" and not ability.range else ability.range
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


def _priced_research(ability: Ability, upgrade: Upgrade | None) -> Ability:
    if upgrade is None or not ability.loops:
        return dataclasses.replace(ability, does="")
    if ability.minerals or ability.vespene:
        return ability
    minerals, vespene = upgrade.cost
    return dataclasses.replace(ability, minerals=minerals, vespene=vespene)


def cost_of(ability: Ability) -> Cost:
    """Minerals and vespene."""
    return float(ability.minerals), float(ability.vespene)


def charge(world: World, player: int, cost: Cost) -> Cost:
    """Take a price from a player; returns what was taken, nothing from one who plays for free."""
    purse = world.players[player]
    if "free" in purse.cheats:
        return 0.0, 0.0
    purse.minerals -= cost[0]
    purse.vespene -= cost[1]
    purse.score.spent[0] += cost[0]
    purse.score.spent[1] += cost[1]
    return cost


def refund(world: World, player: int, paid: Cost, share: float = ALL) -> None:
    """Give a share of what was paid back, in whole points (that it is rounded down is an estimate)."""
    purse = world.players[player]
    for index, amount in enumerate(paid):
        back = float(int(amount * share))
        purse.score.spent[index] -= back
        if index:
            purse.vespene += back
        else:
            purse.minerals += back
