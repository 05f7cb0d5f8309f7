"""What each agent of a side sees, observation after observation: the outward half of a turn.

    observer.begin()                                     a new episode
    sight = observer.observe(snapshot, feedback)         sight.agents["Zealots"].text, .view

An observer remembers who has which unit and the sight before, and nothing else; what it says is a function of
the snapshots and feedbacks that it was given since `begin`. No clock, no bus.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bridge.observe.sight import Sight, look
from bridge.observe.teams import Roster
from bridge.observe.text import Feedback, render

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bridge.snapshot import Snapshot
    from bridge.task import TaskConfig


class Observer:
    """The eyes of one side."""

    def __init__(self, task: TaskConfig) -> None:
        self._task = task
        self.begin()

    def begin(self) -> None:
        """Forgets the episode before."""
        self._roster = Roster(self._task.agents)
        self._before: Sight | None = None

    def observe(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> Sight:
        """What every agent sees now, with what it is told of its last reply.

        Args:
            snapshot: what the game says.
            feedback: by agent; agents that are not in it are told nothing.
        """
        self._roster.update(snapshot.own, snapshot.response.observation.player_common)
        sight = look(snapshot, self._task, self._roster, self._before)
        self._before = sight
        told = feedback or {}
        agents = {
            name: replace(agent, text=render(agent, self._task, told.get(name, Feedback())))
            for name, agent in sight.agents.items()
        }
        return replace(sight, agents=agents)
