"""Observations, states and available actions, as SMAC defines them, for all agents at once.

Every number is computed from the same values in the same order of operations as in SMAC, in 64 bits, and then rounded
to the 32 bits of an observation or a state. Above: `khala.env.numeric.starcraft2`. Below: `khala.env.numeric.forces`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple, Self

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala.env.numeric.forces import Force, OwnForce
    from khala.env.numeric.maps import SmacMap
    from khala.env.numeric.options import Options
    from khala_simulator.battle import Ground

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Floats32 = NDArray[np.float32]

SHOOT_RANGE: Final = 6
SIGHT_RANGE: Final = 9
NO_OP, STOP, FIRST_MOVE, FIRST_TARGET = 0, 1, 2, 6
MOVES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
"""North, south, east and west: the actions from `FIRST_MOVE` on."""
_PATHING_POINTS: Final = ((0, 2), (0, -2), (2, 0), (-2, 0), (1, 1), (-1, -1), (1, -1), (-1, 1))
"""Points of an observation around a unit, in lengths of a move."""
_HEIGHT_POINTS: Final = (*_PATHING_POINTS, (0, 0))


class Board(NamedTuple):
    """The map, in the grids of SMAC."""

    size: tuple[int, int]
    extent: tuple[int, int]
    """Width and height of the playable part."""
    walkable: Bools
    """By x, y."""
    height: Floats
    """By x, y; 0 to 1."""

    @classmethod
    def of(cls, ground: Ground) -> Self:
        """Return the board of a map.

        SMAC reads heights from the north where the game writes them from the south; its observations are so.
        """
        x0, y0, x1, y1 = ground.playable
        return cls(ground.size, (x1 - x0, y1 - y0), ground.walkable.T, np.flip(ground.height.T, 1) / 255)

    def contains(self, x: Ints, y: Ints) -> Bools:
        """Return which points are on the map."""
        width, height = self.size
        inside: Bools = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        return inside

    def at(self, grid: NDArray[np.generic], x: Ints, y: Ints, outside: float) -> Floats:
        """Return the values of a grid at points, and `outside` for those that are not on the map."""
        width, height = self.size
        values = grid[np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)].astype(np.float64)
        return np.where(self.contains(x, y), values, outside)


class Scene:
    """A battle at one moment: what all agents may do and see, and the state."""

    def __init__(self, spec: SmacMap, options: Options, board: Board, own: OwnForce, enemy: Force) -> None:
        self._spec, self._options, self._board, self._own, self._enemy = spec, options, board, own, enemy
        x, y = own.now.x, own.now.y
        self._to_own = _offsets(x, y, x, y)
        self._to_enemy = _offsets(x, y, enemy.now.x, enemy.now.y)
        self.masks = self._masks()

    # actions ------------------------------------------------------------------------------------------------------

    def _masks(self) -> Bools:
        """Return [agents, actions] which actions each agent may take."""
        own, spec = self._own, self._spec
        masks = np.zeros((len(own), FIRST_TARGET + spec.enemies), dtype=np.bool_)
        masks[:, STOP] = True
        half = self._options.move_amount / 2
        for number, (dx, dy) in enumerate(MOVES, start=FIRST_MOVE):
            x, y = (own.now.x + dx * half).astype(np.int64), (own.now.y + dy * half).astype(np.int64)
            masks[:, number] = self._board.at(self._board.walkable, x, y, outside=0.0) > 0.0
        masks[:, FIRST_TARGET:] = self._enemy.alive & (self._to_enemy.distance <= SHOOT_RANGE)
        if own.heals.any():
            reach = own.alive & ~own.heals & (self._to_own.distance <= SHOOT_RANGE)
            masks[own.heals, FIRST_TARGET:] = False
            masks[own.heals, FIRST_TARGET : FIRST_TARGET + len(own)] = reach[own.heals]
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
        own, agents = self._own, len(self._own)
        others = ~np.eye(agents, dtype=np.bool_)
        allies = self._allies(last_action)[others].reshape(agents, -1)
        parts = [self._moves(), self._enemies().reshape(agents, -1), allies, self._self()]
        if self._options.obs_timestep_number:
            parts += [
                np.zeros((agents, 1)),
                np.full((agents, 1), progress),
            ]  # the size of SMAC's own part counts it, too
        whole = np.concatenate(parts, axis=1)
        whole[~own.alive, : whole.shape[1] - bool(self._options.obs_timestep_number)] = 0.0
        return whole.astype(np.float32)

    def _moves(self) -> Floats:
        parts = [self.masks[:, FIRST_MOVE:FIRST_TARGET].astype(np.float64)]
        if self._options.obs_pathing_grid:
            parts.append(self._around(self._board.walkable, _PATHING_POINTS))
        if self._options.obs_terrain_height:
            parts.append(self._around(self._board.height, _HEIGHT_POINTS))
        return np.concatenate(parts, axis=1)

    def _around(self, grid: NDArray[np.generic], points: tuple[tuple[int, int], ...]) -> Floats:
        x, y = self._own.now.x.astype(np.int64)[:, None], self._own.now.y.astype(np.int64)[:, None]
        dx, dy = np.array(points).T * self._options.move_amount
        return self._board.at(grid, (x + dx).astype(np.int64), (y + dy).astype(np.int64), outside=1.0)

    def _enemies(self) -> Floats:
        """Return [agents, enemies, features]."""
        seen = self._enemy.alive & (self._to_enemy.distance < SIGHT_RANGE)
        first = self.masks[:, FIRST_TARGET:].astype(np.float64)
        vitals = self._vitals(self._enemy, shields=self._spec.races[1] == "P")
        return _features(seen, first, self._to_enemy, vitals)

    def _allies(self, last_action: Floats) -> Floats:
        """Return [agents, agents, features]; nobody is its own ally, so the diagonal is to be left out."""
        seen = self._own.alive & (self._to_own.distance < SIGHT_RANGE)
        rows = self._vitals(self._own, shields=self._spec.races[0] == "P")
        if self._options.obs_last_action:
            rows = np.concatenate((rows, last_action), axis=1)
        return _features(seen, np.ones(seen.shape), self._to_own, rows)

    def _vitals(self, force: Force, *, shields: bool) -> Floats:
        """Return [units, features] health, shields and type of each, as far as observations have them."""
        parts = []
        if self._options.obs_all_health:
            parts.append(force.life / force.now.life_max)
            if shields:
                parts.append(force.now.shields / force.most_shields)
        parts += self._types(force)
        return np.stack(parts, axis=1) if parts else np.zeros((len(force), 0))

    def _self(self) -> Floats:
        own, parts = self._own, []
        if self._options.own_health:
            parts.append(own.life / own.now.life_max)
            if self._spec.races[0] == "P":
                parts.append(own.now.shields / own.most_shields)
        parts += self._types(own)
        return np.stack(parts, axis=1) if parts else np.zeros((len(own), 0))

    def _types(self, force: Force) -> list[Floats]:
        return [(force.code == place).astype(np.float64) for place in range(self._spec.type_bits)]

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
        own, enemy = self._own, self._enemy
        allies = self._state_of(own, own.charge / own.most_cooldown, shields=self._spec.races[0] == "P")
        return allies, self._state_of(enemy, None, shields=self._spec.races[1] == "P")

    def _state_of(self, force: Force, charge: Floats | None, *, shields: bool) -> Floats:
        (width, height), (wide, high) = self._board.size, self._board.extent
        parts = [force.life / force.now.life_max]
        if charge is not None:
            parts.append(charge)
        parts += [(force.now.x - width / 2) / wide, (force.now.y - height / 2) / high]
        if shields:
            parts.append(force.now.shields / force.most_shields)
        parts += self._types(force)
        return np.stack(parts, axis=1) * force.alive[:, None]

    def in_sight(self) -> Bools:
        """Return [agents, agents + enemies] which units each agent sees; nobody sees itself."""
        own, enemy = self._own, self._enemy
        allies = own.alive & own.alive[:, None] & (self._to_own.distance < SIGHT_RANGE)
        np.fill_diagonal(allies, val=False)
        enemies = enemy.alive & own.alive[:, None] & (self._to_enemy.distance < SIGHT_RANGE)
        return np.concatenate((allies, enemies), axis=1)


class _Offsets(NamedTuple):
    """From each unit of a group to each of another: [units, others]."""

    x: Floats
    y: Floats
    distance: Floats


def _offsets(x: Floats, y: Floats, other_x: Floats, other_y: Floats) -> _Offsets:
    dx, dy = other_x - x[:, None], other_y - y[:, None]
    return _Offsets(dx, dy, np.hypot(dx, dy))


def _features(seen: Bools, first: Floats, to: _Offsets, rows: Floats) -> Floats:
    """Return [units, others, features] of what units see of others; zeros of what they do not see."""
    places = np.stack((first, to.distance / SIGHT_RANGE, to.x / SIGHT_RANGE, to.y / SIGHT_RANGE), axis=2)
    whole = np.concatenate((places, np.broadcast_to(rows, (*seen.shape, rows.shape[1]))), axis=2)
    return np.where(seen[:, :, None], whole, 0.0)
