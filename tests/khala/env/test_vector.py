"""Many battles at once: the numbers of the single environment, to the bit, in every convention."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from khala_protocol.errors import ConfigError
from khala_sc2.env import numeric
from khala_sc2.env.numeric import MAPS, StarCraft2Env
from khala_sc2.env.numeric.workers import RemoteShare, WorkerError

if TYPE_CHECKING:
    from numpy.typing import NDArray

EPISODES = 22
"""Of each of the 23 maps: 506 in all, as `python -m bench env_parity` plays them beside SMAC's package."""
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def sample(masks: NDArray[Any], rng: np.random.Generator) -> NDArray[np.int64]:
    """Return an available action of each agent."""
    actions: NDArray[np.int64] = (rng.random(masks.shape) * masks).argmax(-1)
    return actions


class Twin:
    """A single environment that is stepped as a row of a vector is."""

    def __init__(self, map_name: str, seed: int, mode: AutoresetMode, **options: Any) -> None:
        self.env = StarCraft2Env(map_name, **options)
        self.env.reset(seed=seed)
        self.same_step = mode is AutoresetMode.SAME_STEP
        self.ended = False
        self.episodes = 0
        self.last: NDArray[np.float32] | None = None

    def step(self, actions: NDArray[np.int64]) -> tuple[float, bool]:
        """Return the reward, and whether an episode ended."""
        if self.ended:
            self.env.reset()
            self.ended = False
            return 0.0, False
        reward, over, _ = self.env.step(actions)
        self.episodes += over
        self.ended = over and not self.same_step
        if over and self.same_step:
            self.last = self.env.observations()
            self.env.reset()
        return reward, over

    def numbers(self) -> list[NDArray[Any]]:
        """Return what is seen, may be done and is true."""
        return [self.env.observations(), self.env.masks(), self.env.get_state()]


def play_beside(name: str, episodes: int, envs: int, threads: int, mode: AutoresetMode, **options: Any) -> None:
    """Play a vector and single environments at once until each has played some episodes; all numbers are equal."""
    vector = numeric.vector_env(name, envs, threads=threads, autoreset_mode=mode, **options)
    twins = [Twin(name, 7 + row, mode, **options) for row in range(envs)]
    rng = np.random.default_rng(7)
    seen, info = vector.reset(seed=7)
    while min(twin.episodes for twin in twins) < episodes:
        actions = sample(info["action_mask"], rng)
        seen, rewards, terminated, truncated, info = vector.step(actions)
        for row, twin in enumerate(twins):
            reward, over = twin.step(actions[row])
            assert (rewards[row], terminated[row] | truncated[row]) == (reward, over)
            for told, own in zip((seen, info["action_mask"], info["state"]), twin.numbers(), strict=True):
                np.testing.assert_array_equal(told[row], own)
            if over and mode is AutoresetMode.SAME_STEP:
                np.testing.assert_array_equal(info["final_obs"][row], twin.last)
    vector.close()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("threads", [1, 2])
def test_every_row_is_the_single_environment(threads: int, mode: AutoresetMode) -> None:
    play_beside("3m", 2, 3, threads, mode, obs_last_action=True, state_timestep_number=True)


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", MAPS)
def test_506_episodes_of_all_maps_are_those_of_the_single_environment(name: str) -> None:
    play_beside(name, EPISODES // 2, 2, 2, AutoresetMode.SAME_STEP)


def test_a_vector_plays_the_same_worlds_as_single_environments() -> None:
    vector = numeric.vector_env("2s3z", 2)
    twins = [Twin("2s3z", 3 + row, AutoresetMode.NEXT_STEP) for row in range(2)]
    _, info = vector.reset(seed=3)
    rng = np.random.default_rng(3)
    for _ in range(90):
        actions = sample(info["action_mask"], rng)
        _, _, _, _, info = vector.step(actions)
        for row, twin in enumerate(twins):
            twin.step(actions[row])
    share = vector.shares.parts[0][1]
    assert not isinstance(share, RemoteShare)
    assert [b.battle.digest() for b in share.batch.battles] == [twin.env.battle.digest() for twin in twins]
    assert min(twin.episodes for twin in twins) > 0


def test_results_are_written_into_buffers_of_the_caller() -> None:
    alone = numeric.vector_env("3m", 2)
    shape = alone.observation_space.shape
    assert shape is not None
    buffers = {"observation": np.zeros(shape, dtype=np.float32), "reward": np.zeros(2)}
    vector = numeric.vector_env("3m", 2, buffers=buffers)
    seen, _ = vector.reset(seed=1)
    expected, _ = alone.reset(seed=1)
    assert seen is buffers["observation"]
    np.testing.assert_array_equal(buffers["observation"], expected)
    kept = expected.copy()
    apart = np.array([[4, 1, 1], [4, 1, 1]])
    vector.step(apart)
    after, _, _, _, _ = alone.step(apart)
    np.testing.assert_array_equal(buffers["observation"], after)
    np.testing.assert_array_equal(expected, kept)  # without buffers, a step changes nothing that was returned before
    assert not np.array_equal(after, kept)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"observations": np.zeros(1)}, "no buffer 'observations': give some of action, observation"),
        ({"reward": np.zeros(3)}, r"buffer 'reward' is \[3\] float64 and must be \[2\] float64"),
        ({"reward": np.zeros(2, np.float32)}, r"'reward' is \[2\] float32 and must be \[2\] float64"),
        ({"reward": [0.0, 0.0]}, "buffer 'reward' cannot be written in place"),
        ({"reward": np.zeros(4)[::2]}, "buffer 'reward' cannot be written in place"),
    ],
)
def test_a_wrong_buffer_is_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        numeric.vector_env("3m", 2, buffers=given)


