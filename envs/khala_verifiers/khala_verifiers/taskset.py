"""The rows, a game each, and what an agent's trace of one is worth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import verifiers.v1 as vf
from pydantic import Field

from khala_sc2.rollout import RolloutSpec, TeamRollout

if TYPE_CHECKING:
    from collections.abc import Iterator


class KhalaData(vf.TaskData):
    """One game."""

    battle: str
    """The task of Khala; `task` is another word in verifiers."""
    seed: int
    others: str = "skilled"
    max_steps: int | None = None
    history: bool = False
    """Whether a prompt has all turns before."""

    @property
    def spec(self) -> RolloutSpec:
        """The episode that is played."""
        return RolloutSpec(self.battle, self.seed, others=self.others, max_steps=self.max_steps)


class KhalaTask(vf.Task[KhalaData]):
    """A game, as one agent plays it."""

    @vf.reward
    async def credit(self, trace: vf.Trace) -> dict[str, float]:
        """Return the weighted parts of the agent's reward, each summed over its turns; `khala_sc2.dataset.credit`."""
        return dict(trace.info.get("khala", {}).get("rewards", {"objective": 0.0}))

    @vf.metric
    async def won(self, trace: vf.Trace) -> float:
        """Return 1 if the agent's side won, else 0."""
        return float(trace.info.get("khala", {}).get("outcome") == "win")

    async def validate(self, runtime: vf.Runtime) -> bool:  # noqa: ARG002  # verifiers passes it by its name
        """Return whether the game begins: an agent is asked."""
        async with TeamRollout(self.data.spec) as rollout:
            return bool(await rollout.begin())


class KhalaTasksetConfig(vf.TasksetConfig):
    """Which games are played, under `--env.taskset.*`."""

    battle: str = "2s3z_pair"
    """One of `khala tasks`, of at most eight agents."""
    games: int = Field(100, ge=1)
    """Rows."""
    seed: int = Field(1, ge=0)
    """Of the first game; each game has the next one."""
    others: str = "skilled"
    """Who decides for agents of the other side: a player that costs nothing."""
    max_steps: int | None = Field(None, ge=1)
    """End of an episode; None for the task's own."""
    history: bool = False
    """Whether a prompt has all turns before, so that an episode is one sample; else each turn is one, as Khala's own
    agents are asked: with the briefing, the worked example, what the task's memory recalls, and the observation."""


class KhalaTaskset(vf.Taskset[KhalaTask, KhalaTasksetConfig]):
    """The games of a task."""

    def load(self) -> Iterator[KhalaTask]:
        """Yield a game for each seed."""
        config = self.config
        same: dict[str, Any] = {
            name: getattr(config, name) for name in ("battle", "others", "max_steps", "history")
        }  # fmt: skip
        for seed in range(config.seed, config.seed + config.games):
            yield KhalaTask(KhalaData(name=f"{config.battle}#{seed}", seed=seed, **same), config.task)
