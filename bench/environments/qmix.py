"""QMIX in torch: each agent learns values of its actions, and a network that only rises mixes them into the team's.

What makes it work on SMAC's hard maps is as PyMARL2 has it: returns of TD(lambda), Adam, large batches of whole
episodes, and a quick end of exploration. Agents are recurrent and share their weights; they see their last action and
their number. An episode that reached its limit of steps counts as ended. Above it: `bench.environments.train`.

Rashid et al., QMIX: Monotonic Value Function Factorisation, arXiv:1803.11485; Hu et al., Rethinking the Implementation
Tricks and Monotonicity Constraint in Cooperative Multi-Agent Reinforcement Learning, arXiv:2102.03479.
"""

from __future__ import annotations

import copy
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from torch import nn
from torch.nn import functional as F  # noqa: N812  # as all of torch's pages call it

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bench.environments.battles import Battles, Policy, Sizes

    Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the learner, which are PyMARL2's; the same for all maps."""

    hidden: int = 64
    mixed: int = 32
    """Hidden units of the mixing network."""
    rate: float = 1e-3
    gamma: float = 0.99
    trace: float = 0.6
    """Lambda of the returns."""
    most_gradient: float = 10.0
    kept: int = 5000
    """Episodes that are kept."""
    batch: int = 128
    """Episodes of an update."""
    between: int = 8
    """Episodes that end between two updates."""
    copied: int = 200
    """Episodes that end until the target networks are renewed."""
    explored: int = 100_000
    """Steps in which random actions become as rare as they stay."""
    rarest: float = 0.05


class Step(NamedTuple):
    """A step of a battle, or the steps of an episode or of a batch, [steps, ...]."""

    seen: Any
    """[..., agents, size], with what an agent did last and its number."""
    masks: Any
    """[..., agents, actions]."""
    states: Any
    actions: Any
    """[..., agents]."""
    rewards: Any
    """[...]."""


class Batch(NamedTuple):
    """Steps of some episodes: the first steps of all of them, then the second ones, and so on while any goes on."""

    steps: Step
    there: NDArray[np.bool_]
    """[time, episodes]: whether the episode has such a step; the longest episodes come first."""


