"""The units of a battle as SMAC counts them, and what a step is worth.

Agents come first and enemies after them, in the same rows for a whole episode. A dead unit has life 0 and keeps its
last place. Sums are taken in the order of the units, as SMAC takes them: numbers with fractions have another sum in
another order. Above: `scene`. Below: `khala_simulator.api.vitals`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator.api import vitals
from khala_simulator.api.vital_rows import LIFE, SHIELDS
from khala_simulator.native import memory
from khala_simulator.smac.rules import DRAW, GOES_ON, LOST, WON
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]


class Fighters:
    """Both sides of a battle; each array has a row, or in `numbers` a column, for each unit.

    Attributes:
        agents: how many of the units are agents.
        tag: (n,) their tags.
        type_id: (n,) the game's numbers of their types.
        numbers: (8, n) their vitals as they were last seen, see `khala_simulator.api.vitals`.
        alive: (n,) which of them live.
        life: (n,) their life; 0 of the dead.
        before: (n,) life and shields before the last step.
        died: (n,) those that died in the last step.
        types: (n, bits) SMAC's one-hot code of their types.
        most_shields: (n,) what SMAC divides their shields by.
        most_charge: (n,) what SMAC divides their cooldown, or a Medivac's energy, by.
        medivac: (n,) which of them are Medivacs.
    """

    def __init__(
        self,
        agents: int,
        tag: Ints,
        type_id: Ints,
        numbers: Floats,
        types: Floats,
        most_shields: Floats,
        most_charge: Floats,
        medivac: Bools,
    ) -> None:
        """Take units as they are at the begin of an episode, all alive; the arrays become its own."""
        self.agents = agents
        self.count = len(tag)
        self.bits: int = types.shape[1]
        self.tag, self.type_id = np.ascontiguousarray(tag), np.ascontiguousarray(type_id)
        self.numbers, self.types = np.ascontiguousarray(numbers), np.ascontiguousarray(types)
        self.most_shields, self.most_charge = most_shields, most_charge
        self.medivac = medivac
        self.alive = np.ones(self.count, dtype=np.bool_)
        self.died = np.zeros(self.count, dtype=np.bool_)
        self.life = self.numbers[LIFE].copy()
        self.before = self.numbers[LIFE] + self.numbers[SHIELDS]
        self._bind()

    def _bind(self) -> None:
        self.tags = memory.ints(self.tag)
        self.cells = memory.floats(self.numbers)
        self.lives = memory.bools(self.alive)
        self.deaths = memory.bools(self.died)
        self.health = memory.floats(self.life)
        self.past = memory.floats(self.before)
        self.codes = memory.floats(self.types)
        self.shields_by = memory.floats(self.most_shields)
        self.charge_by = memory.floats(self.most_charge)
        self.heals = memory.bools(self.medivac)

    def __reduce__(self) -> tuple[type[Fighters], tuple[Any, ...], tuple[Any, ...]]:
        """Return what makes a copy."""
        made = (
            self.agents, self.tag, self.type_id, self.numbers, self.types, self.most_shields, self.most_charge,
            self.medivac,
        )  # fmt: skip
        return Fighters, made, (self.alive, self.died, self.life, self.before)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Take what was seen since the begin of the episode."""
        self.alive, self.died, self.life, self.before = state
        self._bind()

    def look(self, world: World, types: Types) -> None:
        """Take in what has become of the units in a step."""
        reader = vitals.Reader(world, types)
        n = self.count
        for i in range(n):
            self.past[i] = self.health[i] + self.cells[SHIELDS * n + i]
            slot = reader.find(self.tags[i])
            there = self.lives[i] and slot != NOBODY
            self.deaths[i] = self.lives[i] and not there
            self.lives[i] = there
            if there:
                reader.read(slot, self.cells, n, i)
            self.health[i] = self.cells[LIFE * n + i] if there else 0.0

    # what a step is worth -----------------------------------------------------------------------------------------

    def reward(self, death_value: float, negative_scale: float, only_positive: bool) -> float:
        """Return the reward of what happened in the last step, before it is scaled and without that of the end."""
        damage = self._damage(self.agents, self.count, 1.0)
        kills = self._deaths(self.agents, self.count, death_value, 1.0)
        if only_positive:
            return abs(damage + kills)  # also what enemies have regained
        deaths = self._deaths(0, self.agents, death_value, negative_scale)
        return damage + (kills - deaths) - self._damage(0, self.agents, negative_scale)

    def _damage(self, first: int, last: int, weight: float) -> float:
        """Return what some units have lost in the last step, times a weight; nothing of those that were dead before."""
        total = 0.0
        for i in range(first, last):
            if self.deaths[i]:
                total += self.past[i] * weight
            elif self.lives[i]:
                total += (self.past[i] - self.health[i] - self.cells[SHIELDS * self.count + i]) * weight
        return total

    def _deaths(self, first: int, last: int, value: float, weight: float) -> float:
        total = 0.0
        for i in range(first, last):
            if self.deaths[i]:
                total += value * weight
        return total

    def ending(self) -> int:
        """Return how the battle ended, `GOES_ON` while it does not. Medivacs alone do not fight on."""
        heals = self.heal()
        agents = self._living(0, self.agents)
        enemies = self._living(self.agents, self.count)
        if heals and not self._living_fighters():
            return LOST
        if not agents:
            return LOST if enemies else DRAW
        return WON if not enemies or (heals and self.one_medivac()) else GOES_ON

    def heal(self) -> bool:
        """Return whether any agent is a Medivac, alive or not."""
        for i in range(self.agents):  # noqa: SIM110  # a loop that is compiled
            if self.heals[i]:
                return True
        return False

    def one_medivac(self) -> bool:
        """Return whether one Medivac is all that is left of the enemies."""
        last = -1
        for i in range(self.agents, self.count):
            if self.lives[i]:
                if last >= 0:
                    return False
                last = i
        return last >= 0 and bool(self.heals[last])

    def _living(self, first: int, last: int) -> int:
        living = 0
        for i in range(first, last):
            living += self.lives[i]
        return living

    def _living_fighters(self) -> int:
        living = 0
        for i in range(self.agents):
            if self.lives[i] and not self.heals[i]:
                living += 1
        return living

    def counts(self) -> tuple[int, int]:
        """Return how many agents and how many enemies are dead."""
        agents = self._living(0, self.agents)
        enemies = self._living(self.agents, self.count)
        return self.agents - agents, self.count - self.agents - enemies
