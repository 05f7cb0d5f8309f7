"""An HTTP server that speaks OpenAI's chat completions and plays from the text of the prompt alone.

    POST /v1/chat/completions    the model's name selects the player: `silent`, `random-legal`, `focus-fire`,
                                 `skilled`
    GET  /v1/models              their names
    GET  /health                 {"status": "ok"}

It replaces a model where none is wanted: in the demo, in tests and benchmarks, in a compose file. It does not
play as well as a model. Answers come after a fixed latency, faults on request (`khala_agents.scripted.faults`).
Tokens are counted by `count_tokens`, so that usage and prices are not empty.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import random
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Self

from aiohttp import web
from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic_core import to_json

from khala_agents.repeats import say_again
from khala_agents.scripted.faults import InjectedFaults
from khala_agents.scripted.players import PLAYERS
from khala_protocol.bus.config import is_loopback
from khala_protocol.listening import Patience, bind
from khala_protocol.manual import VERDICT
from khala_protocol.platforms import reset_on_close

if TYPE_CHECKING:
    import socket
    from collections.abc import Mapping

    from aiohttp.typedefs import Handler

log = logging.getLogger(__name__)

NONSENSE = "As an AI I would <Attack_Unit(> them all, \x00 <<MessageTo()> and Team : [ 3, ("
MAX_BODY_BYTES = 32 * 2**20
MOST_CONNECTIONS = 512
"""A connection for each agent of a large team, and half of the files that a process may open by default."""
DRIPS = 10
CHARACTERS_PER_TOKEN = 4
TOKENS_PER_IMAGE = 85
"""Tokens of a picture, whatever its size."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """How the endpoint answers.

    Attributes:
        latency_s: time between a request and its answer; a fault takes as long.
        faults: which requests go wrong.
        retry_after_s: sent with 429 and 503.
        drip_s: time between two pieces of an answer that drips.
        seed: for players that choose at random.
    """

    latency_s: float = 0.0
    faults: InjectedFaults = field(default_factory=InjectedFaults)
    retry_after_s: float = 1.0
    drip_s: float = 0.5
    seed: int = 0


class Endpoint:
    """The running server. An asynchronous context manager.

    Attributes:
        base_url: for clients, ends in `/v1`.
        requests: number of chat completions that were requested.
    """

    def __init__(self, behaviour: Behaviour | None = None, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self.requests = 0
        self.base_url = ""
        self._behaviour = behaviour or Behaviour()
        self._address = host, port
        self._runner: web.AppRunner | None = None
        self._server: asyncio.Server | None = None

    async def __aenter__(self) -> Self:
        host, port = self._address
        listening = bind(host, port)
        guard = _guard_near if is_loopback(host) else _guard
        application = web.Application(client_max_size=MAX_BODY_BYTES, middlewares=[guard])
        application.router.add_post("/v1/chat/completions", self._complete)
        application.router.add_get("/v1/models", _models)
        application.router.add_get("/health", _health)
        self._runner = web.AppRunner(
            application,
            access_log=None,
            handle_signals=False,
            shutdown_timeout=0.1,
            handler_cancellation=True,  # a stalled answer ends when its client has gone
        )
        await self._runner.setup()
        assert self._runner.server is not None
        accepting = Patience(self._runner.server, most=MOST_CONNECTIONS)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(accepting, sock=listening, backlog=1024)
        name = f"[{host}]" if ":" in host else host
        self.base_url = f"http://{name}:{listening.getsockname()[1]}/v1"
        return self

    async def __aexit__(self, *error: object) -> None:
        if self._server is not None and self._runner is not None:
            self._server.close()
            await self._runner.cleanup()

    async def _complete(self, request: web.Request) -> web.StreamResponse:
        self.requests += 1
        arrived = asyncio.get_running_loop().time()
        try:
            asked = _Asked.model_validate_json(await request.read())
        except ValidationError as error:
            return _refusal(400, f"this is no chat completion request: {error.errors()[0]['msg']}", "invalid_request")
        player = PLAYERS.get(asked.model)  # type: ignore[call-overload]  # any text may be asked for
        if player is None:
            return _refusal(
                404, f"there is no model '{asked.model}', there are {', '.join(PLAYERS)}", "model_not_found"
            )
        prompt = asked.observation
        digest = hashlib.sha256(f"{self._behaviour.seed} {prompt}".encode("utf-8", "replace")).hexdigest()
        fault = self._behaviour.faults.pick(digest)
        text = NONSENSE if fault == "nonsense" else player(prompt, random.Random(digest))
        body = _completion(asked, text, digest)
        await asyncio.sleep(self._behaviour.latency_s - (asyncio.get_running_loop().time() - arrived))
        if fault is None or fault == "nonsense":
            return web.Response(body=body, content_type="application/json")
        return await self._fail(request, fault, body)

    async def _fail(self, request: web.Request, fault: str, body: bytes) -> web.StreamResponse:
        match fault:
            case "stall":
                await asyncio.Event().wait()
            case "reset":
                return _reset(request)
            case "garbage":
                return web.Response(body=b"<html>Bad gate", content_type="text/html")
            case "quota":
                return _refusal(429, "you exceeded your current quota", "insufficient_quota")
            case "half":
                return await _send_half(request, body)
            case "drip":
                return await _drip(request, body, self._behaviour.drip_s)
        status = int(fault) if fault.isdigit() else 500
        headers = {"Retry-After": f"{self._behaviour.retry_after_s:g}"} if status in {429, 503} else {}
        return _refusal(status, "this fault was asked for", "scripted_fault", headers)


def count_tokens(text: str) -> int:
    """Return the tokens of a text by this endpoint's rule: a token for every four characters begun."""
    return -(-len(text) // CHARACTERS_PER_TOKEN)


class _Address(BaseModel):
    url: str = Field(pattern="^(data:|https?://)")
    detail: Literal["auto", "low", "high"] = "auto"


class _Part(BaseModel):
    type: Literal["text", "image_url"]
    text: str = ""
    image_url: _Address | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.type == "image_url") != (self.image_url is not None):
            raise ValueError("a part has either a text or an image_url, as its type says")
        return self


