"""One environment that `python -m bench env` measures: it waits for a line, plays, and says how long that took.

It needs nothing of Khala for SMAClite, so that another Python can run it as a script: `env_worker.py smaclite 3m 1`.
Between two steps it reads what a learner reads: observations, the state, and which actions are available, of which it
takes one at random for each agent.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

import numpy as np


class Khala:
    """Ours, in this process."""

    def __init__(self, map_name: str, seed: int) -> None:
        from khala_sc2.env.numeric import StarCraft2Env  # noqa: PLC0415  # what other workers need not have

        self._env: Any = StarCraft2Env(map_name, seed=seed)

    def reset(self) -> None:
        self._env.reset()

    def read(self) -> Any:
        self._env.observations(), self._env.get_state()
        return self._env.masks()

    def step(self, actions: list[int]) -> bool:
        return bool(self._env.step(actions)[1])

    def cpu_s(self) -> float:
        """Return the processor time of the environment, of all of its processes."""
        return time.process_time()

    def close(self) -> None:
        self._env.close()


class Smac(Khala):
    """SMAC's package, on the simulator's server in a process of its own."""

    def __init__(self, map_name: str, seed: int) -> None:
        from smac.env import StarCraft2Env  # noqa: PLC0415  # see above

        self._env = StarCraft2Env(map_name=map_name, seed=seed)

    def read(self) -> Any:
        self._env.get_obs(), self._env.get_state()
        return np.array(self._env.get_avail_actions())

    def cpu_s(self) -> float:
        import psutil  # noqa: PLC0415  # see above

        game = psutil.Process(self._env._sc2_proc.pid).cpu_times()  # noqa: SLF001  # SMAC tells it nowhere else
        return time.process_time() + float(game.user + game.system)


class SmacLite(Khala):
    """SMAClite, which imitates the game in Python."""

    def __init__(self, map_name: str, seed: int) -> None:
        import gymnasium  # noqa: PLC0415  # see above
        import smaclite  # noqa: F401, PLC0415  # registers its environments

        self._env = gymnasium.make(f"smaclite/{map_name}-v0").unwrapped
        self._seed: int | None = seed
        self._obs: Any = None

    def reset(self) -> None:
        self._obs, _ = self._env.reset(seed=self._seed)
        self._seed = None

    def read(self) -> Any:
        self._env.get_state()
        return np.array(self._env.get_avail_actions())

    def step(self, actions: list[int]) -> bool:
        self._obs, _, over, cut, _ = self._env.step(actions)
        return bool(over or cut)


KINDS: dict[str, type[Khala]] = {"khala": Khala, "smac": Smac, "smaclite": SmacLite}


def work() -> None:
    """Make an environment, and play it for as many seconds as each line of the input says; its end is the end."""
    kind = sys.argv[1]
    map_name = sys.argv[2]
    seed = int(sys.argv[3])
    said, sys.stdout = sys.stdout, open(os.devnull, "w")  # noqa: SIM115, PTH123  # SMAClite prints
    env = KINDS[kind](map_name, seed)
    rng = np.random.default_rng(seed)
    env.reset()
    print("ready", file=said, flush=True)
    for line in sys.stdin:
        print(json.dumps(_play(env, rng, float(line))), file=said, flush=True)
    env.close()


def _play(env: Khala, rng: np.random.Generator, seconds: float) -> dict[str, float]:
    begun_s = time.perf_counter()
    cpu_s = env.cpu_s()
    steps = 0
    while time.perf_counter() - begun_s < seconds:
        over = env.step([int(rng.choice(np.flatnonzero(can))) for can in env.read()])
        steps += 1
        if over:
            env.reset()
    return {"steps": steps, "wall_s": time.perf_counter() - begun_s, "cpu_s": env.cpu_s() - cpu_s}


if __name__ == "__main__":
    work()