def test_an_action_that_is_not_available_is_replaced_by_stop() -> None:
    one, other = numeric.vector_env("3m", 1), numeric.vector_env("3m", 1)
    for vector, action in ((one, 99), (other, 1)):
        vector.reset(seed=1)
        vector.step(np.full((1, 3), action))
    after = [vector.step(np.ones((1, 3), dtype=np.int64))[0] for vector in (one, other)]
    np.testing.assert_array_equal(after[0], after[1])


def test_an_episode_that_ends_at_its_limit_is_truncated_and_the_next_step_begins_one() -> None:
    vector = numeric.vector_env("3m", 2, max_cycles=2)
    vector.reset(seed=4)
    stop = np.ones((2, 3), dtype=np.int64)
    ends = [vector.step(stop)[2:4] for _ in range(2)]
    assert [[flags.tolist() for flags in end] for end in ends] == [[[False] * 2] * 2, [[False] * 2, [True] * 2]]
    _, rewards, terminated, truncated, _ = vector.step(stop)
    assert (rewards.tolist(), (terminated | truncated).tolist()) == ([0.0, 0.0], [False] * 2)
    assert [vector.step(stop)[3].tolist() for _ in range(2)] == [[False] * 2, [True] * 2]


def test_a_worker_that_is_gone_is_reported() -> None:
    vector = numeric.vector_env("3m", 2, threads=2)
    vector.reset(seed=1)
    share = vector.shares.parts[1][1]
    assert isinstance(share, RemoteShare)
    assert share.process.pid is not None
    os.kill(share.process.pid, signal.SIGKILL)
    share.process.join()
    with pytest.raises(WorkerError, match="a worker process is gone, with exit code -9"):
        vector.step(np.ones((2, 3), dtype=np.int64))
    vector.close()


def test_pufferlibs_convention_has_a_row_for_each_agent_in_buffers_of_the_trainer() -> None:
    size = numeric.vector_env("3m", 1).single_observation_space.shape
    assert size is not None
    rows = {"observations": np.zeros((6, size[1]), dtype=np.float32), "rewards": np.zeros(6, dtype=np.float32)}
    puffer = numeric.PufferBattles("3m", 2, buf=rows, seed=5)
    vector = numeric.vector_env("3m", 2, autoreset_mode=AutoresetMode.SAME_STEP)
    seen, infos = puffer.reset()
    expected, info = vector.reset(seed=5)
    rng = np.random.default_rng(5)
    assert (seen is rows["observations"], infos) == (True, [])
    ended = 0
    for _ in range(60):
        actions = sample(info["action_mask"], rng)
        np.testing.assert_array_equal(puffer.action_masks, info["action_mask"].reshape(6, -1))
        seen, rewards, terminals, truncations, infos = puffer.step(actions.ravel())
        expected, reward, terminated, truncated, info = vector.step(actions)
        np.testing.assert_array_equal(seen, expected.reshape(6, -1))
        np.testing.assert_array_equal(rewards, np.repeat(reward, 3).astype(np.float32))
        np.testing.assert_array_equal(terminals | truncations, np.repeat(terminated | truncated, 3))
        assert len(infos) == (terminated | truncated).sum()
        ended += len(infos)
    assert ended > 0


def test_envpools_convention_returns_the_batch_that_is_done_and_says_which() -> None:
    pool = numeric.EnvPoolBattles("3m", 4, num_threads=2, seed=6)
    vector = numeric.vector_env("3m", 4)
    expected, _ = vector.reset(seed=6)
    pool.async_reset()
    with pytest.raises(ValueError, match="whole batches"):
        pool.send(np.ones((1, 3)), np.array([1]))
    steps = np.zeros(4, dtype=int)
    seen: dict[int, Any] = {}
    told: dict[str, Any] = {}
    for _ in range(2):
        observations, _, _, _, told = pool.recv()
        seen |= dict(zip(told["env_id"].tolist(), observations, strict=True))
    np.testing.assert_array_equal(np.stack([seen[row] for row in range(4)]), expected)
    for _ in range(6):
        ids = told["env_id"]
        pool.send(np.ones((len(ids), 3), dtype=np.int64), ids)
        observations, _, _, _, told = pool.recv()
        steps[told["env_id"]] += 1
        assert told["elapsed_step"].tolist() == steps[told["env_id"]].tolist()
    pool.close()
    assert steps.sum() == 12


def test_envpools_step_is_that_of_the_vector() -> None:
    pool = numeric.EnvPoolBattles("3m", 3, num_threads=2, seed=6)
    vector = numeric.vector_env("3m", 3)
    np.testing.assert_array_equal(pool.reset()[0], vector.reset(seed=6)[0])
    actions = np.full((3, 3), 4)
    for _ in range(3):
        (*ours, _), (*theirs, _) = pool.step(actions), vector.step(actions)
        for own, told in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(own, told)
    np.testing.assert_array_equal(pool.step(actions)[4]["action_mask"], vector.step(actions)[4]["action_mask"])
    pool.close()
    vector.close()
