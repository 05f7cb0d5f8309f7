"""A resources server for NeMo Gym: the model plays one agent of a game, turn by turn.

`gymnasium_agent` drives it with `/reset` and `/step`. An environment server may begin and end the same episode with
`/seed_session` and `/close_session`, and name it as it likes.

A step's reward is that of the turn before, which is settled once the next observation is there; the last step has both,
so that the rewards of an episode sum up to the agent's `khala_sc2.dataset.credit.own_reward` over all of its turns.
"""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI, HTTPException, Request
from nemo_gym.base_resources_server import (
    ResourcesCloseSessionRequest,
    ResourcesCloseSessionResponse,
    ResourcesSeedSessionRequest,
    ResourcesSeedSessionResponse,
)
from nemo_gym.server_utils import SESSION_ID_KEY
from pydantic import PrivateAttr, ValidationError
from resources_servers.gymnasium import GymnasiumServer, extract_text
from resources_servers.khala_starcraft.task_data import TaskData

from khala_bridge.game.processes import IdleGames
from khala_protocol.errors import KhalaError
from khala_sc2.dataset.credit import own_reward
from khala_sc2.playing.loop_thread import LoopThread
from khala_sc2.rollout import RolloutSpec, TeamRollout

if TYPE_CHECKING:
    from collections.abc import Coroutine, Mapping

    from nemo_gym.openai_utils import NeMoGymResponse

    from khala_sc2.rollout import AgentPrompt

IDLE_GAMES = 8
"""Processes of the game that wait for the next episode."""


@dataclass
class AgentEpisode:
    """An episode of one agent; its methods are for the thread of the games."""

    rollout: TeamRollout
    agent: str
    prompt: AgentPrompt | None = None
    paid: int = 0
    """Turns whose rewards were given."""
    is_open: bool = False

    async def begin(self) -> str:
        """Return the first observation, below the briefing."""
        await self.rollout.__aenter__()
        self.is_open = True
        self.prompt = (await self.rollout.begin()).get(self.agent)
        if self.prompt is None:
            raise KhalaError(f"{self.agent} is never asked")
        return f"{self.prompt.messages[0].content}\n\n{self.prompt.messages[-1].content}"

    async def step(self, reply: str) -> tuple[str | None, float]:
        """Play a reply, and return the next observation, None at the end, and what was settled since the last one."""
        if self.prompt is None:
            return None, 0.0
        prompts = await self.rollout.reply({self.agent: reply})
        self.prompt = prompts.get(self.agent)
        turns = self.rollout.turns
        settled = turns if self.prompt is None else turns[:-1]
        reward = sum(map(own_reward, settled[self.paid :]))
        self.paid = len(settled)
        return self.prompt.messages[-1].content if self.prompt else None, reward

    def info(self) -> dict[str, Any]:
        """Return the turns that were settled, and how the episode ended."""
        result = self.rollout.result
        turns = [asdict(turn) | {"reward": own_reward(turn)} for turn in self.rollout.turns[: self.paid]]
        return {"agent": self.agent, "outcome": result.outcome if result else None, "turns": turns}

    async def close(self) -> None:
        """End the match."""
        if self.is_open:
            self.is_open = False
            with contextlib.suppress(KhalaError):  # it was raised where the match was waited for
                await self.rollout.__aexit__(None, None, None)


