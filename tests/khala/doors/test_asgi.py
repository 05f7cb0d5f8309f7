"""The shell around ASGI applications: what reaches them, and what is refused before."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from khala_sc2.doors.asgi import Guarded
from khala_sc2.doors.rules import Door

DOOR = Door(command="khala mcp", most_body_bytes=100)


class App:
    """An application that reads its body, and answers with its size."""

    def __init__(self) -> None:
        self.bodies: list[bytes] = []
        self.kinds: list[str] = []

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        self.kinds.append(scope["type"])
        if scope["type"] == "http":
            body = b""
            while (message := await receive()).get("more_body"):
                body += message["body"]
            self.bodies.append(body + message.get("body", b""))
            await send({"type": "http.response.start", "status": 200, "headers": []})


def scope(kind: str = "http", *headers: tuple[bytes, bytes], **more: Any) -> dict[str, Any]:
    return {
        "type": kind, "method": "POST", "path": "/x", "query_string": b"", "client": ("127.0.0.1", 1),
        "headers": [(b"host", b"127.0.0.1:8000"), *headers], **more,
    }  # fmt: skip


async def ask(app: App, asked: dict[str, Any], *parts: bytes, body_s: float = 5.0) -> list[dict[str, Any]]:
    """Return what is sent; without parts the body never comes."""
    messages = [
        {"type": "http.request", "body": part, "more_body": number < len(parts)}
        for number, part in enumerate(parts, start=1)
    ]
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        if not messages:
            await asyncio.Event().wait()
        return messages.pop(0)

    async def send(message: Any) -> None:
        sent.append(message)

    await Guarded(app, DOOR, body_s)(asked, receive, send)
    return sent


async def test_a_body_in_parts_reaches_the_application_whole() -> None:
    app = App()
    assert (await ask(app, scope(), b"a" * 40, b"b" * 60))[0]["status"] == 200
    assert app.bodies == [b"a" * 40 + b"b" * 60]


@pytest.mark.parametrize("parts", [(b"a" * 101,), (b"a" * 60, b"a" * 60), (b"a",) * 500])
async def test_a_body_that_is_larger_than_declared_does_not_reach_the_application(parts: tuple[bytes, ...]) -> None:
    app = App()
    assert (await ask(app, scope("http", (b"content-length", b"1")), *parts))[0]["status"] == 413
    assert app.bodies == []


async def test_a_body_that_does_not_come_is_not_waited_for() -> None:
    app = App()
    sent = await ask(app, scope(), body_s=0.01)
    assert (sent[0]["status"], app.bodies) == (408, [])


async def test_a_refusal_ends_the_connection_and_says_why() -> None:
    start, body = await ask(App(), scope("http", (b"origin", b"http://evil.example")), b"")
    assert start["status"] == 403
    assert (b"connection", b"close") in start["headers"]
    assert body["body"] == b"another page asked this: only the page of `khala mcp` may\n"


@pytest.mark.parametrize(
    ("extensions", "kinds"),
    [
        ({}, ["websocket.close"]),
        ({"websocket.http.response": {}}, ["websocket.http.response.start", "websocket.http.response.body"]),
    ],
)
async def test_a_websocket_of_another_page_is_refused_before_it_begins(
    extensions: dict[str, Any], kinds: list[str]
) -> None:
    app = App()
    asked = scope("websocket", (b"origin", b"http://evil.example"), extensions=extensions)
    assert [message["type"] for message in await ask(app, asked)] == kinds
    assert app.kinds == []


async def test_what_is_no_request_passes() -> None:
    app = App()
    await ask(app, {"type": "lifespan"})
    assert app.kinds == ["lifespan"]
