"""The server: sessions over a websocket, by OpenEnv's own server, and over HTTP, by name.

OpenEnv's server makes an environment for each request over HTTP, and closes it after: a step would find no episode.
Here an episode over HTTP has a name, `episode_id`, which `/reset` makes or takes and `/step`, `/state` and `/close` ask
for. A name that the server makes cannot be guessed, so it is all that they need; for a name that a client chose they
need the cookie of that client as well. With the cookie they may leave the name out while there is one episode. These
sessions count as those over websockets do, and end when they are idle.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fastapi import FastAPI, HTTPException, Request, Response, status
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

from khala_bridge.game.processes import IdleGames
from khala_protocol.bus.config import is_loopback
from khala_protocol.errors import KhalaError
from khala_protocol.listening import MOST_CONNECTIONS
from khala_sc2 import __version__
from khala_sc2.doors.asgi import Guarded
from khala_sc2.doors.rules import Door, is_same, token_of
from khala_sc2.doors.serving import uvicorn_config
from khala_sc2.openenv.environment import KhalaEnvironment, NoEpisode
from khala_sc2.openenv.models import KhalaAction, KhalaObservation, KhalaState
from khala_sc2.openenv.places import ServerPlaces
from khala_sc2.openenv.settings import ServerSettings

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator

    import uvicorn
    from openenv.core.env_server.interfaces import Environment
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from khala_sc2.doors.asgi import Application

SESSIONS: Final = 8
IDLE_S: Final = 3600.0
MOST_WAITING: Final = 32
"""Sessions that do not play, beyond as many as may play; when one more comes, the oldest is closed."""
MOST_BODY_BYTES: Final = 2**20
"""Of a request or a message: twice the longest reply of an agent over the bus."""
OPENENV_TOKEN: Final = "KHALA_OPENENV_TOKEN"  # noqa: S105  # the name of its variable
OPENENV_OPEN: Final = "KHALA_OPENENV_OPEN"
CLIENT: Final = "khala_client"
"""The cookie that names a client over HTTP."""
_OURS: Final = frozenset({"/reset", "/step", "/state"})


def openenv_door(host: str | None = None, *, is_open: bool = False) -> Door:
    """Return the rules of a server: whoever can reach it from elsewhere needs a token.

    The token is that of the environment, or a new one.

    Args:
        host: address that it serves on; None if somebody else chooses it.
        is_open: whether other machines may play without a token.

    Raises:
        ConfigError: the token can be guessed.
    """
    has_token = bool(os.environ.get(OPENENV_TOKEN))
    is_near = not has_token and not is_open if host is None else is_loopback(host)
    needs_token = has_token or not (is_near or is_open)
    return Door(
        command="khala openenv",
        is_near=is_near,
        token=token_of(OPENENV_TOKEN) if needs_token else "",
        open_paths=frozenset({"/health"}),
        most_body_bytes=MOST_BODY_BYTES,
    )


def server_config(app: Application, *, sessions: int = SESSIONS, **options: Any) -> uvicorn.Config:
    """Return how the application is served; options are more of `uvicorn.Config`."""
    most = max(MOST_CONNECTIONS, 4 * sessions)
    return uvicorn_config(app, most_connections=most, ws="websockets-sansio", ws_max_size=MOST_BODY_BYTES, **options)


def app_of(
    settings: ServerSettings | None = None,
    *,
    sessions: int = SESSIONS,
    idle_s: float = IDLE_S,
    door: Door | None = None,
) -> FastAPI:
    """Return the application.

    Args:
        settings: what the server decides.
        sessions: most that play at a time; each has a process of the game, which waits for the next one when it ends.
        idle_s: seconds after which a session ends that does nothing.
        door: who may ask; by default programs of this machine.
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
    # those that play, those that wait, and those that are told to leave and have not left yet
    limits = ConcurrencyConfig(max_concurrent_envs=2 * (sessions + MOST_WAITING), session_timeout=idle_s)
    _Server(settings or ServerSettings(), games, ServerPlaces(sessions), limits).register_routes(app)
    app.add_middleware(_Leaving)
    app.add_middleware(Guarded, door=door or openenv_door("127.0.0.1"))
    return app


