"""Whether a request has left: over a real connection, which is what a bill depends on."""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING

import pytest
from pydantic import SecretStr

from khala_agents.llm.client import Departure, Unreachable
from khala_agents.llm.http import HttpEndpoint

if TYPE_CHECKING:
    from collections.abc import Iterator

KEY = SecretStr("sk-0123456789")


@pytest.fixture
def silent() -> Iterator[socket.socket]:
    """A socket that takes connections into its queue and never answers."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(8)
        yield listening


async def test_a_request_that_was_written_has_left(silent: socket.socket) -> None:
    endpoint, delivery = HttpEndpoint(f"http://127.0.0.1:{silent.getsockname()[1]}/v1", key=KEY), Departure()
    asking = asyncio.create_task(endpoint.post("/chat/completions", b"{}", delivery))
    taken, _ = await asyncio.to_thread(silent.accept)
    with taken:
        await asyncio.to_thread(taken.recv, 1)
        assert delivery.left
        asking.cancel()
        await asyncio.gather(asking, return_exceptions=True)
        assert delivery.left
    await endpoint.close()


async def test_a_request_without_a_connection_has_not_left() -> None:
    with socket.socket() as taken:  # bound, and nobody listens
        taken.bind(("127.0.0.1", 0))
        endpoint, delivery = HttpEndpoint(f"http://127.0.0.1:{taken.getsockname()[1]}/v1"), Departure()
        with pytest.raises(Unreachable) as caught:
            await endpoint.post("/chat/completions", b"{}", delivery)
    assert not caught.value.may_be_billed
    assert not delivery.left
    await endpoint.close()
