"""One session of OpenEnv: a match, some of whose agents the client plays.

The match is played by the host of every other match; a step lasts until somebody is asked again. Above:
`khala_sc2.openenv.server`. Below: `khala_sc2.openenv.settings`, which makes the match, and `khala_sc2.playing.seats`, which plays
it.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import uuid
from typing import TYPE_CHECKING, Any, Final

from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.types import EnvironmentMetadata

from khala_bridge.game.processes import IdleGames
from khala_protocol.configfile import loads
from khala_protocol.errors import KhalaError
from khala_protocol.messages import LOOPS_PER_S, count_refusals
from khala_sc2 import __version__
from khala_sc2.openenv.models import KhalaAction, KhalaObservation, KhalaState, ResetOptions
from khala_sc2.openenv.places import ServerPlaces
from khala_sc2.openenv.settings import ServerSettings
from khala_sc2.openenv.views import outcome_of, view_of
from khala_sc2.playing.loop_thread import LoopThread
from khala_sc2.playing.seats import SeatsTurn

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_sc2.openenv.settings import ChosenMatch
    from khala_sc2.playing.seats import Seat, SeatedMatch

CLOSE_S: Final = 30.0
"""Longest wait for the end of a game, which takes 0.1 s."""


class NoEpisode(KhalaError):
    """The client asked for a step where there is none."""


class KhalaEnvironment(Environment[KhalaAction, KhalaObservation, KhalaState]):
    """One episode of a task after the other, for agents of one side."""

    SUPPORTS_CONCURRENT_SESSIONS = True

    def __init__(
        self, settings: ServerSettings | None = None, games: IdleGames | None = None, places: ServerPlaces | None = None
    ) -> None:
        """Take what the server decides, and the processes and places that its sessions share, or make its own."""
        self._settings = settings or ServerSettings()
        self._places = places or ServerPlaces(1)
        self._games = games or IdleGames()
        self._owns_games = games is None
        super().__init__(rubric=self._settings.rubric())
        self._choice = ResetOptions()
        self._match: SeatedMatch | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: LoopThread | None = None
        self._seats: dict[str, Seat] = {}
        self._turn = SeatsTurn()
        self._state = KhalaState()
        self._briefed: set[str] = set()
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
        self._game_loop = 0
        await self._reset_rubric_async()
        await self._advance()
        return self._observe()

    async def step_async(self, action: KhalaAction, timeout_s: float | None = None, **_: Any) -> KhalaObservation:
        """Send the replies of those who are asked, and play until somebody is asked again, or the episode is over.

        Args:
            action: the replies.
            timeout_s: not read: how long the others think is the match's to say.

        Raises:
            NoEpisode: none has begun, or it is over.
            KhalaError: the action names an agent of somebody else, or the match failed.
        """
        del timeout_s
        async with self._one_at_a_time:
            try:
                return await self._step(action)
            finally:
                self._places.touch(self)

    async def _step(self, action: KhalaAction) -> KhalaObservation:
        match = self._match
        if match is None and self._ended:
            raise NoEpisode(f"the episode was ended, since {self._ended}")
        if match is None or self._state.episode_id is None:
            raise NoEpisode("no episode has begun: call reset first")
        if self._state.over:
            raise NoEpisode("the episode is over: call reset to begin the next one")
        replies = self._replies(action)
        for name, seat in self._seats.items():
            if seat in self._turn.asked:
                match.act(seat, replies.get(name, ""))
        await self._advance()
        self._state.step_count += 1
        observation = self._observe()
        observation.reward = await self._apply_rubric_async(action, observation)
        assert self.rubric is not None
        parts = self.rubric.named_rubrics()
        observation.scores = {name: part.last_score for name, part in parts if part.last_score is not None}
        return observation

    def reset(self, seed: int | None = None, episode_id: str | None = None, **options: Any) -> KhalaObservation:
        """Do as `reset_async`, for callers without an event loop."""
        if self._thread is None:
            self._thread = LoopThread()
        return self._thread.run(self.reset_async(seed, episode_id, **options))

    def step(self, action: KhalaAction, timeout_s: float | None = None, **_: Any) -> KhalaObservation:
        """Do as `step_async`, for callers without an event loop."""
        if self._thread is None:
            raise NoEpisode("no episode has begun: call reset first")
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

    def _replies(self, action: KhalaAction) -> Mapping[str, str]:
        """Return the replies by agent.

        Raises:
            KhalaError: one is for an agent that the session does not play.
        """
        names = ", ".join(self._seats)
        if unknown := [name for name in action.replies if name not in self._seats]:
            raise KhalaError(f"this session does not play {unknown[0]!r}: it plays {names}")
        if action.reply is None:
            return action.replies
        if len(self._seats) > 1:
            raise KhalaError(f"this session plays {names}: give `replies`, by agent, in place of `reply`")
        (name,) = self._seats
        return {name: action.reply}

    # what the client gets -----------------------------------------------------------------------------------------

    def _observe(self) -> KhalaObservation:
        turn, before = self._turn, self._game_loop
        reports = [report for report in turn.reports if report.side == self._state.side]
        agents = [agent for report in reports for agent in report.agents if agent.agent in self._seats]
        results = [result for result in turn.results if result.side == self._state.side]
        loops = [seen.observation.game_loop for seen in turn.asked.values()] + [result.game_loop for result in results]
        self._game_loop = max([before, *loops])
        asked = {name: turn.asked[seat] for name, seat in self._seats.items() if seat in turn.asked}
        views = {name: view_of(seen, briefed=name in self._briefed) for name, seen in asked.items()}
        self._briefed |= views.keys()
        return KhalaObservation(
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
            result=outcome_of(results[0]) if results else None,
            done=self._state.over,
        )


def _is_running_here(loop: asyncio.AbstractEventLoop) -> bool:
    try:
        return asyncio.get_running_loop() is loop
    except RuntimeError:
        return False
