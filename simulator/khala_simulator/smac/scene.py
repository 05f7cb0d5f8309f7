"""What the agents of a battle may do and see, and its state, as SMAC defines them.

Every number is computed from the same values in the same order of operations as in SMAC, in 64 bits, and then rounded
to the 32 bits of an observation or a state. Results go into arrays of the caller, whose memory must be contiguous.

The parts of an observation, in this order: the four moves; the surroundings; each enemy; each ally; the agent itself;
the time. Above: `khala_sc2.env.numeric`. Below: `fighters`, `board`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from khala_simulator.api.vital_rows import COOLDOWN, ENERGY, LIFE_MAX, SHIELDS
from khala_simulator.native import memory
from khala_simulator.smac.rules import (
    FIRST_MOVE,
    FIRST_TARGET,
    HEIGHT_POINTS,
    NO_OP,
    NOTHING,
    PATHING_POINTS,
    SHOOT_RANGE,
    SIGHT_RANGE,
    STOP,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.native.memory import Cells
    from khala_simulator.smac.board import Board
    from khala_simulator.smac.fighters import Fighters
    from khala_simulator.world.world import World


class SceneLayout(NamedTuple):
    """What observations and states of a battle consist of; see `khala_sc2.env.numeric.options` for each."""

    actions: int
    """How many an agent has."""
    move_amount: float
    own_shields: bool
    """Whether the agents' race has shields."""
    enemy_shields: bool
    obs_all_health: bool
    obs_own_health: bool
    obs_last_action: bool
    obs_pathing_grid: bool
    obs_terrain_height: bool
    obs_timestep_number: bool
    obs_instead_of_state: bool
    state_last_action: bool
    state_timestep_number: bool


