"""Many battles at once, as Gymnasium has them, on as many processor cores as wanted.

Above: `khala_sc2.env.numeric`, `khala_sc2.env.numeric.conventions`. Below: `khala_sc2.env.numeric.workers`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from khala_protocol.errors import ConfigError
from khala_sc2.env.numeric.batch import NEXT_STEP, SAME_STEP, BatchSpec, arrays_for
from khala_sc2.env.numeric.spaces import values
from khala_sc2.env.numeric.workers import Shares

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from khala_sc2.env.numeric.batch import Arrays

    Floats32 = NDArray[np.float32]
    Ints = NDArray[np.int64]
    Bools = NDArray[np.bool_]
    Stepped = tuple[Floats32, NDArray[np.float64], Bools, Bools, dict[str, Any]]

TOLD = ("action_mask", "state", "battle_won", "dead_allies", "dead_enemies")


class NumericVectorEnv(VectorEnv[Any, Any, Any]):
    """Several battles at once, each with one player for all of its agents.

    Observations are [envs, agents, size] float32, actions [envs, agents], rewards [envs] float64. An action that is not
    available is replaced: the unit stops. `info` has, with a row for each battle: `action_mask` [envs, agents, actions]
    int8, `state` [envs, size], and of the last step `battle_won`, `dead_allies` and `dead_enemies`.

    With `AutoresetMode.SAME_STEP`, `info` also has `final_obs` and `final_state`, which hold in the rows of
    `_final_obs`.
    """

    def __init__(
        self,
        map_name: str,
        num_envs: int,
        *,
        threads: int,
        autoreset_mode: AutoresetMode,
        buffers: Mapping[str, Any] | None,
        max_cycles: int | None,
        options: dict[str, Any],
    ) -> None:
        """Take a map; see `khala_sc2.env.numeric.vector_env`."""
        if num_envs < 1 or threads < 1:
            raise ConfigError(f"num_envs is {num_envs} and threads is {threads}: both are at least 1")
        if autoreset_mode is AutoresetMode.DISABLED:
            raise ConfigError(
                "autoreset_mode is DISABLED and can be NEXT_STEP or SAME_STEP: battles begin by themselves"
            )
        mode = SAME_STEP if autoreset_mode is AutoresetMode.SAME_STEP else NEXT_STEP
        spec = BatchSpec(map_name, mode, max_cycles, options)
        self._buffers = None if buffers is None else arrays_for(spec, num_envs, buffers)
        self.shares = Shares(spec, num_envs, threads)
        self.num_envs = num_envs
        self.metadata = {"autoreset_mode": autoreset_mode}
        arrays = self.shares.arrays
        actions = arrays["action_mask"].shape[2]
        self.single_observation_space = values(*arrays["observation"].shape[1:])
        self.single_action_space = spaces.MultiDiscrete([actions] * arrays["action"].shape[1])
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.closed = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin all episodes: with a seed new games, which have it and the following numbers; or a list of seeds."""
        del options
        seeds: Sequence[int | None]
        if seed is None or isinstance(seed, int | np.integer):
            seeds = [None if seed is None else int(seed) + number for number in range(self.num_envs)]
        else:
            seeds = seed
        if len(seeds) != self.num_envs:
            raise ValueError(f"there are {len(seeds)} seeds for {self.num_envs} environments")
        for rows, share in self.shares.parts:
            share.begin(seeds[rows])
        self.wait()
        told = self._told()
        return told["observation"], self._info(told)

    def step(self, actions: Any) -> Stepped:
        """Play a step of each battle."""
        self.send(actions)
        return self.receive()

    def send(self, actions: Any) -> None:
        """Begin a step of each battle, which worker processes play from now on; `receive` ends it."""
        arrays = self.shares.arrays
        arrays["action"][...] = np.asarray(actions).reshape(arrays["action"].shape)
        for _, share in self.shares.parts:
            share.step()

    def receive(self) -> Stepped:
        """Wait for the end of a step, and return what `step` returns."""
        self.wait()
        told = self._told()
        return told["observation"], told["reward"], told["terminated"], told["truncated"], self._info(told)

    def wait(self) -> None:
        """Wait for the end of a step; its numbers are in the arrays of `shares`."""
        for _, share in self.shares.parts:
            share.wait()

    def close_extras(self, **kwargs: Any) -> None:
        """Forget the games, and end the worker processes."""
        del kwargs
        self.shares.close()

    def _told(self) -> Arrays:
        """Return the caller's arrays, filled, or new ones."""
        arrays = self.shares.arrays
        if self._buffers is None:
            return {name: array.copy() for name, array in arrays.items()}
        for name, buffer in self._buffers.items():
            buffer[...] = arrays[name]
        return self._buffers

    def _info(self, told: Arrays) -> dict[str, Any]:
        info: dict[str, Any] = {name: told[name] for name in TOLD}
        if "final_observation" in told:
            info["final_obs"], info["final_state"] = told["final_observation"], told["final_state"]
            info["_final_obs"] = told["terminated"] | told["truncated"]
        return info
