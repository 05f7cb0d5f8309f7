"""SMAC's battles as Gymnasium has them: one player decides for all agents.

Above: `khala_sc2.env.numeric`. Below: `khala_sc2.env.numeric.starcraft2`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces

from khala_sc2.env.numeric.spaces import joint_space
from khala_sc2.env.numeric.starcraft2 import StarCraft2Env

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Seen = dict[str, NDArray[Any]]
    Actions = NDArray[np.int64]


class CentralEnv(gymnasium.Env[Any, Any]):
    """One battle after the other, for a player that decides for all agents at once.

    An observation has `observation` [agents, size], `action_mask` [agents, actions] and `state` [size]; an action is a
    number for each agent. One that is not available is replaced: the unit stops.

    Attributes:
        battles: SMAC's own interface to the same game.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 3}  # noqa: RUF012  # where Gymnasium looks for it

    def __init__(
        self, map_name: str = "3m", *, max_cycles: int | None = None, render_mode: str | None = None, **options: Any
    ) -> None:
        """Take a map; arguments as in `khala_sc2.env.numeric.parallel_env`."""
        self.battles = StarCraft2Env(map_name, episode_limit=max_cycles, **options)
        self.render_mode = render_mode
        self.observation_space = joint_space(self.battles)
        self.action_space = spaces.MultiDiscrete([self.battles.n_actions] * self.battles.n_agents)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, dict[str, Any]]:
        """Begin an episode: in a new game with a seed, and without one in the game that goes on."""
        super().reset(seed=seed, options=options)
        self.battles.reset(seed=seed)
        return self._seen(), {}

    def step(self, action: Actions) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Play a step."""
        outcome = self.battles.play(np.asarray(action, dtype=np.int64))
        return self._seen(), outcome.reward, outcome.terminated, outcome.truncated, self.battles.info()

    def action_masks(self) -> NDArray[np.bool_]:
        """Return [agents, actions] which actions are available."""
        return self.battles.masks()

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the battle, [height, width, 3] RGB; None without a render mode."""
        return None if self.render_mode is None else self.battles.render(self.render_mode)

    def close(self) -> None:
        """Forget the game."""
        self.battles.close()

    def _seen(self) -> Seen:
        battles = self.battles
        masks = battles.masks().astype(np.int8)
        return {"observation": battles.observations(), "action_mask": masks, "state": battles.get_state()}
