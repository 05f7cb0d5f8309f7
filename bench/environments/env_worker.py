"""Battles of one kind, in a process that `env.py` starts: a line of input asks for a round.

Run by the Python of the kind: it imports nothing of the project but what it measures. Every agent takes one of its
available actions at random, which is part of the time, as it is in training.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

import numpy as np


class Batch:
    """Ours, on two worker processes."""

    def __init__(self, map_name: str, envs: int) -> None:
        from khala_sc2.env import numeric  # noqa: PLC0415  # what other kinds need not have

        self._envs: Any = numeric.vector_env(map_name, envs, threads=min(2, envs))
        self._rng = np.random.default_rng(1)
        _, info = self._envs.reset(seed=1)
        self._masks = info["action_mask"]

    def step(self) -> int:
        """Play a step of each battle, and return how many steps that was."""
        actions = (self._rng.random(self._masks.shape) * self._masks).argmax(-1)
        self._masks = self._envs.step(actions)[4]["action_mask"]
        return len(self._masks)

    def processes(self) -> list[int]:
        """Return the ids of the processes that play."""
        return [os.getpid(), *(share.process.pid for _, share in self._envs.shares.parts if hasattr(share, "process"))]

    def close(self) -> None:
        self._envs.close()


class Single(Batch):
    """Ours, one environment after the other in this process."""

    def __init__(self, map_name: str, envs: int) -> None:
        self._rng = np.random.default_rng(1)
        self._envs = [self._make(map_name, seed) for seed in range(1, envs + 1)]
        for env in self._envs:
            env.reset()

    def _make(self, map_name: str, seed: int) -> Any:
        from khala_sc2.env.numeric import StarCraft2Env  # noqa: PLC0415  # see above

        return StarCraft2Env(map_name, seed=seed)

    def _can(self, env: Any) -> Any:
        return env.masks()

    def _play(self, env: Any, actions: Any) -> bool:
        """Play a step, read what a learner reads, and return whether the battle is over."""
        over = env.step(actions)[1]
        env.get_obs(), env.get_state(), env.get_avail_actions()
        return bool(over)

    def step(self) -> int:
        for env in self._envs:
            masks = self._can(env)
            if self._play(env, (self._rng.random(masks.shape) * masks).argmax(-1)):
                env.reset()
        return len(self._envs)

    def processes(self) -> list[int]:
        return [os.getpid()]

    def close(self) -> None:
        for env in self._envs:
            env.close()


class Smac(Single):
    """SMAC's package; each environment has the simulator's server in a process of its own."""

    def _make(self, map_name: str, seed: int) -> Any:
        from smac.env import StarCraft2Env  # noqa: PLC0415  # see above

        return StarCraft2Env(map_name=map_name, seed=seed)

    def _can(self, env: Any) -> Any:
        return np.array(env.get_avail_actions())

    def _play(self, env: Any, actions: Any) -> bool:
        over = env.step(actions)[1]
        env.get_obs(), env.get_state()
        return bool(over)

    def processes(self) -> list[int]:
        games = [env._sc2_proc.pid for env in self._envs]  # noqa: SLF001  # SMAC tells it nowhere else
        return [os.getpid(), *games]


class SmacLite(Smac):
    """SMAClite, which imitates the game in Python."""

    def _make(self, map_name: str, seed: int) -> Any:
        import gymnasium  # noqa: PLC0415  # see above
        import smaclite  # noqa: F401, PLC0415  # registers its environments

        env = gymnasium.make(f"smaclite/{map_name}-v0").unwrapped
        env.reset(seed=seed)
        return env

    def _play(self, env: Any, actions: Any) -> bool:
        _, _, over, cut, _ = env.step(actions.tolist())  # with observations
        env.get_state()
        return bool(over or cut)

    def processes(self) -> list[int]:
        return [os.getpid()]


class Smax(Single):
    """SMAX of JaxMARL: other rules, compiled by XLA for all battles and 32 steps at once."""

    STEPS = 32

    def __init__(self, map_name: str, envs: int) -> None:
        import jax  # type: ignore[import-not-found]  # noqa: PLC0415  # see above
        import jax.numpy as jnp  # type: ignore[import-not-found]  # noqa: PLC0415  # see above
        from jaxmarl import make  # type: ignore[import-not-found]  # noqa: PLC0415  # see above
        from jaxmarl.environments.smax import map_name_to_scenario  # type: ignore[import-not-found]  # noqa: PLC0415  # see above

        env = make("HeuristicEnemySMAX", scenario=map_name_to_scenario(map_name))

        def one(key: Any, state: Any) -> Any:
            key, acts, steps = jax.random.split(key, 3)
            can = env.get_avail_actions(state)
            keys = dict(zip(env.agents, jax.random.split(acts, len(env.agents)), strict=True))
            chosen = {
                name: jax.random.categorical(keys[name], jnp.where(can[name] > 0, 0.0, -1e9)) for name in env.agents
            }
            seen, state, _, _, _ = env.step(steps, state, chosen)
            return key, state, sum(part.sum() for part in seen.values())

        def many(keys: Any, states: Any) -> Any:
            def body(carry: Any, _: Any) -> Any:
                keys, states, seen = jax.vmap(one)(*carry)
                return (keys, states), seen.sum()

            return jax.lax.scan(body, (keys, states), None, length=self.STEPS)

        self._count = envs
        self._keys = jax.random.split(jax.random.PRNGKey(1), envs)
        _, self._states = jax.jit(jax.vmap(env.reset))(self._keys)
        self._many = jax.jit(many)
        self.step()

    def step(self) -> int:
        (self._keys, self._states), seen = self._many(self._keys, self._states)
        seen.block_until_ready()
        return self._count * self.STEPS

    def close(self) -> None:
        return


KINDS: dict[str, Any] = {"batch": Batch, "single": Single, "smac": Smac, "smaclite": SmacLite, "smax": Smax}


def cpu_s(processes: list[int]) -> float:
    """Return the processor time that processes have used."""
    total = 0.0
    for process in processes:
        with open(f"/proc/{process}/stat") as stat:  # noqa: PTH123  # of the kernel
            fields = stat.read().rpartition(")")[2].split()
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def memory_mb(processes: list[int]) -> float:
    """Return the memory that processes have for themselves, and a share of what they have together."""
    total = 0
    for process in processes:
        with open(f"/proc/{process}/smaps_rollup") as rollup:  # noqa: PTH123  # of the kernel
            total += next(int(line.split()[1]) for line in rollup if line.startswith("Pss:"))
    return total / 1024


def work() -> None:
    """Answer each line of input, the seconds of a round, with what was played in it."""
    kind, map_name, envs = sys.argv[1:4]
    said = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what a library prints is no answer
    battles = KINDS[kind](map_name, int(envs))
    print("ready", file=said, flush=True)
    for line in sys.stdin:
        seconds = float(line)
        processes = battles.processes()
        before_s = cpu_s(processes)
        began_s = time.perf_counter()
        steps = 0
        while time.perf_counter() - began_s < seconds:
            steps += battles.step()
        took_s = time.perf_counter() - began_s
        spent_s = cpu_s(processes) - before_s
        row = {"steps": steps, "wall_s": took_s, "cpu_s": spent_s, "memory_mb": memory_mb(processes)}
        print(json.dumps(row), file=said, flush=True)
    battles.close()


if __name__ == "__main__":
    work()
