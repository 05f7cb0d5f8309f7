"""Abilities of the army in a fight: ``data/opponents/casts.yaml`` says which, and when."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from khala_simulator.combat import buffs
from khala_simulator.opponent import hands
from khala_simulator.opponent.build_file import Data
from khala_simulator.tables.loader import read_data
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.columns import Floats


class CastRule(Data):
    """When units of a type use an ability; the data file says what each condition means."""

    unit: str
    ability: int
    at: Literal["self", "point"]
    fighting: bool = False
    life: float = 0.0
    without: str = ""
    enemy_within: float = 0.0
    none_within: float = 0.0


def cast(side: OwnSide, enemy: Enemy) -> None:
    """Use the abilities whose conditions hold, one order for all units of a type."""
    if "casts" not in side.level.skills:
        return
    foes = _on_the_ground(side, enemy)
    for rule in rules():
        units = [slot for slot in side.of_type(rule.unit) if _holds(side, slot, rule, foes)]
        if not units:
            continue
        ability = side.world.catalog.ability(rule.ability)
        if rule.at == "self":
            hands.use(side, units, ability)
        else:
            for slot in units:
                x, y = foes[int(np.argmin(np.hypot(*(foes - side.world.pos[slot]).T)))].tolist()
                hands.use(side, [slot], ability, point=(x, y))


@lru_cache(maxsize=1)
def rules() -> tuple[CastRule, ...]:
    """Return the rules of the data file, in its order."""
    rows: list[dict[str, Any]] = read_data("opponents", "casts.yaml")["casts"]
    return tuple(CastRule.model_validate(row) for row in rows)


def _on_the_ground(side: OwnSide, enemy: Enemy) -> Floats:
    """Return (k, 2) where enemies stand that fight on the ground."""
    world = side.world
    return world.pos[[s for s in enemy.fighters.tolist() if not world.unit_type(s).flying]]


def _holds(side: OwnSide, slot: int, rule: CastRule, foes: Floats) -> bool:
    world = side.world
    if (rule.fighting and world.target[slot] == NOBODY) or world.casts[slot]:
        return False
    if rule.life and world.life[slot] < rule.life * world.life_max[slot]:
        return False
    if rule.without and buffs.has(world, slot, rule.without):
        return False
    if not (rule.enemy_within or rule.none_within):
        return True
    nearest = float(np.hypot(*(foes - world.pos[slot]).T).min()) if len(foes) else np.inf
    return nearest <= rule.enemy_within if rule.enemy_within else nearest > rule.none_within
