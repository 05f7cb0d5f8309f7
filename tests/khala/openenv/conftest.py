"""A server of OpenEnv in this process."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from typing import TYPE_CHECKING, Any

import pytest
import uvicorn

from khala_sc2.openenv.server import app_of, server_config

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from khala_sc2.openenv.settings import ServerSettings


class _Server(uvicorn.Server):
    @contextlib.contextmanager
    def capture_signals(self) -> Any:
        yield


@contextlib.asynccontextmanager
async def _serving(settings: ServerSettings | None = None, **options: Any) -> AsyncIterator[str]:
    """Yield the address of a server; sessions that are open at its end are closed."""
    app = app_of(settings, **options)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = _Server(server_config(app, timeout_graceful_shutdown=2))
        task = asyncio.create_task(server.serve(sockets=[listening]))
        try:
            yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        finally:
            server.should_exit = True
            await task


@pytest.fixture
def serving() -> Callable[..., contextlib.AbstractAsyncContextManager[str]]:
    """Return what starts a server."""
    return _serving
