"""An HTTP server whose answers are given: for what endpoints and gateways do that the scripted endpoint never would.

Tests and `python -m bench doors` ask it. It answers every path and method, and notes what it was asked.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self, TypeAlias

from aiohttp import web
from pydantic_core import from_json, to_json

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True, slots=True)
class CannedRequest:
    """A request as it arrived.

    Attributes:
        headers: names in lower case.
        body: what its JSON says, or its bytes if it is none; None if it has no body.
        peer: the connection that it came on.
    """

    path: str
    query: Mapping[str, str]
    headers: Mapping[str, str]
    body: Any
    peer: Any


@dataclass(frozen=True, slots=True)
class Given:
    """An answer: JSON, or bytes as they are."""

    body: Any = None
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)


Answering: TypeAlias = "Given | Callable[[CannedRequest], Given]"


class Canned:
    """The running server. An asynchronous context manager.

    Attributes:
        base_url: for clients, ends in `/v1`.
        asked: the requests so far.
    """

    def __init__(self, answer: Answering) -> None:
        self.asked: list[CannedRequest] = []
        self.base_url = ""
        self._answer = answer
        self._runner: web.AppRunner | None = None

    async def __aenter__(self) -> Self:
        application = web.Application()
        application.router.add_route("*", "/{path:.*}", self._note)
        self._runner = web.AppRunner(application, access_log=None, shutdown_timeout=0.1)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", 0).start()
        self.base_url = f"http://127.0.0.1:{self._runner.addresses[0][1]}/v1"
        return self

    async def __aexit__(self, *error: object) -> None:
        if self._runner is not None:
            await self._runner.cleanup()

    @property
    def root(self) -> str:
        """Its address without a path."""
        return self.base_url.removesuffix("/v1")

    async def _note(self, request: web.Request) -> web.Response:
        body = await request.read()
        asked = CannedRequest(
            path=request.path,
            query=dict(request.query),
            headers={name.lower(): value for name, value in request.headers.items()},
            body=_read(body) if request.content_type == "application/json" else body or None,
            peer=request.transport.get_extra_info("peername") if request.transport else None,
        )
        self.asked.append(asked)
        given = self._answer if isinstance(self._answer, Given) else self._answer(asked)
        content = given.body if isinstance(given.body, bytes) else to_json(given.body)
        return web.Response(
            status=given.status, body=content, headers={"Content-Type": "application/json", **given.headers}
        )


def _read(body: bytes) -> Any:
    return from_json(body) if body else None


def completion(content: Any, finish: Any = "stop", usage: Any = None, **message: Any) -> Given:
    """Return a chat completion with this content and these other fields of its message."""
    said = {"role": "assistant", "content": content, **message}
    return Given(
        {"model": "canned", "choices": [{"index": 0, "message": said, "finish_reason": finish}], "usage": usage}
    )


def refusal(status: int, message: str, **fields: Any) -> Given:
    """Return an error with a message, as OpenAI words it."""
    return Given({"error": {"message": message, **fields}}, status)
