"""SMAC's battles as PettingZoo has them: agents that act at the same time, with a mask of their available actions.

All agents stay until the battle is over, as in SMAC: a dead one sees zeros and can do nothing. An action that is not
available is replaced: the unit stops. Above: `khala_sc2.env.numeric`. Below: `khala_sc2.env.numeric.starcraft2`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from khala_sc2.env.numeric.spaces import observation_space, state_space
from khala_sc2.env.numeric.starcraft2 import StarCraft2Env

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Seen = dict[str, NDArray[Any]]


class NumericParallelEnv(ParallelEnv[str, Any, int]):  # type: ignore[misc]  # PettingZoo has no types
    """One battle after the other. Every agent is rewarded with the team's reward.

    Attributes:
        battles: SMAC's own interface to the same game.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": ["rgb_array"], "name": "khala_smac_v0", "is_parallelizable": True, "render_fps": 3,
    }  # fmt: skip

    def __init__(
        self, map_name: str = "3m", *, max_cycles: int | None = None, render_mode: str | None = None, **options: Any
    ) -> None:
        """Take a map; see `khala_sc2.env.numeric.parallel_env`."""
        self.battles = StarCraft2Env(map_name, episode_limit=max_cycles, **options)
        self.render_mode = render_mode
        self.possible_agents = [f"agent_{number}" for number in range(self.battles.n_agents)]
        self.agents: list[str] = []
        self.state_space = state_space(self.battles)
        self.observation_spaces = {agent: observation_space(self.battles) for agent in self.possible_agents}
        self.action_spaces = {agent: spaces.Discrete(self.battles.n_actions) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of what an agent sees and may do."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Seen], dict[str, dict[str, Any]]]:
        """Begin an episode: in a new game with a seed, and without one in the game that goes on."""
        del options
        self.battles.reset(seed=seed)
        self.agents = list(self.possible_agents)
        return self._seen(), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, int]
    ) -> tuple[dict[str, Seen], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Play a step; who has no action does nothing."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        numbers = np.array([int(actions.get(agent, 0)) for agent in self.agents])
        outcome = self.battles.play(numbers)
        seen = self._seen()
        agents = self.agents
        self.agents = [] if self.battles.over else agents
        return (
            seen,
            dict.fromkeys(agents, outcome.reward),
            dict.fromkeys(agents, outcome.terminated),
            dict.fromkeys(agents, outcome.truncated),
            {agent: self.battles.info() for agent in agents},
        )

    def state(self) -> NDArray[np.float32]:
        """Return the state, for training alone."""
        return self.battles.get_state()

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the battle, [height, width, 3] RGB; None without a render mode."""
        return None if self.render_mode is None else self.battles.render(self.render_mode)

    def close(self) -> None:
        """Forget the game."""
        self.battles.close()

    def _seen(self) -> dict[str, Seen]:
        values = self.battles.observations()
        masks = self.battles.masks().astype(np.int8)
        return {
            agent: {"observation": values[number], "action_mask": masks[number]}
            for number, agent in enumerate(self.agents)
        }
