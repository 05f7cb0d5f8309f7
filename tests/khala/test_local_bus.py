"""Where the processes of a match on one machine meet, and what a killed match leaves there."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus, probe
from khala_sc2.playing.local_bus import LOOPBACK, local_endpoint

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def temporary(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield a directory for temporary files whose name is short, as unix sockets need it."""
    with tempfile.TemporaryDirectory(prefix="k") as place:
        monkeypatch.setattr(tempfile, "tempdir", place)
        yield Path(place)


def test_agents_meet_where_no_other_user_can_enter_and_nothing_is_left(temporary: Path) -> None:
    async def meet(endpoint: str) -> None:
        bus = await open_bus(BusConfig(mode="router", listen=(endpoint,)))
        assert await probe(BusConfig(connect=bus.endpoints)) == (bus.identity,)
        await bus.close()

    with local_endpoint() as endpoint:
        (directory,) = temporary.iterdir()
        assert directory.stat().st_mode & 0o777 == 0o700
        assert endpoint == f"unixsock-stream/{directory}/bus.sock"
        asyncio.run(meet(endpoint))
    assert list(temporary.iterdir()) == []


@pytest.mark.posix
def test_a_match_removes_what_killed_ones_left_and_nothing_of_those_that_live(temporary: Path) -> None:
    names = ("dead", "alive", "starting", "binding")
    dead, alive, starting, binding = (temporary / f"khala-bus-{name}" for name in names)
    for directory in (dead, alive, starting, binding):
        directory.mkdir()
    with contextlib.ExitStack() as stack:
        sockets = {place: stack.enter_context(socket.socket(socket.AF_UNIX)) for place in (dead, alive, binding)}
        for place, bound in sockets.items():
            bound.bind(str(place / "bus.sock"))
        sockets[alive].listen()
        for place in (dead, alive):
            os.utime(place / "bus.sock", (0, 0))
        with local_endpoint():
            assert {alive, starting, binding} < set(temporary.iterdir())
            assert not dead.exists()


def test_where_the_path_would_be_too_long_agents_meet_on_loopback(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = temporary / ("d" * 90)
    deep.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(deep))
    with local_endpoint() as endpoint:
        assert endpoint == LOOPBACK
