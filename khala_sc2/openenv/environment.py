"""One session of OpenEnv: a match, some of whose agents the client plays.

The match is played by the host of every other match; a step lasts until somebody is asked again. Above:
`khala_sc2.openenv.server`. Below: `khala_sc2.openenv.settings`, which makes the match, and `khala_sc2.playing.seats`,
which plays it.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import json
import uuid
from typing import TYPE_CHECKING, Any, Final

from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.mcp_types import CallToolAction, ListToolsAction, ListToolsObservation, ToolError
from openenv.core.env_server.types import EnvironmentMetadata, Observation

from khala_protocol.configfile import loads
from khala_protocol.errors import KhalaError
from khala_protocol.messages import LOOPS_PER_S, count_refusals
from khala_sc2 import __version__
from khala_sc2.openenv.direct import DirectTools
from khala_sc2.openenv.models import KhalaAction, KhalaObservation, KhalaState, ResetOptions
from khala_sc2.openenv.places import ServerPlaces
from khala_sc2.openenv.settings import ServerSettings
from khala_sc2.openenv.tools import (
    Act,
    LookUp,
    Observe,
    PlayTool,
    ReplyInText,
    ToolFault,
    names,
    read_call,
    reply_of,
    tools,
)
from khala_sc2.openenv.views import outcome_of, page_of, view_of
from khala_sc2.playing.inside import InsideGames
from khala_sc2.playing.loop_thread import LoopThread
from khala_sc2.playing.seats import SeatsTurn

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.game.processes import IdleGames
    from khala_sc2.openenv.settings import ChosenMatch
    from khala_sc2.playing.seats import Seat, SeatedMatch

ToolAction = CallToolAction | ListToolsAction

CLOSE_S: Final = 30.0
"""Longest wait for the end of a game, which takes 0.1 s."""


class NoEpisode(KhalaError):
    """The client asked for a step where there is none."""


class KhalaEnvironment(Environment[ToolAction, Observation, KhalaState]):
    """One episode of a task after the other, for agents of one side."""

    SUPPORTS_CONCURRENT_SESSIONS = True

    def __init__(
        self,
        settings: ServerSettings | None = None,
        games: IdleGames | InsideGames | None = None,
        places: ServerPlaces | None = None,
    ) -> None:
        """Take what the server decides, and the games and places that its sessions share, or make its own."""
        self._settings = settings or ServerSettings()
        self._places = places or ServerPlaces(1)
        self._games = games or InsideGames()
        self._owns_games = games is None
        super().__init__(rubric=self._settings.rubric())
        self.mcp_client = DirectTools(self.step_async)
        self._choice = ResetOptions()
        self._match: SeatedMatch | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: LoopThread | None = None
        self._seats: dict[str, Seat] = {}
        self._turn = SeatsTurn()
        self._state = KhalaState()
        self._briefed: set[str] = set()
        self._answers: dict[str, str] = {}
        """Of agents that have acted, until all have that are asked."""
        self._game_loop = 0
        self._closed = False
        self._ended = ""
        """Why there is no match any more, if the client did not end it."""
        self._one_at_a_time = asyncio.Lock()
        self._leaving: asyncio.Task[None] | None = None

    async def reset_async(
        self, seed: int | None = None, episode_id: str | None = None, **options: Any
    ) -> KhalaObservation:
        """Begin an episode: in a new game with a seed, or with other options than before; else in that which goes on.

        Args:
            seed: of a new game.
            episode_id: a name for the episode; one is made.
            options: fields of `ResetOptions`.

        Raises:
            KhalaError: an option is wrong, or the game cannot be played; the text says what to do.
        """
        async with self._one_at_a_time:
            return await self._reset({"seed": seed, "episode_id": episode_id} | options)

    async def _reset(self, options: Mapping[str, object]) -> KhalaObservation:
        if self._closed:
            raise NoEpisode("this session was closed, or did nothing for too long: connect again")
        wanted = loads(json.dumps(options), ResetOptions, source="reset")
        await self._places.take(self)
        try:
            return await self._begin(wanted)
        finally:
            self._places.touch(self)
            if self._match is None:
                self._places.free(self)

    async def _begin(self, wanted: ResetOptions) -> KhalaObservation:
        goes_on = self._match is not None and self._turn.results and not self._turn.over
        if wanted.seed is not None or wanted.choice() != self._choice or not goes_on:
            await self._leave()
            await self._enter(await asyncio.to_thread(self._settings.match, wanted, self._games))
            self._choice = wanted.choice()
            self._ended = ""
        else:
            assert self._state.seed is not None
            self._state.seed += 1
        self._state.episode_id = wanted.episode_id or str(uuid.uuid4())
        self._state.step_count = 0
        self._state.over = False
        self._briefed.clear()
        self._answers.clear()
        self._game_loop = 0
        await self._reset_rubric_async()
        await self._advance()
        return self._observe()

    async def step_async(self, action: ToolAction, timeout_s: float | None = None, **_: Any) -> Observation:
        """Call a tool. One that answers for agents plays until somebody is asked again, or the episode is over.

        A call that is wrong moves nothing, and the observation has its error.

        Args:
            action: the call, or the question which tools there are.
            timeout_s: not read: how long the others think is the match's to say.

        Raises:
            NoEpisode: none has begun, or it is over.
            KhalaError: the match failed.
        """
        del timeout_s
        if isinstance(action, ListToolsAction):
            return ListToolsObservation(tools=tools())
        async with self._one_at_a_time:
            try:
                return await self._call(action)
            finally:
                self._places.touch(self)

    async def _call(self, action: CallToolAction) -> KhalaObservation:
        try:
            tool = read_call(action.tool_name, action.arguments)
            if isinstance(tool, LookUp):
                return self._say(action.tool_name, tool.answer())
            if isinstance(tool, Observe):
                return await self._look()
            return await self._step(action.tool_name, self._said(tool))
        except ToolFault as fault:
            return self._say(action.tool_name, error=ToolError(error_type=fault.kind, message=str(fault)))

    async def _look(self) -> KhalaObservation:
        if self._match is None or self._state.over:
            observation = await self._reset({})
        else:
            observation = self._observe(since=False)
        self._state.step_count += 1
        return observation.model_copy(update={"tool_name": Observe.name, "reward": 0.0})

    async def _step(self, tool: str, said: Mapping[str, str]) -> KhalaObservation:
        match = self._playing()
        self._answers |= said
        asked = [name for name, seat in self._seats.items() if seat in self._turn.asked]
        if tool == Act.name and (left := [name for name in asked if name not in self._answers]):
            return self._say(tool, f"Noted. The game goes on when these have acted, too: {names(left)}.")
        answers, self._answers = self._answers, {}
        for name in asked:
            match.act(self._seats[name], answers.get(name, ""))
        await self._advance()
        self._state.step_count += 1
        observation = self._observe()
        observation.tool_name = tool
        reply = next(iter(answers.values()), "") if len(self._seats) == 1 else None
        assert self.rubric is not None
        reward = self.rubric(KhalaAction(reply=reply, replies=answers), observation)
        observation.reward = await reward if inspect.isawaitable(reward) else reward
        parts = self.rubric.named_rubrics()
        observation.scores = {name: part.last_score for name, part in parts if part.last_score is not None}
        return observation

    def _playing(self) -> SeatedMatch:
        """Return the match.

        Raises:
            NoEpisode: no episode goes on.
        """
        if self._match is None and self._ended:
            raise NoEpisode(f"the episode was ended, since {self._ended}")
        if self._match is None or self._state.episode_id is None:
            raise NoEpisode("no episode has begun: call reset first, or the tool observe")
        if self._state.over:
            raise NoEpisode("the episode is over: call reset to begin the next one")
        return self._match

    def _say(self, tool: str, result: str | None = None, error: ToolError | None = None) -> KhalaObservation:
        """Return the answer of a tool that did not play."""
        self._state.step_count += 1
        return KhalaObservation(
            tool_name=tool,
            result=result,
            error=error,
            episode_id=self._state.episode_id or "",
            reward=0.0,
            done=self._state.over,
        )

    def reset(self, seed: int | None = None, episode_id: str | None = None, **options: Any) -> KhalaObservation:
        """Do as `reset_async`, for callers without an event loop."""
        if self._thread is None:
            self._thread = LoopThread()
        return self._thread.run(self.reset_async(seed, episode_id, **options))

    def step(self, action: ToolAction, timeout_s: float | None = None, **_: Any) -> Observation:
        """Do as `step_async`, for callers without an event loop."""
        if self._thread is None:
            raise NoEpisode("no episode has begun: call reset first, or the tool observe")
        return self._thread.run(self.step_async(action, timeout_s))

    @property
    def state(self) -> KhalaState:
        """What is played."""
        return self._state.model_copy()

    @property
    def is_busy(self) -> bool:
        """Whether it is answering a call."""
        return self._one_at_a_time.locked()

    @property
    def is_over(self) -> bool:
        """Whether its episode is over."""
        return self._state.over

    async def give_up(self, why: str) -> None:
        """End the match, and tell the client why with its next call; it may reset."""
        async with self._one_at_a_time:
            self._ended = why
            await self._leave()

    def get_metadata(self) -> EnvironmentMetadata:
        """Return what the environment is called."""
        return EnvironmentMetadata(
            name="khala",
            description="Teams of LLM agents play StarCraft II together; a session plays one of them, or a side.",
            version=__version__,
        )

    def close(self) -> None:
        """End the match and its game, for good."""
        self._closed = True
        self._places.free(self)
        loop = self._loop
        if loop is None:
            pass
        elif _is_running_here(loop):
            self._leaving = loop.create_task(self._end())
        else:
            asyncio.run_coroutine_threadsafe(self._end(), loop).result(CLOSE_S)
        if self._thread is not None:
            self._thread.close()
            self._thread = None

    # the match ----------------------------------------------------------------------------------------------------

    async def _enter(self, chosen: ChosenMatch) -> None:
        match, config = chosen
        self._seats = {seat.agent: seat for seat in match.seats}
        self._loop = asyncio.get_running_loop()
        self._turn = SeatsTurn()
        self._match = await match.__aenter__()
        self._state = KhalaState(
            task=config.task.name,
            side=match.seats[0].side,
            agents=list(self._seats),
            seed=config.seed,
            recording=None if config.record is None else str(config.record),
        )

    async def _leave(self) -> None:
        match, self._match = self._match, None
        if match is not None:
            with contextlib.suppress(KhalaError):  # it was raised where the match was waited for
                await match.__aexit__(None, None, None)

    async def _end(self) -> None:
        await self._leave()
        if self._owns_games:
            await asyncio.to_thread(self._games.close)

    async def _advance(self) -> None:
        assert self._match is not None
        try:
            self._turn = await self._match.turn()
        except KhalaError:
            await self._leave()
            self._places.free(self)
            raise
        self._state.over = bool(self._turn.results) or self._turn.over

    def _said(self, tool: PlayTool) -> Mapping[str, str]:
        """Return what agents answer.

        Raises:
            NoEpisode: no episode goes on.
            ToolFault: it is for an agent that the session does not play, or for none.
        """
        self._playing()
        if isinstance(tool, Act):
            return {self._agent(tool.agent): reply_of(tool)}
        assert isinstance(tool, ReplyInText)
        for name in tool.replies:
            self._agent(name)
        if tool.text is None:
            return tool.replies
        if len(self._seats) > 1:
            raise ToolFault(
                f"this session plays {names(list(self._seats))}: give `replies`, by agent, in place of one reply"
            )
        return {self._agent(""): tool.text}

    def _agent(self, name: str) -> str:
        if not name and len(self._seats) == 1:
            return next(iter(self._seats))
        if name not in self._seats:
            raise ToolFault(f"this session does not play {name!r}: it plays {names(list(self._seats))}")
        return name

    # what the client gets -----------------------------------------------------------------------------------------

    def _observe(self, *, since: bool = True) -> KhalaObservation:
        """Return what the agents see, and what has happened since the observation before, unless that was told."""
        turn, before = self._turn, self._game_loop
        reports = [report for report in turn.reports if since and report.side == self._state.side]
        agents = [agent for report in reports for agent in report.agents if agent.agent in self._seats]
        results = [result for result in turn.results if result.side == self._state.side]
        loops = [seen.observation.game_loop for seen in turn.asked.values()] + [result.game_loop for result in results]
        self._game_loop = max([before, *loops])
        asked = {name: turn.asked[seat] for name, seat in self._seats.items() if seat in turn.asked}
        views = {name: view_of(seen, briefed=name in self._briefed) for name, seen in asked.items()}
        self._briefed |= views.keys()
        outcome = outcome_of(results[0]) if results else None
        return KhalaObservation(
            result=page_of(views, outcome),
            episode_id=self._state.episode_id or "",
            agents=views,
            step=max(
                [seen.observation.step for seen in asked.values()] + [result.steps for result in results], default=0
            ),
            killed_value=sum(report.killed_value or 0.0 for report in reports),
            lost_value=sum(report.lost_value or 0.0 for report in reports),
            accepted=sum(len(agent.accepted) for agent in agents),
            refused=sum(count_refusals(agent.rejections).total() for agent in agents),
            elapsed_s=(self._game_loop - before) / LOOPS_PER_S,
            outcome=outcome,
            done=self._state.over,
        )


def _is_running_here(loop: asyncio.AbstractEventLoop) -> bool:
    try:
        return asyncio.get_running_loop() is loop
    except RuntimeError:
        return False
