"""How long observations and states are, as SMAC counts them, and what their values are called."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_simulator.smac.rules import FIRST_TARGET, HEIGHT_POINTS, MOVES, PATHING_POINTS

if TYPE_CHECKING:
    from khala_sc2.env.numeric.maps import SmacMap
    from khala_sc2.env.numeric.options import Options


class ObservationParts(NamedTuple):
    """How many values an observation has of moves, of each enemy, of each ally, and of the agent itself."""

    moves: int
    enemy: int
    ally: int
    own: int


def actions(spec: SmacMap) -> int:
    """Return the number of actions."""
    return FIRST_TARGET + spec.enemies


def parts(spec: SmacMap, options: Options) -> ObservationParts:
    """Return the lengths of the parts of an observation."""
    own_shields, enemy_shields = (race == "P" for race in spec.races)
    around = len(PATHING_POINTS) * options.obs_pathing_grid + len(HEIGHT_POINTS) * options.obs_terrain_height
    enemy = 4 + spec.type_bits + options.obs_all_health * (1 + enemy_shields)
    ally = 4 + spec.type_bits + options.obs_all_health * (1 + own_shields) + options.obs_last_action * actions(spec)
    own = spec.type_bits + options.own_health * (1 + own_shields) + options.obs_timestep_number
    return ObservationParts(len(MOVES) + around, enemy, ally, own)


def observation(spec: SmacMap, options: Options) -> int:
    """Return the length of an observation."""
    moves, enemy, ally, own = parts(spec, options)
    return moves + spec.enemies * enemy + (spec.agents - 1) * ally + own


def seen(spec: SmacMap, options: Options) -> int:
    """Return the length of an observation as it is: SMAC does not count the time at its end."""
    return observation(spec, options) + options.obs_timestep_number


def whole_state(spec: SmacMap, options: Options) -> int:
    """Return the length of a state as it is."""
    return seen(spec, options) * spec.agents if options.obs_instead_of_state else state(spec, options)


def state(spec: SmacMap, options: Options) -> int:
    """Return the length of a state."""
    if options.obs_instead_of_state:
        return observation(spec, options) * spec.agents
    agent, enemy = map(len, state_names(spec))
    last = options.state_last_action * spec.agents * actions(spec)
    return spec.agents * agent + spec.enemies * enemy + last + options.state_timestep_number


def state_names(spec: SmacMap) -> tuple[list[str], list[str]]:
    """Return the names of the values that the state has of each agent, and of each enemy."""
    types = [f"type_{bit}" for bit in range(spec.type_bits)]
    own, enemy = ([*(["shield"] if race == "P" else []), *types] for race in spec.races)
    return ["health", "energy/cooldown", "rel_x", "rel_y", *own], ["health", "rel_x", "rel_y", *enemy]
