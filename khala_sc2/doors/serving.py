"""How uvicorn serves an application of Khala. It is of the extras `mcp` and `openenv`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import uvicorn

from khala_protocol.listening import MOST_CONNECTIONS, Patience

if TYPE_CHECKING:
    from khala_sc2.doors.asgi import Application

KEEP_ALIVE_S: Final = 30
"""Longer than clients keep an idle connection, 5 s for httpx: else they lose a request now and then."""


def uvicorn_config(app: Application, *, most_connections: int = MOST_CONNECTIONS, **options: Any) -> uvicorn.Config:
    """Return the configuration of a server.

    uvicorn takes the address of a peer from headers of a proxy by default, and a peer could choose it; and it pings
    websockets, and closes those of programs that think for a minute. Peers that are gone are found by TCP. It would
    also log addresses, with the tokens in them.

    Args:
        app: the application.
        most_connections: at a time.
        options: more of `uvicorn.Config`.
    """
    config = uvicorn.Config(
        app, log_config=None, access_log=False, proxy_headers=False, server_header=False,
        timeout_keep_alive=KEEP_ALIVE_S, ws_ping_interval=None, ws_ping_timeout=None, **options,
    )  # fmt: skip
    config.load()
    config.http_protocol_class = Patience(config.http_protocol_class, most=most_connections)  # type: ignore[assignment]  # it makes them
    return config
