"""A match on a bus becomes a recording that grows, and is seen like any other."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus.memory import MemoryBroker, MemoryBus
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError
from khala_protocol.keys import Topic
from khala_protocol.recording import Recorder, Recording
from khala_sc2.view.live import DELIVERIES, Following, running_match
from tests.khala.view.made import RUN, begin, card, end, key_of, opened, step_of

if TYPE_CHECKING:
    from pathlib import Path

    from khala_protocol.messages import Wire

CLOCK = "jumps"


async def publish(bus: MemoryBus, *messages: Wire) -> None:
    for message in messages:
        publisher = await bus.publisher(key_of(message), DELIVERIES[Topic(message.kind)])  # type: ignore[attr-defined]
        await publisher.put(encode(message))


async def test_all_topics_of_a_match_are_recorded_until_it_is_over(tmp_path: Path) -> None:
    bus, path = MemoryBroker().session(), tmp_path / "live.mcap"
    await publish(bus, *begin())
    following = asyncio.create_task(Following(bus, await running_match(bus, None), Recorder(path)).follow())
    await asyncio.sleep(1.0)
    for step in range(6):
        await publish(bus, *step_of(step))
        await asyncio.sleep(0.5)
        assert opened(path).index.rows("select max(step) from step") == [(step,)]
    await publish(bus, end())
    await following
    recording = Recording.open(path)
    assert recording.complete
    assert recording.run == card()
    assert [result.outcome for result in recording.results] == ["win"]
    found = opened(path)
    assert found.scenes(0, 0, 5).count(b'"kind":"scene"') == 6
    assert b"Help." in found.moment(0, 5)


async def test_one_that_joins_late_has_the_newest_of_each_state(tmp_path: Path) -> None:
    bus, path = MemoryBroker().session(), tmp_path / "late.mcap"
    await publish(bus, *begin(), *step_of(0), *step_of(1))
    following = asyncio.create_task(Following(bus, card(), Recorder(path)).follow())
    await asyncio.sleep(1.0)
    await publish(bus, *step_of(2), end())
    await following
    topics = {one.key.rsplit("/", 1)[1] for one in Recording.open(path)}
    assert {"run", "briefing", "terrain", "scene", "observation", "report", "result"} <= topics


async def test_a_match_that_is_named_is_found_among_others() -> None:
    bus = MemoryBroker().session()
    await publish(bus, card(), card(run="other"))
    assert (await running_match(bus, "other")).run == "other"
    with pytest.raises(ConfigError, match=f"name one of {RUN}, other"):
        await running_match(bus, None)


async def test_a_match_that_is_not_there_is_missed() -> None:
    with pytest.raises(ConfigError, match="no match of the name 'gone' was found"):
        await running_match(MemoryBroker().session(), "gone")
