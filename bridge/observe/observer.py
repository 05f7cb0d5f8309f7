"""What each agent of a side sees, observation after observation: the outward half of a turn.

    observer.begin()                                     a new episode
    sight = observer.observe(snapshot, feedback)         sight.agents["Zealots"].text, .view

An observer remembers who has which unit and the sight before, and nothing else; what it says is a function of
the snapshots and feedbacks that it was given since `begin`. No clock, no bus.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bridge.observe.sight import Scene
from bridge.observe.teams import Roster
from bridge.observe.text import Feedback, render

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from bridge.observe.sight import AgentSight, Sight
    from bridge.snapshot import Snapshot
    from bridge.task import AgentConfig, TaskConfig


class Observer:
    """The eyes of one side."""

    def __init__(self, task: TaskConfig, roster: Callable[[Sequence[AgentConfig]], Roster] = Roster) -> None:
        """Takes a task, and whoever says which unit answers to which of its agents."""
        self._task = task
        self._new_roster = roster
        self.begin()

    def begin(self) -> None:
        """Forgets the episode before."""
        self._roster = self._new_roster(self._task.agents)
        self._before: Sight | None = None

    def observe(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> Sight:
        """What every agent sees now, with what it is told of its last reply.

        Args:
            snapshot: what the game says.
            feedback: by agent; agents that are not in it are told nothing.
        """
        for _ in self.each(snapshot, feedback):
            pass
        return self.sight

    def each(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> Iterator[AgentSight]:
        """The same, agent by agent in the order of the task: the first can be asked while others are still looked for.

        The whole is in `sight` when the last agent has been taken.
        """
        self._roster.update(snapshot.own, snapshot.response.observation.player_common)
        scene = Scene(snapshot, self._task.frames)
        before, told = self._before.agents if self._before else {}, feedback or {}
        agents: dict[str, AgentSight] = {}
        for config in self._task.agents:
            seen = scene.agent(config, self._roster, before.get(config.name))
            text = render(seen, self._task, told.get(config.name, Feedback()))
            agents[config.name] = replace(seen, text=text)
            yield agents[config.name]
        self._before = scene.sight(agents)

    @property
    def sight(self) -> Sight:
        """What was seen last."""
        assert self._before is not None, "nothing has been observed in this episode"
        return self._before
