"""The units of a battle as an episode begins: in SMAC's order, with SMAC's codes of their types.

Above: `khala_sc2.env.numeric.starcraft2`. Below: `khala_simulator.battle`, `khala_simulator.smac`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.battle import ENEMY, PLAYER
from khala_simulator.smac.fighters import Fighters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_sc2.env.numeric.maps import Kind, SmacMap
    from khala_simulator.battle import Battle, Units

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

STALKER, ZEALOT, COLOSSUS = 74, 73, 4
MARAUDER, MARINE, MEDIVAC, BANELING = 51, 48, 54, 9
_OWN_TYPES: dict[Kind, tuple[str, ...]] = {
    "marines": ("marine",),
    "stalkers_and_zealots": ("stalker", "zealot"),
    "colossi_stalkers_zealots": ("colossus", "stalker", "zealot"),
    "MMM": ("marauder", "marine", "medivac"),
    "zealots": ("zealot",),
    "hydralisks": ("hydralisk",),
    "stalkers": ("stalker",),
    "colossus": ("colossus",),
    "bane": ("baneling", "zergling"),
}
"""By kind of map, the types of the agents' units in the order of their ids, which begin anywhere."""
_MOST_COOLDOWN = {
    "marine": 15, "marauder": 25, "medivac": 200, "stalker": 35, "zealot": 22, "colossus": 24, "hydralisk": 10,
    "zergling": 11, "baneling": 1,
}  # fmt: skip
"""What SMAC divides a unit's cooldown by; a Medivac's is its energy."""
OTHER_COOLDOWN = 15
"""What SMAC divides the cooldown of all others by."""
_MOST_SHIELDS = {"stalker": 80, "zealot": 50, "colossus": 150}
_ENEMY_CODES: dict[Kind, tuple[int, ...]] = {
    "stalkers_and_zealots": (ZEALOT, STALKER),
    "colossi_stalkers_zealots": (COLOSSUS, STALKER, ZEALOT),
    "bane": (BANELING,),
    "MMM": (MARAUDER, MARINE, MEDIVAC),
}
"""By kind of map, which enemy type has which place in the one-hot code; all others have the last one."""
_ENEMIES = {STALKER: "stalker", ZEALOT: "zealot", COLOSSUS: "colossus", MEDIVAC: "medivac"}
"""Types of enemies of which SMAC tells shields or Medivacs."""


def fighters_of(battle: Battle, spec: SmacMap) -> Fighters | None:
    """Return the units of both sides as they are now; None while some are not there yet.

    The agents' stand in the order of their types and places, the enemies in the order of observations.
    """
    own, enemy = battle.tags_of(PLAYER), battle.tags_of(ENEMY)
    if (len(own), len(enemy)) != (spec.agents, spec.enemies):
        return None
    _, mine = battle.look(own)
    order = np.lexsort((mine.y, mine.x, mine.type_id))
    _, units = battle.look(np.concatenate((own[order], enemy)))
    names = _names(units, spec)
    shields = [_MOST_SHIELDS.get(name, 0) for name in names]
    charges = [_MOST_COOLDOWN.get(name, OTHER_COOLDOWN) for name in names[: spec.agents]]
    charges += [OTHER_COOLDOWN] * spec.enemies
    return Fighters(
        spec.agents,
        units.tag,
        units.type_id,
        units.numbers,
        _one_hot(_places(units, spec), spec),
        np.array(shields, dtype=np.float64),
        np.array(charges, dtype=np.float64),
        np.array([name == "medivac" for name in names]),
    )


def _names(units: Units, spec: SmacMap) -> list[str]:
    """Return what SMAC calls the type of each unit; empty if it has no name for it."""
    numbers = units.type_id.tolist()
    own = numbers[: spec.agents]
    names = dict(enumerate(_OWN_TYPES[spec.kind], start=min(own)))
    return [names.get(number, "") for number in own] + [_ENEMIES.get(n, "") for n in numbers[spec.agents :]]


def _places(units: Units, spec: SmacMap) -> Ints:
    """Return the place of each unit's type in the one-hot code."""
    own, enemy = units.type_id[: spec.agents], units.type_id[spec.agents :]
    codes = _ENEMY_CODES.get(spec.kind, ())
    others = [codes.index(number) if number in codes else len(codes) for number in enemy.tolist()]
    return np.concatenate((own - own.min(), np.array(others, dtype=np.int64)))


def _one_hot(places: Ints, spec: SmacMap) -> Floats:
    types: Floats = (places[:, None] == np.arange(spec.type_bits)).astype(np.float64)
    return types
