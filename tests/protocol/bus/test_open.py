"""The error when a session cannot be opened."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus, probe
from khala_protocol.errors import BusError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from .conftest import OpenBus


@pytest.fixture
async def stranger() -> AsyncIterator[int]:
    """Yield the port of a server that is no router: it hangs up."""

    async def hang_up(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.close()

    async with await asyncio.start_server(hang_up, "127.0.0.1", 0) as server:
        yield server.sockets[0].getsockname()[1]


async def why(**config: Any) -> str:
    with pytest.raises(BusError) as error:
        await open_bus(BusConfig(connect_timeout_s=0.2, **config))
    return str(error.value)


@pytest.mark.parametrize(
    ("endpoint", "reason"),
    [
        ("tcp/127.0.0.1:1", "nothing listens there"),
        ("tcp/router.invalid:7447", "this host name is unknown"),
        ("unixsock-stream//nowhere/bus.sock", "there is no such socket"),
        ("tcp/127.0.0.1:{stranger}", "something listens there, but it is no Zenoh router without TLS"),
        ("ws/127.0.0.1:{stranger}", "something listens there, but it is no Zenoh router without TLS"),
    ],
)
async def test_without_a_router_the_reason_and_what_to_do_are_told(endpoint: str, reason: str, stranger: int) -> None:
    endpoint = endpoint.format(stranger=stranger)
    assert await why(connect=(endpoint,), insecure=True) == (
        f"no router answered within 0.2 s at {endpoint} ({reason}): "
        "start one there with `khala router`, or connect elsewhere"
    )


async def test_of_several_endpoints_each_has_its_reason() -> None:
    assert await why(connect=("tcp/127.0.0.1:1", "unixsock-stream//nowhere/bus.sock")) == (
        "no router answered within 0.2 s at tcp/127.0.0.1:1 (nothing listens there), "
        "unixsock-stream//nowhere/bus.sock (there is no such socket): "
        "start one there with `khala router`, or connect elsewhere"
    )


async def test_a_probe_of_nobody_fails_as_an_open_does() -> None:
    with pytest.raises(BusError, match=r"no router answered within 0\.2 s"):
        await probe(BusConfig(connect=("tcp/127.0.0.1:1",), connect_timeout_s=0.2))


@pytest.mark.parametrize(
    ("endpoint", "reason"),
    [
        (
            "tcp/127.0.0.1:{stranger}",
            "another process uses it; stop that one or take another port (0 is any free one)",
        ),
        ("unixsock-stream//nowhere/bus.sock", "its directory does not exist; make it first"),
        ("tcp/192.0.2.1:7447", "this machine has no such address; listen on one of its own"),
        ("tcp/router.invalid:7447", "this host name is unknown; write an address"),
    ],
)
async def test_who_cannot_listen_is_told_why(endpoint: str, reason: str, stranger: int) -> None:
    endpoint = endpoint.format(stranger=stranger)
    said = await why(mode="router", listen=(endpoint,), insecure=True)
    assert said == f"cannot listen on {endpoint}: {reason}"


async def test_a_socket_in_use_is_told(opened: OpenBus, socket: str) -> None:
    await opened(BusConfig(mode="router", listen=(socket,)))
    assert await why(mode="router", listen=(socket,)) == (
        f"cannot listen on {socket}: another process uses it; stop that one or take another path"
    )


@pytest.mark.parametrize(
    ("extras", "text"),
    [
        ({"no/such": "secret"}, "Zenoh does not accept the setting 'no/such': unknown key"),
        (
            {"transport/link/tx/lease": "secret"},
            "Zenoh does not accept the setting 'transport/link/tx/lease': error parsing number",
        ),
    ],
)
async def test_a_wrong_extra_setting_is_named(extras: dict[str, Any], text: str) -> None:
    assert await why(zenoh=extras) == text
