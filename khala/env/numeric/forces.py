"""The two sides of a battle as SMAC counts them: the same rows for the whole episode, with life 0 once they are dead.

Above: `khala.env.numeric.features`, `khala.env.numeric.rewards`. Below: `khala_simulator.battle`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.battle import ENEMY, PLAYER

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala.env.numeric.maps import Kind, SmacMap
    from khala_simulator.battle import Battle, Units

    Bools = NDArray[np.bool_]
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
_MOST_SHIELDS = {"stalker": 80, "zealot": 50, "colossus": 150}
_ENEMY_CODES: dict[Kind, tuple[int, ...]] = {
    "stalkers_and_zealots": (ZEALOT, STALKER),
    "colossi_stalkers_zealots": (COLOSSUS, STALKER, ZEALOT),
    "bane": (BANELING,),
    "MMM": (MARAUDER, MARINE, MEDIVAC),
}
"""By kind of map, which enemy type has which place in the one-hot code; all others have the last one."""
_ENEMY_SHIELDS = {STALKER: 80, ZEALOT: 50, COLOSSUS: 150}


class Force:
    """One side. Columns have an entry for each unit of the beginning; a dead one keeps its last place.

    Attributes:
        now: the units as they were last seen, as `Units` has their numbers.
        alive: which of them live.
        life: their life; 0 of the dead.
        types: [n, bits] SMAC's one-hot code of their types.
        most_shields: what SMAC divides their shields by.
        before: life and shields of each before the last step.
        died: those that died in the last step.
    """

    def __init__(self, units: Units, types: Floats, most_shields: Floats) -> None:
        self.now, self.types, self.most_shields = units, types, most_shields
        self.alive: Bools = np.ones(len(units.tag), dtype=np.bool_)
        self.life: Floats = units.life.copy()
        self.before: Floats = units.life + units.shields
        self.died: Bools = ~self.alive

    def __len__(self) -> int:
        return len(self.alive)

    def take(self, there: Bools, numbers: Floats) -> None:
        """Take in which units are in the world now, and what they are like."""
        self.before = self.life + self.now.shields
        there = self.alive & there
        self.died = self.alive & ~there
        np.copyto(self.now.numbers, numbers, where=there)
        self.alive = there
        self.life = self.now.life * there

    def one_medivac(self, own: OwnForce) -> bool:
        """Return whether one Medivac is all that is left of these enemies, against a side that has some, too."""
        return bool(own.heals.any()) and self.now.type_id[self.alive].tolist() == [MEDIVAC]


class OwnForce(Force):
    """The agents' units, in the order of their types and places.

    Attributes:
        heals: which of them are Medivacs.
        most_cooldown: what SMAC divides their cooldown, or a Medivac's energy, by.
    """

    def __init__(self, units: Units, spec: SmacMap) -> None:
        first = int(units.type_id.min())
        names = dict(enumerate(_OWN_TYPES[spec.kind], start=first))
        kinds = [names.get(number, "") for number in units.type_id.tolist()]
        shields = np.array([_MOST_SHIELDS.get(name, 0) for name in kinds], dtype=np.float64)
        super().__init__(units, _one_hot(units.type_id - first, spec), shields)
        self.heals: Bools = np.array([name == "medivac" for name in kinds])
        self.most_cooldown: Floats = np.array([_MOST_COOLDOWN.get(name, 15) for name in kinds], dtype=np.float64)

    @property
    def charge(self) -> Floats:
        """Energy of the Medivacs, the cooldown of all others."""
        charge: Floats = np.where(self.heals, self.now.energy, self.now.cooldown)
        return charge


def own_force(battle: Battle, spec: SmacMap) -> OwnForce:
    """Return the agents' units as they are now."""
    _, units = battle.look(battle.tags_of(PLAYER))
    order = np.lexsort((units.y, units.x, units.type_id))
    return OwnForce(battle.look(units.tag[order])[1], spec)


def enemy_force(battle: Battle, spec: SmacMap) -> Force:
    """Return the enemies as they are now, in the order of observations."""
    _, units = battle.look(battle.tags_of(ENEMY))
    codes = _ENEMY_CODES.get(spec.kind, ())
    places = [codes.index(number) if number in codes else len(codes) for number in units.type_id.tolist()]
    shields = np.array([_ENEMY_SHIELDS.get(number, 0) for number in units.type_id.tolist()], dtype=np.float64)
    return Force(units, _one_hot(np.array(places, dtype=np.int64), spec), shields)


def look(battle: Battle, *forces: Force) -> None:
    """Have forces take in what has become of their units."""
    there, units = battle.look(np.concatenate([force.now.tag for force in forces]))
    first = 0
    for force in forces:
        last = first + len(force)
        force.take(there[first:last], units.numbers[:, first:last])
        first = last


def _one_hot(places: Ints, spec: SmacMap) -> Floats:
    types: Floats = (places[:, None] == np.arange(spec.type_bits)).astype(np.float64)
    return types
