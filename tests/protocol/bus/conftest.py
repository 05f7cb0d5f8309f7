"""Fixtures of the bus: endpoints, and peers."""

from __future__ import annotations

import asyncio
import shutil
import sys
import tempfile
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack
from pathlib import Path

import pytest

from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import ZenohBus, open_bus

pytest.register_assert_rewrite("khala_protocol.bus.testing")

OpenBus = Callable[[BusConfig], Awaitable[ZenohBus]]
StartPeer = Callable[..., Awaitable[Process]]
PEER = str(Path(__file__).parent / "peer.py")


@pytest.fixture
def socket() -> Iterator[str]:
    """Return its own endpoint. Not below `tmp_path`, as the path of a unix socket has at most 107 bytes."""
    directory = Path(tempfile.mkdtemp(prefix="bus"))
    yield f"unixsock-stream/{directory}/bus.sock"
    shutil.rmtree(directory)


@pytest.fixture
async def opened() -> AsyncIterator[OpenBus]:
    """Open sessions of Zenoh and close them at the end."""
    async with AsyncExitStack() as sessions:

        async def open_one(config: BusConfig) -> ZenohBus:
            session = await open_bus(config)
            sessions.push_async_callback(session.close)
            return session

        yield open_one


@pytest.fixture
async def start() -> AsyncIterator[StartPeer]:
    """Start `peer.py` in a role, wait until it is up, and kill it at the end."""
    async with AsyncExitStack() as processes:

        async def start_one(*arguments: str, command: tuple[str, ...] = ()) -> Process:
            process = await asyncio.create_subprocess_exec(*command, sys.executable, PEER, *arguments, stdout=PIPE)

            async def end() -> None:
                if process.returncode is None:
                    process.kill()
                await process.wait()

            processes.push_async_callback(end)
            assert process.stdout is not None
            async with asyncio.timeout(20):
                assert await process.stdout.readline() == b"up\n"
            return process

        yield start_one
