"""Environments for reinforcement learning, by PettingZoo and Gymnasium; `pip install 'khala-sc2[env]'`.

env = khala_sc2.env.parallel_env("2s3z_pair")      any task in words, as its agents play it over the bus
env = khala_sc2.env.numeric.parallel_env("3m")     SMAC's maps in numbers, as fast as the simulator goes
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pettingzoo.utils import OrderEnforcingWrapper, parallel_to_aec

from khala_sc2.env.rewards import battle
from khala_sc2.env.text import TextParallelEnv

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pettingzoo import AECEnv

    from khala_bridge.task.config import TaskConfig
    from khala_sc2.env.rewards import SideReward

__all__ = ["TextParallelEnv", "env", "parallel_env"]


def parallel_env(
    task: str | TaskConfig = "2s3z_pair",
    *,
    agents: Sequence[str] | None = None,
    others: str | None = None,
    max_cycles: int | None = None,
    render_mode: str | None = None,
    reward: SideReward = battle,
    game: str = "simulator",
) -> TextParallelEnv:
    """Return a task in words, in which all agents act at the same time.

    Args:
        task: the name of a task, the path of a file, or a task.
        agents: those that are played here, with their sides if there are two: `blue/Captain`; None for all.
        others: how all others decide: a model or a policy, as `khala run --model` takes it, such as `skilled`.
        max_cycles: steps of an episode; None: as many as the task has.
        render_mode: `rgb_array`: `render()` returns a picture.
        reward: what happened since a side was asked before, as a number.
        game: `simulator`, `starcraft2`, or a directory.

    Raises:
        ConfigError: there is no such task or agent, or nobody decides for one.
    """
    return TextParallelEnv(
        task, agents=agents, others=others, max_cycles=max_cycles, render_mode=render_mode, reward=reward, game=game
    )


def env(task: str | TaskConfig = "2s3z_pair", **options: Any) -> AECEnv[str, str, str]:
    """Return a task in words, in which one agent after the other acts; arguments and errors as in `parallel_env`."""
    return OrderEnforcingWrapper(parallel_to_aec(parallel_env(task, **options)))
