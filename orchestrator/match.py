"""The match: reset, observe, ask, act, until the episode is over.

The loop reads like the turn in docs/design/turn.md. It owns nothing but the order: what agents see is
`bridge.observe`'s, who answered in time `orchestrator.turn`'s, what their words do `bridge.act`'s, who hears what
`orchestrator.mailbox`'s. It needs no bus: a recording can stand in for the agents (`Asking`).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from bridge.observe import Feedback
from orchestrator.brief import briefing
from orchestrator.roster import Seat
from orchestrator.tally import Tally
from orchestrator.turn import Question
from protocol.messages import AgentReport, Observation, Received, Report, Timings
from protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator, Mapping

    from bridge.act import Actor, JointAction
    from bridge.game import OneSide, Turn
    from bridge.observe import Observer
    from bridge.state import Snapshot
    from orchestrator.config import MatchConfig
    from orchestrator.mailbox import Mailbox, Post
    from orchestrator.turn import Answers, Asking
    from protocol.messages import Briefing, Rejection, Result
    from protocol.speech import Speech


class Telling(Protocol):
    """Where a match says what happens; `orchestrator.announce.Announcer` is one."""

    async def brief(self, briefing: Briefing) -> None:
        """Takes a briefing, before the first observation of an episode."""
        ...

    async def report(self, report: Report) -> None:
        """Takes the report of a step."""
        ...

    async def result(self, result: Result) -> None:
        """Takes the result of an episode."""
        ...


@dataclass(frozen=True, slots=True)
class At:
    """Where a match stands."""

    episode: int
    step: int


@dataclass
class Match:
    """One side's agents in one game, for a number of episodes."""

    config: MatchConfig
    game: OneSide
    observer: Observer
    actor: Actor
    asking: Asking
    mailbox: Mailbox
    telling: Telling

    async def play(self) -> AsyncIterator[Result]:
        """Plays every episode and yields its result."""
        for episode in range(self.config.episodes):
            yield await self._episode(episode)

    async def _episode(self, episode: int) -> Result:
        began = time.perf_counter()
        await self._begin(episode)
        snapshot = await self.game.reset()
        tally, feedback, step = Tally(snapshot), dict[str, Feedback](), 0
        while not snapshot.ended and step != self.config.task.max_steps:
            report, snapshot, feedback = await self._step(At(episode, step), snapshot, feedback)
            tally.add(report, snapshot)
            await self.telling.report(report)
            step += 1
        result = tally.result(self.config.run, episode, wall_s=time.perf_counter() - began)
        await self.telling.result(result)
        return result

    async def _step(
        self, at: At, snapshot: Snapshot, feedback: Mapping[str, Feedback]
    ) -> tuple[Report, Snapshot, dict[str, Feedback]]:
        watch = Stopwatch()
        answers = await self.asking.ask(self._questions(at, snapshot, feedback))
        ask_s = watch.lap()
        speeches = self._speeches(answers)
        joint = self.actor.joint(self.observer.sight, speeches)
        post = self._deliver(answers, speeches)
        act_s = watch.lap()
        turn = await self.game.act(joint.commands)
        timings = Timings(
            observe_s=ask_s - answers.publish_s - answers.wait_s,
            publish_s=answers.publish_s,
            wait_s=answers.wait_s,
            act_s=act_s,
            game_s=watch.lap(),
        )
        heard = self._feedback(joint, turn, post)
        return self._report(at, answers, heard, turn, timings), turn.snapshot, heard

    async def _begin(self, episode: int) -> None:
        self.observer.begin()
        self.mailbox.clear()
        for agent in self.config.task.agents:
            await self.telling.brief(briefing(self.config.task, agent, self.config.run, episode))

    def _questions(self, at: At, snapshot: Snapshot, feedback: Mapping[str, Feedback]) -> Iterator[Question]:
        """One for each agent, made when it is asked for: the first agent thinks while others are looked for."""
        task = self.config.task
        for seen in self.observer.each(snapshot, feedback):
            heard = feedback.get(seen.agent.name, Feedback())
            observation = Observation(
                run=self.config.run,
                agent=seen.agent.name,
                side=task.side,
                episode=at.episode,
                step=at.step,
                game_loop=snapshot.game_loop,
                answer_within_s=task.clock.max_wait_s,
                text=seen.text,
                view=seen.view,
                images=tuple(picture.ref for picture in seen.pictures),
                accepted=heard.accepted,
                rejections=heard.rejections,
                messages=heard.messages,
            )
            yield Question(observation, [picture.data for picture in seen.pictures])

    def _speeches(self, answers: Answers) -> dict[str, Speech]:
        default = self.config.task.default_reply
        texts = {seat.agent: answer.text or default for seat, answer in answers.by_seat.items()}
        return {agent: parse(text) for agent, text in texts.items() if text}

    def _deliver(self, answers: Answers, speeches: Mapping[str, Speech]) -> Post:
        for agent, speech in speeches.items():
            for listen in speech.listens:
                self.mailbox.listen(Seat(self.config.task.side, agent), listen.channel)
        return self.mailbox.deliver(answers.messages)

    def _feedback(self, joint: JointAction, turn: Turn, post: Post) -> dict[str, Feedback]:
        feedback = {}
        for agent in self.config.task.agents:
            seat = Seat(self.config.task.side, agent.name)
            refused = (r.rejection for r in turn.played.refusals if r.agent == agent.name)
            rejections: tuple[Rejection, ...] = (
                *joint.rejections.get(agent.name, ()),
                *refused,
                *post.rejections.get(seat, ()),
            )
            accepted, received = joint.accepted.get(agent.name, ()), post.received.get(seat, ())
            feedback[agent.name] = Feedback(accepted, rejections, received)
        return feedback

    def _report(
        self, at: At, answers: Answers, feedback: Mapping[str, Feedback], turn: Turn, timings: Timings
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
            game_loop=turn.snapshot.game_loop,
            agents=agents,
            messages=tuple(Received(sender=m.agent, recipient=m.recipient, text=m.text) for m in answers.messages),
            functions=turn.played.functions,
            env_steps=turn.env_steps,
            score=turn.snapshot.score.total,
            timings=timings,
        )


class Stopwatch:
    """Seconds between laps."""

    def __init__(self) -> None:
        self._last = time.perf_counter()

    def lap(self) -> float:
        """Seconds since the last lap."""
        before, self._last = self._last, time.perf_counter()
        return self._last - before