class BattleScene:
    """A battle at one moment; `look` after each step.

    Attributes:
        layout: as given.
        masks: (agents, actions) which actions each agent may take.
        seen: (agents, n) which units each agent would see if it lived.
        last: (agents,) the action that each agent took last, or `NOTHING`.
    """

    def __init__(self, layout: SceneLayout, board: Board, fighters: Fighters) -> None:
        """Take the units of an episode that begins."""
        self.layout, self.board, self.fighters = layout, board, fighters
        self.masks = np.zeros((fighters.agents, layout.actions), dtype=np.bool_)
        self.seen = np.zeros((fighters.agents, fighters.count), dtype=np.bool_)
        self.last = np.full(fighters.agents, NOTHING, dtype=np.int64)
        self._arrays = (
            memory.new_floats(fighters.agents * fighters.count),
            np.ascontiguousarray(board.open),
            np.ascontiguousarray(board.walkable),
            np.ascontiguousarray(board.height),
        )
        self.n = fighters.count
        self.agents = fighters.agents
        self.actions = layout.actions
        self.move_amount = layout.move_amount
        self.margin: int = board.margin
        self.rows: int = board.open.shape[1]
        self.own_shields = layout.own_shields
        self.enemy_shields = layout.enemy_shields
        self.all_health = layout.obs_all_health
        self.own_health = layout.obs_own_health
        self.shows_last = layout.obs_last_action
        self.timed = layout.obs_timestep_number
        self.shows_paths = layout.obs_pathing_grid
        self.shows_heights = layout.obs_terrain_height
        self.middle_x, self.middle_y = board.size[0] / 2, board.size[1] / 2
        self.wide, self.high = board.extent
        self._bind()

    def _bind(self) -> None:
        self.can = memory.bools(self.masks)
        self.sees = memory.bools(self.seen)
        self.chosen = memory.ints(self.last)
        self.distances = memory.floats(self._arrays[0])
        self.open = memory.bools(self._arrays[1])
        self.walkable = memory.floats(self._arrays[2])
        self.heights = memory.floats(self._arrays[3])

    def __reduce__(self) -> tuple[type[BattleScene], tuple[Any, ...], tuple[Any, ...]]:
        """Return what makes a copy."""
        return BattleScene, (self.layout, self.board, self.fighters), (self.masks, self.seen, self.last, self._arrays)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Take what was seen last."""
        self.masks, self.seen, self.last, self._arrays = state
        self._bind()

    def look(self) -> None:
        """Measure the battle as the fighters are now, and write which actions the agents may take."""
        f = self.fighters
        x = f.cells
        for agent in range(self.agents):
            for unit in range(self.n):
                across = x[unit] - x[agent]
                along = x[self.n + unit] - x[self.n + agent]
                distance = memory.distance(across, along)
                self.distances[agent * self.n + unit] = distance
                self.sees[agent * self.n + unit] = f.lives[unit] and distance < SIGHT_RANGE
            self._allow(agent)

    # actions ------------------------------------------------------------------------------------------------------

    def _allow(self, agent: int) -> None:
        """Write which actions an agent may take."""
        f = self.fighters
        first = agent * self.actions
        for action in range(self.actions):
            self.can[first + action] = False
        if not f.lives[agent]:
            self.can[first + NO_OP] = True
            return
        self.can[first + STOP] = True
        half = self.move_amount / 2
        x = f.cells[agent]
        y = f.cells[self.n + agent]
        self.can[first + FIRST_MOVE] = self.open[self._cell(x, y + half)]
        self.can[first + FIRST_MOVE + 1] = self.open[self._cell(x, y - half)]
        self.can[first + FIRST_MOVE + 2] = self.open[self._cell(x + half, y)]
        self.can[first + FIRST_MOVE + 3] = self.open[self._cell(x - half, y)]
        heals = f.heals[agent]
        unit = 0 if heals else self.agents
        last = self.agents if heals else self.n
        target = first + FIRST_TARGET
        while unit < last:
            near = self.distances[agent * self.n + unit] <= SHOOT_RANGE
            self.can[target] = near and f.lives[unit] and not (heals and f.heals[unit])
            unit += 1
            target += 1

    def _cell(self, x: float, y: float) -> int:
        """Return the cell of a grid with a margin at a point, whose fraction is cut off."""
        column = int(x)
        row = int(y)
        return (column + self.margin) * self.rows + row + self.margin

    def choose(self, actions: Cells) -> None:
        """Take actions as the last ones, with stop in place of each that is not available, and nothing for the dead."""
        for agent in range(self.agents):
            action = actions[agent]
            if self.can[agent * self.actions + NO_OP]:
                action = NO_OP
            elif not (0 <= action < self.actions and self.can[agent * self.actions + action]):
                action = STOP
            self.chosen[agent] = action

    def take(self, actions: NDArray[np.int64]) -> None:
        """Do as `choose`, of an array (agents,)."""
        self.choose(memory.ints(actions))

    def see(self, world: World, types: Types) -> None:
        """Take in what has become of the units in a step, and look at the battle."""
        self.fighters.look(world, types)
        self.look()

    # observations -------------------------------------------------------------------------------------------------

    def show(
        self, observations: NDArray[np.float32], state: NDArray[np.float32], masks: NDArray[np.int8], progress: float
    ) -> None:
        """Do as `observe` and `describe`, and write (agents, actions) 1 for each action that an agent may take."""
        self.observe(observations, progress)
        self.describe(state, progress)
        cells = memory.uint8s(masks)  # type: ignore[arg-type]  # 0 and 1 are the same in both
        for i in range(self.agents * self.actions):
            cells[i] = self.can[i]

    def observe(self, out: NDArray[np.float32], progress: float) -> None:
        """Write (agents, size) what each agent sees; `progress` is the part of the episode that is over."""
        cells = memory.float32s(out)
        size = out.size // self.agents  # of an agent
        total = out.size
        for i in range(total):
            cells[i] = 0.0
        for agent in range(self.agents):
            if self.fighters.lives[agent]:
                self._observe(cells, agent * size, agent)
            if self.timed:
                cells[(agent + 1) * size - 1] = progress

    def _observe(self, cells: Cells, at: int, agent: int) -> None:
        """Write from an index on what a living agent sees."""
        for action in range(FIRST_MOVE, FIRST_TARGET):
            cells[at] = self.can[agent * self.actions + action]
            at += 1
        at = self._surround(cells, at, agent)
        for enemy in range(self.agents, self.n):
            target = FIRST_TARGET + enemy - self.agents
            first = self.can[agent * self.actions + target]
            at = self._see(cells, at, agent, enemy, first, self.enemy_shields, False)
        for ally in range(self.agents):
            if ally != agent:
                at = self._see(cells, at, agent, ally, True, self.own_shields, self.shows_last)
        self._vitals(cells, at, agent, self.own_health, self.own_shields)

    def _surround(self, cells: Cells, at: int, agent: int) -> int:
        """Write what is around an agent, as far as observations have it; return the next index."""
        if self.shows_paths:
            for across, along in PATHING_POINTS:
                cells[at] = self.walkable[self._around(agent, across, along)]
                at += 1
        if self.shows_heights:
            for across, along in HEIGHT_POINTS:
                cells[at] = self.heights[self._around(agent, across, along)]
                at += 1
        return at

    def _around(self, agent: int, across: float, along: float) -> int:
        x = int(self.fighters.cells[agent])
        y = int(self.fighters.cells[self.n + agent])
        return self._cell(x + across * self.move_amount, y + along * self.move_amount)

    def _see(self, cells: Cells, at: int, agent: int, unit: int, first: bool, shields: bool, acts: bool) -> int:
        """Write what an agent sees of another unit, nothing if that is not in sight; return the next index."""
        f = self.fighters
        pair = agent * self.n + unit
        if not self.sees[pair]:
            return at + 4 + f.bits + self.all_health * (1 + shields) + acts * self.actions
        cells[at] = first
        cells[at + 1] = self.distances[pair] / SIGHT_RANGE
        cells[at + 2] = (f.cells[unit] - f.cells[agent]) / SIGHT_RANGE
        cells[at + 3] = (f.cells[self.n + unit] - f.cells[self.n + agent]) / SIGHT_RANGE
        at = self._vitals(cells, at + 4, unit, self.all_health, shields)
        if acts:
            if self.chosen[unit] >= 0:
                cells[at + self.chosen[unit]] = 1.0
            at += self.actions
        return at

    def _vitals(self, cells: Cells, at: int, unit: int, health: bool, shields: bool) -> int:
        """Write health, shields and type of a unit, as far as observations have them; return the next index."""
        f = self.fighters
        if health:
            cells[at] = f.health[unit] / f.cells[LIFE_MAX * self.n + unit]
            at += 1
            if shields:
                cells[at] = f.cells[SHIELDS * self.n + unit] / f.shields_by[unit]
                at += 1
        for bit in range(f.bits):
            cells[at + bit] = f.codes[unit * f.bits + bit]
        return at + f.bits

    # state --------------------------------------------------------------------------------------------------------

    def describe(self, out: NDArray[np.float32], progress: float) -> None:
        """Write (size,) the state, for training alone; `progress` as in `observe`."""
        layout = self.layout
        if layout.obs_instead_of_state:
            self.observe(out, progress)
            return
        cells = memory.float32s(out)
        parts = self._units()
        numbers = memory.floats(parts)
        at = 0
        for i in range(len(parts)):
            cells[at] = numbers[i]
            at += 1
        if layout.state_last_action:
            for agent in range(self.agents):
                for action in range(self.actions):
                    cells[at] = action == self.chosen[agent]
                    at += 1
        if layout.state_timestep_number:
            cells[at] = progress

    def units(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (agents, features) and (enemies, features) of the state."""
        numbers = self._units()
        own = self.agents * (4 + self.own_shields + self.fighters.bits)
        return numbers[:own].reshape(self.agents, -1), numbers[own:].reshape(self.n - self.agents, -1)

    def _units(self) -> NDArray[np.float64]:
        """Return what the state has of all units, one after the other."""
        bits = self.fighters.bits
        own = self.agents * (4 + self.own_shields + bits)
        array = memory.new_floats(own + (self.n - self.agents) * (3 + self.enemy_shields + bits))
        cells = memory.floats(array)
        at = 0
        for unit in range(self.n):
            at = self._unit(cells, at, unit)
        return array

    def _unit(self, cells: Cells, at: int, unit: int) -> int:
        """Write what the state has of a unit, zeros of a dead one; return the next index."""
        f = self.fighters
        n = self.n
        is_agent = unit < self.agents
        shields = self.own_shields if is_agent else self.enemy_shields
        end = at + 3 + is_agent + shields + f.bits
        if not f.lives[unit]:
            for i in range(at, end):
                cells[i] = 0.0
            return end
        cells[at] = f.health[unit] / f.cells[LIFE_MAX * n + unit]
        if is_agent:
            charge = f.cells[ENERGY * n + unit] if f.heals[unit] else f.cells[COOLDOWN * n + unit]
            cells[at + 1] = charge / f.charge_by[unit]
            at += 1
        cells[at + 1] = (f.cells[unit] - self.middle_x) / self.wide
        cells[at + 2] = (f.cells[n + unit] - self.middle_y) / self.high
        at += 3
        if shields:
            cells[at] = f.cells[SHIELDS * n + unit] / f.shields_by[unit]
            at += 1
        for bit in range(f.bits):
            cells[at + bit] = f.codes[unit * f.bits + bit]
        return end
