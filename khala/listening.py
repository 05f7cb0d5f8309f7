"""Sockets of servers that the command line starts."""

from __future__ import annotations

import socket

from khala_protocol.errors import ConfigError


def bound(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Args:
        host: address of this machine.
        port: 0 for a free one.

    Raises:
        ConfigError: the port is taken, or the address is none of this machine's.
    """
    try:
        return socket.create_server((host, port))
    except OSError as error:
        raise ConfigError(f"cannot listen on {host}:{port}: {error.strerror}", source="--port") from None
