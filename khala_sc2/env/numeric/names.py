"""The rest of the public names of SMAC's class, for code that was written for it: settings, sizes, units and the map.

Left out are names that speak with StarCraft II (`full_restart`, `save_replay`, `init_units`, `update_units`,
`renderer`), that are parts of `step` (`get_agent_action`, `get_agent_action_heuristic`, `heuristic_targets`,
`reward_battle`, `previous_ally_units`, `previous_enemy_units`, `win_counted`, `defeat_counted`), that SMAC never sets
(`last_stats`), and the numbers of types (`marine_id`): `get_unit_type_id` tells types apart.

Above: `khala_sc2.env.numeric.starcraft2`. Below: `khala_sc2.env.numeric.sizes`, `khala_simulator.smac`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from khala_sc2.env.numeric import sizes
from khala_simulator.battle import ENEMY, PLAYER
from khala_simulator.smac.rules import (
    FIRST_TARGET,
    HEIGHT_POINTS,
    MOVES,
    PATHING_POINTS,
    SHOOT_RANGE,
    SIGHT_RANGE,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala_sc2.env.numeric.maps import SmacMap
    from khala_sc2.env.numeric.options import Options
    from khala_simulator.smac.board import Board
    from khala_simulator.smac.fighters import Fighters

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]


class UnitPlace(NamedTuple):
    """Where a unit is, in world units."""

    x: float
    y: float


class SmacUnit(NamedTuple):
    """A unit as it was last seen, with the fields of a message; a dead one has health 0."""

    tag: int
    unit_type: int
    owner: int
    """1: the agents, 2: the enemies."""
    pos: UnitPlace
    health: float
    health_max: float
    shield: float
    shield_max: float
    energy: float
    weapon_cooldown: float
    """Game loops; 0 of enemies."""


class SmacNames:
    """What `StarCraft2Env` inherits. `RuntimeError`: the map or the units are asked for before the first `reset`."""

    map_name: str
    options: Options
    n_agents: int
    n_enemies: int
    n_actions: int
    n_actions_no_attack = FIRST_TARGET
    n_actions_move = len(MOVES)
    n_obs_pathing = len(PATHING_POINTS)
    n_obs_height = len(HEIGHT_POINTS)
    force_restarts = 0
    reward: float = 0
    """Of the last step."""
    _spec: SmacMap

    def __getattr__(self, name: str) -> Any:
        """Return an option by its name."""
        if name != "options" and name in type(self.options).__dataclass_fields__:
            return getattr(self.options, name)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def _units(self) -> Fighters:
        raise NotImplementedError

    def _map(self) -> Board:
        raise NotImplementedError

    def _last(self) -> NDArray[np.int64]:
        raise NotImplementedError

    # settings and sizes -------------------------------------------------------------------------------------------

    @property
    def obs_own_health(self) -> bool:
        """Whether an observation has the agent's own health."""
        return self.options.own_health

    @property
    def window_size(self) -> tuple[int, int]:
        """As given."""
        return self.options.window_size_x, self.options.window_size_y

    @property
    def map_type(self) -> str:
        """What SMAC calls the kind of map."""
        return self._spec.kind

    @property
    def unit_type_bits(self) -> int:
        """Length of the one-hot code of a unit's type."""
        return self._spec.type_bits

    @property
    def shield_bits_ally(self) -> int:
        """1 if the agents' units have shields."""
        return int(self._spec.races[0] == "P")

    @property
    def shield_bits_enemy(self) -> int:
        """1 if the enemies have shields."""
        return int(self._spec.races[1] == "P")

    @property
    def ally_state_attr_names(self) -> list[str]:
        """Names of the values that the state has of each agent."""
        return sizes.state_names(self._spec)[0]

    @property
    def enemy_state_attr_names(self) -> list[str]:
        """Names of the values that the state has of each enemy."""
        return sizes.state_names(self._spec)[1]

    def get_ally_num_attributes(self) -> int:
        """Return how many values the state has of each agent."""
        return len(self.ally_state_attr_names)

    def get_enemy_num_attributes(self) -> int:
        """Return how many values the state has of each enemy."""
        return len(self.enemy_state_attr_names)

    def get_obs_move_feats_size(self) -> int:
        """Return how many values an observation begins with: moves, paths and heights."""
        return sizes.parts(self._spec, self.options).moves

    def get_obs_enemy_feats_size(self) -> tuple[int, int]:
        """Return how many enemies an observation has, and how many values of each; they follow the moves."""
        return self.n_enemies, sizes.parts(self._spec, self.options).enemy

    def get_obs_ally_feats_size(self) -> tuple[int, int]:
        """Return how many allies an observation has, and how many values of each; they follow the enemies."""
        return self.n_agents - 1, sizes.parts(self._spec, self.options).ally

    def get_obs_own_feats_size(self) -> int:
        """Return how many values an observation has of the agent itself; they come last."""
        return sizes.parts(self._spec, self.options).own

    # units --------------------------------------------------------------------------------------------------------

    @property
    def last_action(self) -> Floats:
        """[agents, actions] one-hot; zeros before the first action."""
        codes: Floats = (self._last()[:, None] == np.arange(self.n_actions)).astype(np.float64)
        return codes

    @property
    def agents(self) -> dict[int, SmacUnit]:
        """The agents' units by their numbers."""
        return dict(enumerate(_records(self._units(), PLAYER)))

    @property
    def enemies(self) -> dict[int, SmacUnit]:
        """The enemies by their numbers."""
        return dict(enumerate(_records(self._units(), ENEMY)))

    @property
    def death_tracker_ally(self) -> Floats:
        """[agents] 1 for the dead."""
        return (~self._units().alive[: self.n_agents]).astype(np.float64)

    @property
    def death_tracker_enemy(self) -> Floats:
        """[enemies] 1 for the dead."""
        return (~self._units().alive[self.n_agents :]).astype(np.float64)

    def get_unit_by_id(self, a_id: int) -> SmacUnit:
        """Return an agent's unit."""
        return self.agents[a_id]

    def get_unit_type_id(self, unit: SmacUnit, ally: bool) -> int:  # noqa: ARG002  # as SMAC has it
        """Return the place of a unit in the one-hot code of types."""
        return int(self._units().types[self._find(unit)].argmax()) if self.unit_type_bits else 0

    def unit_max_shield(self, unit: SmacUnit) -> int | None:
        """Return what SMAC divides a unit's shields by; None if its type has none."""
        return int(self._units().most_shields[self._find(unit)]) or None

    def unit_max_cooldown(self, unit: SmacUnit) -> int:
        """Return what SMAC divides a unit's cooldown by, or a Medivac's energy."""
        return int(self._units().most_charge[self._find(unit)])

    def _find(self, unit: SmacUnit) -> int:
        tags: list[int] = self._units().tag.tolist()
        return tags.index(unit.tag)

    def only_medivac_left(self, ally: bool) -> bool:  # as SMAC has it
        """Return whether nobody of a side can fight on; of the enemy, one Medivac must be left."""
        fighters = self._units()
        if not fighters.heal():
            return False
        own = slice(self.n_agents)
        return not (fighters.alive[own] & ~fighters.medivac[own]).any() if ally else fighters.one_medivac()

    def unit_shoot_range(self, agent_id: int) -> int:  # noqa: ARG002  # as SMAC has it
        """Return how far an agent can shoot, in world units: SMAC has one range for all."""
        return SHOOT_RANGE

    def unit_sight_range(self, agent_id: int) -> int:  # noqa: ARG002  # as SMAC has it
        """Return how far an agent sees, in world units: SMAC has one range for all."""
        return SIGHT_RANGE

    # the map ------------------------------------------------------------------------------------------------------

    @property
    def map_x(self) -> int:
        """Width of the map, world units."""
        return self._map().size[0]

    @property
    def map_y(self) -> int:
        """Height of the map, world units."""
        return self._map().size[1]

    @property
    def max_distance_x(self) -> int:
        """Width of the playable part."""
        return self._map().extent[0]

    @property
    def max_distance_y(self) -> int:
        """Height of the playable part."""
        return self._map().extent[1]

    @property
    def pathing_grid(self) -> Bools:
        """[x, y] where units can walk."""
        return _within(self._map().open, self._map().margin)

    @property
    def terrain_height(self) -> Floats:
        """[x, y] 0 to 1, from the north as SMAC reads it."""
        return _within(self._map().height, self._map().margin)

    def check_bounds(self, x: float, y: float) -> bool:
        """Return whether a point is on the map."""
        return 0 <= x < self.map_x and 0 <= y < self.map_y

    def can_move(self, unit: SmacUnit, direction: int) -> bool:
        """Return whether a unit can move: 0 north, 1 south, 2 east, 3 west."""
        half = self.options.move_amount / 2
        dx, dy = MOVES[direction]
        x, y = int(unit.pos.x + dx * half), int(unit.pos.y + dy * half)
        return self.check_bounds(x, y) and bool(self.pathing_grid[x, y])

    def get_surrounding_points(
        self, unit: SmacUnit, include_self: bool = False
    ) -> list[tuple[float, float]]:  # as SMAC has it
        """Return the eight points around a unit, and then its own."""
        x, y = int(unit.pos.x), int(unit.pos.y)
        far = self.options.move_amount
        return [(x + dx * far, y + dy * far) for dx, dy in (HEIGHT_POINTS if include_self else PATHING_POINTS)]

    def get_surrounding_pathing(self, unit: SmacUnit) -> list[float]:
        """Return whether units can walk at the eight points around a unit; 1 off the map."""
        return self._values(self.pathing_grid, self.get_surrounding_points(unit))

    def get_surrounding_height(self, unit: SmacUnit) -> list[float]:
        """Return the heights of the eight points around a unit and of its own; 1 off the map."""
        return self._values(self.terrain_height, self.get_surrounding_points(unit, include_self=True))

    def _values(self, grid: NDArray[Any], points: Sequence[tuple[float, float]]) -> list[float]:
        return [grid[int(x), int(y)] if self.check_bounds(x, y) else 1 for x, y in points]

    @staticmethod
    def distance(x1: float, y1: float, x2: float, y2: float) -> float:
        """Return the distance of two points."""
        return math.hypot(x2 - x1, y2 - y1)


def _records(fighters: Fighters, owner: int) -> list[SmacUnit]:
    rows = range(fighters.agents) if owner == PLAYER else range(fighters.agents, fighters.count)
    units = []
    for row in rows:
        x, y, _, life_max, shields, shields_max, energy, cooldown = fighters.numbers[:, row].tolist()
        told = cooldown if owner == PLAYER else 0.0
        vitals = (float(fighters.life[row]), life_max, shields, shields_max, energy, told)
        tag, number = int(fighters.tag[row]), int(fighters.type_id[row])
        units.append(SmacUnit(tag, number, owner, UnitPlace(x, y), *vitals))
    return units


def _within(grid: NDArray[Any], margin: int) -> NDArray[Any]:
    return grid[margin:-margin, margin:-margin]
