"""One side of a match: what its agents see, what becomes of their words, and what each of them hears next.

A side knows its own task, its own snapshots and its own agents, and nothing of the other side. It owns no order and no
time: `khala_orchestrator.match.match` says when an agent is asked and when its decision takes effect. What is to be
said to an agent (what was accepted and rejected, and who wrote to it) waits here until it is asked again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act import Actor
from khala_bridge.observe import Feedback, Observer, shortened
from khala_bridge.observe.triggers import triggers, vitals
from khala_orchestrator.match.turn import Question
from khala_orchestrator.roster import Seat
from khala_orchestrator.words.letters import Letters
from khala_orchestrator.words.mailbox import Mailbox, newest
from khala_orchestrator.words.notebook import Notebook
from khala_orchestrator.words.repeats import Repeats
from khala_protocol.messages import LOOPS_PER_S, AgentReport, Message, Observation, Received, Rejection, Report
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from khala_bridge.act import Command, JointAction
    from khala_bridge.game.game import StepResult
    from khala_bridge.observe import AgentObservation, SideObservation
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.schedule import Decision, StepId
    from khala_orchestrator.words.mailbox import Post
    from khala_protocol.messages import Advice, Fate, Timings, Trigger, Unasked
    from khala_protocol.speech import Speech


class Played(NamedTuple):
    """What a side does in one step: its decisions, and the commands and messages that came of them."""

    decisions: Sequence[Decision]
    joint: JointAction
    post: Post
    unnoted: Mapping[str, Sequence[Rejection]] = MappingProxyType({})
    """By agent, why notes were not kept or forgotten."""

    @property
    def commands(self) -> Sequence[Command]:
        """What the game is to carry out."""
        return self.joint.commands


@dataclass
class Side:
    """One side of a match; see the module."""

    task: TaskConfig
    """Of this side alone."""
    run: str
    observer: Observer = field(init=False)
    actor: Actor = field(init=False)
    mailbox: Mailbox = field(init=False)
    notebook: Notebook = field(init=False)
    letters: Letters = field(init=False)
    _repeats: Repeats = field(init=False, default_factory=Repeats)
    _now: SideObservation = field(init=False)
    _seen: dict[str, AgentObservation] = field(init=False, default_factory=dict)
    """By agent, the observation that it decides on."""
    _vitals: dict[str, dict[int, float]] = field(init=False, default_factory=dict)
    """By agent, health of its units at its last observation."""
    _pending: dict[str, Feedback] = field(init=False, default_factory=dict)
    """By agent, what has become new since its last observation."""
    _finds: dict[str, Feedback] = field(init=False, default_factory=dict)
    """By agent, what it finds in its next observation: what is new, and what stays."""

    def __post_init__(self) -> None:
        task = self.task
        reach = {self.seat(a.name): [self.seat(other.name) for other in task.correspondents(a)] for a in task.agents}
        self.observer = Observer(task)
        self.actor = Actor(task)
        advisers = {self.seat(adviser.name): adviser.role for adviser in task.advisers}
        memory = {agent.name: task.memory_of(agent) for agent in task.agents}
        self.notebook = Notebook({name: rule.notes for name, rule in memory.items()})
        self.letters = Letters({name: rule.messages_s for name, rule in memory.items()})
        self.mailbox = Mailbox(reach, task.channels if task.communication else (), advisers)

    @property
    def name(self) -> str:
        """The side's name in keys and reports."""
        return self.task.side

    @property
    def seats(self) -> Sequence[Seat]:
        """The seats of its agents, in the order of the task."""
        return [self.seat(agent.name) for agent in self.task.agents]

    @property
    def required(self) -> Sequence[str]:
        """The agents that it cannot do without."""
        return [agent.name for agent in self.task.agents if agent.required]

    def seat(self, agent: str) -> Seat:
        """Return the seat of an agent of this side."""
        return Seat(self.name, agent)

    def begin(self) -> None:
        """Forget the episode before."""
        for part in (self.mailbox, self.notebook, self.letters, self._repeats):
            part.clear()
        self.observer.begin()
        self.actor.begin()
        self._seen.clear()
        self._vitals.clear()
        self._pending = {agent.name: Feedback() for agent in self.task.agents}

    # --- seeing -------------------------------------------------------------------------------------

    def look(self, snapshot: Snapshot) -> None:
        """Take in the present state of the game."""
        self._finds = {agent: self._all_for(agent, snapshot.game_loop) for agent in self._pending}
        self._now = self.observer.observe(snapshot, self._finds)

    def _all_for(self, agent: str, loop: int) -> Feedback:
        new = self._pending[agent]
        messages = self.letters.of(agent, new.messages, loop)
        notes = self.notebook.of(agent)
        standing = self.actor.standing.views(agent)
        return replace(new, messages=messages, notes=notes, standing=standing)

    def happened(self, agent: str) -> Collection[Trigger]:
        """Return what happened to an agent since its last observation."""
        found: set[Trigger] = set(triggers(self._now, agent, self._vitals.get(agent, {})))
        if self._pending[agent].messages:
            found.add("message")
        return found

    def is_needed(self, agent: str) -> bool:
        """Return whether an agent has anything to decide: units, orders to the whole side, a message, or nothing else.

        An agent without teams only talks, and does so whenever it is asked.
        """
        config = self.task.agent(agent)
        return bool(
            config.ask == "always" or not config.teams or self._now.teams[agent] or self._pending[agent].messages
        )

    def question(self, agent: str, at: StepId) -> Question:
        """Return an agent's observation of the present state, with all that was to be said to it."""
        seen, heard = self._now.agents[agent], self._finds[agent]
        self._seen[agent], self._pending[agent] = seen, Feedback()
        self.letters.shown(agent)
        self.actor.standing.seen(agent)
        self._vitals[agent] = vitals(self._now, agent)
        observation = Observation(
            run=self.run,
            agent=agent,
            side=self.name,
            episode=at.episode,
            step=at.step,
            game_loop=self._now.snapshot.game_loop,
            answer_within_s=self.task.clock.max_wait_s,
            text=seen.text,
            view=seen.view,
            images=tuple(picture.ref for picture in seen.pictures),
            accepted=heard.accepted,
            rejections=heard.rejections,
            messages=heard.messages,
        )
        return Question(observation, [picture.data for picture in seen.pictures])

    # --- acting -------------------------------------------------------------------------------------

    def act(self, at: StepId, decisions: Sequence[Decision], advice: Sequence[Advice] = ()) -> Played:
        """Return what comes of the decisions that take effect now, and of what advisers wrote meanwhile."""
        heard = {decision.seat.agent: self._speech(decision) for decision in decisions}
        speeches = {agent: speech for agent, speech in heard.items() if speech is not None}
        joint = self.actor.joint(self._now, speeches, self._seen)
        messages = [
            Message(
                run=self.run,
                agent=agent,
                side=self.name,
                episode=at.episode,
                step=at.step,
                recipient=said.recipient,
                text=said.text,
            )
            for agent, speech in speeches.items()
            for said in speech.messages
        ]
        messages += [self._advised(at, one) for one in advice]
        for agent, speech in speeches.items():
            for listen in speech.listens:
                self.mailbox.listen(self.seat(agent), listen.channel)
        return Played(decisions, joint, self.mailbox.deliver(messages), self._note(speeches))

    def _note(self, speeches: Mapping[str, Speech]) -> dict[str, Sequence[Rejection]]:
        time_s = round(self._now.snapshot.game_loop / LOOPS_PER_S, 1)
        return {agent: tuple(self.notebook.take(agent, said.notes, time_s)) for agent, said in speeches.items()}

    def _advised(self, at: StepId, advice: Advice) -> Message:
        return Message(
            run=self.run,
            agent=advice.agent,
            side=self.name,
            episode=at.episode,
            step=at.step,
            recipient=advice.recipient,
            text=advice.text,
            human=True,
        )

    def _speech(self, decision: Decision) -> Speech | None:
        """Return what an agent says: the only place where a reply is parsed. None if it failed, and nothing stands in.

        The default reply stands in for an agent that failed, and not for one that chose to say nothing.
        """
        answer = decision.answer
        text = answer.text if answer.status == "ok" else answer.text or self.task.default_reply or None
        speech = None if text is None else parse(text)
        if speech is None or not self._is_too_old(decision):
            return speech
        faults = [_too_old(decision, call.name, call.start) for call in speech.calls[:1]]
        return replace(speech, calls=(), faults=(*speech.faults, *faults))

    def _is_too_old(self, decision: Decision) -> bool:
        limit = self.task.clock.max_age_loops
        return limit is not None and decision.due_loop - decision.asked_loop > limit

    # --- reporting ----------------------------------------------------------------------------------

    def report(
        self,
        at: StepId,
        played: Played,
        result: StepResult,
        timings: Timings,
        incidents: Sequence[str] = (),
        unasked: Mapping[Seat, Unasked] = MappingProxyType({}),
    ) -> Report:
        """Return the report of a step, and keep what each agent is to hear of it."""
        heard = {seat.agent: self._heard(seat, played, result) for seat in self.seats}
        before, after = self._now.snapshot.score, result.snapshot.score
        self._deliver(played.post)
        for agent, feedback in heard.items():
            self._pending[agent] = _joined(self._pending[agent], feedback)
        return Report(
            run=self.run,
            side=self.name,
            episode=at.episode,
            step=at.step,
            game_loop=result.snapshot.game_loop,
            agents=tuple(
                self._agent(at, decision, played, heard[decision.seat.agent]) for decision in played.decisions
            ),
            messages=tuple(Received(sender=m.agent, recipient=m.recipient, text=m.text) for m in played.post.taken),
            advisers=tuple(m.agent for m in played.post.taken if m.human),
            functions=result.played.functions,
            env_steps=result.env_steps,
            score=after.total,
            killed_value=after.killed - before.killed,
            lost_value=after.lost - before.lost,
            unasked={seat.agent: why for seat, why in unasked.items() if seat.side == self.name},
            incidents=tuple(incidents),
            timings=timings,
        )

    def _deliver(self, post: Post) -> None:
        """Close the messages that were answered, and keep the new ones."""
        for message in post.taken:
            if not message.human:
                self.letters.answered(message.agent, [message.recipient])
        for seat, messages in post.received.items():
            self.letters.arrive(seat.agent, messages, self._now.snapshot.game_loop)

    def _heard(self, seat: Seat, played: Played, result: StepResult) -> Feedback:
        joint = played.joint
        rejections: tuple[Rejection, ...] = (
            *joint.rejections.get(seat.agent, ()),
            *(refusal.rejection for refusal in result.played.refusals if refusal.agent == seat.agent),
            *played.post.rejections.get(seat, ()),
            *played.unnoted.get(seat.agent, ()),
        )
        if any(decision.seat == seat for decision in played.decisions):
            rejections = self._repeats.counted(seat.agent, rejections, self._offers(seat.agent))
        accepted = joint.accepted.get(seat.agent, ())
        wrote = any(m.agent == seat.agent for m in played.post.taken)
        received = played.post.received.get(seat, ())
        return Feedback(accepted, shortened(rejections), received, ordered=bool(accepted) or wrote)

    def _offers(self, agent: str) -> dict[str, Sequence[str]]:
        """Return by team the actions that were valid when an agent decided."""
        teams = self._seen[agent].view.teams if agent in self._seen else ()
        return {team.name: [action.name for action in team.actions] for team in teams}

    def _agent(self, at: StepId, decision: Decision, played: Played, heard: Feedback) -> AgentReport:
        agent, loop = decision.seat.agent, self._now.snapshot.game_loop
        fate: Fate | None = "refused" if self._is_too_old(decision) else played.joint.fates.get(agent)
        return _reported(at, decision, loop, fate=fate, accepted=heard.accepted, rejections=heard.rejections)

    def dropped(self, at: StepId, decisions: Sequence[Decision], loop: int) -> Sequence[AgentReport]:
        """Return the reports of decisions that did not take effect before the end of the episode."""
        own = (decision for decision in decisions if decision.seat.side == self.name)
        return [_reported(at, decision, loop, fate="dropped") for decision in own]