_LEAVES: ContextVar[asyncio.Event | None] = ContextVar("_LEAVES", default=None)
"""Within a websocket: set to end it."""


class _Leaving:
    """Middleware: lets the server end a websocket whose place is needed, though OpenEnv waits for its client alone.

    OpenEnv closes each websocket once more when its client has gone, which uvicorn would log as an error.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "websocket":
            await self._app(scope, receive, send)
            return
        leaves = asyncio.Event()
        _LEAVES.set(leaves)

        async def closing(message: Message) -> None:
            if leaves.is_set() and message["type"] == "websocket.close":
                message.update(code=1013, reason="too many clients wait: connect again when you begin to play")
            await send(message)

        with contextlib.suppress(WebSocketDisconnect):
            await self._app(scope, _until(leaves, receive), closing)


def _until(leaves: asyncio.Event, receive: Receive) -> Receive:
    """Return a `receive` that says that the client has gone as soon as it has to leave."""

    async def receive_or_leave() -> Message:
        coming, leaving = asyncio.ensure_future(receive()), asyncio.ensure_future(leaves.wait())
        try:
            await asyncio.wait({coming, leaving}, return_when=asyncio.FIRST_COMPLETED)
            return coming.result() if coming.done() else {"type": "websocket.disconnect", "code": 1013}
        finally:
            coming.cancel()
            leaving.cancel()

    return receive_or_leave


class NamedStep(StepRequest):
    """A request for a step."""

    action: KhalaAction  # type: ignore[assignment]  # OpenEnv's is any JSON
    episode_id: str | None = None


class Named(BaseModel):
    """Which episode is meant."""

    episode_id: str | None = None


@dataclass(frozen=True, slots=True)
class _Episode:
    """An episode over HTTP."""

    session: str
    client: str
    """The cookie of the client that began it."""
    is_chosen: bool
    """Whether the client chose its name, which others could guess."""

    def is_open_to(self, client: str) -> bool:
        return not self.is_chosen or is_same(client, self.client)


class _Server(HTTPEnvServer):
    """OpenEnv's server, with sessions over HTTP."""

    def __init__(
        self, settings: ServerSettings, games: IdleGames, places: ServerPlaces, limits: ConcurrencyConfig
    ) -> None:
        def environment() -> KhalaEnvironment:
            return KhalaEnvironment(settings, games, places)

        super().__init__(environment, KhalaAction, KhalaObservation, concurrency_config=limits)
        self._places = places
        self._episodes: dict[str, _Episode] = {}
        self._leaves: dict[str, asyncio.Event] = {}
        """Of each session over a websocket: ends it."""

    def register_routes(self, app: FastAPI, mode: ServerMode | str = ServerMode.SIMULATION) -> None:
        """Add all routes; ours are in the place of OpenEnv's."""
        super().register_routes(app, mode)
        app.router.routes[:] = [route for route in app.router.routes if getattr(route, "path", "") not in _OURS]
        control: dict[str, Any] = {"tags": ["Environment Control"]}
        app.post("/reset", summary="Begin an episode", **control)(self.reset)
        app.post("/step", summary="Send replies, and play until somebody is asked again", **control)(self.step)
        app.post("/close", summary="End a session", **control)(self.close)
        app.get("/state", summary="What is played", tags=["State Management"])(self.state)

    async def reset(self, http: Request, response: Response, request: ResetRequest | None = None) -> ResetResponse:
        """Begin an episode, in the session of this name if there is one."""
        wanted = {} if request is None else request.model_dump(exclude_unset=True)
        client = http.cookies.get(CLIENT) or secrets.token_urlsafe(24)
        name = wanted.get("episode_id")
        known = self._episodes.get(name or "")
        is_new = known is None
        with _answer_errors():
            session = (await self._create_session())[0] if known is None else self._check_session(known, client)
            try:
                observation = await self._environment(session).reset_async(**wanted)
            except BaseException:
                if is_new:
                    await self._destroy_session(session)
                raise
        self._episodes[observation.episode_id] = _Episode(session, client, is_chosen=name is not None)
        self._update_session_activity(session)
        response.set_cookie(CLIENT, client, httponly=True, samesite="strict")
        return ResetResponse(**serialize_observation(observation))

    async def step(self, http: Request, request: NamedStep) -> StepResponse:
        """Send replies."""
        with _answer_errors():
            session = self._find_session(request.episode_id, http)
            observation = await self._environment(session).step_async(request.action)
        self._update_session_activity(session, increment_step=True)
        return StepResponse(**serialize_observation(observation))

    async def state(self, http: Request, episode_id: str | None = None) -> KhalaState:
        """Return what is played."""
        with _answer_errors():
            return self._environment(self._find_session(episode_id, http)).state

    async def close(self, http: Request, request: Named | None = None) -> Named:
        """End a session and its game."""
        with _answer_errors():
            session = self._find_session(None if request is None else request.episode_id, http)
            name = self._environment(session).state.episode_id
        await self._destroy_session(session)
        return Named(episode_id=name)

    async def _create_session(self) -> tuple[str, Environment[Any, Any, Any]]:
        """Make room for a session, if too many wait that do not play; then do as OpenEnv."""
        waiting = [session for session, made in self._sessions.items() if made is not None and not self._plays(session)]
        if len(waiting) >= self._places.most + MOST_WAITING:
            if (leaves := self._leaves.get(waiting[0])) is not None:
                leaves.set()
            else:  # over HTTP nobody is there to be told
                await self._destroy_session(waiting[0])
        session, environment = await super()._create_session()
        if (leaves := _LEAVES.get()) is not None:
            self._leaves[session] = leaves
        return session, environment

    async def _destroy_session(self, session_id: str) -> None:
        self._leaves.pop(session_id, None)
        self._episodes = {name: known for name, known in self._episodes.items() if known.session != session_id}
        await super()._destroy_session(session_id)

    def _plays(self, session: str) -> bool:
        environment = self._sessions.get(session)
        return isinstance(environment, KhalaEnvironment) and self._places.holds(environment)

    def _environment(self, session: str) -> KhalaEnvironment:
        environment = self._sessions[session]
        assert isinstance(environment, KhalaEnvironment)
        return environment

    def _check_session(self, known: _Episode, client: str) -> str:
        """Return the session of an episode.

        Raises:
            NoEpisode: another client chose its name.
        """
        if not known.is_open_to(client):
            raise NoEpisode(
                "another client chose this episode_id: send the cookie that reset set, or leave episode_id out of "
                "reset and give the one that it returns"
            )
        return known.session

    def _find_session(self, name: str | None, http: Request) -> str:
        """Return the session over HTTP of this name, or the only one of the client.

        Raises:
            NoEpisode: there is none, it is another client's, or there are several.
        """
        client = http.cookies.get(CLIENT, "")
        if name is not None and (known := self._episodes.get(name)) is not None:
            return self._check_session(known, client)
        mine = {known.session for known in self._episodes.values() if is_same(client, known.client)}
        if name is None and len(mine) > 1:
            raise NoEpisode("there are several episodes: say which one with episode_id, as reset returned it")
        if name is not None or not mine:
            which = "of this client" if name is None else name
            raise NoEpisode(f"there is no episode {which}: call reset first, and give the episode_id that it returns")
        return mine.pop()


@contextlib.contextmanager
def _answer_errors() -> Iterator[None]:
    """Let the client read what is wrong and what to do."""
    try:
        yield
    except SessionCapacityError as error:
        raise HTTPException(status.HTTP_503_SERVICE_UNAVAILABLE, str(error)) from error
    except NoEpisode as error:
        raise HTTPException(status.HTTP_409_CONFLICT, str(error)) from error
    except KhalaError as error:
        raise HTTPException(status.HTTP_422_UNPROCESSABLE_CONTENT, str(error)) from error