class _Said(BaseModel):
    role: Literal["system", "developer", "user", "assistant"]
    content: str | list[_Part]

    @property
    def text(self) -> str:
        if isinstance(self.content, str):
            return self.content
        texts = (part.text for part in self.content if part.type == "text")
        return "".join(text if text.endswith("\n") else f"{text}\n" for text in texts)

    @property
    def images(self) -> int:
        """Number of pictures in it; the players see none of them."""
        return 0 if isinstance(self.content, str) else sum(part.type == "image_url" for part in self.content)


class _Asked(BaseModel):
    model: str
    messages: list[_Said]

    @property
    def observation(self) -> str:
        """The last message, if it is the user's, with the task; before a verdict, the one of the user before it."""
        if not self.messages or self.messages[-1].role != "user":
            return ""
        said = [message.text for message in self.messages if message.role == "user"]
        seen = said[-2] if len(said) > 1 and said[-1].startswith(VERDICT) else said[-1]
        system = "\n\n".join(message.text for message in self.messages if message.role in ("system", "developer"))
        return say_again(system, seen) if system else seen


def _completion(asked: _Asked, text: str, digest: str) -> bytes:
    prompt_tokens = sum(count_tokens(message.text) + message.images * TOKENS_PER_IMAGE for message in asked.messages)
    completion_tokens = count_tokens(text)
    return to_json(
        {
            "id": f"chatcmpl-{digest[:24]}",
            "object": "chat.completion",
            "created": int(time.time()),
            "model": asked.model,
            "choices": [
                {"index": 0, "message": {"role": "assistant", "content": text}, "finish_reason": "stop"},
            ],
            "usage": {
                "prompt_tokens": prompt_tokens,
                "completion_tokens": completion_tokens,
                "total_tokens": prompt_tokens + completion_tokens,
            },
        }
    )


def _refusal(status: int, message: str, code: str, headers: Mapping[str, str] | None = None) -> web.Response:
    body = to_json({"error": {"message": message, "type": code, "code": code}})
    return web.Response(status=status, body=body, content_type="application/json", headers=headers)


def _reset(request: web.Request) -> web.Response:
    """Reset the connection with a RST: close it with nothing lingering."""
    transport = request.transport
    if transport is not None:
        peer: socket.socket = transport.get_extra_info("socket")
        reset_on_close(peer)
        transport.abort()
    return web.Response()  # the client is gone


async def _send_half(request: web.Request, body: bytes) -> web.StreamResponse:
    response = _stream(body)
    await response.prepare(request)
    await response.write(body[: len(body) // 2])
    if request.transport is not None:
        request.transport.close()
    return response


async def _drip(request: web.Request, body: bytes, drip_s: float) -> web.StreamResponse:
    response = _stream(body)
    await response.prepare(request)
    size = -(-len(body) // DRIPS)
    for begin in range(0, len(body), size):
        await asyncio.sleep(drip_s)
        await response.write(body[begin : begin + size])
    return response


def _stream(body: bytes) -> web.StreamResponse:
    response = web.StreamResponse(headers={"Content-Type": "application/json"})
    response.content_length = len(body)
    return response


@web.middleware
async def _guard(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Refuse what no program that asks a model would send: a request of a page, and a body beyond all prompts."""
    if "Origin" in request.headers or request.headers.get("Sec-Fetch-Site", "none") != "none":
        return _refusal(403, "a page asked this: the scripted model answers programs alone", "forbidden")
    if (request.content_length or 0) > MAX_BODY_BYTES:
        return _refusal(413, f"the body is longer than {MAX_BODY_BYTES} bytes: send less at a time", "too_large")
    return await handler(request)


@web.middleware
async def _guard_near(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Refuse other names as well, for a server of this machine alone: somebody may point them here for a page."""
    if not is_loopback((request.url.host or "").casefold()):
        return _refusal(403, "this server is not asked under this name: write 127.0.0.1 or localhost", "forbidden")
    return await _guard(request, handler)


async def _models(request: web.Request) -> web.Response:
    del request
    models = [{"id": name, "object": "model", "owned_by": "khala"} for name in PLAYERS]
    return web.Response(body=to_json({"object": "list", "data": models}), content_type="application/json")


async def _health(request: web.Request) -> web.Response:
    del request
    return web.Response(body=b'{"status": "ok"}', content_type="application/json")
