"""The rules around an ASGI application: a thin shell that reads no more of a body than the door allows.

Above: `khala_sc2.mcp.serve` and `khala_sc2.openenv.server`. Below: `khala_sc2.doors.rules`.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from khala_sc2.doors.rules import Refusal, RequestHead

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, MutableMapping

    from khala_sc2.doors.rules import Door

    Message: TypeAlias = MutableMapping[str, Any]
    Scope: TypeAlias = MutableMapping[str, Any]
    Receive: TypeAlias = Callable[[], Awaitable[Message]]
    Send: TypeAlias = Callable[[Message], Awaitable[None]]
    Application: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

BODY_S: Final = 30.0
"""Longest time in which a body arrives; it is small, and comes at once from an honest client."""


class Guarded:
    """An application behind a door."""

    def __init__(self, app: Application, door: Door, body_s: float = BODY_S) -> None:
        """Take the application and its rules."""
        self._app, self._door, self._body_s = app, door, body_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] not in {"http", "websocket"}:
            return await self._app(scope, receive, send)
        refusal = self._door.check(head_of(scope))
        if refusal is None and scope["type"] == "http":
            body = await self._read_body(receive)
            if not isinstance(body, Refusal):
                return await self._app(scope, _replay(body, receive), send)
            refusal = body
        if refusal is None:
            return await self._app(scope, receive, send)
        return await refuse(refusal, scope, send)

    async def _read_body(self, receive: Receive) -> list[Message] | Refusal:
        """Return the messages with the body of a request, or why it is refused."""
        messages: list[Message] = []
        size = 0
        try:
            async with asyncio.timeout(self._body_s):
                while not messages or messages[-1].get("more_body", False):
                    messages.append(await receive())
                    size += len(messages[-1].get("body", b""))
                    if size > self._door.most_body_bytes:
                        return self._door.too_large()
        except TimeoutError:
            return Refusal(408, f"the body did not arrive within {self._body_s:.0f} s")
        return messages


def head_of(scope: Scope) -> RequestHead:
    """Return the head of a request as the rules read it."""
    return RequestHead(
        method=scope.get("method", "GET"),  # a websocket begins as GET
        path=scope["path"],
        query=scope.get("query_string", b"").decode("latin-1"),
        headers=tuple(
            (name.decode("latin-1").lower(), value.decode("latin-1")) for name, value in scope.get("headers", ())
        ),
        peer=(scope.get("client") or ("",))[0],
    )


async def refuse(refusal: Refusal, scope: Scope, send: Send) -> None:
    """Send a refusal, and end the connection: its peer has to begin anew for the next try."""
    kind = "http.response"
    if scope["type"] == "websocket":
        if "websocket.http.response" not in scope.get("extensions", {}):
            return await send({"type": "websocket.close", "code": 1008, "reason": refusal.text})
        kind = "websocket.http.response"
    body = f"{refusal.text}\n".encode()
    headers = {
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(body)),
        "Cache-Control": "no-store",
        "Connection": "close",
        **refusal.headers,
    }
    packed = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    await send({"type": f"{kind}.start", "status": refusal.status, "headers": packed})
    return await send({"type": f"{kind}.body", "body": body})


def _replay(messages: list[Message], receive: Receive) -> Receive:
    """Return a `receive` that begins with what was read already."""
    rest = iter(messages)

    async def replay() -> Message:
        return next(rest, None) or await receive()

    return replay
