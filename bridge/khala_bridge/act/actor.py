"""From the replies of a side to one joint action: the second half of a turn.

    joint = Actor(task).joint(observation, {"Zealots": parse(text), …})      what every agent wants, checked
    plan = executor.plan(joint.commands, observation.snapshot, loops)        played by khala_bridge.game.game

An agent may have decided on an earlier observation than the present one. Its words mean what it saw: its teams, their
units and their screens then. What they do is judged now: who is alive, what is in sight, what can be paid.

All calls of a turn share the same minerals, vespene, supply and workers, in the order of the agents in the task and
of their words. Standing orders come after them, and the host's own orders last, for units that no agent ordered. An
actor keeps the standing orders from turn to turn, and nothing else. The layer above decides which replies count and
when one is too late.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act.addressee import Addressees
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.act.recognise import recognise
from khala_bridge.act.rejected import CallRejected, reject
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.act.standing import StandingOrders
from khala_bridge.act.translate import Translator
from khala_bridge.act.until import read_until
from khala_bridge.act.vocabulary import Vocabulary
from khala_bridge.auto.workers import automatic
from khala_protocol.messages import Call, Rejection
from khala_protocol.speech import Revoke, Standing, render

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_bridge.act.plan import Executor
    from khala_bridge.act.translate import Command
    from khala_bridge.observe.observation import AgentObservation, SideObservation
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Fate, StandingView
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
    fates: Mapping[str, Fate] = field(default_factory=dict)
    """By agent."""


def fate(*, older: bool, accepted: bool, rejected: bool, hindered: bool) -> Fate:
    """Return the fate of a decision.

    Args:
        older: it was made on an earlier observation than the present one.
        accepted: a call of it is carried out.
        rejected: a call of it is not, for any reason.
        hindered: a call that was understood is not carried out, or not by all units that it was meant for.
    """
    if rejected and not accepted:
        return "refused"
    if not older:
        return "fresh"
    return "adapted" if hindered else "stale"


class _Outcome(NamedTuple):
    """The result of one agent's calls."""

    commands: list[Command]
    accepted: list[str]
    faults: list[Rejection]
    hindered: bool


