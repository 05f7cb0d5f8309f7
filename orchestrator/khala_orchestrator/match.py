"""The match: reset, observe, ask, act, until the episode is over.

The loop reads like the turn in docs/design/turn.md. It owns only the order: `khala_bridge.observe` decides what agents
see, `khala_orchestrator.turn` which replies are in time, `khala_bridge.act` what their words do, and
`khala_orchestrator.mailbox` who hears which message. It needs no bus: a recording can stand in for the agents
(`AgentPool`).
"""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

from khala_bridge.observe import Feedback, shortened
from khala_orchestrator.cards import briefing
from khala_orchestrator.roster import Seat
from khala_orchestrator.tally import Tally
from khala_orchestrator.turn import Question
from khala_protocol.messages import AgentReport, Message, Observation, Received, Report, Timings
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator, Mapping, Sequence

    from khala_bridge.act import Actor, JointAction
    from khala_bridge.game.game import Sides, StepResult
    from khala_bridge.observe import AgentObservation, Observer, SideObservation
    from khala_bridge.state import Snapshot
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.mailbox import Mailbox, Post
    from khala_orchestrator.turn import AgentPool, Answers
    from khala_protocol.messages import Briefing, Rejection, Result
    from khala_protocol.speech import Speech

Phase = Literal["observe", "act", "game"]


class MatchObserver(Protocol):
    """What is notified of events in a match."""

    async def brief(self, briefing: Briefing) -> None:
        """Take a briefing, before the first observation of an episode."""
        ...

    async def message(self, message: Message) -> None:
        """Take a message from one agent to another or to a channel, before the report of the step."""
        ...

    async def report(self, report: Report) -> None:
        """Take the report of a step."""
        ...

    async def result(self, result: Result) -> None:
        """Take the result of an episode."""
        ...


class SilentObserver:
    """A `MatchObserver` that does nothing."""

    async def brief(self, briefing: Briefing) -> None:
        """Do nothing."""

    async def message(self, message: Message) -> None:
        """Do nothing."""

    async def report(self, report: Report) -> None:
        """Do nothing."""

    async def result(self, result: Result) -> None:
        """Do nothing."""


class StepId(NamedTuple):
    """One step of a run."""

    episode: int
    step: int


class StepOutcome(NamedTuple):
    """The outcome of a step: its report, and what the next step begins with."""

    report: Report
    snapshot: Snapshot
    feedback: Mapping[str, Feedback]


