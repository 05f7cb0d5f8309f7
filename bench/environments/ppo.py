"""PPO for a team of agents with shared weights, in NumPy: small enough to read, fast enough for SMAC's small maps.

Each agent decides from what it sees and its number (IPPO's policy); one critic judges the state for all, since the
reward is the team's. What is not available has no probability. Above it: `bench.environments.train`.

Schulman et al., Proximal Policy Optimization Algorithms, arXiv:1707.06347; Yu et al., The Surprising Effectiveness of
PPO in Cooperative Multi-Agent Games, arXiv:2103.01955.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.floating[Any]]
    Ints = NDArray[np.int64]
    Bools = NDArray[np.bool_]

IMPOSSIBLE = -1e9


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the learner."""

    hidden: int = 64
    rate: float = 7e-4
    gamma: float = 0.99
    trace: float = 0.95
    """Lambda of the advantages."""
    clip: float = 0.2
    entropy: float = 0.01
    epochs: int = 6
    batches: int = 4
    most_gradient: float = 1.0


class Rollout(NamedTuple):
    """What several environments have played: [steps, envs, ...]."""

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
        shapes, scales = ((inputs, hidden), (hidden, hidden), (hidden, outputs)), (1.0, 1.0, last)
        self.weights = [
            part
            for (rows, columns), scale in zip(shapes, scales, strict=True)
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

    def learn(self, x: Array, slope_of: Any, settings: Settings) -> None:
        """Go a step down: `slope_of` takes the outputs and returns the slope of the loss in each."""
        x, lower, upper, out = self._layers(x)
        slope = slope_of(out)
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
            mean, spread = first / (1 - 0.9**self._count), second / (1 - 0.999**self._count)
            weight[:] = weight - settings.rate * mean / (np.sqrt(spread) + 1e-5)


@dataclass
class Learner:
    """The team's policy and its critic."""

    agents: int
    size: int
    state_size: int
    actions: int
    seed: int
    settings: Settings = field(default_factory=Settings)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        hidden = self.settings.hidden
        self.policy = Net((self.size + self.agents, hidden, self.actions), 0.01, self._rng)
        self.critic = Net((self.state_size, hidden, 1), 1.0, self._rng)
        self._numbers = np.eye(self.agents)

    def act(self, seen: Array, masks: Bools, *, greedy: bool = False) -> tuple[Ints, Array]:
        """Return [envs, agents] actions, and the logarithms of their probabilities."""
        logs = _logs(self.policy(self._inputs(seen)), masks.reshape(-1, self.actions))
        noise = 0.0 if greedy else self._rng.gumbel(size=logs.shape)
        chosen = np.argmax(logs + noise, axis=1)
        shape = seen.shape[:-1]
        return chosen.reshape(shape), logs[np.arange(len(logs)), chosen].reshape(shape)

    def learn(self, rollout: Rollout, last_state: Array) -> None:
        """Learn from what was played; `last_state` is [envs, size] after it."""
        advantages, returns = self._judge(rollout, last_state)
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        rows = len(returns)
        seen = rollout.seen.reshape(rows, self.agents, -1)
        masks = rollout.masks.reshape(rows, self.agents, -1)
        actions, chance = rollout.actions.reshape(rows, -1), rollout.chance.reshape(rows, -1)
        states = rollout.states.reshape(rows, -1)
        for some in self._batches(rows):
            living = masks[some].sum(2).ravel() > 1  # who has no choice teaches nothing
            self.policy.learn(
                self._inputs(seen[some])[living],
                _Policy(
                    masks[some].reshape(-1, self.actions)[living], actions[some].ravel()[living],
                    chance[some].ravel()[living], np.repeat(advantages[some], self.agents)[living], self.settings,
                ),
                self.settings,
            )  # fmt: skip
            wanted = returns[some, None]
            self.critic.learn(
                states[some], lambda out, wanted=wanted: np.clip(out - wanted, -1, 1) / len(out), self.settings
            )

    def _inputs(self, seen: Array) -> Array:
        numbers = np.broadcast_to(self._numbers, (*seen.shape[:-1], self.agents))
        return np.concatenate((seen, numbers), axis=-1).reshape(-1, self.size + self.agents)

    def _judge(self, rollout: Rollout, last_state: Array) -> tuple[Array, Array]:
        """Return the advantage and the return of each step, in one row."""
        steps, envs = rollout.rewards.shape
        values = self.critic(np.concatenate((rollout.states.reshape(steps * envs, -1), last_state)))
        values = values.reshape(steps + 1, envs)
        advantages, ahead = np.zeros((steps, envs)), np.zeros(envs)
        for step in reversed(range(steps)):
            goes_on = ~rollout.over[step]
            surprise = rollout.rewards[step] + self.settings.gamma * values[step + 1] * goes_on - values[step]
            advantages[step] = ahead = surprise + self.settings.gamma * self.settings.trace * goes_on * ahead
        return advantages.ravel(), (advantages + values[:-1]).ravel()

    def _batches(self, rows: int) -> Iterator[Ints]:
        for _ in range(self.settings.epochs):
            yield from np.array_split(self._rng.permutation(rows), self.settings.batches)


class _Policy(NamedTuple):
    """The slope of PPO's loss in the outputs of the policy: of its clipped gain, and of the entropy."""

    masks: Bools
    actions: Ints
    chance: Array
    advantages: Array
    settings: Settings

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
