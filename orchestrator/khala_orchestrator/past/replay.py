"""Play a recorded match again: the recorded replies stand in for the agents, and the observations must be the same.

The match, the bridge and the game are the real ones; `RecordedTurn` takes the place of the bus. With the same map,
seed and rules, the observations of the replay equal the recorded ones byte for byte, and every difference is returned.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ValidationError

from khala_bridge.task.code import code_of
from khala_bridge.task.config import TaskConfig
from khala_orchestrator.config import MatchConfig
from khala_orchestrator.match.match import Match, SilentObserver
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Answer, Answers
from khala_orchestrator.roster import Seat
from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic
from khala_protocol.messages import Advice, Message, Observation, Reply, Report
from khala_protocol.recording.difference import Difference
from khala_protocol.trust import check_trusted, trust

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from khala_bridge.game.game import Sides
    from khala_orchestrator.match.match import MatchObserver
    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import AgentReport
    from khala_protocol.recording import RecordedStep, Recording


def recorded_config(recording: Recording, *, modules: Collection[str] = ()) -> MatchConfig:
    """Return the match that was recorded.

    Args:
        recording: of a match.
        modules: Python modules of sections that the caller trusts. A recording may be anyone's, and to import a module
            is to run it.

    Raises:
        RecordingError: it has no run card, its run card is wrong, or it cannot be played again.
        Untrusted: it names code that is not trusted.
    """
    run = recording.run
    if run is None:
        raise RecordingError(f"{recording.path} has no run card: the run ended before the match began")
    try:
        task = TaskConfig.model_validate(run.config)
        game, _, _version = run.game.rpartition(" ")
        config = MatchConfig(
            task=task, run=run.run, game=game, seed=run.seed, episodes=run.episodes, labels=run.labels,
            humans=frozenset((agent.side, agent.name) for agent in run.agents if agent.human), forked=run.forked,
        )  # fmt: skip
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(map(str, fault["loc"]))
        raise RecordingError(
            f"{recording.path}: its run card is not of this version: {place}: {fault['msg']}"
        ) from None
    check_repeatable(recording, task)
    trust(*modules)
    check_trusted(code_of(task), source=str(recording.path))
    return config


def check_repeatable(recording: Recording, task: TaskConfig) -> None:
    """Check that the decisions of all players are in the recording or in the game.

    Raises:
        RecordingError: the opponent's are not.
    """
    if task.opponent.joins:
        run = recording.run
        raise RecordingError(
            f"{recording.path} was played against a {run.opponent if run else task.against}, whose decisions are not "
            "recorded: it cannot be played again"
        )


async def replay(
    recording: Recording, game: Sides, *, modules: Collection[str] = (), observer: MatchObserver | None = None
) -> list[Difference]:
    """Play a recording again, up to its last complete step.

    Args:
        recording: of a match.
        game: the game of `recorded_config`, started.
        modules: see `recorded_config`.
        observer: is notified of what happens.

    Returns:
        every observation that differs from the recorded one; a replay that diverges ends at its first step.
    """
    turn = RecordedTurn(recording)
    config = recorded_config(recording, modules=modules)
    match = Match(config, game, sides_of(config), turn, observer or SilentObserver())
    try:
        async for _ in match.play():
            pass
    except EndOfRecording:
        pass
    return turn.differences


class RecordedTurn:
    """An `AgentPool` from a recording: the recorded answers arrive at once, in the step in which they were taken."""

    def __init__(self, recording: Recording, *, first_episode: int = 0) -> None:
        """Take a recording, and the number of the first episode that is played."""
        self.differences: list[Difference] = []
        self._sides = len({report.side for report in recording.of(Report)} or {None})
        self._steps: Iterator[RecordedStep] = (s for s in recording.by_step() if s.episode >= first_episode)
        self._replies = accepted_replies(recording)
        self._verdicts = {
            (seen.episode, seen.step, Seat(seen.side, seen.agent), seen.verdict.number): seen.verdict.text
            for seen in recording.of(Observation) if seen.verdict is not None
        }  # fmt: skip
        self._outcomes: dict[tuple[int, int, Seat], AgentReport] = {}
        for report in recording.of(Report):
            for agent in report.agents:
                asked = report.step if agent.asked_step is None else agent.asked_step
                self._outcomes[report.episode, asked, Seat(agent.side, agent.agent)] = agent

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:
        """Compare the observations with the recorded ones, and return the recorded answers.

        Pictures are compared by the hashes under which observations name them.
        """
        observations = [question.observation for question in questions]
        step = next(self._steps, None)
        if step is None or len(step.of(Report)) < self._sides:
            raise EndOfRecording
        self._compare(step, observations)
        if self.differences:
            raise EndOfRecording
        answers = dict(self._settled_by(step, observations) if wait else self._taken_in(step))
        return Answers(answers, advice=[_advice(message) for message in step.of(Message) if message.human])

    def _settled_by(self, step: RecordedStep, observations: Iterable[Observation]) -> Iterator[tuple[Seat, Answer]]:
        """Yield the answers to these observations, which the host waited for."""
        for observation in observations:
            seat = Seat(observation.side, observation.agent)
            outcome = self._outcomes.get((step.episode, step.step, seat))
            if outcome is None:  # the recording ends before this decision took effect
                yield seat, self._answer_without_report(step.episode, step.step, seat)
            else:
                yield seat, self._answer(step.episode, step.step, seat, outcome)

    def _taken_in(self, step: RecordedStep) -> Iterator[tuple[Seat, Answer]]:
        """Yield the answers that arrived in this step, whenever their questions were asked."""
        for agent in (agent for report in step.of(Report) for agent in report.agents):
            seat = Seat(agent.side, agent.agent)
            asked = agent.asked_step
            yield seat, self._answer(step.episode, step.step if asked is None else asked, seat, agent)

    def _answer_without_report(self, episode: int, asked: int, seat: Seat) -> Answer:
        """Return the answer to a question of which there is no report."""
        reply = self._replies.get((episode, asked, seat))
        if reply is None:
            return Answer("late", detail="no reply before the deadline")
        return Answer(reply.status, reply, reply.detail, reply.latency_s, verdicts=self._verdicts_before(reply))

    def _answer(self, episode: int, asked: int, seat: Seat, agent: AgentReport) -> Answer:
        reply = self._replies[episode, asked, seat] if agent.latency_s is not None else None
        verdicts = self._verdicts_before(reply) if reply else ()
        return Answer(agent.status, reply, agent.detail, agent.latency_s, agent.ignored, verdicts)

    def _verdicts_before(self, reply: Reply) -> tuple[str, ...]:
        place = reply.episode, reply.step, Seat(reply.side, reply.agent)
        return tuple(self._verdicts[*place, number] for number in range(1, reply.rethinks + 1))

    def _compare(self, step: RecordedStep, observations: Iterable[Observation]) -> None:
        sent = {(observation.side, observation.agent): encode(observation).decode() for observation in observations}
        missing = dict(sent)
        for sample in step.samples:
            message = sample.message if sample.is_of(Observation) else None
            if not isinstance(message, Observation) or message.step != step.step or message.verdict is not None:
                continue  # a verdict follows from the reply before it, and a killed host that goes on asks again
            now = sent.get((message.side, message.agent), "")
            recorded = sample.payload.decode()
            missing.pop((message.side, message.agent), None)
            if now != recorded:
                self._differ(message.agent, step, recorded, now)
        for (_, agent), now in missing.items():
            self._differ(agent, step, "", now)

    def _differ(self, agent: str, step: RecordedStep, recorded: str, sent: str) -> None:
        self.differences.append(Difference(agent, step.episode, step.step, "observation", recorded, sent))


def accepted_replies(recording: Recording) -> dict[tuple[int, int, Seat], Reply]:
    """Return the first reply to each question since it was last asked; of an agent that rethought, the one that counts.

    A host asks again only what it has no answer to. What came before was lost with the host before it, or was a guess.
    A report says which reply counted; where there is none, it was the last one.
    """
    replies: dict[tuple[int, int, Seat], dict[int, Reply]] = {}
    counted: dict[tuple[int, int, Seat], int] = {}
    for sample in recording:
        match sample.message if sample.is_of(Observation, Reply, Report) else None:
            case Observation(verdict=None) as seen:
                replies.pop((seen.episode, seen.step, Seat(seen.side, seen.agent)), None)
            case Reply() as reply if sample.key.endswith(f"/{reply.side}/{reply.agent}/{Topic.REPLY}"):
                place = reply.episode, reply.step, Seat(reply.side, reply.agent)
                replies.setdefault(place, {}).setdefault(reply.rethinks, reply)
            case Report() as report:
                for agent in report.agents:
                    asked = report.step if agent.asked_step is None else agent.asked_step
                    counted[report.episode, asked, Seat(agent.side, agent.agent)] = agent.rethinks
    return {place: found.get(counted.get(place, -1)) or found[max(found)] for place, found in replies.items()}


def _advice(message: Message) -> Advice:
    return Advice.model_construct(
        run=message.run, agent=message.agent, side=message.side, recipient=message.recipient, text=message.text
    )


class EndOfRecording(Exception):
    """There is nothing more to compare."""
