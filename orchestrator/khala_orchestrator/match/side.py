"""One side of a match: what its agents see, what becomes of their words, and what each of them hears next.

A side knows its own task, its own snapshots and its own agents, and nothing of the other side. It owns no order and no
time: `khala_orchestrator.match.match` says when an agent is asked and when its decision takes effect. The feedback on
an agent's words, and the messages of others, wait in its `_Member` until it is asked again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act import Actor, Casts
from khala_bridge.observe import Feedback, Observer, shorten
from khala_bridge.observe.triggers import triggers, vitals
from khala_orchestrator.match import replies
from khala_orchestrator.match.turn import Question
from khala_orchestrator.roster import Seat
from khala_orchestrator.words.letters import Letters
from khala_orchestrator.words.mailbox import Mailbox, newest
from khala_orchestrator.words.notebook import Notebook
from khala_orchestrator.words.repeats import Repeats
from khala_protocol.manual import manual
from khala_protocol.messages import LOOPS_PER_S, AgentReport, Message, Observation, Received, Rejection, Report
from khala_protocol.speech import ShownText, parse

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from khala_bridge.act import Command, JointAction
    from khala_bridge.game.game import StepResult
    from khala_bridge.observe import AgentObservation, SideObservation
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.schedule import Decision, StepId
    from khala_orchestrator.match.turn import Answer
    from khala_orchestrator.words.mailbox import Post
    from khala_protocol.messages import Advice, CastView, Fate, StandingView, Timings, Trigger, Unasked
    from khala_protocol.speech import Speech


JUDGED = frozenset({"ok", "empty", "cut", "refused", "filtered"})
"""Statuses of replies that a model gave, after which its agent may rethink."""


class SideTurn(NamedTuple):
    """The part of a side in one step: its decisions, and the commands and messages that came of them."""

    before: Snapshot
    """The state of the game in which the decisions take effect."""
    decisions: Sequence[Decision]
    joint: JointAction
    post: Post
    other_rejections: Mapping[str, Sequence[Rejection]]
    """By agent, what is wrong with its notes, its channels, and its reply as a whole."""

    @property
    def commands(self) -> Sequence[Command]:
        """The commands that the game is to carry out."""
        return self.joint.commands


@dataclass(slots=True)
class _Member:
    """One agent in an episode: the observation that it decides on, and what it is to hear in the next one."""

    notebook: Notebook
    letters: Letters
    manual: ShownText
    """How its prompt says that calls are written."""
    repeats: Repeats = field(default_factory=Repeats)
    seen: AgentObservation | None = None
    """Its newest observation; None before the first one."""
    vitals: Mapping[int, float] = field(default_factory=dict)
    """Health and shield of its units in that observation, by tag."""
    news: Feedback = field(default_factory=Feedback)
    """The feedback and the messages since that observation."""

    def shown(self, verdicts: Sequence[str] = ()) -> ShownText:
        """Return what it has read, also of the host's verdicts: a reply that repeats it orders nothing."""
        return ShownText(self.seen.text, *verdicts, earlier=self.manual) if self.seen else self.manual

    def offers(self) -> dict[str, Sequence[str]]:
        """Return by team the actions that were possible when it decided."""
        teams = self.seen.view.teams if self.seen else ()
        return {team.name: [action.name for action in team.actions] for team in teams}


