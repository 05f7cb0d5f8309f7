"""Nodes of a Ray cluster that lasts as long as an experiment: the head beside the runner, and machines that join it.

Each node is `ray start --block` as a child: it ends with its parent, and Ray's other processes with it. Ray would look
for this machine's address with a packet to the internet, which containers may not reach, so the address is given.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import os
import signal
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from khala_orchestrator.console import stderr_console
from khala_protocol.errors import ConfigError
from khala_protocol.extras import not_installed
from khala_sc2.experiment.engine import MATCH_MB, slots_of_this_machine

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

OBJECTS_BYTES = 80 * 2**20
"""Of Ray's store, which is in /dev/shm; the least that it takes is 75 MB. Recordings pass through it."""
START_S = 300.0
"""Time for the head to begin: it is a dozen processes, and a machine may have two cores."""
RETRY_S = 0.5
END_S = 10.0
_PATIENT = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_agent_register_timeout_ms": "300000",
    "RAY_raylet_start_wait_time_s": "300",
}


class RayHead:
    """The first node of a cluster, without room for matches."""

    def __init__(self, address: str) -> None:
        """Start it at `HOST:PORT`, as others reach it."""
        self._address = address
        self._host, self._port = split_address(address)
        self._process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        words = ("--head", f"--port={self._port}", "--include-dashboard=false", "--no-monitor")
        return _start(*words, own=socket.gethostbyname(self._host), matches=0)

    async def listen(self) -> None:
        """Wait until it listens; start it again if it died: Ray ends a node whose helpers need more than 15 s.

        Raises:
            ConfigError: the address is none of this machine, or the port is taken.
        """
        if self._process.poll() is not None:
            self._process = self._start()
        while not await asyncio.to_thread(_is_open, self._host, self._port):
            if self._process.poll() is not None:
                raise ConfigError("Ray did not start: is the port taken, and the address this machine's?",
                                  source=f"--head {self._address}")  # fmt: skip
            await asyncio.sleep(RETRY_S)

    def end(self) -> None:
        """End it in order."""
        _end(self._process)


@contextlib.asynccontextmanager
async def running_head(address: str) -> AsyncIterator[RayHead]:
    """Begin a cluster without room for matches, and end it after the context.

    Args:
        address: `HOST:PORT`, as others reach it.

    Raises:
        ConfigError: it is no address of this machine, or Ray does not start there.
    """
    head = RayHead(address)
    try:
        async with asyncio.timeout(START_S):
            await head.listen()
        yield head
    except TimeoutError:
        raise ConfigError(f"Ray did not start within {START_S:g} s", source=f"--head {address}") from None
    finally:
        await asyncio.to_thread(head.end)


def join(address: str, jobs: int | None) -> None:
    """Be a node of a cluster until its head is gone; begin again if the node dies before.

    Args:
        address: of the head, `HOST:PORT`; it need not be there yet.
        jobs: matches at the same time; None for as many as this machine has room for.

    Raises:
        ConfigError: the address is no address, or Ray is not installed.
    """
    if importlib.util.find_spec("ray") is None:
        raise not_installed("ray", "ray", source="khala experiment join")
    host, port = split_address(address)
    signal.signal(signal.SIGTERM, _interrupt)
    matches = jobs or slots_of_this_machine()
    screen = stderr_console()
    screen.print(f"waiting for an experiment at {address}", soft_wrap=True)
    while not _is_open(host, port):
        time.sleep(RETRY_S)
    while _is_open(host, port):
        screen.print(f"joining the experiment at {address}, to play {matches} at a time", soft_wrap=True)
        where = f"--address={socket.gethostbyname(host)}:{port}"
        process = _start(where, own=_own_address(host, port), matches=matches)
        try:
            process.wait()
        finally:
            _end(process)
    screen.print(f"the experiment at {address} is over", soft_wrap=True)


def split_address(address: str) -> tuple[str, int]:
    """Return host and port.

    Raises:
        ConfigError: it is not written so, or there is no such host.
    """
    host, colon, port = address.rpartition(":")
    if not (host and colon and port.isdecimal()):
        raise ConfigError("give HOST:PORT, such as 10.0.0.5:6379", source=address)
    return host, int(port)


def _start(*words: str, own: str, matches: int) -> subprocess.Popen[bytes]:
    command = [
        sys.executable, "-m", "ray.scripts.scripts", "start", *words, "--block", f"--node-ip-address={own}",
        f"--num-cpus={matches}", f"--memory={max(matches, 1) * MATCH_MB * 2**20}",
        f"--object-store-memory={OBJECTS_BYTES}", "--disable-usage-stats", "--include-log-monitor=false",
    ]  # fmt: skip
    return subprocess.Popen(command, env=_PATIENT | os.environ, stdout=subprocess.DEVNULL)  # noqa: S603  # our own words


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a node in order: it ends its own processes."""
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _is_open(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


def _own_address(host: str, port: int) -> str:
    """Return this machine's address as the host sees it."""
    with socket.create_connection((host, port)) as connection:
        return str(connection.getsockname()[0])


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt
