"""The server: sessions over a websocket, by OpenEnv's own server, and over HTTP, by name.

OpenEnv's server makes an environment for each request over HTTP, and closes it after: a step would find no episode.
Here an episode over HTTP has a name, `episode_id`, which `/reset` makes or takes and `/step` and `/state` ask for; they
may leave it out while there is one. These sessions count as those over websockets do, and end when they are idle.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Any, Final

from fastapi import FastAPI, HTTPException, status
from openenv.core.env_server.exceptions import SessionCapacityError
from openenv.core.env_server.http_server import HTTPEnvServer
from openenv.core.env_server.serialization import serialize_observation
from openenv.core.env_server.types import (
    ConcurrencyConfig,
    ResetRequest,
    ResetResponse,
    ServerMode,
    StepRequest,
    StepResponse,
)
from pydantic import BaseModel
from starlette.websockets import WebSocketDisconnect

from khala import __version__
from khala.openenv.environment import KhalaEnvironment, NoEpisode
from khala.openenv.models import KhalaAction, KhalaObservation, KhalaState
from khala.openenv.settings import Settings
from khala_bridge.game.processes import IdleGames
from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator

    from starlette.types import ASGIApp, Receive, Scope, Send

SESSIONS: Final = 8
IDLE_S: Final = 3600.0
_OURS: Final = frozenset({"/reset", "/step", "/state"})


def app_of(settings: Settings | None = None, *, sessions: int = SESSIONS, idle_s: float = IDLE_S) -> FastAPI:
    """Return the application.

    Args:
        settings: what the server decides.
        sessions: most at a time; each has a process of the game, which waits for the next one when it ends.
        idle_s: seconds after which a session ends that does nothing.
    """
    games = IdleGames(sessions)

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await asyncio.to_thread(games.close)

    app = FastAPI(
        lifespan=lifespan,
        title="Khala",
        version="1.0.0",  # of OpenEnv's API: its clients and `openenv validate` read it
        description=f"StarCraft II for teams of LLM agents, by OpenEnv. Khala {__version__}.",
    )
    limits = ConcurrencyConfig(max_concurrent_envs=sessions, session_timeout=idle_s)
    _Server(settings or Settings(), games, limits).register_routes(app)
    app.add_middleware(_Parting)
    return app


class _Parting:
    """Middleware: OpenEnv closes each websocket once more when its client has gone, which uvicorn logs as an error."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            await self._app(scope, receive, send)


class NamedStep(StepRequest):
    """A request for a step."""

    action: KhalaAction  # type: ignore[assignment]  # OpenEnv's is any JSON
    episode_id: str | None = None


class Named(BaseModel):
    """Which episode is meant."""

    episode_id: str | None = None


class _Server(HTTPEnvServer):
    """OpenEnv's server, with sessions over HTTP."""

    def __init__(self, settings: Settings, games: IdleGames, limits: ConcurrencyConfig) -> None:
        def environment() -> KhalaEnvironment:
            return KhalaEnvironment(settings, games)

        super().__init__(environment, KhalaAction, KhalaObservation, concurrency_config=limits)
        self._by_name: dict[str, str] = {}

    def register_routes(self, app: FastAPI, mode: ServerMode | str = ServerMode.SIMULATION) -> None:
        """Add all routes; ours are in the place of OpenEnv's."""
        super().register_routes(app, mode)
        app.router.routes[:] = [one for one in app.router.routes if getattr(one, "path", "") not in _OURS]
        control: dict[str, Any] = {"tags": ["Environment Control"]}
        app.post("/reset", summary="Begin an episode", **control)(self.reset)
        app.post("/step", summary="Send replies, and play until somebody is asked again", **control)(self.step)
        app.post("/close", summary="End a session", **control)(self.close)
        app.get("/state", summary="What is played", tags=["State Management"])(self.state)

    async def reset(self, request: ResetRequest | None = None) -> ResetResponse:
        """Begin an episode, in the session of this name if there is one."""
        wanted = {} if request is None else request.model_dump(exclude_unset=True)
        session = self._by_name.get(wanted.get("episode_id") or "")
        is_new = session is None
        with _said():
            if session is None:
                session, _ = await self._create_session()
            try:
                observation = await self._of(session).reset_async(**wanted)
            except BaseException:
                if is_new:
                    await self._destroy_session(session)
                raise
        self._by_name[observation.episode_id] = session
        self._update_session_activity(session)
        return ResetResponse(**serialize_observation(observation))

    async def step(self, request: NamedStep) -> StepResponse:
        """Send replies."""
        with _said():
            session = self._named(request.episode_id)
            observation = await self._of(session).step_async(request.action)
        self._update_session_activity(session, increment_step=True)
        return StepResponse(**serialize_observation(observation))

    async def state(self, episode_id: str | None = None) -> KhalaState:
        """Return what is played."""
        with _said():
            return self._of(self._named(episode_id)).state

    async def close(self, request: Named | None = None) -> Named:
        """End a session and its game."""
        with _said():
            session = self._named(None if request is None else request.episode_id)
            name = self._of(session).state.episode_id
        await self._destroy_session(session)
        return Named(episode_id=name)

    async def _destroy_session(self, session_id: str) -> None:
        self._by_name = {name: session for name, session in self._by_name.items() if session != session_id}
        await super()._destroy_session(session_id)

    def _of(self, session: str) -> KhalaEnvironment:
        environment = self._sessions[session]
        assert isinstance(environment, KhalaEnvironment)
        return environment

    def _named(self, name: str | None) -> str:
        """Return the session over HTTP of this name, or the only one.

        Raises:
            NoEpisode: there is none, or there are several.
        """
        if name is None and len(set(self._by_name.values())) > 1:
            raise NoEpisode("there are several episodes: say which one with episode_id, as reset returned it")
        session = next(iter(self._by_name.values()), None) if name is None else self._by_name.get(name)
        if session is None:
            raise NoEpisode(f"there is no episode {name or ''}".rstrip() + ": call reset first")
        return session


@contextlib.contextmanager
def _said() -> Iterator[None]:
    """Let the client read what is wrong and what to do."""
    try:
        yield
    except SessionCapacityError as error:
        raise HTTPException(status.HTTP_503_SERVICE_UNAVAILABLE, str(error)) from error
    except NoEpisode as error:
        raise HTTPException(status.HTTP_409_CONFLICT, str(error)) from error
    except KhalaError as error:
        raise HTTPException(status.HTTP_422_UNPROCESSABLE_CONTENT, str(error)) from error