class Agent(nn.Module):  # type: ignore[misc]  # torch is not installed where types are checked
    """Values of an agent's actions, from all that it has seen; between two layers is a gated recurrent unit.

    torch's own unit plays episodes of different lengths either to the end of the longest or, packed, ten times as long.
    """

    def __init__(self, inputs: int, hidden: int, actions: int) -> None:
        super().__init__()
        self.below = nn.Linear(inputs, hidden)
        self.reads = nn.Linear(hidden, 3 * hidden)
        self.remembers = nn.Linear(hidden, 3 * hidden)
        self.above = nn.Linear(hidden, actions)

    def forward(
        self, seen: torch.Tensor, at_once: list[int], memory: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return [rows, actions] values for [rows, inputs], and the memory after them, [rows of the last moment, size].

        `at_once` says how many rows each moment has: as many as the one before, or only its first ones.
        """
        memories = []
        if memory is None:
            memory = seen.new_zeros(at_once[0], self.above.in_features)
        for read in self.reads(F.relu(self.below(seen))).split(at_once):
            memory = self._remember(read, memory[: len(read)])
            memories.append(memory)
        return self.above(torch.cat(memories)), memory

    def _remember(self, read: torch.Tensor, memory: torch.Tensor) -> torch.Tensor:
        read_gates, read_new = read.tensor_split((2 * memory.shape[1],), 1)
        gates, old = self.remembers(memory).tensor_split((2 * memory.shape[1],), 1)
        keep, use = (read_gates + gates).sigmoid().chunk(2, 1)
        return torch.lerp((read_new + use * old).tanh(), memory, keep)


class Mixer(nn.Module):  # type: ignore[misc]  # see above
    """The team's value from those of its agents; the state makes the weights, none of which is negative."""

    def __init__(self, state: int, agents: int, hidden: int, mixed: int) -> None:
        super().__init__()
        self._agents = agents
        self._mixed = mixed
        self.weights = _two_layers(state, hidden, agents * mixed)
        self.bias = nn.Linear(state, mixed)
        self.last_weights = _two_layers(state, hidden, mixed)
        self.last_bias = _two_layers(state, mixed, 1)

    def forward(self, values: torch.Tensor, states: torch.Tensor) -> torch.Tensor:
        """Return [...] for [..., agents] values and [..., size] states."""
        weights = self.weights(states).abs().unflatten(-1, (self._agents, self._mixed))
        inner = F.elu((values[..., None] * weights).sum(-2) + self.bias(states))
        return (inner * self.last_weights(states).abs()).sum(-1) + self.last_bias(states).squeeze(-1)


def _unroll(agent: Agent, seen: torch.Tensor, there: torch.Tensor) -> torch.Tensor:
    """Return [steps, agents, actions] values of a batch's steps; each agent of each episode has a memory of its own."""
    agents = seen.shape[1]
    values: torch.Tensor = agent(seen.flatten(0, 1), (there.sum(1) * agents).tolist())[0]
    return values.unflatten(0, (-1, agents))


def _by_time(rows: torch.Tensor, there: torch.Tensor) -> torch.Tensor:
    """Return [time, episodes] numbers of a batch's steps, 0 where there is none."""
    return torch.zeros(there.shape).masked_scatter(there, rows)


def _two_layers(inputs: int, hidden: int, outputs: int) -> nn.Module:
    return nn.Sequential(nn.Linear(inputs, hidden), nn.ReLU(), nn.Linear(hidden, outputs))


class Learner:
    """The team's networks, their older copies, and the episodes that they learn from."""

    def __init__(self, sizes: Sizes, seed: int, settings: Settings | None = None) -> None:
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self.settings = settings or Settings()
        self._sizes = sizes
        self._rng = np.random.default_rng(seed)
        hidden = self.settings.hidden
        self.agent = Agent(sizes.seen + sizes.actions + sizes.agents, hidden, sizes.actions)
        self.mixer = Mixer(sizes.state, sizes.agents, hidden, self.settings.mixed)
        self._renew()
        self._weights = [*self.agent.parameters(), *self.mixer.parameters()]
        self._adam = torch.optim.Adam(self._weights, lr=self.settings.rate)
        self.episodes: deque[Step] = deque(maxlen=self.settings.kept)
        self._playing: list[list[Step]] = []
        self._memory: torch.Tensor | None = None
        self._last: Array = np.zeros(0)

    def play(self, battles: Battles) -> None:
        """Play until some episodes have ended, and learn from those that are kept."""
        until = battles.episodes + self.settings.between
        before = battles.episodes
        while battles.episodes < until:
            self._step(battles)
        if len(self.episodes) >= self.settings.batch:
            self.learn(self._batch())
        if before // self.settings.copied != battles.episodes // self.settings.copied:
            self._renew()

    def most_likely(self) -> Policy:
        """Return the policy with which it is tested; it remembers what it has seen."""
        memory: torch.Tensor | None = None
        last: Array | None = None

        def act(seen: Array, masks: Array) -> Array:
            nonlocal memory, last
            values, memory = self._values(self._inputs(seen, last), memory)
            last = np.where(masks, values, -np.inf).argmax(-1)
            return last

        return act

    def learn(self, batch: Batch) -> float:
        """Learn from a batch of episodes, and return the loss."""
        seen, masks, states, actions, rewards = map(torch.from_numpy, batch.steps)
        there = torch.from_numpy(batch.there)
        values = _unroll(self.agent, seen, there)
        team = self.mixer(values.gather(-1, actions[..., None]).squeeze(-1), states)
        with torch.no_grad():
            best = values.masked_fill(~masks, -torch.inf).argmax(-1, keepdim=True)
            ahead = self._old_mixer(_unroll(self._old_agent, seen, there).gather(-1, best).squeeze(-1), states)
            wanted = self.returns(_by_time(rewards, there), there, _by_time(ahead, there))[there]
        loss = F.mse_loss(team, wanted)
        self._adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._weights, self.settings.most_gradient)
        self._adam.step()
        return float(loss.detach())

    def returns(self, rewards: torch.Tensor, there: torch.Tensor, ahead: torch.Tensor) -> torch.Tensor:
        """Return the TD(lambda) returns, all [steps, episodes]; `ahead` is the value of each step, if it is there."""
        gamma, trace = self.settings.gamma, self.settings.trace
        result = torch.zeros_like(rewards)
        later = torch.zeros_like(rewards[0])
        value = torch.zeros_like(rewards[0])
        for step in reversed(range(len(rewards))):
            later = (rewards[step] + gamma * (trace * later + (1 - trace) * value)) * there[step]
            value = ahead[step] * there[step]
            result[step] = later
        return result

    def _step(self, battles: Battles) -> None:
        envs = len(battles.seen)
        if not self._playing:
            self._playing = [[] for _ in range(envs)]
            self._last = np.full((envs, self._sizes.agents), -1)
        seen, masks, states = self._inputs(battles.seen, self._last), battles.masks, battles.states
        values, self._memory = self._values(seen, self._memory)
        actions = np.where(masks, values, -np.inf).argmax(-1)
        settings = self.settings
        chance = max(settings.rarest, 1 - battles.steps / settings.explored * (1 - settings.rarest))
        explores = self._rng.random(actions.shape) < chance
        actions = np.where(explores, (self._rng.random(masks.shape) * masks).argmax(-1), actions)
        rewards, over = battles.step(actions)
        for row, playing in enumerate(self._playing):
            playing.append(Step(seen[row], masks[row], states[row], actions[row], np.float32(rewards[row])))
            if over[row]:
                self.episodes.append(Step(*map(np.stack, zip(*playing, strict=True))))
                self._playing[row] = []
        self._last = np.where(over[:, None], -1, actions)
        self._memory *= torch.from_numpy(~over).repeat_interleave(self._sizes.agents)[:, None]

    def _inputs(self, seen: Array, last: Array | None) -> Array:
        """Return [envs, agents, size] of what an agent sees, its last action (-1: none) and its number."""
        agents = self._sizes.agents
        if last is None:
            last = np.full(seen.shape[:-1], -1)
        did = (last[..., None] == np.arange(self._sizes.actions)).astype(np.float32)
        numbers = np.broadcast_to(np.eye(agents, dtype=np.float32), (len(seen), agents, agents))
        return np.concatenate((seen, did, numbers), axis=-1)

    def _values(self, seen: Array, memory: torch.Tensor | None) -> tuple[Array, torch.Tensor]:
        with torch.no_grad():
            rows = torch.from_numpy(seen).flatten(0, 1)
            values, memory = self.agent(rows, [len(rows)], memory)
        return values.unflatten(0, seen.shape[:2]).numpy(), memory

    def _batch(self) -> Batch:
        """Return some of the episodes that are kept."""
        chosen = self._rng.choice(len(self.episodes), self.settings.batch, replace=False)
        episodes = sorted((self.episodes[number] for number in chosen), key=lambda one: -len(one.rewards))
        lengths = np.array([len(episode.rewards) for episode in episodes])
        there = np.arange(lengths[0])[:, None] < lengths
        time, episode = np.nonzero(there)
        rows = (lengths.cumsum() - lengths)[episode] + time
        return Batch(Step(*(np.concatenate(parts)[rows] for parts in zip(*episodes, strict=True))), there)

    def _renew(self) -> None:
        self._old_agent = copy.deepcopy(self.agent)
        self._old_mixer = copy.deepcopy(self.mixer)