class Actor:
    """Makes one joint action from the replies of a side's agents."""

    def __init__(self, task: TaskConfig) -> None:
        """Take the task, which says which actions each agent has."""
        self._task = task
        self._words = {agent.name: Vocabulary(agent) for agent in task.agents}
        self.standing = StandingOrders(task.standing_orders)

    def begin(self) -> None:
        """Forget the episode before."""
        self.standing.clear()

    def standing_views(self, agent: str, observation: SideObservation) -> tuple[StandingView, ...]:
        """Return an agent's standing orders, with what they wait for at this moment."""
        return self.standing.views(agent, observation, self._translator(observation))

    def joint(
        self,
        observation: SideObservation,
        speeches: Mapping[str, Speech],
        seen: Mapping[str, AgentObservation] | None = None,
    ) -> JointAction:
        """Return the joint action of a turn.

        Args:
            observation: of the moment at which the words take effect.
            speeches: by agent; the units of an agent without one continue.
            seen: by agent, the observation on which it decided; an agent that is not in it decided on the present one.
        """
        translator = self._translator(observation)
        commands: list[Command] = []
        accepted: dict[str, tuple[str, ...]] = {}
        rejections: dict[str, tuple[Rejection, ...]] = {}
        fates: dict[str, Fate] = {}
        for name in observation.agents:
            speech = speeches.get(name)
            if speech is None:
                continue
            saw = seen[name] if seen and name in seen else observation.agents[name]
            ordered, said, faults, hindered = self._carry_out(translator, saw, speech)
            taken, refused = self._stand(translator, observation, saw, speech, self.standing)
            commands += ordered
            said += taken
            faults += refused
            accepted[name] = tuple(said)
            rejections[name] = tuple(sorted((*speech.faults, *faults), key=lambda fault: fault.start))
            fates[name] = fate(
                older=saw.game_loop < observation.snapshot.game_loop,
                accepted=bool(said),
                rejected=bool(rejections[name]),
                hindered=hindered,
            )
        commands += self.standing.carry_out(observation, translator)
        for order in automatic(self._task.auto, observation.snapshot, translator.ledger, frozenset(translator.ordered)):
            commands += translator.commands(order)
        return JointAction(tuple(commands), accepted, rejections, fates)

    def judge(
        self, observation: SideObservation, speech: Speech, saw: AgentObservation
    ) -> tuple[Sequence[str], Sequence[Rejection]]:
        """Return which calls of an agent are possible now, without those of others, and why the others are not.

        Nothing comes of it: no order is given, and none begins to stand.
        """
        translator = self._translator(observation)
        outcome = self._carry_out(translator, saw, speech)
        taken, refused = self._stand(translator, observation, saw, speech, self.standing.copy())
        return [*outcome.accepted, *taken], [*speech.faults, *outcome.faults, *refused]

    def _translator(self, observation: SideObservation) -> Translator:
        return Translator(observation, {agent.name: self._task.max_actions_of(agent) for agent in self._task.agents})

    def _carry_out(self, translator: Translator, saw: AgentObservation, speech: Speech) -> _Outcome:
        words = self._words[saw.agent.name]
        addressees = Addressees(saw, words)
        commands: list[Command] = []
        accepted: list[str] = []
        faults: list[Rejection] = []
        hindered = False
        most = self._most_calls(saw)
        meant = [recognise(call, words, addressees) for call in speech.calls[:most]]
        translator.set_apart(said for found in meant if not isinstance(found, Rejection) for said in found)
        for found in meant:
            if isinstance(found, Rejection):
                faults.append(found)
                continue
            for said in found:
                translated = translator.translate(said)
                if isinstance(translated, Rejection):
                    faults.append(translated)
                    hindered = True
                else:
                    commands += translated
                    accepted.append(said.text)
                    hindered = hindered or translator.lacks_units(said)
        if len(speech.calls) > most:
            faults.append(_unread(speech.calls[most:]))
        return _Outcome(commands, accepted, faults, hindered)

    def _stand(
        self,
        translator: Translator,
        observation: SideObservation,
        saw: AgentObservation,
        speech: Speech,
        standing: StandingOrders,
    ) -> tuple[list[str], list[Rejection]]:
        """Begin and end the standing orders of one agent; return what was accepted, and what was not."""
        accepted: list[str] = []
        faults: list[Rejection] = []
        translator.set_apart(())
        for item in speech.standing[:MOST_WRONG]:
            try:
                if isinstance(item, Revoke):
                    standing.revoke(saw.agent.name, item.number)
                    accepted.append(render(_call_of(item)))
                else:
                    accepted += self._begin_standing(translator, observation, saw, item, standing)
            except CallRejected as refused:
                faults.append(reject(_call_of(item), refused))
        return accepted, faults

    def _begin_standing(
        self,
        translator: Translator,
        observation: SideObservation,
        saw: AgentObservation,
        item: Standing,
        standing: StandingOrders,
    ) -> Iterator[str]:
        """Begin a standing order of each team that it is for, and yield it as it was accepted.

        Raises:
            CallRejected: it cannot stand.
        """
        words = self._words[saw.agent.name]
        meant = recognise(item.call, words, Addressees(saw, words))
        until = read_until(item.until, observation.snapshot.facts)
        if isinstance(meant, Rejection):
            raise CallRejected(meant.reason, meant.message)
        for said in meant:
            if not words.has(said.team, said.action):
                raise CallRejected("not_available", f"Team {said.team.name} has no action {said.action.name}.")
            standing.begin(said, until, translator, observation)
            end = f", until {until.text}" if until.text else ""
            yield f"{said.team.name} <Standing({said.written[1:-1]}{end})>"

    def _most_calls(self, saw: AgentObservation) -> int:
        """Return the number of calls of an agent that are read: all that may count, and some that are wrong."""
        return self._task.max_actions_of(saw.agent) * len(saw.teams) + MOST_WRONG


def _call_of(item: Standing | Revoke) -> Call:
    """Return the call in a standing order, or the one that ends it, as its rejection names it."""
    if isinstance(item, Standing):
        return item.call
    return Call(name="Revoke", args=(str(item.number),), start=item.start, end=item.end)


def _unread(calls: Sequence[Call]) -> Rejection:
    """Return the rejection of the calls of a reply that has far too many."""
    what = f"These are too many calls for one reply: this one and all behind it, {len(calls)}, were not read."
    return reject(calls[0], CallRejected("too_many_actions", what)).but(others={"too_many_actions": len(calls)})


def executor_of(task: TaskConfig) -> Executor:
    """Return the executor that a task asks for."""
    return RawExecutor() if task.executor == "raw" else ScreenExecutor()
