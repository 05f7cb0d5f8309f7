"""Sockets of servers that the command line starts, and how long a connection may take to say what it wants.

Neither uvicorn nor aiohttp limits the time and the size of the head of a request, or the number of connections that
have not sent one: a thousand of them use up the files that a process may open.
"""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING, Any, Final, cast

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable

HEAD_S: Final = 10.0
"""Longest time from the connection to the end of the head of its first request."""
MOST_HEAD_BYTES: Final = 65_536
MOST_CONNECTIONS: Final = 256
"""Of a server: a quarter of the files that a process may open by default."""
_KEEPALIVE: Final = {"TCP_KEEPIDLE": 60, "TCP_KEEPINTVL": 15, "TCP_KEEPCNT": 4}
"""A peer whose machine or network has gone is noticed after two minutes of silence, whatever its program does."""
_END: Final = b"\r\n\r\n"


def bind(host: str, port: int, *, option: str = "--port") -> socket.socket:
    """Open a socket that listens.

    Args:
        host: address of this machine.
        port: 0 for a free one.
        option: that names the port, for the error.

    Raises:
        ConfigError: the port is taken, or the address is none of this machine's.
    """
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        listening = socket.create_server((host, port), family=family)
    except OSError as error:
        raise ConfigError(
            f"cannot listen on {host}:{port}: {error.strerror}; {option} names another port", source=option
        ) from None
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)  # connections inherit it
    for name, value in _KEEPALIVE.items():
        if hasattr(socket, name):  # not on every platform
            listening.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
    return listening


class Patience:
    """Makes the protocols of a server's connections, and ends connections that take too long to ask for anything.

    When the server is full, the oldest connection that has not asked yet makes room; if all have, the new one goes.
    """

    def __init__(
        self, factory: Callable[..., asyncio.BaseProtocol], *, most: int = MOST_CONNECTIONS, head_s: float = HEAD_S
    ) -> None:
        """Take what makes the protocol of the server, and the limits."""
        self._factory, self._most, self.head_s = factory, most, head_s
        self._open: list[_Connection] = []

    def __call__(self, *arguments: Any, **options: Any) -> asyncio.Protocol:
        """Return the protocol of a new connection."""
        return _Connection(self, cast("asyncio.Protocol", self._factory(*arguments, **options)))

    def admit(self, connection: _Connection) -> bool:
        """Take a connection; return False if there is no room for it."""
        if len(self._open) >= self._most:
            # a websocket has a protocol of its own from its begin on, so nobody hears when it ends
            self._open = [known for known in self._open if known.is_open]
        if len(self._open) >= self._most:
            silent = next((known for known in self._open if known.is_silent), None)
            if silent is None:
                return False
            self._open.remove(silent)
            silent.end()
        self._open.append(connection)
        return True

    def forget(self, connection: _Connection) -> None:
        """Give back the room of a connection that has ended."""
        if connection in self._open:
            self._open.remove(connection)


class _Connection(asyncio.Protocol):
    """A connection: what comes goes on to the protocol of the server."""

    def __init__(self, patience: Patience, inner: asyncio.Protocol) -> None:
        self._patience, self._inner = patience, inner
        self._transport: asyncio.Transport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._head_bytes = 0
        self._tail = b""
        self._is_admitted = False

    @property
    def is_open(self) -> bool:
        return self._transport is not None and not self._transport.is_closing()

    @property
    def is_silent(self) -> bool:
        """Whether the head of the first request is still to come."""
        return self._timer is not None

    def end(self) -> None:
        self._stop_timer()
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._is_admitted = self._patience.admit(self)
        if not self._is_admitted:
            self._transport.abort()
            return
        self._timer = asyncio.get_running_loop().call_later(self._patience.head_s, self.end)
        self._inner.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        if self.is_silent:
            self._read_head(data)
        if self.is_open:
            self._inner.data_received(data)

    def _read_head(self, data: bytes) -> None:
        self._head_bytes += len(data)
        seen = self._tail + data
        self._tail = seen[1 - len(_END) :]
        if _END in seen:
            self._stop_timer()
        elif self._head_bytes > MOST_HEAD_BYTES:
            self.end()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def eof_received(self) -> bool | None:
        return self._inner.eof_received()

    def connection_lost(self, error: Exception | None) -> None:
        self._stop_timer()
        self._patience.forget(self)
        if self._is_admitted:
            self._inner.connection_lost(error)

    def pause_writing(self) -> None:
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        self._inner.resume_writing()
