"""The solver: the model plays all agents of the first side of a match, each with its own observations and memory.

Above: `khala_sc2.inspect.tasks`. Below: `khala_sc2.playing.seats`, which plays the match, and `khala_agents.llm_policy`, which
makes the prompts, so that a model reads here what it reads in any other match.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from inspect_ai.log import transcript
from inspect_ai.model import ChatMessageAssistant, ModelOutput, get_model
from inspect_ai.solver import solver
from inspect_ai.util import collect, concurrency, span

from khala_agents.llm.retry import RetryRule
from khala_agents.llm.vision import Vision
from khala_agents.llm_policy import LLMPolicy
from khala_agents.pictures import PictureStore
from khala_agents.policy import Context, Decision
from khala_protocol.messages import ChatMessage, ModelCall, Usage
from khala_sc2.inspect.model import InspectClient, message_of
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import Minds, minds_of
from khala_sc2.playing.seats import Seat, SeatedMatch, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from inspect_ai.solver import Generate, Solver, TaskState
    from pydantic import JsonValue

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Report
    from khala_sc2.playing.seats import SeatsTurn, Seen

RESULT, RECORDING = "khala_result", "khala_recording"
"""What the store of a sample has afterwards: the result of its episode, and the path of its recording."""
MATCH = "khala_match"
"""What a sample is to play, in its metadata: the task, the seed, and further options of `khala_sc2.playing.matches.new`."""


@solver
def team(
    others: str = "scripted", memory: str | None = None, game: str = "simulator", out: str = "runs", games: int = 0
) -> Solver:
    """Return the solver.

    Args:
        others: who plays the other side of a match of two: scripted/skilled, openai, module:name.
        memory: what agents know of the steps before, as `--memory` of `khala run`; as the task says.
        game: simulator, starcraft2, or a directory.
        out: directory of the recordings.
        games: most games at a time; 0 for the number of cores.
    """

    async def solve(state: TaskState, generate: Generate) -> TaskState:  # noqa: ARG001  # each agent has its own prompt
        asked = dict(state.metadata[MATCH])
        config = new(asked.pop("task"), None, Path(out), **_options(asked, memory))
        config = config.model_copy(update={"task": without_time_limit(config.task)})
        first, *_ = sides = config.task.per_side()
        minds = minds_of([side.side for side in sides], Minds().with_name(others), {})
        seats = [Seat(first.side, agent.name) for agent in first.agents]
        async with (
            concurrency("khala games", games or os.cpu_count() or 1),
            SeatedMatch(config, seats, minds, game=game) as match,
        ):
            await _play(match, state, config)
        return state

    return solve


def _options(asked: Mapping[str, object], memory: str | None) -> dict[str, object]:
    return {"episodes": None, "assemble_s": None, "memory": memory, **asked}


async def _play(match: SeatedMatch, state: TaskState, config: MatchConfig) -> None:
    players = {seat: _Player(state) for seat in match.seats}
    turn = await match.turn()
    while not turn.over:
        decisions = await collect(*(players[seat].decide(seat, seen) for seat, seen in turn.asked.items()))
        for seat, decision in zip(turn.asked, decisions, strict=True):
            match.act(seat, decision)
        turn = await match.turn()
        _note(turn)
    (result,) = turn.results
    state.store.set(RESULT, result.model_dump(mode="json"))
    state.store.set(RECORDING, str(config.record))
    state.output = ModelOutput.from_content(str(state.model), result.ending)


class _Player:
    """The model as one agent."""

    def __init__(self, state: TaskState) -> None:
        self._state = state
        self._policy = LLMPolicy(InspectClient(get_model()), retry=RetryRule(tries=1), vision=Vision())

    async def decide(self, seat: Seat, seen: Seen) -> Decision:
        """Return the model's decision; the transcript and the messages of the sample get what it saw and said."""
        calls: list[ModelCall] = []
        store = PictureStore()
        for picture in seen.pictures:
            await store.put(picture)
        context = Context(seen.briefing, seen.observation, store, calls.append)
        async with span(seat.agent, type="agent"):
            said = await self._policy.decide(context)
            await self._policy.reflect(context)
        decision = said if isinstance(said, Decision) else Decision(said)
        self._show(seat, seen, decision.text, await store.get(seen.observation.images, 0))
        return replace(decision, attempts=len(calls), usage=sum((call.usage for call in calls), Usage()))

    def _show(self, seat: Seat, seen: Seen, text: str, pictures: Mapping[str, bytes]) -> None:
        images = tuple(image for image in seen.observation.images if image.sha256 in pictures)
        headed = f"# {seat.agent}, step {seen.observation.step}\n\n{seen.observation.text}"
        observed = message_of(ChatMessage(role="user", content=headed, images=images), pictures)
        self._state.messages += [observed, ChatMessageAssistant(content=text, source="generate")]


def _note(turn: SeatsTurn) -> None:
    """Note in the transcript what became of the decisions."""
    for report in turn.reports:
        transcript().info(_fates(report), source="khala")


def _fates(report: Report) -> JsonValue:
    return {
        "step": report.step,
        "value killed": report.killed_value,
        "value lost": report.lost_value,
        "agents": {
            agent.agent: {
                "fate": agent.fate,
                "accepted": list(agent.accepted),
                "refused": [f"{rejection.text}: {rejection.message}" for rejection in agent.rejections],
            }
            for agent in report.agents
        },
    }