def sides_of(config: MatchConfig) -> list[Side]:
    """Return the sides of a match, in the order of the game's players."""
    return [Side(task, config.run) for task in config.task.per_side()]


def _reported(
    at: StepId,
    decision: Decision,
    loop: int,
    *,
    fate: Fate | None,
    accepted: tuple[str, ...] = (),
    rejections: tuple[Rejection, ...] = (),
) -> AgentReport:
    answer = decision.answer
    return AgentReport(
        agent=decision.seat.agent,
        side=decision.seat.side,
        status=answer.status,
        detail=answer.detail,
        reason=answer.reason,
        latency_s=answer.latency_s,
        accepted=accepted,
        rejections=rejections,
        ignored=answer.ignored,
        usage=answer.usage,
        asked_step=None if decision.asked == at else decision.asked.step,
        age_loops=loop - decision.asked_loop,
        fate=fate,
    )


def _too_old(decision: Decision, text: str, start: int) -> Rejection:
    age = decision.due_loop - decision.asked_loop
    message = f"Your reply came {age} game loops after its observation, which is too late: no order of it was given."
    return Rejection(reason="too_late", message=message, text=text, start=start)


def _joined(before: Feedback, more: Feedback) -> Feedback:
    """Return two feedbacks as one, the older first; of the messages those that still fit into an observation."""
    accepted, rejections = before.accepted + more.accepted, before.rejections + more.rejections
    messages = newest(before.messages + more.messages)
    ordered = before.ordered or more.ordered
    return Feedback(accepted, rejections, messages, ordered=ordered)
