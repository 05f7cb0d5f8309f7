"""Nodes of a Ray cluster that lasts as long as an experiment: the head beside the runner, and machines that join it.

Each node is `ray start --block` as a child: it ends with its parent, and Ray's other processes with it. Ray would look
for this machine's address with a packet to the internet, which containers may not reach, so the address is given.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError
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


@contextlib.asynccontextmanager
async def running_head(address: str) -> AsyncIterator[None]:
    """Begin a cluster without room for matches, and end it after the context.

    Args:
        address: `HOST:PORT`, as others reach it.

    Raises:
        ConfigError: it is no address of this machine, or Ray does not start there.
    """
    host, port = split_address(address)
    words = ("--head", f"--port={port}", "--include-dashboard=false")
    process = _start(*words, own=socket.gethostbyname(host), matches=0)
    try:
        async with asyncio.timeout(START_S):
            while not await asyncio.to_thread(_is_open, host, port):
                if process.poll() is not None:
                    raise ConfigError("Ray did not start: is the port taken, and the address this machine's?",
                                      source=f"--head {address}")  # fmt: skip
                await asyncio.sleep(RETRY_S)
        yield
    except TimeoutError:
        raise ConfigError(f"Ray did not start within {START_S:g} s", source=f"--head {address}") from None
    finally:
        await asyncio.to_thread(_end, process)


def join(address: str, jobs: int | None) -> None:
    """Be a node of a cluster until its head is gone; begin again if the node dies before.

    Args:
        address: of the head, `HOST:PORT`; it need not be there yet.
        jobs: matches at the same time; None for as many as this machine has room for.

    Raises:
        ConfigError: the address is no address, or Ray is not installed.
    """
    if subprocess.run([sys.executable, "-c", "import ray"], check=False, capture_output=True).returncode:
        raise ConfigError("there is no ray: pip install 'khala-sc2[ray]'", source="khala experiment join")
    host, port = split_address(address)
    signal.signal(signal.SIGTERM, _interrupt)
    while not _is_open(host, port):
        time.sleep(RETRY_S)
    while _is_open(host, port):
        where = f"--address={socket.gethostbyname(host)}:{port}"
        process = _start(where, own=_own_address(host, port), matches=jobs or slots_of_this_machine())
        try:
            process.wait()
        finally:
            _end(process)


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
        f"--object-store-memory={OBJECTS_BYTES}", "--disable-usage-stats",
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
