"""Games for pages of the documentation: played in this process by the scripted player, every observation kept.

There is no bus and no model; sides, texts and pictures are those of a match.
"""

from __future__ import annotations

import random
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig
from khala_orchestrator.match.match import Match, SilentObserver
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Answer, Answers
from khala_orchestrator.roster import Seat
from khala_protocol.messages import Reply
from khala_sc2.playing.hosting import game_of

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import Result


class Decided(NamedTuple):
    """What an agent was asked, and what it said."""

    question: Question
    reply: str


class Stop(Exception):  # no error
    """The last step that is wanted is over."""


@dataclass
class Game(SilentObserver):
    """One game: who was asked what, and the result."""

    last: int | None = None
    """Step after which it ends; None for the game's own end."""
    by_agent: defaultdict[str, list[Decided]] = field(default_factory=lambda: defaultdict(list))
    results: list[Result] = field(default_factory=list)

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:  # noqa: ARG002
        """Return the answers of one step, at once."""
        answers: dict[Seat, Answer] = {}
        step = 0
        for question in questions:
            seen = question.observation
            step = seen.step
            text = PLAYERS["skilled"](seen.text, random.Random(seen.step))
            self.by_agent[seen.agent].append(Decided(question, text))
            place = {"run": seen.run, "agent": seen.agent, "side": seen.side, "episode": 0, "step": seen.step}
            answers[Seat(seen.side, seen.agent)] = Answer("ok", Reply.model_validate({**place, "text": text}))
        if self.last is not None and step >= self.last:
            raise Stop
        return Answers(answers)

    async def result(self, result: Result) -> None:
        """Keep the result."""
        self.results.append(result)


async def play(task: TaskConfig, sc2path: Path, *, seed: int = 0, last: int | None = None) -> Game:
    """Return a game of a task, played to its end or to a step.

    Args:
        task: the task to play.
        sc2path: where the simulator is.
        seed: of the game.
        last: the last step that is wanted; None for all.
    """
    config, game = MatchConfig(task=task, run="seen", seed=seed), Game(last)
    async with game_of(config, sc2path) as hosted:
        try:
            async for _ in Match(config, hosted, sides_of(config), game, game).play():
                pass
        except Stop:
            pass
    return game
