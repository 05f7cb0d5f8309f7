"""Go on with a match whose host or game was lost: play the recorded decisions into a new game, then ask live agents.

A recording is safe up to its last report. The steps until then are played again with the recorded answers, as fast as
the game can, and each observation must be the recorded one, byte for byte: a game that is not deterministic is found
out. Then the agents are asked the next step, and those that were asked and had not answered are asked again. Nothing
is lost but the open step. Above it: `khala_orchestrator.host`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from khala_orchestrator.past.replay import (
    EndOfRecording,
    RecordedTurn,
    accepted_replies,
    check_repeatable,
    recorded_config,
)
from khala_orchestrator.roster import Seat
from khala_protocol.errors import RecordingError
from khala_protocol.messages import ModelCall, Observation, Report

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Iterator

    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.turn import AgentPool, Answers, Question
    from khala_protocol.messages import Result
    from khala_protocol.recording import Recorded, Recording


RESUMED = "the host or the game was lost, and the match was resumed here"
FORKED = "the match was forked here: all decisions before are recorded ones"


class ResumeError(RecordingError):
    """A recorded match cannot be resumed."""


@dataclass(frozen=True)
class Unfinished:
    """A match that was not played to its end.

    Attributes:
        recording: the part that was written.
        config: the match, as it was recorded.
        results: of the episodes that are over.
        steps: number of complete steps of the next episode to play.
    """

    recording: Recording
    config: MatchConfig
    results: tuple[Result, ...]
    steps: int

    @property
    def episode(self) -> int:
        """Number of the episode to play."""
        return len(self.results) // self.sides

    @property
    def sides(self) -> int:
        """Number of sides, each of which has a report and a result of its own."""
        return len(self.config.task.per_side())

    @property
    def incident(self) -> str:
        """What the report of the first live step says."""
        forked = self.config.forked
        return FORKED if forked is not None and forked.step == self.steps else RESUMED

    def decisions(self, seat: Seat) -> list[tuple[Observation, str]]:
        """Return what an agent saw in the steps of the next episode to play, and the replies that its model gave."""
        replies = accepted_replies(self.recording)
        found = ((seen, replies.get((seen.episode, seen.step, seat))) for seen in self.recording.of(
            Observation, agent=seat.agent, side=seat.side
        ) if seen.episode == self.episode and seen.verdict is None)  # fmt: skip
        return [(seen, reply.text) for seen, reply in found if reply is not None and reply.status == "ok"]

    def kept(self) -> Iterator[Recorded]:
        """Yield the recorded samples up to the last complete step, in the order of the file.

        What models were asked in the open step is kept, too: it was paid, and an agent that stayed asks no second time.
        """
        last = self.episode, self.steps - 1
        left = self.sides * (1 if self.steps else 0)
        is_open = False
        for sample in self.recording:
            message = sample.message if sample.is_of(Report, ModelCall) else None
            if isinstance(message, Report) and (message.episode, message.step) == last:
                left -= 1
            elif left == 0 and _is_of_the_episode(sample, self.episode):
                is_open = True
            if not is_open or isinstance(message, ModelCall):
                yield sample


def read_unfinished(recording: Recording, config: MatchConfig | None = None) -> Unfinished:
    """Return what is left to play of a recorded match.

    Args:
        recording: of the match, up to where its host or its game was lost.
        config: the match; None: as its run card says.

    Raises:
        ResumeError: it is over, or its game cannot be played again.
        RecordingError: it has no run card, or not all decisions.
    """
    config = config or recorded_config(recording)
    check_repeatable(recording, config.task)
    if not plays_the_same_twice(config):
        raise ResumeError(
            f"{recording.path} was played on {config.game}, which does not play the same game twice: begin a new run"
        )
    sides = len(config.task.per_side())
    results = recording.results[: len(recording.results) // sides * sides]
    episode = len(results) // sides
    if episode >= config.episodes or any(result.outcome == "aborted" for result in results):
        raise ResumeError(f"the run of {recording.path} is over: begin a new one")
    reports = [report for report in recording.of(Report) if report.episode == episode]
    return Unfinished(recording, config, results, len(reports) // sides)


def plays_the_same_twice(config: MatchConfig) -> bool:
    """Return whether the game of a match depends on nothing but its seed and what is decided."""
    return config.game.startswith("Khala simulator")


class ResumedTurn:
    """An `AgentPool` that begins with recorded answers, and goes on with live agents."""

    def __init__(self, past: Unfinished, live: AgentPool, go_live: Callable[[], Awaitable[None]]) -> None:
        """Take a match, its agents, and what to do before they are asked for the first time."""
        self._recorded: RecordedTurn | None = RecordedTurn(past.recording, first_episode=past.episode)
        self._live = live
        self._incident = past.incident
        self._go_live = go_live
        self._open: dict[Seat, Question] = {}

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:
        """Return the recorded answers while there are any, then those of the agents.

        Raises:
            ResumeError: the game goes another way than the recorded one.
        """
        if self._recorded is not None:
            questions = list(questions)
            try:
                return await self._again(self._recorded, questions, wait=wait)
            except EndOfRecording:
                _check_same(self._recorded)
                self._recorded = None
                await self._go_live()
                questions = [*self._open.values(), *questions]
                answers = await self._live.ask(questions, wait=wait)
                return replace(answers, incidents=[self._incident, *answers.incidents])
        return await self._live.ask(questions, wait=wait)

    async def _again(self, recorded: RecordedTurn, questions: list[Question], *, wait: bool) -> Answers:
        answers = await recorded.ask(questions, wait=wait)
        self._open |= {Seat(question.observation.side, question.observation.agent): question for question in questions}
        for seat in answers.by_seat:
            del self._open[seat]
        return answers


def _check_same(recorded: RecordedTurn) -> None:
    if recorded.differences:
        first = recorded.differences[0]
        raise ResumeError(
            f"the new game differs from the recorded one at step {first.step} of episode {first.episode}, in what "
            f"{first.agent} sees: the match cannot be resumed; is this the same version of Khala?"
        )


def _is_of_the_episode(sample: Recorded, episode: int) -> bool:
    return getattr(sample.message, "episode", -1) >= episode