@dataclass
class MatchSide:
    """One side of a match; see the module."""

    task: TaskConfig
    """Of this side alone."""
    run: str
    _observer: Observer = field(init=False)
    _actor: Actor = field(init=False)
    _casts: Casts = field(default_factory=Casts, init=False)
    _mailbox: Mailbox = field(init=False)
    _members: dict[str, _Member] = field(init=False)
    """By the name of the agent, in the order of the task."""
    _now: SideObservation = field(init=False)

    def __post_init__(self) -> None:
        task = self.task
        reach = {self.seat(a.name): [self.seat(other.name) for other in task.correspondents(a)] for a in task.agents}
        advisers = {self.seat(adviser.name): adviser.role for adviser in task.advisers}
        self._observer = Observer(task)
        self._actor = Actor(task)
        self._mailbox = Mailbox(reach, task.channels if task.communication else (), advisers)

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
        self._observer.begin()
        self._actor.begin()
        self._casts.begin()
        self._mailbox.clear()
        self._members = {}
        for agent in self.task.agents:
            memory = self.task.memory_of(agent)
            known = ShownText(manual(agent.specs()))
            self._members[agent.name] = _Member(Notebook(memory.notes), Letters(memory.messages_s), known)

    # --- seeing -------------------------------------------------------------------------------------

    def look(self, snapshot: Snapshot) -> None:
        """Take in the present state of the game."""
        feedback = {
            name: replace(
                member.news,
                messages=member.letters.read(member.news.messages, snapshot.game_loop),
                notes=member.notebook.notes,
            )
            for name, member in self._members.items()
        }
        self._now = self._observer.observe(snapshot, feedback, self._standing)

    def _standing(self, agent: str) -> tuple[StandingView, ...]:
        return self._actor.standing_views(agent, self._now)

    def triggers_of(self, agent: str) -> Collection[Trigger]:
        """Return what happened to an agent since its last observation."""
        member = self._members[agent]
        found: set[Trigger] = set(triggers(self._now, agent, member.vitals))
        if member.news.messages:
            found.add("message")
        return found

    def is_needed(self, agent: str) -> bool:
        """Return whether an agent has anything to decide: units, orders to the whole side, a message, or nothing else.

        An agent without teams only talks, and does so whenever it is asked.
        """
        config = self.task.agent(agent)
        news = self._members[agent].news
        return bool(config.ask == "always" or not config.teams or self._now.teams[agent] or news.messages)

    def question(self, agent: str, at: StepId) -> Question:
        """Show an agent the present state, with all that it is to hear; return the question for it."""
        member = self._members[agent]
        member.seen = seen = self._now.agents[agent]
        member.vitals = vitals(self._now, agent)
        member.news = Feedback()
        member.letters.mark_shown()
        self._actor.standing.forget_ended(agent)
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
            accepted=seen.heard.accepted,
            casts=seen.heard.casts,
            rejections=seen.heard.rejections,
            messages=seen.heard.messages,
        )
        return Question(observation, [picture.data for picture in seen.pictures])

    # --- judging ------------------------------------------------------------------------------------

    def judge(self, agent: str, answer: Answer) -> str:
        """Return the verdict on a reply of which nothing is possible; "" if something is, or if it tries nothing.

        It is judged alone and at this moment, as if it took effect now, and nothing comes of it. A reply that only
        writes to others is possible. What an agent did not get from its model is not judged.
        """
        member = self._members[agent]
        if member.seen is None or answer.status not in JUDGED:
            return ""
        speech = parse(answer.text or "", member.shown(answer.verdicts))
        if speech.messages and not speech.calls and not speech.standing:
            return ""
        accepted, refused = self._actor.judge(self._now, speech, member.seen)
        unread = replies.say_unread(answer, agent, speech, self.task)
        rejections = (*refused, *unread)
        return replies.verdict_words(rejections) if rejections and not accepted else ""

    # --- acting -------------------------------------------------------------------------------------

    def act(self, at: StepId, decisions: Sequence[Decision], advice: Sequence[Advice] = ()) -> SideTurn:
        """Carry out the decisions of this side that take effect now, and deliver what its agents and advisers wrote.

        Args:
            at: the present step.
            decisions: of all sides.
            advice: of all sides, since the step before.
        """
        own = [decision for decision in decisions if decision.seat.side == self.name]
        words = {
            decision.seat.agent: replies.read(
                decision, self.task, self._members[decision.seat.agent].shown(decision.answer.verdicts)
            )
            for decision in own
        }
        speeches = {agent: speech for agent, speech in words.items() if speech is not None}
        seen = {name: member.seen for name, member in self._members.items() if member.seen is not None}
        joint = self._actor.joint(self._now, speeches, seen)
        messages = [
            self._message(at, agent, said.recipient, said.text)
            for agent, speech in speeches.items()
            for said in speech.messages
        ]
        messages += [
            self._message(at, advised.agent, advised.recipient, advised.text, human=True)
            for advised in advice
            if advised.side == self.name
        ]
        refused = {decision.seat.agent: tuple(self._take_in(decision, words[decision.seat.agent])) for decision in own}
        return SideTurn(self._now.snapshot, own, joint, self._mailbox.deliver(messages), refused)

    def _take_in(self, decision: Decision, speech: Speech | None) -> Iterator[Rejection]:
        """Take the notes and the channels of a reply; yield what is wrong with them, and with the reply as a whole."""
        seat = decision.seat
        for listen in speech.listens if speech else ():
            if fault := self._mailbox.listen(seat, listen.channel):
                yield fault
        time_s = round(self._now.snapshot.game_loop / LOOPS_PER_S, 1)
        yield from self._members[seat.agent].notebook.take(speech.notes if speech else (), time_s)
        yield from replies.say_unread(decision.answer, seat.agent, speech, self.task)

    def _message(self, at: StepId, agent: str, recipient: str, text: str, *, human: bool = False) -> Message:
        return Message(
            run=self.run,
            agent=agent,
            side=self.name,
            episode=at.episode,
            step=at.step,
            recipient=recipient,
            text=text,
            human=human,
        )

    # --- reporting ----------------------------------------------------------------------------------

    def report(
        self,
        at: StepId,
        turn: SideTurn,
        result: StepResult,
        timings: Timings,
        incidents: Sequence[str] = (),
        unasked: Mapping[Seat, Unasked] = MappingProxyType({}),
    ) -> Report:
        """Return the report of a step, and keep what each agent is to hear of it."""
        casts = self._casts.follow(turn.commands, turn.before, result.snapshot, result.played.refusals)
        feedback = {seat.agent: self._feedback(seat, turn, result, casts.get(seat.agent, ())) for seat in self.seats}
        before = turn.before.score
        after = result.snapshot.score
        for message in turn.post.taken:
            if not message.human:
                self._members[message.agent].letters.close(message.recipient)
        for seat, messages in turn.post.received.items():
            self._members[seat.agent].letters.add(messages, turn.before.game_loop)
        for name, member in self._members.items():
            member.news = _join(member.news, feedback[name])
        return Report(
            run=self.run,
            side=self.name,
            episode=at.episode,
            step=at.step,
            game_loop=result.snapshot.game_loop,
            agents=tuple(
                _agent_report(
                    at, decision, turn.before.game_loop, self._fate(decision, turn), feedback[decision.seat.agent]
                )
                for decision in turn.decisions
            ),
            messages=tuple(Received(sender=m.agent, recipient=m.recipient, text=m.text) for m in turn.post.taken),
            advisers=tuple(m.agent for m in turn.post.taken if m.human),
            functions=result.played.functions,
            env_steps=result.env_steps,
            score=after.total,
            killed_value=after.killed - before.killed,
            lost_value=after.lost - before.lost,
            unasked={seat.agent: why for seat, why in unasked.items() if seat.side == self.name},
            incidents=tuple(incidents),
            timings=timings,
        )

    def _feedback(self, seat: Seat, turn: SideTurn, result: StepResult, casts: Sequence[CastView]) -> Feedback:
        """Return what an agent is to hear of a step."""
        member = self._members[seat.agent]
        rejections: tuple[Rejection, ...] = (
            *turn.joint.rejections.get(seat.agent, ()),
            *(refusal.rejection for refusal in result.played.refusals if refusal.agent == seat.agent),
            *turn.post.rejections.get(seat, ()),
            *turn.other_rejections.get(seat.agent, ()),
        )
        if any(decision.seat == seat for decision in turn.decisions):
            rejections = member.repeats.annotate(rejections, member.offers())
        accepted = turn.joint.accepted.get(seat.agent, ())
        wrote = any(message.agent == seat.agent for message in turn.post.taken)
        received = turn.post.received.get(seat, ())
        ordered = bool(accepted) or wrote
        return Feedback(accepted, shorten(rejections), received, ordered=ordered, casts=tuple(casts))

    def _fate(self, decision: Decision, turn: SideTurn) -> Fate | None:
        return "refused" if replies.is_too_old(decision, self.task) else turn.joint.fates.get(decision.seat.agent)

    def report_dropped(self, at: StepId, decisions: Sequence[Decision], loop: int) -> Sequence[AgentReport]:
        """Return the reports of decisions that did not take effect before the end of the episode."""
        own = (decision for decision in decisions if decision.seat.side == self.name)
        return [_agent_report(at, decision, loop, "dropped", Feedback()) for decision in own]


