"""Connections that take their time are ended, and make room for others: real sockets, and a clock that is moved."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from typing import TYPE_CHECKING

import pytest

from khala_protocol.listening import HEAD_S, MOST_HEAD_BYTES, Patience, bind

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable


class Echo(asyncio.Protocol):
    """A server that sends back what comes."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        self.transport.write(data)


class Client:
    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def ask(self, data: bytes = b"GET / HTTP/1.1\r\n\r\n") -> bytes:
        self.writer.write(data)
        return await self.reader.read(100)

    async def is_ended(self) -> bool:
        """Return whether the server ended the connection, before somebody gives up."""
        with contextlib.suppress(ConnectionError):
            try:
                await asyncio.wait_for(self.reader.read(), 5)
            except TimeoutError:
                return False
        return True

    async def leave(self) -> None:
        self.writer.close()
        with contextlib.suppress(ConnectionError):
            await self.writer.wait_closed()


@contextlib.asynccontextmanager
async def serving(**limits: float) -> AsyncIterator[Callable[[], Awaitable[Client]]]:
    """Yield what connects a client."""
    clients: list[Client] = []

    async def connect() -> Client:
        clients.append(Client(*await asyncio.open_connection(*listening.getsockname())))
        return clients[-1]

    patience = Patience(Echo, **limits)  # type: ignore[arg-type]  # the most is a whole number
    with bind("127.0.0.1", 0) as listening:
        server = await asyncio.get_running_loop().create_server(patience, sock=listening)
        yield connect
        for client in clients:
            await client.leave()
        server.close()


@pytest.fixture
async def later(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return the seconds by which the clock of the loop is ahead; the test may change them."""
    loop, ahead_s = asyncio.get_running_loop(), [0.0]
    true_time = loop.time
    monkeypatch.setattr(loop, "time", lambda: true_time() + ahead_s[0])
    return ahead_s


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"])
async def test_a_connection_that_does_not_ask_in_time_is_ended(later: list[float], sent: bytes) -> None:
    async with serving() as connect:
        slow, honest = await connect(), await connect()
        slow.writer.write(sent)
        assert await honest.ask()
        later[0] += HEAD_S + 1
        assert await slow.is_ended()
        assert await honest.ask(b"more") == b"more", "a connection that has asked stays"


async def test_a_head_without_end_is_ended(later: list[float]) -> None:
    async with serving() as connect:
        client = await connect()
        client.writer.write(b"GET / HTTP/1.1\r\nX: " + b"a" * 4 * MOST_HEAD_BYTES)
        with contextlib.suppress(ConnectionError):
            while await client.reader.read(2**20):
                pass
        assert await client.is_ended()


async def test_an_end_that_comes_in_parts_is_seen(later: list[float]) -> None:
    async with serving() as connect:
        client = await connect()
        for part in (b"GET / HTTP/1.1\r", b"\n\r", b"\n"):
            await client.ask(part)
        later[0] += HEAD_S + 1
        assert await client.ask(b"more") == b"more"


async def test_a_full_server_ends_the_oldest_that_has_not_asked_and_no_honest_client() -> None:
    async with serving(most=4) as connect:
        honest = [await connect() for _ in range(2)]
        for client in honest:
            assert await client.ask()
        silent = [await connect() for _ in range(4)]
        assert [await client.is_ended() for client in silent[:2]] == [True, True]
        new = await connect()
        assert await new.ask()
        assert [await client.ask(b"more") for client in honest] == [b"more"] * 2


async def test_a_server_full_of_clients_that_have_asked_takes_no_more_until_one_goes() -> None:
    async with serving(most=2) as connect:
        first, second = await connect(), await connect()
        assert await first.ask()
        assert await second.ask()
        assert await (await connect()).is_ended()
        await first.leave()
        third = await connect()
        assert await third.ask()


def test_a_peer_whose_machine_is_gone_is_noticed_by_tcp() -> None:
    with (
        bind("127.0.0.1", 0) as listening,
        socket.create_connection(listening.getsockname()),
        listening.accept()[0] as accepted,
    ):
        assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        if hasattr(socket, "TCP_KEEPIDLE"):
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == 60
