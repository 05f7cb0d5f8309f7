"""Battles of a player that answers prompts, several at once, through `khala_sc2.env.parallel_env`.

Battles go on in lockstep: the player gets the prompts of all of them that wait for an answer at once, as a language
model answers fastest. Above: `bench.learning.learns`; below: the environment in words.
"""

from __future__ import annotations

import random
import re
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol, Self

from khala_agents.scripted.players import PLAYERS, PlayerName
from khala_bridge.errors import GameError
from khala_sc2.dataset.prompts import Prompter, count_example, without_example
from khala_sc2.env import parallel_env

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Briefing, ChatMessage, Observation
    from khala_sc2.env.text import TextParallelEnv

CALL: Final = re.compile(r"^\s*(<\w+\(.*\)>)\s*$", re.MULTILINE)

ENEMY: Final = re.compile(r"tag (0x[0-9a-f]+) .*\| distance .*\| (health \d+/\d+)")
"""A line of an enemy: that of an own unit has no distance."""


class Asked(NamedTuple):
    """A question to a player."""

    observation: str
    """As the host wrote it."""
    prompt: tuple[ChatMessage, ...]
    """As a model gets it: without a worked example, and of the observation what `enemies_alone` leaves."""


class Answer(NamedTuple):
    """What a player said."""

    text: str
    tokens: tuple[int, ...] = ()
    """Of a model; with the end of the turn, unless it was cut."""


class Player(Protocol):
    """Answers prompts."""

    def answer(self, asked: Sequence[Asked]) -> Sequence[Answer]:
        """Return an answer to each."""
        ...


class Scripted:
    """A scripted player, whose answers have the shortest form.

    Args:
        name: of the player.
        seed: of its random choices.
    """

    def __init__(self, name: PlayerName, seed: int = 0) -> None:
        self._player = PLAYERS[name]
        self._random = random.Random(seed)

    def answer(self, asked: Sequence[Asked]) -> list[Answer]:
        """Return an answer to each."""
        return [Answer(shortest(self._player(question.observation, self._random))) for question in asked]


def shortest(reply: str) -> str:
    """Return the calls of a reply, without analysis and headings: the host takes them for those of the only team."""
    return "\n".join(CALL.findall(reply))


def enemies_alone(text: str) -> str:
    """Return the enemies in sight by tag and health, which the choice of a target needs: a third of the tokens."""
    return "\n".join(["Enemy units:", *(f"{tag} | {health}" for tag, health in ENEMY.findall(text))])


class Answered(NamedTuple):
    """A prompt and the answer to it."""

    prompt: tuple[ChatMessage, ...]
    answer: Answer
    obeyed: bool = True
    """Whether at least one order of it was carried out."""


@dataclass(slots=True)
class PlayedBattle:
    """A battle, as far as it was played."""

    seed: int
    answered: list[Answered] = field(default_factory=list)
    reward: float = 0.0
    """The sum of `khala_sc2.env.rewards.battle`: (destroyed - lost value) / 1000, +1 for a win, -1 for a loss."""
    won: bool = False

    @property
    def obeyed(self) -> int:
        """Answers of which at least one order was carried out."""
        return sum(answered.obeyed for answered in self.answered)


class _Board:
    """One environment, and the battle that it plays."""

    def __init__(self, task: TaskConfig) -> None:
        self.env: TextParallelEnv = parallel_env(task)
        self.battle = PlayedBattle(-1)
        self.question: Asked | None = None
        self._prompter = Prompter("tiny")
        (self._agent,) = self.env.possible_agents

    def begin(self, seed: int) -> None:
        self.battle = PlayedBattle(seed)
        self._prompter = Prompter("tiny")
        _, infos = self.env.reset(seed=seed)
        info = infos[self._agent]
        self.question = self._ask(info["briefing"], info["observation"]) if info["asked"] else None

    def play(self, answer: Answer) -> None:
        """Give an answer, if there was a question."""
        _, rewards, _, _, infos = self.env.step({self._agent: answer.text})
        info = infos[self._agent]
        self.battle.reward += rewards[self._agent]
        if self.question is not None:
            obeyed = any(report.accepted for report in info["reports"])
            self.battle.answered.append(Answered(self.question.prompt, answer, obeyed))
        if "result" in info:
            self.battle.won = info["result"].outcome == "win"
        self.question = self._ask(info["briefing"], info["observation"]) if info["asked"] else None

    def _ask(self, briefing: Briefing, observation: Observation) -> Asked:
        short = observation.model_copy(update={"text": enemies_alone(observation.text)})
        prompt = self._prompter.messages(briefing, short)
        return Asked(observation.text, without_example(prompt, count_example(prompt, self._prompter.example)))


class Boards:
    """Environments of a task, which stay open from battle to battle.

    Args:
        task: with one agent.
        count: of battles that are played in lockstep.
    """

    def __init__(self, task: TaskConfig, count: int) -> None:
        self._task = task
        self._count = count
        self._boards: list[_Board] = []

    def __enter__(self) -> Self:
        """Open nothing yet."""
        return self

    def __exit__(self, *failure: object) -> None:
        """Close all environments."""
        self.close()

    def close(self) -> None:
        """Close all environments, also those whose game was lost; the next battles open new ones."""
        for board in self._boards:
            with suppress(GameError):
                board.env.close()
        self._boards.clear()

    def play(self, player: Player, seeds: Sequence[int]) -> Iterator[PlayedBattle]:
        """Yield battles, each when it is over.

        Args:
            player: of the only agent.
            seeds: of the battles.
        """
        waiting = list(reversed(seeds))
        while len(self._boards) < min(self._count, len(seeds)):
            self._boards.append(_Board(self._task))
        boards = self._boards[: len(seeds)]
        for board in boards:
            board.begin(waiting.pop())
        while boards:
            asking = [board for board in boards if board.question is not None]
            answers = player.answer([board.question for board in asking if board.question is not None])
            said = dict(zip(map(id, asking), answers, strict=True))
            for board in list(boards):
                board.play(said.get(id(board), Answer("")))
                if board.env.agents:
                    continue
                yield board.battle
                if waiting:
                    board.begin(waiting.pop())
                else:
                    boards.remove(board)