def sides_of(config: MatchConfig) -> list[MatchSide]:
    """Return the sides of a match, in the order of the game's players."""
    return [MatchSide(task, config.run) for task in config.task.per_side()]


def _agent_report(at: StepId, decision: Decision, loop: int, fate: Fate | None, heard: Feedback) -> AgentReport:
    answer = decision.answer
    return AgentReport(
        agent=decision.seat.agent,
        side=decision.seat.side,
        status=answer.status,
        detail=answer.detail,
        reason=answer.reason,
        latency_s=answer.latency_s,
        accepted=heard.accepted,
        rejections=heard.rejections,
        ignored=answer.ignored,
        rethinks=len(answer.verdicts),
        human=answer.human,
        usage=answer.usage,
        asked_step=None if decision.asked == at else decision.asked.step,
        age_loops=loop - decision.asked_loop,
        fate=fate,
    )


def _join(before: Feedback, more: Feedback) -> Feedback:
    """Return two feedbacks as one, the older first; of the messages those that still fit into an observation."""
    return Feedback(
        before.accepted + more.accepted,
        before.rejections + more.rejections,
        newest(before.messages + more.messages),
        ordered=before.ordered or more.ordered,
        casts=tuple({cast.call: cast for cast in (*before.casts, *more.casts)}.values()),
    )
