"""Training: slopes are those of the loss, returns those of TD(lambda), and both algorithms find what is worth more."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bench.environments import ppo, train
from bench.environments.battles import Battles, Sizes, count_wins

if TYPE_CHECKING:
    from pathlib import Path

    from bench.environments.battles import Learner

SIZES = Sizes(agents=2, seen=3, state=4, actions=4)


class Levers(Battles):
    """Eight battles of two steps in which each agent should pull lever 2; lever 3 is worth most and out of reach."""

    def __init__(self) -> None:
        rng = np.random.default_rng(1)
        self.seen = rng.normal(size=(8, 2, 3)).astype(np.float32)
        self.states = rng.normal(size=(8, 4)).astype(np.float32)
        self.masks = np.array([True, True, True, False]) & np.ones((8, 2, 4), dtype=np.bool_)
        self.sizes = SIZES
        self.steps = 0
        self.episodes = 0

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.steps += 8
        over = np.full(8, self.steps % 16 == 0)
        self.episodes += int(over.sum())
        return (actions == 2).sum(1) + 9.0 * (actions == 3).sum(1), over


def share_of_the_best(learner: Learner, rounds: int) -> float:
    """Return how many agents pull the best lever after some rounds of training."""
    levers = Levers()
    for _ in range(rounds):
        learner.play(levers)
    return float((learner.most_likely()(levers.seen, levers.masks) == 2).mean())


def loss(out: np.ndarray, chosen: ppo._Policy) -> float:
    """Return PPO's loss, as its paper has it."""
    logs = ppo._logs(out, chosen.masks)
    rows = np.arange(len(out))
    ratio = np.exp(logs[rows, chosen.actions] - chosen.chance)
    clip = chosen.settings.clip
    gain = np.minimum(ratio * chosen.advantages, np.clip(ratio, 1 - clip, 1 + clip) * chosen.advantages)
    likely = np.where(chosen.masks, np.exp(logs), 0.0)
    entropy = -(likely * np.where(chosen.masks, logs, 0.0)).sum(1)
    return float(-(gain + chosen.settings.entropy * entropy).mean())


def test_the_slope_of_the_policy_is_that_of_its_loss() -> None:
    rng = np.random.default_rng(0)
    rows = 40
    actions = 5
    out = rng.normal(size=(rows, actions))
    masks = rng.random((rows, actions)) < 0.7
    masks[:, 0] = True
    taken = np.array([rng.choice(np.flatnonzero(can)) for can in masks])
    before = ppo._logs(out + rng.normal(scale=0.2, size=out.shape), masks)[np.arange(rows), taken]
    chosen = ppo._Policy(masks, taken, before, rng.normal(size=rows), ppo.Settings(entropy=0.3))
    numeric = np.zeros_like(out)
    step = 1e-6
    for place in np.ndindex(*out.shape):
        more = out.copy()
        less = out.copy()
        more[place] += step
        less[place] -= step
        numeric[place] = (loss(more, chosen) - loss(less, chosen)) / (2 * step)
    np.testing.assert_allclose(chosen(out), numeric, atol=1e-7)


def test_mappo_finds_the_action_that_is_rewarded_and_available() -> None:
    assert share_of_the_best(ppo.Learner(SIZES, seed=1), rounds=8) == 1.0


def test_qmix_finds_the_action_that_is_rewarded_and_available() -> None:
    pytest.importorskip("torch")
    from bench.environments import qmix

    settings = qmix.Settings(hidden=16, batch=16, kept=64, copied=80, explored=400, rate=5e-3)
    assert share_of_the_best(qmix.Learner(SIZES, 1, settings), rounds=25) == 1.0


def test_returns_of_qmix_are_those_of_td_lambda() -> None:
    torch = pytest.importorskip("torch")
    from bench.environments import qmix

    learner = qmix.Learner(SIZES, 1, qmix.Settings(gamma=0.5, trace=0.4))
    rewards = torch.tensor([[1.0, 2.0], [3.0, 0.0], [5.0, 0.0]])
    there = torch.tensor([[True, True], [True, False], [True, False]])
    ahead = torch.tensor([[7.0, 7.0], [8.0, 9.0], [6.0, 9.0]])
    last = 5.0
    middle = 3.0 + 0.5 * (0.4 * last + 0.6 * 6.0)
    first = 1.0 + 0.5 * (0.4 * middle + 0.6 * 8.0)
    expected = torch.tensor([[first, 2.0], [middle, 0.0], [last, 0.0]])
    torch.testing.assert_close(learner.returns(rewards, there, ahead), expected)


def test_an_agent_of_qmix_remembers_its_own_episode_alone() -> None:
    torch = pytest.importorskip("torch")
    from bench.environments import qmix

    agent = qmix.Agent(inputs=3, hidden=4, actions=2)
    there = torch.tensor([[True, True], [True, False], [True, False]])
    seen = torch.rand(4, 2, 3)  # of two agents: the first moment of both episodes, then two more of the first one
    alone = qmix._unroll(agent, seen[[0, 2, 3]][:, 1:], torch.ones(3, 1, dtype=torch.bool))
    torch.testing.assert_close(qmix._unroll(agent, seen, there)[[0, 2, 3]][:, 1:], alone)


def test_a_test_counts_each_battle_once() -> None:
    def attack(_: np.ndarray, masks: np.ndarray) -> np.ndarray:
        """Go east, and attack the first enemy that is near enough."""
        near = masks[..., 6:]
        return np.where(near.any(-1), 6 + near.argmax(-1), np.where(masks[..., 4], 4, masks.argmax(-1)))

    assert count_wins("3m", lambda _, masks: masks.argmax(-1), battles=3) == 0
    assert 1 <= count_wins("3m", attack, battles=8) <= 8


@pytest.mark.parametrize("algorithm", train.ALGORITHMS)
def test_a_team_is_trained_tested_and_drawn(algorithm: str, tmp_path: Path) -> None:
    if algorithm == "qmix":
        pytest.importorskip("torch")
    tests = list(train.train("3m", algorithm, seed=1, envs=4, steps=400, tests=2, battles=2))
    assert [test.battles for test in tests] == [2, 2]
    assert 200 <= tests[0].steps < tests[1].steps
    assert 0 < tests[0].cpu_s <= tests[1].cpu_s
    train.draw(tests, tmp_path / "curve.svg")
    assert algorithm in (tmp_path / "curve.svg").read_text(encoding="utf-8")
