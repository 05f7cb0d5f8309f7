"""The learner of `bench.environments.train`: its slopes are those of its loss, and it finds out what is worth more."""

from __future__ import annotations

import numpy as np
import pytest

from bench.environments import ppo, train
from bench.environments.ppo import Learner, Rollout, Settings


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
    rows, actions = 40, 5
    out, masks = rng.normal(size=(rows, actions)), rng.random((rows, actions)) < 0.7
    masks[:, 0] = True
    taken = np.array([rng.choice(np.flatnonzero(can)) for can in masks])
    before = ppo._logs(out + rng.normal(scale=0.2, size=out.shape), masks)[np.arange(rows), taken]
    chosen = ppo._Policy(masks, taken, before, rng.normal(size=rows), Settings(entropy=0.3))
    numeric, step = np.zeros_like(out), 1e-6
    for place in np.ndindex(*out.shape):
        more, less = out.copy(), out.copy()
        more[place] += step
        less[place] -= step
        numeric[place] = (loss(more, chosen) - loss(less, chosen)) / (2 * step)
    np.testing.assert_allclose(chosen(out), numeric, atol=1e-7)


def test_a_learner_finds_the_action_that_is_rewarded_and_available() -> None:
    learner = Learner(agents=2, size=3, state_size=4, actions=4, seed=1)
    rng = np.random.default_rng(1)
    masks = np.ones((8, 2, 4), dtype=np.bool_)
    masks[:, :, 3] = False  # it would be worth most
    seen, states = rng.normal(size=(8, 2, 3)), rng.normal(size=(8, 4))
    for _ in range(30):
        steps = []
        for _ in range(16):
            actions, chance = learner.act(seen, masks)
            rewards = (actions == 2).sum(1) + 9.0 * (actions == 3).sum(1)
            steps.append((seen, masks, actions, chance, states, rewards, np.ones(8, dtype=np.bool_)))
        learner.learn(Rollout(*map(np.stack, zip(*steps, strict=True))), states)
    actions, chance = learner.act(seen, masks)
    assert (actions == 2).mean() > 0.9
    assert np.exp(chance).mean() > 0.8


@pytest.mark.slow
def test_a_team_is_trained_and_tested() -> None:
    run, _ = train.train("3m", seed=1, envs=4, minutes=0.05, tell=lambda _: None)
    assert run.steps == sorted(run.steps)
    assert len(run.won) == len(run.minutes) > 0
    assert run.greedy is not None
    assert 0.0 <= run.greedy <= 1.0
