"""The conventions of PufferLib and of EnvPool for many battles at once, without their packages.

Thin: both pass arrays on. PettingZoo's parallel environments are `khala_sc2.env.numeric.parallel`. Below:
`khala_sc2.env.numeric.vector`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from khala_sc2.env.numeric.spaces import values
from khala_sc2.env.numeric.vector import NumericVectorEnv

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Floats32 = NDArray[np.float32]
    Bools = NDArray[np.bool_]


class PufferBattles:
    """Battles as PufferLib's native environments are: a row for each agent, written into buffers of the trainer.

    An episode begins in the step in which the one before ends. PufferLib has no masks of actions: `action_masks` has
    them, and an action that is not available is replaced by stop. Each agent gets the reward of its team.

    Attributes:
        observations: [rows, size] float32.
        rewards: [rows] float32.
        terminals: [rows] bool.
        truncations: [rows] bool.
        masks: [rows] bool, which rows count: all of them.
        actions: [rows] int32, those of the last step.
    """

    def __init__(
        self,
        map_name: str = "3m",
        num_envs: int = 8,
        *,
        threads: int = 1,
        buf: Mapping[str, Any] | None = None,
        seed: int = 0,
        **options: Any,
    ) -> None:
        """Take a map.

        Args:
            map_name: one of SMAC's 23 maps.
            num_envs: how many battles.
            threads: as in `khala_sc2.env.numeric.vector_env`.
            buf: the trainer's arrays, by the names of the attributes.
            seed: of `reset` without one.
            **options: see `khala_sc2.env.numeric.options.Options`.
        """
        self._battles = NumericVectorEnv(
            map_name,
            num_envs,
            threads=threads,
            autoreset_mode=AutoresetMode.SAME_STEP,
            buffers=None,
            max_cycles=None,
            options=options,
        )
        arrays = self._battles.shares.arrays
        agents, size = arrays["observation"].shape[1:]
        self.agents_per_battle = agents
        self.num_agents = rows = num_envs * agents
        self.agents_per_batch = rows
        self.agent_ids = np.arange(rows)
        self.emulated = None
        self.done = False
        self.single_observation_space = values(size)
        self.single_action_space = spaces.Discrete(arrays["action_mask"].shape[2])
        self.observation_space = batch_space(self.single_observation_space, rows)
        self.action_space = batch_space(self.single_action_space, rows)
        given = buf or {}
        self.observations = given.get("observations", np.zeros((rows, size), dtype=np.float32))
        self.rewards = given.get("rewards", np.zeros(rows, dtype=np.float32))
        self.terminals = given.get("terminals", np.zeros(rows, dtype=np.bool_))
        self.truncations = given.get("truncations", np.zeros(rows, dtype=np.bool_))
        self.masks = given.get("masks", np.ones(rows, dtype=np.bool_))
        self.actions = given.get("actions", np.zeros(rows, dtype=np.int32))
        self._seed = seed
        self._begun = False

    @property
    def driver_env(self) -> PufferBattles:
        """Return what has the spaces: itself."""
        return self

    @property
    def num_envs(self) -> int:
        """How many environments PufferLib counts: this one."""
        return 1

    @property
    def action_masks(self) -> Bools:
        """[rows, actions] which actions are available."""
        mask = self._battles.shares.arrays["action_mask"]
        available: Bools = mask.reshape(self.num_agents, -1).view(np.bool_)
        return available

    def reset(self, seed: int | None = None) -> tuple[Any, list[dict[str, Any]]]:
        """Begin all battles."""
        self.async_reset(seed)
        observations, _, _, _, infos, *_ = self.recv()
        return observations, infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, list[dict[str, Any]]]:
        """Play a step of each battle; an info for each battle that ended."""
        self.send(actions)
        observations, rewards, terminals, truncations, infos, *_ = self.recv()
        return observations, rewards, terminals, truncations, infos

    def async_reset(self, seed: int | None = None) -> None:
        """Begin all battles; `recv` has their first observations."""
        self._battles.reset(seed=self._seed if seed is None else seed)
        self._begun = True

    def send(self, actions: Any) -> None:
        """Begin a step."""
        self.actions[:] = np.asarray(actions).ravel()
        self._battles.send(self.actions)

    def recv(self) -> tuple[Any, Any, Any, Any, list[dict[str, Any]], Any, Any]:
        """Wait for the step; return what `step` returns, the ids of the agents, and which of them count."""
        if self._begun:
            self._begun = False
        else:
            self._battles.wait()
        arrays = self._battles.shares.arrays
        agents = self.agents_per_battle
        self.observations[:] = arrays["observation"].reshape(self.num_agents, -1)
        self.rewards[:] = np.repeat(arrays["reward"], agents)
        self.terminals[:] = np.repeat(arrays["terminated"], agents)
        self.truncations[:] = np.repeat(arrays["truncated"], agents)
        infos = [
            {name: arrays[name][row].item() for name in ("battle_won", "dead_allies", "dead_enemies")}
            for row in np.flatnonzero(arrays["terminated"] | arrays["truncated"]).tolist()
        ]
        return (
            self.observations, self.rewards, self.terminals, self.truncations, infos, self.agent_ids,
            np.ones(self.num_agents, dtype=np.bool_),
        )  # fmt: skip

    def close(self) -> None:
        """Forget the games."""
        self._battles.close()


class EnvPoolBattles:
    """Battles as EnvPool has them: `send` and `recv` of a batch, or `step` of all of them.

    The worker processes are the batches: `recv` returns the rows of the one that is done first, and
    `info["env_id"]` says which these are. With one thread it returns all rows. The step after the end of an episode
    begins the next one.
    """

    def __init__(
        self, map_name: str = "3m", num_envs: int = 8, *, num_threads: int = 1, seed: int = 42, **options: Any
    ):
        """Take a map; `seed` is that of the first battle, the others have the following numbers."""
        self._battles = NumericVectorEnv(
            map_name,
            num_envs,
            threads=num_threads,
            autoreset_mode=AutoresetMode.NEXT_STEP,
            buffers=None,
            max_cycles=None,
            options=options,
        )
        self._seeds: list[int | None] = [seed + number for number in range(num_envs)]
        self._asked: list[int] = []
        shares = self._battles.shares
        self.observation_space = self._battles.single_observation_space
        self.action_space = self._battles.single_action_space
        self.all_env_ids = np.arange(num_envs)
        self.config = {
            "num_envs": num_envs,
            "batch_size": max(rows.stop - rows.start for rows, _ in shares.parts),
            "num_threads": len(shares.parts),
            "seed": seed,
            "max_num_players": shares.arrays["action"].shape[1],
        }

    def __len__(self) -> int:
        """Return how many battles there are."""
        return len(self.all_env_ids)

    def async_reset(self) -> None:
        """Begin all battles: the first time new games, which then go on."""
        for part, (rows, share) in enumerate(self._battles.shares.parts):
            share.begin(self._seeds[rows])
            self._asked.append(part)
        self._seeds = [None] * len(self)

    def reset(self) -> tuple[Floats32, dict[str, Any]]:
        """Begin all battles, and return what agents see."""
        self.async_reset()
        observations, _, _, _, info = self._all()
        return observations, info

    def send(self, action: Any, env_id: Any = None) -> None:
        """Begin a step of some battles: of all, or of those that `recv` has returned."""
        shares = self._battles.shares
        ids = self.all_env_ids if env_id is None else np.asarray(env_id)
        shares.arrays["action"][ids] = np.asarray(action).reshape(len(ids), -1)
        for part, (rows, share) in enumerate(shares.parts):
            named = (ids >= rows.start) & (ids < rows.stop)
            if not named.any():
                continue
            if named.sum() != rows.stop - rows.start or part in self._asked:
                raise ValueError(f"env_id {ids.tolist()} must be what recv() has returned: whole batches, each once")
            share.step()
            self._asked.append(part)

    def recv(self) -> tuple[Floats32, NDArray[np.float64], Bools, Bools, dict[str, Any]]:
        """Wait for a batch of those that were sent or reset, the one that is done first."""
        if not self._asked:
            raise RuntimeError("there is nothing to wait for: call async_reset() or send() first")
        shares = self._battles.shares
        part = shares.first_done(self._asked)
        self._asked.remove(part)
        rows, share = shares.parts[part]
        share.wait()
        return self._rows(rows)

    def step(
        self, action: Any, env_id: Any = None
    ) -> tuple[Floats32, NDArray[np.float64], Bools, Bools, dict[str, Any]]:
        """Play a step of some battles, and return what became of them, in the order of their ids."""
        self.send(action, env_id)
        return self._all()

    def close(self) -> None:
        """Forget the games."""
        self._battles.close()

    def _all(self) -> tuple[Floats32, NDArray[np.float64], Bools, Bools, dict[str, Any]]:
        parts = self._battles.shares.parts
        asked = sorted(self._asked)
        for part in asked:
            parts[part][1].wait()
        self._asked = []
        return self._rows(np.concatenate([self.all_env_ids[parts[part][0]] for part in asked]))

    def _rows(self, rows: Any) -> tuple[Floats32, NDArray[np.float64], Bools, Bools, dict[str, Any]]:
        arrays = {name: array[rows].copy() for name, array in self._battles.shares.arrays.items()}
        ids = self.all_env_ids[rows]
        agents = arrays["action"].shape[1]
        info = {name: arrays[name] for name in ("action_mask", "state", "battle_won", "dead_allies", "dead_enemies")}
        info |= {"env_id": ids, "elapsed_step": arrays["elapsed"], "players": {"env_id": np.repeat(ids, agents)}}
        return arrays["observation"], arrays["reward"], arrays["terminated"], arrays["truncated"], info
