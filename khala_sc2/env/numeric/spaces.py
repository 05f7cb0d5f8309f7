"""Spaces of observations, states and actions, in Gymnasium's classes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium import spaces

if TYPE_CHECKING:
    from khala_sc2.env.numeric.starcraft2 import StarCraft2Env

LEAST: Final = -1.0
MOST: Final = 16.0
"""Of every value: places are -1 to 1, health and shields 0 to 1. SMAC divides the cooldown of a Baneling by 1, and it
has at most 13 game loops."""


def observation_space(env: StarCraft2Env) -> spaces.Dict:
    """Return the space of what one agent sees and may do."""
    return spaces.Dict(_observation(env, ()) | {"action_mask": _flags(env.n_actions)})


def joint_space(env: StarCraft2Env) -> spaces.Dict:
    """Return the space of what all agents see and may do, and of the state."""
    parts = _observation(env, (env.n_agents,))
    return spaces.Dict(parts | {"action_mask": _flags(env.n_agents, env.n_actions), "state": state_space(env)})


def state_space(env: StarCraft2Env) -> spaces.Box:
    """Return the space of the state."""
    return values(env.get_state_size())


def _observation(env: StarCraft2Env, agents: tuple[int, ...]) -> dict[str, spaces.Space[Any]]:
    return {"observation": values(*agents, env.get_obs_size() + env.options.obs_timestep_number)}


def values(*shape: int) -> spaces.Box:
    """Return the space of an array of observations or of a state."""
    return spaces.Box(LEAST, MOST, shape, np.float32)


def _flags(*shape: int) -> spaces.Box:
    return spaces.Box(0, 1, shape, np.int8)
