"""The units of a battle as an episode begins: in SMAC's order, with SMAC's codes of their types.

Above: `khala_sc2.env.numeric.starcraft2`. Below: `khala_simulator.battle`, `khala_simulator.smac`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.smac.fighters import Fighters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_sc2.env.numeric.maps import Kind, SmacMap
    from khala_simulator.battle import Battle

    Bools = NDArray[np.bool_]
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
    own, enemy = battle.tags()
    if (len(own), len(enemy)) != (spec.agents, spec.enemies):
        return None
    _, mine = battle.look(own)
    order = np.lexsort((mine.y, mine.x, mine.type_id))
    _, units = battle.look(np.concatenate((own[order], enemy)))
    sides = units.type_id.tolist()
    codes = _codes_of(tuple(sides[: spec.agents]), tuple(sides[spec.agents :]), spec)
    return Fighters(spec.agents, units.tag, units.type_id, units.numbers, *codes)


@lru_cache(maxsize=64)
def _codes_of(own: tuple[int, ...], enemy: tuple[int, ...], spec: SmacMap) -> tuple[Floats, Floats, Floats, Bools]:
    """Return of units of these types the one-hot codes, what shields and cooldowns are divided by, and who heals."""
    names = dict(enumerate(_OWN_TYPES[spec.kind], start=min(own)))
    called = [names.get(number, "") for number in own] + [_ENEMIES.get(number, "") for number in enemy]
    shields = [_MOST_SHIELDS.get(name, 0) for name in called]
    charges = [_MOST_COOLDOWN.get(name, OTHER_COOLDOWN) for name in called[: len(own)]]
    charges += [OTHER_COOLDOWN] * len(enemy)
    known = _ENEMY_CODES.get(spec.kind, ())
    places = [number - min(own) for number in own]
    places += [known.index(number) if number in known else len(known) for number in enemy]
    one_hot = np.array(places)[:, None] == np.arange(spec.type_bits)
    return (
        one_hot.astype(np.float64),
        np.array(shields, dtype=np.float64),
        np.array(charges, dtype=np.float64),
        np.array([name == "medivac" for name in called]),
    )
