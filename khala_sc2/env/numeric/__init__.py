"""SMAC's battles in numbers, on the simulator in this process: observations, states, masks and rewards as SMAC's.

    env = parallel_env("3m")                       PettingZoo, all agents at once
    env = env("3m")                                PettingZoo, one agent after the other
    env = CentralEnv("3m")                         Gymnasium, one player for all agents
    env = gymnasium.make("khala_sc2.env.numeric:khala-smac/3m-v0")
    envs = vector_env("3m", 64, threads=2)         Gymnasium, many at once
    envs = PufferBattles("3m", 64, threads=2)       as PufferLib's native environments
    envs = EnvPoolBattles("3m", 64, num_threads=2)  as EnvPool's
    env = StarCraft2Env("3m")                      SMAC's own interface

All play the same game, and take SMAC's options (`khala_sc2.env.numeric.options`), such as `difficulty="A"`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
from gymnasium.vector import AutoresetMode
from pettingzoo.utils import OrderEnforcingWrapper, parallel_to_aec

from khala_sc2.env.numeric.central import CentralEnv
from khala_sc2.env.numeric.conventions import EnvPoolBattles, PufferBattles
from khala_sc2.env.numeric.maps import MAPS
from khala_sc2.env.numeric.options import Options
from khala_sc2.env.numeric.parallel import NumericParallelEnv
from khala_sc2.env.numeric.starcraft2 import StarCraft2Env
from khala_sc2.env.numeric.vector import NumericVectorEnv

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pettingzoo import AECEnv

__all__ = [
    "MAPS",
    "CentralEnv",
    "EnvPoolBattles",
    "NumericParallelEnv",
    "NumericVectorEnv",
    "Options",
    "PufferBattles",
    "StarCraft2Env",
    "env",
    "parallel_env",
    "vector_env",
]

for _name in MAPS:
    gymnasium.register(
        f"khala-smac/{_name}-v0", entry_point="khala_sc2.env.numeric:CentralEnv", kwargs={"map_name": _name}
    )


def parallel_env(
    map_name: str = "3m", *, max_cycles: int | None = None, render_mode: str | None = None, **options: Any
) -> NumericParallelEnv:
    """Return battles in which all agents act at the same time.

    Args:
        map_name: one of SMAC's 23 maps.
        max_cycles: steps of an episode; None: as many as in SMAC.
        render_mode: `rgb_array`: `render()` returns a picture.
        **options: see `khala_sc2.env.numeric.options.Options`.

    Raises:
        ConfigError: there is no such map, or an option has no such value.
    """
    return NumericParallelEnv(map_name, max_cycles=max_cycles, render_mode=render_mode, **options)


def env(map_name: str = "3m", **options: Any) -> AECEnv[str, Any, Any]:
    """Return battles in which one agent after the other is asked; arguments and errors as in `parallel_env`."""
    return OrderEnforcingWrapper(parallel_to_aec(parallel_env(map_name, **options)))


def vector_env(
    map_name: str = "3m",
    num_envs: int = 8,
    *,
    threads: int = 1,
    autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
    buffers: Mapping[str, Any] | None = None,
    max_cycles: int | None = None,
    **options: Any,
) -> NumericVectorEnv:
    """Return several battles at once. `reset(seed=1)` seeds the first with 1, the next with 2, and so on.

    Args:
        map_name: one of SMAC's 23 maps.
        num_envs: how many.
        threads: how many battles play at the same time. More than one: each of these is a process of its own, because
            the engine holds Python's lock; then the memory of all of them is shared, and no number goes through a pipe.
        autoreset_mode: when an episode begins whose predecessor is over, in Gymnasium's words.
        buffers: arrays of the caller that are written in each step, by the names of `khala_sc2.env.numeric.batch.shapes`:
            `{"observation": array, "reward": array}`. NumPy's, or what shares its memory with NumPy, such as a tensor
            of torch. Without them, each step returns new arrays.
        max_cycles: steps of an episode; None: as many as in SMAC.
        **options: see `khala_sc2.env.numeric.options.Options`.

    Raises:
        ConfigError: there is no such map, an option or a buffer is wrong.
    """
    return NumericVectorEnv(
        map_name,
        num_envs,
        threads=threads,
        autoreset_mode=autoreset_mode,
        buffers=buffers,
        max_cycles=max_cycles,
        options=options,
    )
