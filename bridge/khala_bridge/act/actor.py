"""From the replies of a side to one joint action: the second half of a turn.

    joint = Actor(task).joint(observation, {"Zealots": parse(text), …})      what every agent wants, checked
    plan = executor.plan(joint.commands, observation.snapshot, loops)        played by khala_bridge.game.game

All calls of a turn share the same minerals, vespene, supply and workers, in the order of the agents in the task and
of their words. The host's own orders come last, for units that no agent ordered. An actor keeps nothing between two
turns. The layer above decides which replies count and when one is too late.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.act.addressee import Addressees
from khala_bridge.act.raw import RawExecutor
from khala_bridge.act.recognise import recognise
from khala_bridge.act.rejected import CallRejected, reject
from khala_bridge.act.screen import ScreenExecutor
from khala_bridge.act.translate import Translator
from khala_bridge.act.vocabulary import Vocabulary
from khala_bridge.auto.workers import automatic
from khala_protocol.messages import Rejection

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_bridge.act.plan import Executor
    from khala_bridge.act.translate import Command
    from khala_bridge.observe.observation import AgentObservation, SideObservation
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Call
    from khala_protocol.speech import Speech


MOST_WRONG = 100
"""Calls of an agent that are read in addition to as many as may count: 4 600 wrong ones would take 1.3 s."""


@dataclass(frozen=True, slots=True)
class JointAction:
    """The commands of a side in one turn, and the result of each agent's calls."""

    commands: tuple[Command, ...] = ()
    """In the order of the agents in the task, and of their calls."""
    accepted: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By agent, `Stalker-1 <Attack_Unit(0x1)>`."""
    rejections: Mapping[str, tuple[Rejection, ...]] = field(default_factory=dict)
    """By agent, in the order of the text; malformed calls among them."""


class Actor:
    """Makes one joint action from the replies of a side's agents."""

    def __init__(self, task: TaskConfig) -> None:
        """Take the task, which says which actions each agent has."""
        self._task = task
        self._words = {agent.name: Vocabulary(agent) for agent in task.agents}

    def joint(self, observation: SideObservation, replies: Mapping[str, Speech]) -> JointAction:
        """Return the joint action of a turn.

        Args:
            observation: what the agents see at the moment when their replies take effect.
            replies: by agent; the units of an agent without a reply continue.
        """
        translator = Translator(
            observation, {agent.name: self._task.max_actions_of(agent) for agent in self._task.agents}
        )
        commands: list[Command] = []
        accepted: dict[str, tuple[str, ...]] = {}
        rejections: dict[str, tuple[Rejection, ...]] = {}
        for name, agent in observation.agents.items():
            speech = replies.get(name)
            if speech is None:
                continue
            ordered, said, faults = self._one(translator, agent, speech)
            commands += ordered
            accepted[name] = tuple(said)
            rejections[name] = tuple(sorted((*speech.faults, *faults), key=lambda fault: fault.start))
        for order in automatic(self._task.auto, observation.snapshot, translator.ledger, frozenset(translator.ordered)):
            commands += translator.commands(order)
        return JointAction(tuple(commands), accepted, rejections)

    def _one(
        self, translator: Translator, agent: AgentObservation, speech: Speech
    ) -> tuple[list[Command], list[str], list[Rejection]]:
        words = self._words[agent.agent.name]
        addressees = Addressees(agent, words)
        commands: list[Command] = []
        accepted: list[str] = []
        faults: list[Rejection] = []
        most = self._most_calls(agent)
        for call in speech.calls[:most]:
            recognised = recognise(call, words, addressees)
            if isinstance(recognised, Rejection):
                faults.append(recognised)
                continue
            for said in recognised:
                translated = translator.translate(said)
                if isinstance(translated, Rejection):
                    faults.append(translated)
                else:
                    commands += translated
                    accepted.append(said.text)
        if len(speech.calls) > most:
            faults.append(_unread(speech.calls[most:]))
        return commands, accepted, faults

    def _most_calls(self, agent: AgentObservation) -> int:
        """Return the number of calls of an agent that are read: all that may count, and some that are wrong."""
        return self._task.max_actions_of(agent.agent) * len(agent.teams) + MOST_WRONG


def _unread(calls: Sequence[Call]) -> Rejection:
    """Return the rejection of the calls of a reply that has far too many."""
    what = f"These are too many calls for one reply: this one and all behind it, {len(calls)}, were not read."
    return reject(calls[0], CallRejected("too_many_actions", what))


def executor_of(task: TaskConfig) -> Executor:
    """Return the executor that a task asks for."""
    return RawExecutor() if task.executor == "raw" else ScreenExecutor()