@dataclass
class Match:
    """One side's agents in one game, for a number of episodes."""

    config: MatchConfig
    game: Sides
    observer: Observer
    actor: Actor
    agents: AgentPool
    mailbox: Mailbox
    match_observer: MatchObserver

    async def play(self) -> AsyncIterator[Result]:
        """Play every episode and yield its result."""
        for episode in range(self.config.episodes):
            yield await self._episode(episode)

    async def _episode(self, episode: int) -> Result:
        began = time.perf_counter()
        await self._begin(episode)
        (snapshot,) = await self.game.reset()
        tally, step = Tally(snapshot), 0
        feedback: Mapping[str, Feedback] = {}
        while not snapshot.ended and step != self.config.task.max_steps:
            report, snapshot, feedback = await self._step(StepId(episode, step), snapshot, feedback)
            tally.add(report, snapshot)
            await self.match_observer.report(report)
            step += 1
        result = tally.result(self.config.run, episode, wall_s=time.perf_counter() - began)
        await self.match_observer.result(result)
        return result

    async def _step(self, at: StepId, snapshot: Snapshot, feedback: Mapping[str, Feedback]) -> StepOutcome:
        watch = Stopwatch()
        with watch.phase("observe"):
            observation = self.observer.observe(snapshot, feedback)
        answers = await self.agents.ask(self._questions(at, observation, feedback, watch))
        with watch.phase("act"):
            speeches = self._speeches(answers)
            joint = self.actor.joint(observation, speeches)
            post = await self._deliver(self._messages(at, speeches), speeches)
        with watch.phase("game"):
            (result,) = await self.game.act([joint.commands], self.config.task.clock.step_loops)
        heard = self._feedback(joint, result, post)
        report = self._report(at, answers, post.taken, heard, result, watch.timings(answers))
        return StepOutcome(report, result.snapshot, heard)

    async def _begin(self, episode: int) -> None:
        self.observer.begin()
        self.mailbox.clear()
        for agent in self.config.task.agents:
            await self.match_observer.brief(briefing(self.config.task, agent, self.config.run, episode))

    def _questions(
        self, at: StepId, observation: SideObservation, feedback: Mapping[str, Feedback], watch: Stopwatch
    ) -> Iterator[Question]:
        """Yield a question per agent, made on demand: the first agent thinks while others' observations are made."""
        for agent in self.config.task.agents:
            with watch.phase("observe"):
                seen, heard = observation.agents[agent.name], feedback.get(agent.name, Feedback())
                question = self._question(at, observation.snapshot.game_loop, seen, heard)
            yield question

    def _question(self, at: StepId, game_loop: int, seen: AgentObservation, heard: Feedback) -> Question:
        task = self.config.task
        observation = Observation(
            run=self.config.run,
            agent=seen.agent.name,
            side=task.side,
            episode=at.episode,
            step=at.step,
            game_loop=game_loop,
            answer_within_s=task.clock.max_wait_s,
            text=seen.text,
            view=seen.view,
            images=tuple(picture.ref for picture in seen.pictures),
            accepted=heard.accepted,
            rejections=heard.rejections,
            messages=heard.messages,
        )
        return Question(observation, [picture.data for picture in seen.pictures])

    def _speeches(self, answers: Answers) -> dict[str, Speech]:
        """Return what each agent says, in the order of the task: the only place where a reply is parsed."""
        default = self.config.task.default_reply
        texts = {seat.agent: answer.text or default for seat, answer in answers.by_seat.items()}
        return {agent: parse(text) for agent, text in texts.items() if text}

    def _messages(self, at: StepId, speeches: Mapping[str, Speech]) -> Sequence[Message]:
        """Return the messages of agents to each other, in the order of the task and of their words."""
        return [
            Message(
                run=self.config.run,
                agent=agent,
                side=self.config.task.side,
                episode=at.episode,
                step=at.step,
                recipient=said.recipient,
                text=said.text,
            )
            for agent, speech in speeches.items()
            for said in speech.messages
        ]

    async def _deliver(self, messages: Sequence[Message], speeches: Mapping[str, Speech]) -> Post:
        for agent, speech in speeches.items():
            for listen in speech.listens:
                self.mailbox.listen(Seat(self.config.task.side, agent), listen.channel)
        post = self.mailbox.deliver(messages)
        for message in post.taken:
            await self.match_observer.message(message)
        return post

    def _feedback(self, joint: JointAction, result: StepResult, post: Post) -> dict[str, Feedback]:
        feedback = {}
        for agent in self.config.task.agents:
            seat = Seat(self.config.task.side, agent.name)
            refused = (r.rejection for r in result.played.refusals if r.agent == agent.name)
            rejections: tuple[Rejection, ...] = (
                *joint.rejections.get(agent.name, ()),
                *refused,
                *post.rejections.get(seat, ()),
            )
            accepted, received = joint.accepted.get(agent.name, ()), post.received.get(seat, ())
            feedback[agent.name] = Feedback(accepted, shortened(rejections), received)
        return feedback

    def _report(
        self,
        at: StepId,
        answers: Answers,
        messages: Sequence[Message],
        feedback: Mapping[str, Feedback],
        result: StepResult,
        timings: Timings,
    ) -> Report:
        agents = tuple(
            AgentReport(
                agent=seat.agent,
                side=seat.side,
                status=answer.status,
                detail=answer.detail,
                latency_s=answer.latency_s,
                accepted=feedback[seat.agent].accepted,
                rejections=feedback[seat.agent].rejections,
                ignored=answer.ignored,
                usage=answer.usage,
            )
            for seat, answer in answers.by_seat.items()
        )
        return Report(
            run=self.config.run,
            episode=at.episode,
            step=at.step,
            game_loop=result.snapshot.game_loop,
            agents=agents,
            messages=tuple(Received(sender=m.agent, recipient=m.recipient, text=m.text) for m in messages),
            functions=result.played.functions,
            env_steps=result.env_steps,
            score=result.snapshot.score.total,
            timings=timings,
        )


class Stopwatch:
    """Seconds that each phase of a step took."""

    def __init__(self) -> None:
        self._took_s: dict[Phase, float] = defaultdict(float)

    @contextmanager
    def phase(self, name: Phase) -> Iterator[None]:
        """Add the time inside to a phase."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._took_s[name] += time.perf_counter() - began

    def timings(self, answers: Answers) -> Timings:
        """Return all phases of a step; `Answers` brings the time of asking."""
        return Timings(
            observe_s=self._took_s["observe"],
            publish_s=answers.publish_s,
            wait_s=answers.wait_s,
            act_s=self._took_s["act"],
            game_s=self._took_s["game"],
        )
