"""MAPPO in NumPy: PPO for a team of agents with shared weights, and a critic that judges the state.

Each agent decides from what it sees now and from its number; the reward, the critic and the advantage are the team's.
The policy sees no earlier step: it has no recurrent layer, which the paper's has. What is not available has no
probability. Numbers are float32, which NumPy multiplies twice as fast. Above it: `bench.environments.train`.

Schulman et al., Proximal Policy Optimization Algorithms, arXiv:1707.06347; Yu et al., The Surprising Effectiveness of
PPO in Cooperative Multi-Agent Games, arXiv:2103.01955.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bench.environments.battles import Battles, Policy, Sizes

    Array = NDArray[np.floating[Any]]
    Ints = NDArray[np.int64]
    Bools = NDArray[np.bool_]

IMPOSSIBLE = -1e9


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the learner; the same for all maps."""

    hidden: int = 64
    rate: float = 1e-3
    gamma: float = 0.99
    trace: float = 0.95
    """Lambda of the advantages."""
    clip: float = 0.2
    entropy: float = 0.01
    epochs: int = 5
    batches: int = 2
    most_gradient: float = 10.0
    steps: int = 32
    """Of each battle between two updates."""


class Rollout(NamedTuple):
    """What several battles have played: [steps, envs, ...]."""

    seen: Array
    """[steps, envs, agents, size]."""
    masks: Bools
    actions: Ints
    chance: Array
    """Logarithm of the probability that the action had."""
    states: Array
    rewards: Array
    """[steps, envs]."""
    over: Bools


class Net:
    """Two hidden layers of tanh, with Adam."""

    def __init__(self, sizes: tuple[int, int, int], last: float, rng: np.random.Generator) -> None:
        """Take numbers of inputs, hidden and output units, and the scale of the last layer's weights."""
        inputs, hidden, outputs = sizes
        shapes = ((inputs, hidden), (hidden, hidden), (hidden, outputs))
        self.weights = [
            part.astype(np.float32)
            for (rows, columns), scale in zip(shapes, (1.0, 1.0, last), strict=True)
            for part in (rng.normal(0, scale / np.sqrt(rows), (rows, columns)), np.zeros(columns))
        ]
        self._first = [np.zeros_like(weight) for weight in self.weights]
        self._second = [np.zeros_like(weight) for weight in self.weights]
        self._count = 0

    def __call__(self, x: Array) -> Array:
        """Return [n, outputs] for [n, inputs]."""
        return self._layers(x)[-1]

    def _layers(self, x: Array) -> list[Array]:
        w1, b1, w2, b2, w3, b3 = self.weights
        lower = np.tanh(x @ w1 + b1)
        upper = np.tanh(lower @ w2 + b2)
        return [x, lower, upper, upper @ w3 + b3]

    def learn(self, x: Array, slope_of: Callable[[Array], Array], settings: Settings) -> None:
        """Go a step down: `slope_of` takes the outputs and returns the slope of the loss in each."""
        x, lower, upper, out = self._layers(x)
        slope = slope_of(out).astype(np.float32)
        back_upper = (slope @ self.weights[4].T) * (1 - upper**2)
        back_lower = (back_upper @ self.weights[2].T) * (1 - lower**2)
        slopes = [
            part
            for below, above in ((x, back_lower), (lower, back_upper), (upper, slope))
            for part in (below.T @ above, above.sum(0))
        ]
        length = np.sqrt(sum(float((part**2).sum()) for part in slopes))
        shrink = min(1.0, settings.most_gradient / (length + 1e-9))
        self._count += 1
        for weight, first, second, part in zip(self.weights, self._first, self._second, slopes, strict=True):
            first[:] = 0.9 * first + 0.1 * (part * shrink)
            second[:] = 0.999 * second + 0.001 * (part * shrink) ** 2
            mean = first / (1 - 0.9**self._count)
            spread = second / (1 - 0.999**self._count)
            weight[:] = weight - settings.rate * mean / (np.sqrt(spread) + 1e-5)


class Scale:
    """Mean and spread of returns so far, newer ones counting more: the critic learns numbers about 0 and 1."""

    KEPT = 0.99

    def __init__(self) -> None:
        self._sums = np.zeros(3)

    @property
    def mean(self) -> float:
        return float(self._sums[1] / max(self._sums[0], 1e-9))

    @property
    def spread(self) -> float:
        return float(np.sqrt(max(self._sums[2] / max(self._sums[0], 1e-9) - self.mean**2, 1e-2)))

    def add(self, returns: Array) -> None:
        self._sums = self.KEPT * self._sums + (1 - self.KEPT) * np.array([1, returns.mean(), (returns**2).mean()])


