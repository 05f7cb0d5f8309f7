"""Read a recording once, and give each episode and side its row."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from khala_protocol.errors import RecordingError
from khala_protocol.messages import Report
from khala_sc2.experiment.measures.actions import ActionTally
from khala_sc2.experiment.measures.calls import CallCount, CallTally
from khala_sc2.experiment.measures.communication import CommunicationTally
from khala_sc2.experiment.measures.economy import EconomyTally
from khala_sc2.experiment.measures.evidence import (
    CallGlance,
    ObservationGlance,
    RecordedDecision,
    RecordedQuestion,
    SideStep,
    evidence,
)
from khala_sc2.experiment.measures.faults import FaultTally
from khala_sc2.experiment.measures.hallucinations import HallucinationTally
from khala_sc2.experiment.measures.identity import EpisodeProgress
from khala_sc2.experiment.measures.row import Measures
from khala_sc2.experiment.measures.spending import SpendingTally
from khala_sc2.experiment.measures.timing import Timing

if TYPE_CHECKING:
    from khala_protocol.messages import AgentReport, Result, Run
    from khala_protocol.recording import Recording


def measure(recording: Recording) -> list[Measures]:
    """Return a row for each episode and side that was begun, in their order.

    An episode without a result has a row too, whose outcome is `unfinished`: what it cost was spent.

    Raises:
        RecordingError: the recording has no run card.
    """
    return [row for row, _ in measure_with_calls(recording)]


def measure_with_calls(recording: Recording) -> list[tuple[Measures, list[CallCount]]]:
    """Return the same rows, each with the calls of its agents; errors as in `measure`."""
    run = recording.run
    if run is None:
        raise RecordingError(f"{recording.path} has no run card, so nobody can say what was played: play it again")
    accounts: dict[tuple[int, str], _Account] = defaultdict(_Account)
    for sample in recording:
        match evidence(sample):
            case ObservationGlance() as seen:
                accounts[seen.episode, seen.side].see(RecordedQuestion(seen, sample.payload))
            case CallGlance() as call:
                accounts[call.episode, call.side].spending.call(call)
            case Report() as report:
                accounts[report.episode, report.side].add(report)
    results = {(result.episode, result.side): result for result in recording.results}
    return [
        (accounts[place].row(run, *place, results.get(place)), accounts[place].calls.total())
        for place in sorted({*accounts, *results})
    ]


class _Account:
    """The running account of one side in one episode."""

    def __init__(self) -> None:
        self._asked: dict[str, RecordedQuestion] = {}
        """By agent, the last observation that it was sent."""
        self._progress = EpisodeProgress()
        self._faults = FaultTally()
        self._actions = ActionTally()
        self._hallucinations = HallucinationTally()
        self._communication = CommunicationTally()
        self._economy = EconomyTally()
        self.spending = SpendingTally()
        self.calls = CallTally()

    def see(self, question: RecordedQuestion) -> None:
        """Take in an observation."""
        self._asked[question.glance.agent] = question
        self._economy.see(question.glance.view)

    def add(self, report: Report) -> None:
        """Take in the report of a step."""
        step = SideStep(report, [RecordedDecision(agent, self._question(report, agent)) for agent in report.agents])
        for tally in (
            self._progress,
            self._faults,
            self._actions,
            self._hallucinations,
            self._communication,
            self.spending,
            self.calls,
        ):
            tally.add(step)

    def _question(self, report: Report, agent: AgentReport) -> RecordedQuestion | None:
        """Return the observation that a decision answers."""
        question = self._asked.get(agent.agent)
        asked = report.step if agent.asked_step is None else agent.asked_step
        return question if question is not None and question.glance.step == asked else None

    def row(self, run: Run, episode: int, side: str, result: Result | None) -> Measures:
        """Return the row."""
        identity = self._progress.total(run, side, episode, result)
        return Measures(
            **vars(identity),
            **vars(self._faults.total()),
            **vars(self._actions.total()),
            **vars(self._hallucinations.total()),
            **vars(self._communication.total()),
            **vars(Timing.of(result)),
            **vars(self.spending.total()),
            **vars(self._economy.total(identity.game_s)),
        )
