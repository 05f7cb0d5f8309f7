"""Requirements: whether a player has what an ability needs, such as a finished structure or an upgrade.

Counts what the tables ask for; ``abilities.Need`` defines a requirement.
"""

from __future__ import annotations

import operator
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import buffs

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from khala_simulator.tables.abilities import Ability, Need
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.world import World

FINISHED, EVERYBODY = 0, 1
ALIAS: Final = "Alias_"
NATURES: Final[dict[str, Callable[[World, int], bool]]] = {
    "IsTransportOverlord": lambda world, slot: world.unit_type(slot).name == "OverlordTransport",
    "WidowMineArmed": lambda world, slot: world.unit_type(slot).name == "WidowMineBurrowed",
    "QueenMustBeOnCreep": lambda world, slot: world.on_creep(slot),
}
"""Behaviours that units have by their type or their place; they are never applied as buffs."""
COMPARE: Final[dict[str, Callable[[float, float], bool]]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip


def met(world: World, slot: int, need: Need | None) -> bool:
    """Return whether the condition holds for a unit and its owner; a player with the debug tech tree needs nothing."""
    if need is None or "tech_tree" in world.players[int(world.owner[slot])].cheats:
        return True
    return _count(world, slot, need) > 0


def missing_to_all(world: World, slot: int, ability: Ability) -> bool:
    """Return whether an ability's condition fails for a unit for a reason that all units of its owner share."""
    return any(not met(world, slot, need) for need in _shared_needs(world.catalog, ability.id))


def lacks_upgrade(world: World, player: int, ability: int) -> bool:
    """Return whether a player lacks an upgrade without which none of its units can use an ability."""
    needed = _upgrades_needed(world.catalog, ability)
    if not needed:
        return False
    owner = world.players[player]
    return "tech_tree" not in owner.cheats and not all(upgrade in owner.upgrades for upgrade in needed)


@lru_cache(maxsize=4096)
def _upgrades_needed(catalog: Catalog, ability: int) -> tuple[int, ...]:
    """Return the ids of the upgrades that are conditions of an ability by themselves."""
    names = [need.name for need in _shared_needs(catalog, ability) if need.kind == "upgrade" and need.state == "done"]
    return tuple(catalog.upgrade_of[name].id for name in names if name in catalog.upgrade_of)


@lru_cache(maxsize=4096)
def _shared_needs(catalog: Catalog, ability: int) -> tuple[Need, ...]:
    """Return the conditions of an ability that all units of a player share."""
    found = catalog.ability(ability)
    return tuple(need for need in (found.requires, found.shown_if) if need is not None and _of_the_player(need))


def _of_the_player(need: Need) -> bool:
    """Return whether a condition has the same value for all units of a player: no part looks at the unit itself."""
    itself = need.kind == "behavior" or (need.kind == "unit" and need.state.endswith("_here"))
    return not itself and all(map(_of_the_player, need.parts))


def _count(world: World, slot: int, need: Need) -> float:
    """Return the value of a condition: how many there are, or 1 and 0 for true and false."""
    return RULES[need.kind](world, slot, need)


def _all(world: World, slot: int, need: Need) -> float:
    return float(all(_count(world, slot, part) > 0 for part in need.parts))


def _any(world: World, slot: int, need: Need) -> float:
    return float(any(_count(world, slot, part) > 0 for part in need.parts))


def _not(world: World, slot: int, need: Need) -> float:
    return float(_count(world, slot, need.parts[0]) <= 0)


def _compare(world: World, slot: int, need: Need) -> float:
    left, right = (_count(world, slot, part) for part in need.parts)
    return float(COMPARE[need.name](left, right))


def _always(_: World, __: int, ___: Need) -> float:
    """Return the value of the tables' only operation, which is always true in melee games."""
    return 1.0


def _constant(_: World, __: int, need: Need) -> float:
    return need.value or 0.0


def _buffs(world: World, slot: int, need: Need) -> float:
    if need.name in NATURES:
        return float(NATURES[need.name](world, slot))
    return float(need.name in world.catalog.buff_of_name and buffs.has(world, slot, need.name))


def _upgrades(world: World, slot: int, need: Need) -> float:
    player = int(world.owner[slot])
    upgrade = world.catalog.upgrade_of.get(need.name)
    if upgrade is None:
        return 0.0
    underway = need.state.startswith("queued") and upgrade.name in world.players[player].underway
    return float(upgrade.id in world.players[player].upgrades or underway)


def _units(world: World, slot: int, need: Need) -> float:
    rows = counts_as(world.catalog, need.name.removeprefix(ALIAS), alias=need.name.startswith(ALIAS))
    player = int(world.owner[slot])
    if need.state.endswith("_here"):
        return float(world.addon[slot] >= 0 and int(world.type[world.addon[slot]]) in rows)
    counted = _tally(world)[FINISHED if need.state == "done" else EVERYBODY, player]
    found = float(sum(counted[row] for row in rows))
    if need.state.startswith("queued"):
        found += sum(world.catalog.units[row].name in world.players[player].underway for row in rows)
    return found


def _tally(world: World) -> NDArray[np.int64]:
    """Return [2, players, unit rows] each player's number of finished units, and of all units, passengers included."""
    if world.tally is None or world.tallied != world.loop:
        slots = np.flatnonzero(world.alive)
        shape = (len(world.players), len(world.catalog.units))
        kinds = world.owner[slots] * shape[1] + world.type[slots]
        finished = kinds[world.build_progress[slots] >= 1.0]
        world.tallied = world.loop
        world.tally = np.stack(
            [np.bincount(k, minlength=shape[0] * shape[1]).reshape(shape) for k in (finished, kinds)]
        )
    return world.tally


RULES: Final[dict[str, Callable[[World, int, Need], float]]] = {
    "and": _all,
    "or": _any,
    "not": _not,
    "cmp": _compare,
    "op": _always,
    "const": _constant,
    "behavior": _buffs,
    "upgrade": _upgrades,
    "unit": _units,
}


@lru_cache(maxsize=512)
def counts_as(catalog: Catalog, name: str, *, alias: bool) -> frozenset[int]:
    """Return the rows of the types that count as ``name``: its own, and with ``alias`` its substitutes."""
    own = catalog.row_of_name.get(name)
    rows = set() if own is None else {own}
    if alias:
        number = None if own is None else catalog.units[own].id
        rows |= {u.row for u in catalog.units if number is not None and number in u.tech_alias}
        rows |= {u.row for u in catalog.units if name == "TechLab" and u.name.endswith("TechLab")}
    return frozenset(rows)