class KhalaStarCraftServer(GymnasiumServer):
    """Games, one for each session."""

    ray_enabled = False
    _games: IdleGames = PrivateAttr(default_factory=lambda: IdleGames(IDLE_GAMES))
    _thread: LoopThread = PrivateAttr(default_factory=LoopThread)
    _closed: set[str] = PrivateAttr(default_factory=set)
    """Sessions that an environment server has closed, begun or not: a late seed must not begin them again."""
    _seeding: asyncio.Lock = PrivateAttr(default_factory=asyncio.Lock)

    def setup_webserver(self) -> FastAPI:
        """Return the app of a server for `gymnasium_agent`, with what ends an episode before its time."""
        app = super().setup_webserver()
        app.post("/close")(self.close)
        app.post("/seed_session")(self.seed_session)
        app.post("/close_session")(self.close_resources_session)
        return app

    async def reset(self, metadata: dict[str, Any], session_id: str | None = None) -> tuple[str | None, dict[str, Any]]:
        """Begin an episode, and return the briefing with the first observation."""
        name = _named(session_id)
        await self.close_session(name)
        episode = await self._begin(metadata)
        self.session_state[name] = episode
        return await self._in_games(self._first(episode)), {"supports_explicit_close": True, "agent": episode.agent}

    async def step(
        self, action: NeMoGymResponse, metadata: dict[str, Any], session_id: str | None = None
    ) -> tuple[str | None, float, bool, bool, dict[str, Any]]:
        """Play the reply of the model until its agent is asked again."""
        del metadata
        episode = self.session_state.get(_named(session_id))
        if episode is None:
            raise HTTPException(400, "no episode has begun in this session: call /reset first")
        observation, reward = await self._in_games(episode.step(extract_text(action)))
        over = observation is None
        result = episode.rollout.result
        cut = over and (result is None or result.outcome == "cut")
        return observation, reward, over and not cut, cut, episode.info() if over else {}

    async def close_session(self, session_id: str | None) -> None:
        """End the episode of a session, if it has one."""
        episode = self.session_state.pop(session_id, None) if session_id else None
        if episode is not None:
            await self._in_games(episode.close())

    async def close(self, request: Request) -> dict[str, Any]:
        """End the episode of the caller's session."""
        await self.close_session(request.session.get(SESSION_ID_KEY))
        return {}

    async def seed_session(self, request: Request, body: ResourcesSeedSessionRequest) -> ResourcesSeedSessionResponse:
        """Make an episode under the caller's name; `/reset` in this session begins it anew."""
        name = body.resources_session_id
        async with self._seeding:
            if name in self._closed:
                raise HTTPException(409, f"the session {name} was closed")
            if name not in self.session_state:
                self.session_state[name] = await self._begin(body.task_data)
        request.session[SESSION_ID_KEY] = name
        return ResourcesSeedSessionResponse(resources_session_id=name)

    async def close_resources_session(self, body: ResourcesCloseSessionRequest) -> ResourcesCloseSessionResponse:
        """End the episode of that name, for good."""
        self._closed.add(body.resources_session_id)
        await self.close_session(body.resources_session_id)
        return ResourcesCloseSessionResponse(resources_session_id=body.resources_session_id)

    async def _begin(self, metadata: Mapping[str, Any]) -> AgentEpisode:
        try:
            row = TaskData.model_validate(dict(metadata))
            agents = (row.agent,) if row.agent else ()
            spec = RolloutSpec(row.battle, row.seed, agents, others=row.others, max_steps=row.max_steps)
            return await self._in_games(_made(spec, self._games))
        except (KhalaError, ValidationError) as error:
            raise HTTPException(422, str(error)) from None

    async def _first(self, episode: AgentEpisode) -> str:
        try:
            return await episode.begin()
        except BaseException:
            await episode.close()
            raise

    async def _in_games(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        """Return what a coroutine returns in the thread of the games, whose loop is one for all requests."""
        return await self._thread.run_for(coroutine)


async def _made(spec: RolloutSpec, games: IdleGames) -> AgentEpisode:
    rollout = TeamRollout(spec, games)
    if len(rollout.agents) > 1:
        rollout = TeamRollout(replace(spec, agents=rollout.agents[:1]), games)
    return AgentEpisode(rollout, rollout.agents[0])


def _named(session_id: str | None) -> str:
    if not session_id:
        raise HTTPException(400, "the request has no session")
    return session_id


if __name__ == "__main__":
    KhalaStarCraftServer.run_webserver()
