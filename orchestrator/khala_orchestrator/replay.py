"""Play a recorded match again: the recorded replies stand in for the agents, and the observations must be the same.

The match, the bridge and the game are the real ones; `RecordedTurn` takes the place of the bus. With the same map,
seed and rules, the observations of the replay equal the recorded ones byte for byte, and every difference is returned.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ValidationError

from khala_bridge.task.config import TaskConfig
from khala_orchestrator.config import MatchConfig
from khala_orchestrator.host import assemble
from khala_orchestrator.match import SilentObserver
from khala_orchestrator.roster import Seat
from khala_orchestrator.turn import Answer, Answers
from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.messages import Observation, Reply, Report
from khala_protocol.recording.difference import Difference

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from khala_bridge.game.game import OneSide
    from khala_orchestrator.turn import Question
    from khala_protocol.messages import AgentReport
    from khala_protocol.recording import RecordedStep, Recording


def recorded_config(recording: Recording, *, modules: Collection[str] = ()) -> MatchConfig:
    """Return the match that was recorded.

    Args:
        recording: of a match.
        modules: Python modules of sections that it may name. A recording may be anyone's, and to import a module is to
            run it.

    Raises:
        RecordingError: it has no run card, its run card is wrong, or it names another module.
    """
    run = recording.run
    if run is None:
        raise RecordingError(f"{recording.path} has no run card: it was ended before the match began")
    try:
        task = TaskConfig.model_validate(run.config)
        config = MatchConfig(task=task, run=run.run, seed=run.seed, episodes=run.episodes)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(map(str, fault["loc"]))
        raise RecordingError(
            f"{recording.path}: its run card is not one of this version: {place}: {fault['msg']}"
        ) from None
    if foreign := sorted(_modules(task) - set(modules)):
        raise RecordingError(
            f"{recording.path} names the module {foreign[0]!r} for a section of its text, and a recording imports "
            f"nothing by itself: if you trust it, allow modules=[{foreign[0]!r}]"
        )
    return config


def _modules(task: TaskConfig) -> set[str]:
    names = (name.rpartition(":") for agent in task.agents for name in agent.sections)
    return {module for module, colon, _ in names if colon}


async def replay(recording: Recording, game: OneSide, *, modules: Collection[str] = ()) -> list[Difference]:
    """Play a recording again, up to its last complete step.

    Args:
        recording: of a match.
        game: the game of `recorded_config`, started.
        modules: see `recorded_config`.

    Returns:
        every observation that differs from the recorded one; a replay that diverges ends at its first step.
    """
    turn = RecordedTurn(recording)
    match = assemble(recorded_config(recording, modules=modules), game, turn, SilentObserver())
    try:
        async for _ in match.play():
            pass
    except _EndOfRecording:
        pass
    return turn.differences


class RecordedTurn:
    """An `AgentPool` from a recording: replies that were in time then arrive at once."""

    def __init__(self, recording: Recording) -> None:
        self.differences: list[Difference] = []
        self._steps: Iterator[RecordedStep] = recording.by_step()
        self._replies: dict[tuple[int, int, str], Reply] = {}
        for reply in recording.of(Reply):
            self._replies.setdefault((reply.episode, reply.step, reply.agent), reply)

    async def ask(self, questions: Iterable[Question]) -> Answers:
        """Compare the observations with the recorded ones, and return the recorded answers.

        Pictures are compared by the hashes under which observations name them.
        """
        observations = [question.observation for question in questions]
        step = next(self._steps, None)
        if step is None or not step.of(Report):
            raise _EndOfRecording
        self._compare(step, observations)
        if self.differences:
            raise _EndOfRecording
        (report,) = step.of(Report)
        return Answers({Seat(agent.side, agent.agent): self._answer(report, agent) for agent in report.agents})

    def _answer(self, report: Report, agent: AgentReport) -> Answer:
        taken = agent.status in {"ok", "fallback"}
        reply = self._replies[report.episode, report.step, agent.agent] if taken else None
        return Answer(agent.status, reply, agent.detail, agent.latency_s, agent.ignored)

    def _compare(self, step: RecordedStep, observations: Iterable[Observation]) -> None:
        sent = {observation.agent: encode(observation).decode() for observation in observations}
        for sample in step.samples:
            message = sample.message
            if not isinstance(message, Observation):
                continue
            now, recorded = sent.pop(message.agent, ""), sample.payload.decode()
            if now != recorded:
                self._differ(message.agent, step, recorded, now)
        for agent, now in sent.items():
            self._differ(agent, step, "", now)

    def _differ(self, agent: str, step: RecordedStep, recorded: str, sent: str) -> None:
        self.differences.append(Difference(agent, step.episode, step.step, "observation", recorded, sent))


class _EndOfRecording(Exception):
    """There is nothing more to compare."""
