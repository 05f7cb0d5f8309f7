"""Two machines and a cable between them, played by network namespaces."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus import Delivery, Liveness
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.testing import take

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .conftest import OpenBus, StartPeer

pytestmark = [
    pytest.mark.netns,
    pytest.mark.skipif(
        sys.platform != "linux" or os.geteuid() != 0 or shutil.which("ip") is None, reason="needs root and iproute2"
    ),
]
ROUTER_ADDRESS, AGENT_ADDRESS = "198.18.77.1", "198.18.77.2"  # of the block that is reserved for benchmarks


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True)


class Cable:
    """Two namespaces, joined."""

    def __init__(self, name: str) -> None:
        self.router, self.agent = f"{name}-r", f"{name}-a"

    def lay(self) -> None:
        for namespace, address in ((self.router, ROUTER_ADDRESS), (self.agent, AGENT_ADDRESS)):
            ip("netns", "add", namespace)
            if namespace == self.agent:
                ip("-n", self.router, "link", "add", "cable", "type", "veth", "peer", "cable", "netns", self.agent)
                ip("-n", self.router, "address", "add", f"{ROUTER_ADDRESS}/24", "dev", "cable")
                ip("-n", self.router, "link", "set", "cable", "up")
                ip("-n", self.agent, "address", "add", f"{address}/24", "dev", "cable")
        self.plug()

    def plug(self) -> None:
        ip("-n", self.agent, "link", "set", "cable", "up")

    def pull(self) -> None:
        ip("-n", self.agent, "link", "set", "cable", "down")

    def remove(self) -> None:
        for namespace in (self.router, self.agent):
            subprocess.run(["ip", "netns", "delete", namespace], check=False, capture_output=True)


@pytest.fixture
def cable() -> Iterator[Cable]:
    cable = Cable(f"bus{os.getpid()}")
    try:
        cable.lay()
    except subprocess.CalledProcessError as error:
        cable.remove()
        pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")
    yield cable
    cable.remove()


async def test_an_agent_on_another_machine_takes_part_and_a_pulled_cable_is_noticed(
    opened: OpenBus, start: StartPeer, socket: str, cable: Cable
) -> None:
    tcp = f"tcp/{ROUTER_ADDRESS}:7447"
    await start("router", tcp, socket, command=("ip", "netns", "exec", cable.router))
    host = await opened(BusConfig(connect=(socket,)))
    watch = await host.watch("*/alive")
    replies = await host.subscribe("agent/reply", Delivery.SPEECH)
    observations = await host.publisher("agent/observation", Delivery.STATE)
    await start("agent", tcp, command=("ip", "netns", "exec", cable.agent))
    assert await take(watch, 1) == [Liveness("agent/alive", alive=True)]
    await observations.put(b"00000001" + bytes(20_000))
    assert (await take(replies, 1))[0].payload == b"00000001"

    cable.pull()
    pulled = time.perf_counter()
    assert await take(watch, 1) == [Liveness("agent/alive", alive=False, link_up=True)]
    assert time.perf_counter() - pulled < 4  # 2.5 s of lease
    await observations.put(b"00000002")
    await observations.put(b"00000003")

    cable.plug()
    plugged = time.perf_counter()
    assert (await take(replies, 1))[0].payload == b"00000003"
    assert await take(watch, 1) == [Liveness("agent/alive", alive=True)]
    assert time.perf_counter() - plugged < 8  # the kernel's retries of a connection back off to seconds
