"""Composition: which units the army wants most, by the shares of the build and by what is known of the enemy.

A level that adapts counts what it has seen: units that can't hit flyers count less the more flyers there are, units
with a bonus against the enemy's attributes count more.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType

AIR_SHIFT: Final = 0.8
"""How much of its share a unit loses that can't hit flyers, if the enemy has nothing else."""
BONUS_SHIFT: Final = 0.7
FOR_AIR: Final = 0.1
"""The part of its share that a unit keeps that hits only flyers while there are none."""
GAS_PILE: Final = 300.0
PILE_SHIFT: Final = 0.5


def supply_made(side: OwnSide) -> float:
    """Return the supply of the army and of what is being made for it: all that no worker uses, so Queens too."""
    return side.cap - side.purse.room - side.count(side.race.worker)


def shares(side: OwnSide) -> dict[str, float]:
    """Return the shares of the army that a side wants now."""
    shares = {name: share * _for_money(side, name) for name, share in side.stage.army.items()}
    if "adapt" not in side.level.skills:
        return shares
    flyers, attributes = _seen(side)
    return {name: share * _fit(side.world.catalog, name, flyers, attributes) for name, share in shares.items()}


def _for_money(side: OwnSide, name: str) -> float:
    """Return the factor on a unit's share by what there is to spend: units with vespene first when it piles up."""
    piled = side.owner.vespene > GAS_PILE and side.owner.vespene > side.owner.minerals
    if not piled:
        return 1.0
    return 1.0 + PILE_SHIFT if side.world.catalog.unit(name).cost[1] else 1.0 - PILE_SHIFT


def by_need(side: OwnSide, shares: dict[str, float]) -> list[str]:
    """Return the types of the army by how far each is behind its share, the farthest first."""
    behind = {name: (side.count(name) + 1) / share for name, share in shares.items() if share > 0.0}
    return sorted(behind, key=lambda name: (behind[name], name))


def _seen(side: OwnSide) -> tuple[float, dict[str, float]]:
    """Return the share of flyers among the enemies that it knows of, and the share of each attribute, by price."""
    catalog = side.world.catalog
    units = [catalog.units[row] for row, _ in side.mind.seen.values()]
    whole = sum(map(sum, (unit.cost for unit in units))) or 1.0
    flyers = sum(sum(unit.cost) for unit in units if unit.flying) / whole
    attributes: dict[str, float] = {}
    for unit in units:
        for name in unit.attributes:
            attributes[name] = attributes.get(name, 0.0) + sum(unit.cost) / whole
    return flyers, attributes


def _fit(catalog: Catalog, name: str, flyers: float, attributes: dict[str, float]) -> float:
    hits_ground, hits_air, bonuses = _strengths(catalog, name)
    fit = 1.0 if hits_air else 1.0 - AIR_SHIFT * flyers
    if not hits_ground:
        fit = FOR_AIR + flyers
    return fit * (1.0 + BONUS_SHIFT * sum(share * attributes.get(word, 0.0) for word, share in bonuses))


@lru_cache(maxsize=256)
def _strengths(catalog: Catalog, name: str) -> tuple[bool, bool, tuple[tuple[str, float], ...]]:
    """Return whether a type hits the ground and flyers, and its bonuses by attribute as parts of its damage."""
    unit: UnitType = catalog.unit(name)
    weapons = [weapon for weapon in unit.weapons if weapon.works]
    hits_air = unit.weapon_against("air") is not None or not weapons
    bonuses = {word: bonus / max(w.shown_damage, 1.0) for w in weapons for word, bonus in w.shown_bonus}
    hits_ground = unit.weapon_against("ground") is not None or not weapons
    return hits_ground, hits_air, tuple(sorted(bonuses.items()))
