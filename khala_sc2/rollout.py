"""One episode of a task for a trainer: prompts for the agents that are asked, their replies, and what these were worth.

    async with TeamRollout(RolloutSpec("2s3z_pair", seed=7)) as rollout:
        prompts = await rollout.begin()
        while prompts:
            prompts = await rollout.reply({agent: my_model(prompt.messages) for agent, prompt in prompts.items()})
    rollout.result, rollout.turns

The host and the prompts are those of every other match. Above it are the packages in `envs/`, each for one library;
below are `khala_sc2.playing.seats` and `khala_sc2.dataset.credit`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import ConfigError, KhalaError
from khala_sc2.dataset.credit import AgentTurn, CreditBook
from khala_sc2.dataset.prompts import Prompter
from khala_sc2.playing.minds import SCRIPTED, SILENT, Minds, minds_of
from khala_sc2.playing.seats import SeatedMatch, SeatsTurn, seat_named, seats_of, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from types import TracebackType

    from khala_bridge.game.processes import Processes
    from khala_protocol.messages import ChatMessage, Result

FREE: Final = frozenset({SILENT, SCRIPTED, *PLAYERS})
"""Who may decide for the agents that are not played: players that cost nothing and load no code."""


@dataclass(frozen=True, slots=True)
class RolloutSpec:
    """Which episode is played. A row of a data set may say it: it names no file, no model and no code.

    Attributes:
        task: one of `khala tasks`.
        seed: of the game, in which everything follows from it and the replies.
        agents: those that are played, of one side; () for all of the first side.
        others: who decides for all other agents, one of `FREE`.
        max_steps: end of the episode; None for the task's own.
        game: `simulator`, `starcraft2`, or a directory.
    """

    task: str = "2s3z_pair"
    seed: int = 1
    agents: Sequence[str] = ()
    others: str = "skilled"
    max_steps: int | None = None
    game: str = "simulator"


@dataclass(frozen=True, slots=True)
class AgentPrompt:
    """What an agent is asked.

    Attributes:
        step: of the match.
        messages: a system message, a worked example, what the task's memory recalls, and the observation.
        stable: how many messages at the front are the same in the whole episode.
    """

    step: int
    messages: tuple[ChatMessage, ...]
    stable: int


class TeamRollout:
    """An episode that the caller plays. An asynchronous context manager.

    Attributes:
        agents: the names of those that the caller plays.
        result: of the episode, once it is over.
    """

    def __init__(self, spec: RolloutSpec, processes: Processes | None = None) -> None:
        """Take what is played, and where the process of the game comes from and goes afterwards.

        Raises:
            ConfigError: there is no such task, agent or player.
        """
        if not spec.task.replace("_", "").replace("-", "").isalnum():
            raise ConfigError(f"{spec.task!r} is not the name of a task: `khala tasks` lists them", source="task")
        if spec.others not in FREE:
            raise ConfigError(f"{spec.others!r} is none of {', '.join(sorted(FREE))}", source="others")
        task = without_time_limit(change(load_task(spec.task), max_steps=spec.max_steps, scenes="none"))
        there_are = seats_of(task)
        wanted = [seat_named(name, there_are, source="agents") for name in dict.fromkeys(spec.agents)]
        seats = wanted or [seat for seat in there_are if seat.side == there_are[0].side]
        if len({seat.side for seat in seats}) > 1:
            raise ConfigError("the agents are of two sides: `others` decide for the other one", source="agents")
        minds = minds_of([side.side for side in task.per_side()], Minds().with_name(spec.others), {})
        config = MatchConfig(task=task, run=task.name, seed=spec.seed)
        self._match = SeatedMatch(config, seats, minds, game=spec.game, processes=processes)
        self._seats = {seat.agent: seat for seat in seats}
        self._side = seats[0].side
        self._prompters = {agent: Prompter() for agent in self._seats}
        self._turn = SeatsTurn()
        self._book = CreditBook()
        self.agents = list(self._seats)
        self.result: Result | None = None

    async def __aenter__(self) -> Self:
        await self._match.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._match.__aexit__(kind, error, trace)

    @property
    def turns(self) -> Sequence[AgentTurn]:
        """The turns of the agents that the caller plays; the last one of each grows until the episode is over.

        What their teammates see is not known here: kills and losses of the side are shared by what the played agents
        saw, and are all theirs where nobody else is known to have a part.
        """
        return [turn for turn in self._book.turns if turn.agent in self._seats]

    async def begin(self) -> Mapping[str, AgentPrompt]:
        """Return the first prompts, by agent; `reply` returns the next ones.

        Raises:
            KhalaError: the game cannot be played; the text says what to do.
        """
        return await self._advance()

    async def reply(self, replies: Mapping[str, str]) -> Mapping[str, AgentPrompt]:
        """Play replies, and return the next prompts: {} once the episode is over.

        Args:
            replies: by agent; one that is asked and not named does nothing.

        Raises:
            KhalaError: the match failed, or a reply is of an agent that is not asked.
        """
        asked = {agent for agent, seat in self._seats.items() if seat in self._turn.asked}
        if unknown := sorted(replies.keys() - asked):
            raise KhalaError(f"{unknown[0]} is not asked now, {', '.join(sorted(asked)) or 'nobody'} is")
        for agent in sorted(asked):
            said = replies.get(agent, "")
            self._prompters[agent].remember(self._turn.asked[self._seats[agent]].observation, said)
            self._match.act(self._seats[agent], said)
        return await self._advance()

    async def _advance(self) -> Mapping[str, AgentPrompt]:
        self._turn = turn = await self._match.turn()
        for report in turn.reports:
            if report.side == self._side:
                self._book.report(report)
        for seen in turn.asked.values():
            self._book.observe(seen.observation)
        for result in turn.results:
            if result.side == self._side:
                self.result = result
                self._book.end(result)
        return {agent: self._prompt(agent) for agent, seat in self._seats.items() if seat in turn.asked}

    def _prompt(self, agent: str) -> AgentPrompt:
        seen = self._turn.asked[self._seats[agent]]
        prompter = self._prompters[agent]
        messages = prompter.messages(seen.briefing, seen.observation)
        return AgentPrompt(seen.observation.step, messages, 1 + len(prompter.example))
