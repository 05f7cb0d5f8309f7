"""The promises of the bus, kept by each implementation."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.bus.testing import BusConformance, Connect
from khala_protocol.bus.zenoh import open_bus

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_protocol.bus import Bus


class TestMemoryBus(BusConformance):
    @pytest.fixture
    async def connect(self) -> AsyncIterator[Connect]:
        broker = MemoryBroker()
        async with AsyncExitStack() as sessions:

            async def connect() -> Bus:
                session = broker.session()
                sessions.push_async_callback(session.close)
                return session

            yield connect


class TestZenohBusOfClients(BusConformance):
    """Every session is a client of a router that takes no part."""

    @pytest.fixture
    async def connect(self, socket: str) -> AsyncIterator[Connect]:
        async with AsyncExitStack() as sessions:
            router = await open_bus(BusConfig(mode="router", listen=(socket,)))
            sessions.push_async_callback(router.close)

            async def connect() -> Bus:
                session = await open_bus(BusConfig(connect=(socket,)))
                sessions.push_async_callback(session.close)
                return session

            yield connect


class TestZenohBusWithTheHostAsRouter(BusConformance):
    """The first session is the router, and the others are its clients."""

    NEEDS_A_ROUTER_THAT_STAYS = frozenset(
        {
            "test_closing_one_session_leaves_the_others_alone",
            "test_the_state_of_a_publisher_that_came_back_arrives",
        }
    )

    @pytest.fixture
    async def connect(self, socket: str, request: pytest.FixtureRequest) -> AsyncIterator[Connect]:
        if request.node.originalname in self.NEEDS_A_ROUTER_THAT_STAYS:
            pytest.skip("the session that is closed first is the router here")
        async with AsyncExitStack() as sessions:
            configs = [BusConfig(mode="router", listen=(socket,))]

            async def connect() -> Bus:
                session = await open_bus(configs.pop() if configs else BusConfig(connect=(socket,)))
                sessions.push_async_callback(session.close)
                return session

            yield connect
