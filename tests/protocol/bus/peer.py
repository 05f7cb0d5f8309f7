"""Another process on the bus, for tests that kill, stop or forget it: `peer.py <role> <endpoint>...`.

It says `up` on stdout when it is ready.
"""

from __future__ import annotations

import asyncio
import sys

from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus


async def agent(*endpoints: str) -> None:
    """Reply to each observation with its first eight bytes."""
    bus = await open_bus(BusConfig(connect=endpoints, insecure=True))
    observations = await bus.subscribe("agent/observation", Delivery.STATE, depth=1)
    replies = await bus.publisher("agent/reply", Delivery.SPEECH)
    await bus.announce("agent/alive")
    sys.stdout.write("up\n")
    sys.stdout.flush()
    async for sample in observations:
        await replies.put(sample.payload[:8])


async def router(*endpoints: str) -> None:
    """Route until killed."""
    await open_bus(BusConfig(mode="router", listen=endpoints, insecure=True))
    sys.stdout.write("up\n")
    sys.stdout.flush()
    await asyncio.get_running_loop().create_future()


async def forgetful(*endpoints: str) -> None:
    """Use everything, close nothing, and end."""
    bus = await open_bus(BusConfig(connect=endpoints, insecure=True))
    for delivery in Delivery:
        subscription = await bus.subscribe("a/*", delivery)
        await (await bus.publisher(f"a/{delivery.value}", delivery)).put(bytes(200_000))
        await anext(subscription)
    await bus.watch("**")
    await bus.announce("a/token")
    sys.stdout.write("up\n")
    sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run({"agent": agent, "router": router, "forgetful": forgetful}[sys.argv[1]](*sys.argv[2:]))
