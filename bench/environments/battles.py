"""The battles that a team is trained in, and those that test it. Above it: `bench.environments.train`."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode

from khala_sc2.env import numeric

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

Policy: TypeAlias = "Callable[[NDArray[Any], NDArray[np.bool_]], NDArray[np.int64]]"
"""Takes [envs, agents, size] what is seen and [envs, agents, actions] masks, and returns [envs, agents] actions."""

TEST_SEED = 1_000_000
RECENT = 200


class Sizes(NamedTuple):
    """Numbers of a map."""

    agents: int
    seen: int
    """Numbers that an agent sees."""
    state: int
    actions: int


class Learner(Protocol):
    """An algorithm with its networks."""

    def play(self, battles: Battles) -> None:
        """Play some steps of all battles, and learn."""

    def most_likely(self) -> Policy:
        """Return a policy that explores nothing, for battles that begin together."""


class Battles:
    """Battles in this process, each of which begins again in the step in which it ends.

    Attributes:
        seen, masks, states: what the agents and the critic see now.
        steps, episodes: of all battles together, so far.
        won: whether each of the last episodes was won.
    """

    def __init__(self, map_name: str, count: int, seed: int) -> None:
        self._envs = numeric.vector_env(map_name, count, autoreset_mode=AutoresetMode.SAME_STEP)
        self.seen, info = self._envs.reset(seed=seed * 1000)
        self._look(info)
        self.steps = 0
        self.episodes = 0
        self.won: deque[bool] = deque(maxlen=RECENT)
        agents, seen = self.seen.shape[1:]
        self.sizes = Sizes(agents, seen, self.states.shape[1], self.masks.shape[2])

    def step(self, actions: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Play a step of each battle; return [envs] rewards, and which episodes are over, be it by the limit."""
        self.seen, rewards, terminated, truncated, info = self._envs.step(actions)
        self._look(info)
        over: NDArray[np.bool_] = terminated | truncated
        self.steps += len(over)
        self.episodes += int(over.sum())
        self.won.extend(info["battle_won"][over].tolist())
        return rewards, over

    def _look(self, info: dict[str, Any]) -> None:
        self.masks = info["action_mask"].astype(np.bool_)
        self.states = info["state"]


def count_wins(map_name: str, policy: Policy, battles: int) -> int:
    """Return how many new battles a policy wins; they are the same battles at each call."""
    envs = numeric.vector_env(map_name, battles)
    seen, info = envs.reset(seed=TEST_SEED)
    goes_on = np.ones(battles, dtype=np.bool_)
    won = 0
    while goes_on.any():
        seen, _, terminated, truncated, info = envs.step(policy(seen, info["action_mask"].astype(np.bool_)))
        won += int(info["battle_won"][goes_on].sum())
        goes_on &= ~(terminated | truncated)
    envs.close()
    return won
