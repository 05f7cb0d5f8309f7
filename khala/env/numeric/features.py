"""Observations, states and available actions, as SMAC defines them, for all agents at once.

Every number is computed from the same values in the same order of operations as in SMAC, in 64 bits, and then rounded
to the 32 bits of an observation or a state. Above: `khala.env.numeric.starcraft2`. Below: `khala.env.numeric.forces`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple, Self

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from khala.env.numeric.forces import Force, OwnForce
    from khala.env.numeric.maps import SmacMap
    from khala.env.numeric.options import Options
    from khala_simulator.battle import BattleGround

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Floats32 = NDArray[np.float32]

SHOOT_RANGE: Final = 6
SIGHT_RANGE: Final = 9
NO_OP, STOP, FIRST_MOVE, FIRST_TARGET = 0, 1, 2, 6
MOVES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
"""North, south, east and west: the actions from `FIRST_MOVE` on."""
_MOVES: Final = np.array(MOVES).T[:, None]
PATHING_POINTS: Final = ((0, 2), (0, -2), (2, 0), (-2, 0), (1, 1), (-1, -1), (1, -1), (-1, 1))
"""Points of an observation around a unit, in lengths of a move."""
HEIGHT_POINTS: Final = (*PATHING_POINTS, (0, 0))


class Board(NamedTuple):
    """The map, in the grids of SMAC, with a margin around them that is wide enough for what agents see of it."""

    size: tuple[int, int]
    extent: tuple[int, int]
    """Width and height of the playable part."""
    margin: int
    open: Bools
    """By x, y: where units can walk; nowhere off the map."""
    walkable: Floats
    """The same for observations: 1 off the map."""
    height: Floats
    """0 to 1; 1 off the map."""

    @classmethod
    def of(cls, ground: BattleGround, move_amount: float) -> Self:
        """Return the board of a map.

        SMAC reads heights from the north where the game writes them from the south; its observations are so.
        """
        x0, y0, x1, y1 = ground.playable
        margin = math.ceil(2 * move_amount) + 1
        walkable = ground.walkable.T
        height = np.flip(ground.height.T, 1) / 255
        around = np.pad(walkable.astype(np.float64), margin, constant_values=1.0)
        heights = np.pad(height, margin, constant_values=1.0)
        return cls(ground.size, (x1 - x0, y1 - y0), margin, np.pad(walkable, margin), around, heights)


class BattleScene:
    """A battle at one moment: what all agents may do and see, and the state."""

    def __init__(self, spec: SmacMap, options: Options, board: Board, own: OwnForce, enemy: Force) -> None:
        self._spec, self._options, self._board, self._own, self._enemy = spec, options, board, own, enemy
        places = np.concatenate((own.now.numbers[:2], enemy.now.numbers[:2]), axis=1)
        self._way = places[:, None] - places[:, : len(own), None]  # [2, agents, agents + enemies]
        self._distance = np.hypot(*self._way)
        self._alive = np.concatenate((own.alive, enemy.alive))
        self._seen = self._alive & (self._distance < SIGHT_RANGE)
        self.masks = self._masks()

    # actions ------------------------------------------------------------------------------------------------------

    def _masks(self) -> Bools:
        """Return [agents, actions] which actions each agent may take."""
        own = self._own
        board = self._board
        agents = len(self._own)
        masks = np.zeros((agents, FIRST_TARGET + self._spec.enemies), dtype=np.bool_)
        masks[:, STOP] = True
        points = own.now.numbers[:2, :, None] + _MOVES * (self._options.move_amount / 2)
        x, y = points.astype(np.int64) + board.margin
        masks[:, FIRST_MOVE:FIRST_TARGET] = board.open[x, y]
        reach = self._alive & (self._distance <= SHOOT_RANGE)
        masks[:, FIRST_TARGET:] = reach[:, agents:]
        if own.heals.any():
            masks[own.heals, FIRST_TARGET:] = False
            masks[own.heals, FIRST_TARGET : FIRST_TARGET + agents] = reach[own.heals, :agents] & ~own.heals
        masks[~own.alive] = False
        masks[~own.alive, NO_OP] = True
        return masks

    # observations -------------------------------------------------------------------------------------------------

    def observations(self, last_action: Floats, progress: float) -> Floats32:
        """Return [agents, size] what each agent sees.

        Args:
            last_action: [agents, actions] one-hot.
            progress: part of the episode that is over.
        """
        own = self._own
        agents = len(self._own)
        others = ~np.eye(agents, dtype=np.bool_)
        first = self.masks[:, FIRST_TARGET:]
        parts = [
            *self._moves(),
            self._features(slice(agents, None), first, self._vitals(self._enemy)).reshape(agents, -1),
            self._features(slice(agents), 1.0, self._ally_rows(last_action))[others].reshape(agents, -1),
            self._self(),
        ]
        if self._options.obs_timestep_number:
            parts.append(np.zeros((agents, 1)))  # the size of SMAC's own part counts it, too
        whole = np.concatenate(parts, axis=1, dtype=np.float32)
        whole[~own.alive] = 0.0
        if self._options.obs_timestep_number:
            whole = np.concatenate((whole, np.full((agents, 1), progress, dtype=np.float32)), axis=1)
        return whole

    def _moves(self) -> Iterator[Floats]:
        yield self.masks[:, FIRST_MOVE:FIRST_TARGET].astype(np.float64)
        if self._options.obs_pathing_grid:
            yield self._around(self._board.walkable, PATHING_POINTS)
        if self._options.obs_terrain_height:
            yield self._around(self._board.height, HEIGHT_POINTS)

    def _around(self, grid: Floats, points: tuple[tuple[int, int], ...]) -> Floats:
        """Return [agents, points] the values of a grid around each agent."""
        places = self._own.now.numbers[:2, :, None].astype(np.int64)
        far = np.array(points).T[:, None] * self._options.move_amount
        x, y = (places + far).astype(np.int64) + self._board.margin
        around: Floats = grid[x, y]
        return around

    def _features(self, whom: slice, first: Bools | float, rows: Floats) -> Floats:
        """Return [agents, others, features] what agents see of others; zeros of what they do not see."""
        seen, way = self._seen[:, whom], self._way[:, :, whom]
        features = np.empty((*seen.shape, 4 + rows.shape[1]))
        features[:, :, 0] = first
        features[:, :, 1] = self._distance[:, whom] / SIGHT_RANGE
        features[:, :, 2] = way[0] / SIGHT_RANGE
        features[:, :, 3] = way[1] / SIGHT_RANGE
        features[:, :, 4:] = rows
        features[~seen] = 0.0
        return features

    def _vitals(self, force: Force) -> Floats:
        """Return [units, features] health, shields and type of each, as far as observations have them."""
        return self._columns(force, health=self._options.obs_all_health)

    def _ally_rows(self, last_action: Floats) -> Floats:
        rows = self._vitals(self._own)
        return np.concatenate((rows, last_action), axis=1) if self._options.obs_last_action else rows

    def _self(self) -> Floats:
        return self._columns(self._own, health=self._options.own_health)

    def _columns(self, force: Force, *, health: bool) -> Floats:
        if not health:
            return force.types
        parts = [(force.life / force.now.life_max)[:, None], *self._shields(force), force.types]
        return np.concatenate(parts, axis=1)

    def _shields(self, force: Force) -> Iterator[Floats]:
        if self._spec.races[force is self._enemy] == "P":
            yield (force.now.shields / force.most_shields)[:, None]

    # state --------------------------------------------------------------------------------------------------------

    def state(self, last_action: Floats, progress: float) -> Floats32:
        """Return [size] what is true, for training alone; arguments as in `observations`."""
        if self._options.obs_instead_of_state:
            return self.observations(last_action, progress).ravel()
        allies, enemies = self.state_parts()
        parts = [allies.ravel(), enemies.ravel()]
        if self._options.state_last_action:
            parts.append(last_action.ravel())
        if self._options.state_timestep_number:
            parts.append(np.array([progress]))
        return np.concatenate(parts).astype(np.float32)

    def state_parts(self) -> tuple[Floats, Floats]:
        """Return [agents, features] and [enemies, features] of the state."""
        own = self._own
        return self._state_of(own, (own.charge / own.most_cooldown)[:, None]), self._state_of(self._enemy)

    def _state_of(self, force: Force, *charge: Floats) -> Floats:
        middle = np.array(self._board.size)[:, None] / 2
        extent = np.array(self._board.extent)[:, None]
        places = (force.now.numbers[:2] - middle) / extent
        health = (force.life / force.now.life_max)[:, None]
        whole = np.concatenate((health, *charge, places.T, *self._shields(force), force.types), axis=1)
        whole[~force.alive] = 0.0
        return whole

    def in_sight(self) -> Bools:
        """Return [agents, agents + enemies] which units each agent sees; nobody sees itself."""
        seen: Bools = self._seen & self._own.alive[:, None]
        np.fill_diagonal(seen, val=False)
        return seen
