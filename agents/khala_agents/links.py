"""The topics of one agent: its subscriptions, its publishers and its liveliness token.

Only `khala_agents.worker` uses it. Nothing is decoded here.
"""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.bus import Delivery
from khala_protocol.keys import Topic, agent_key, alive_key, images_of, run_key

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from khala_protocol.bus import Bus, Publisher, Sample, Subscription


IMAGES = 64
"""Number of pictures that may wait to be read."""


@dataclass(frozen=True, slots=True)
class Links:
    """The topics of one agent.

    Of each subscription the newest sample waits, of pictures those of some observations; what it says does not wait.
    """

    briefings: Subscription[Sample]
    observations: Subscription[Sample]
    images: Subscription[Sample]
    results: Subscription[Sample]
    replies: Publisher
    exchanges: Publisher


async def join(stack: AsyncExitStack, bus: Bus, run: str, side: str, agent: str) -> Links:
    """Declare all topics, and announce the agent once it can hear; `stack` undoes it.

    Raises:
        BusClosed: the bus is closed.
    """

    async def hear(key: str, depth: int = 1) -> Subscription[Sample]:
        subscription = await bus.subscribe(key, Delivery.STATE, depth=depth)
        stack.push_async_callback(subscription.close)
        return subscription

    async def say(topic: Topic, delivery: Delivery) -> Publisher:
        publisher = await bus.publisher(agent_key(run, side, agent, topic), delivery)
        stack.push_async_callback(publisher.close)
        return publisher

    links = Links(
        images=await hear(images_of(run, side, agent), depth=IMAGES),
        briefings=await hear(agent_key(run, side, agent, Topic.BRIEFING)),
        observations=await hear(agent_key(run, side, agent, Topic.OBSERVATION)),
        results=await hear(run_key(run, Topic.RESULT)),
        replies=await say(Topic.REPLY, Delivery.SPEECH),
        exchanges=await say(Topic.EXCHANGE, Delivery.LOG),
    )
    token = await bus.announce(alive_key(run, side, agent, uuid.uuid4().hex[:8]))
    stack.push_async_callback(token.close)
    return links