class Learner:
    """The team's policy and its critic."""

    def __init__(self, sizes: Sizes, seed: int, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self._sizes = sizes
        self._rng = np.random.default_rng(seed)
        hidden = self.settings.hidden
        self.policy = Net((sizes.seen + sizes.agents, hidden, sizes.actions), 0.01, self._rng)
        self.critic = Net((sizes.state, hidden, 1), 1.0, self._rng)
        self._scale = Scale()

    def play(self, battles: Battles) -> None:
        """Play some steps of each battle, and learn from them."""
        steps = []
        for _ in range(self.settings.steps):
            seen, masks, states = battles.seen, battles.masks, battles.states
            actions, chance = self.act(seen, masks)
            rewards, over = battles.step(actions)
            steps.append((seen, masks, actions, chance, states, rewards, over))
        self.learn(Rollout(*map(np.stack, zip(*steps, strict=True))), battles.states)

    def most_likely(self) -> Policy:
        """Return the policy with which it is tested."""
        return lambda seen, masks: self.act(seen, masks, greedy=True)[0]

    def act(self, seen: Array, masks: Bools, *, greedy: bool = False) -> tuple[Ints, Array]:
        """Return [envs, agents] actions, and the logarithms of their probabilities."""
        logs = _logs(self.policy(self._inputs(seen)), masks.reshape(-1, self._sizes.actions))
        noise = 0.0 if greedy else self._rng.gumbel(size=logs.shape)
        chosen = np.argmax(logs + noise, axis=1)
        shape = seen.shape[:-1]
        return chosen.reshape(shape), logs[np.arange(len(logs)), chosen].reshape(shape)

    def learn(self, rollout: Rollout, last_state: Array) -> None:
        """Learn from what was played; `last_state` is [envs, size] after it."""
        advantages, returns = self._judge(rollout, last_state)
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        self._scale.add(returns)
        wanted = ((returns - self._scale.mean) / self._scale.spread)[:, None]
        agents = self._sizes.agents
        inputs = self._inputs(rollout.seen)
        masks = rollout.masks.reshape(len(inputs), -1)
        choice = np.flatnonzero(masks.sum(1) > 1)  # who has no choice teaches nothing
        chosen = _Policy(
            masks[choice], rollout.actions.ravel()[choice], rollout.chance.ravel()[choice],
            np.repeat(advantages, agents)[choice], self.settings,
        )  # fmt: skip
        inputs = inputs[choice]
        states = rollout.states.reshape(len(returns), -1)
        for some in self._batches(len(choice)):
            self.policy.learn(inputs[some], chosen.rows(some), self.settings)
        for some in self._batches(len(returns)):
            self.critic.learn(states[some], _Critic(wanted[some]), self.settings)

    def _inputs(self, seen: Array) -> Array:
        agents = self._sizes.agents
        numbers = np.broadcast_to(np.eye(agents, dtype=np.float32), (*seen.shape[:-1], agents))
        return np.concatenate((seen, numbers), axis=-1).reshape(-1, self._sizes.seen + agents)

    def _judge(self, rollout: Rollout, last_state: Array) -> tuple[Array, Array]:
        """Return the advantage and the return of each step, in one row."""
        steps, envs = rollout.rewards.shape
        values = self.critic(np.concatenate((rollout.states.reshape(steps * envs, -1), last_state)))
        values = values.reshape(steps + 1, envs) * self._scale.spread + self._scale.mean
        advantages = np.zeros((steps, envs))
        ahead = np.zeros(envs)
        for step in reversed(range(steps)):
            goes_on = ~rollout.over[step]
            surprise = rollout.rewards[step] + self.settings.gamma * values[step + 1] * goes_on - values[step]
            advantages[step] = ahead = surprise + self.settings.gamma * self.settings.trace * goes_on * ahead
        return advantages.ravel(), (advantages + values[:-1]).ravel()

    def _batches(self, rows: int) -> Iterator[Ints]:
        for _ in range(self.settings.epochs):
            yield from np.array_split(self._rng.permutation(rows), self.settings.batches)


@dataclass(frozen=True, slots=True)
class _Critic:
    """The slope of half the squared distance, which is no steeper than 1, in the outputs of the critic."""

    wanted: Array

    def __call__(self, out: Array) -> Array:
        result: Array = np.clip(out - self.wanted, -1, 1) / len(out)
        return result


@dataclass(frozen=True, slots=True)
class _Policy:
    """The slope of PPO's loss in the outputs of the policy: of its clipped gain, and of the entropy."""

    masks: Bools
    actions: Ints
    chance: Array
    advantages: Array
    settings: Settings

    def rows(self, some: Ints) -> _Policy:
        """Return those of some rows."""
        return _Policy(self.masks[some], self.actions[some], self.chance[some], self.advantages[some], self.settings)

    def __call__(self, out: Array) -> Array:
        rows = np.arange(len(out))
        logs = _logs(out, self.masks)
        likely = np.exp(logs)
        ratio = np.exp(logs[rows, self.actions] - self.chance)
        clip = self.settings.clip
        free = np.where(self.advantages > 0, ratio < 1 + clip, ratio > 1 - clip)
        push = np.where(free, self.advantages * ratio, 0.0)
        slope = likely * push[:, None]
        slope[rows, self.actions] -= push
        known = np.where(self.masks, logs, 0.0)
        entropy = -(likely * known).sum(1, keepdims=True)
        slope += self.settings.entropy * likely * (known + entropy)
        result: Array = np.where(self.masks, slope, 0.0) / len(out)
        return result


def _logs(out: Array, masks: Bools) -> Array:
    """Return [n, actions] logarithms of probabilities, very small ones for what is not available."""
    out = np.where(masks, out, IMPOSSIBLE)
    out = out - out.max(1, keepdims=True)
    logs: Array = out - np.log(np.exp(out).sum(1, keepdims=True))
    return logs
