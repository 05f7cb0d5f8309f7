"""Who may connect over TLS, and who may not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus import Delivery, Sample
from khala_protocol.bus.config import BusConfig, TlsFiles
from khala_protocol.bus.testing import take
from khala_protocol.certificates import certify_agent, files_of, issue, make_authority
from khala_protocol.errors import BusError

if TYPE_CHECKING:
    from pathlib import Path

    from .conftest import OpenBus


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return authority(tmp_path_factory.mktemp("tls") / "ours")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return authority(tmp_path_factory.mktemp("tls") / "foreign")


def authority(directory: Path) -> Path:
    make_authority(directory, ["127.0.0.1"])
    certify_agent(directory, "blue", "A")
    return directory


def agent(directory: Path) -> TlsFiles:
    return files_of(directory, "agent:blue/A")


def router(directory: Path, endpoint: str = "tls/127.0.0.1:0") -> BusConfig:
    return BusConfig(mode="router", listen=(endpoint,), tls=files_of(directory, "router"))


async def test_who_shows_our_certificate_takes_part(opened: OpenBus, ours: Path) -> None:
    host = await opened(router(ours))
    client = await opened(BusConfig(connect=host.endpoints, tls=agent(ours)))
    subscription = await client.subscribe("a/b", Delivery.STATE)
    await (await host.publisher("a/b", Delivery.STATE)).put(b"x")
    assert await take(subscription, 1) == [Sample("a/b", b"x")]


async def test_a_router_with_tls_may_listen_to_other_machines(opened: OpenBus, ours: Path) -> None:
    host = await opened(router(ours, "tls/0.0.0.0:0"))
    assert all(endpoint.startswith("tls/") for endpoint in host.endpoints)


@pytest.mark.parametrize(
    ("stranger", "reason"),
    [
        (
            "signed by others",
            "it does not know the authority of our certificate; take one of the same `khala keys`",
        ),
        ("trusts others", "its certificate is of another authority; take keys of the same `khala keys`"),
        ("another name", "its certificate is not good: IP address mismatch, certificate is not valid for '127.0.0.1'"),
        ("speaks no TLS", "something listens there, but it is no Zenoh router without TLS"),
    ],
)
async def test_strangers_are_refused_and_told_why(
    opened: OpenBus, ours: Path, foreign: Path, stranger: str, reason: str
) -> None:
    if stranger == "another name":
        issue(ours, "router", "elsewhere", hosts=["router.example"])
        place = ours / "elsewhere"
        files = TlsFiles(ca=place / "ca.pem", certificate=place / "certificate.pem", key=place / "key.pem")
        host = await opened(BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=files))
    else:
        host = await opened(router(ours))
    endpoint = host.endpoints[0]
    tls = {
        "signed by others": agent(foreign).model_copy(update={"ca": agent(ours).ca}),
        "trusts others": agent(ours).model_copy(update={"ca": agent(foreign).ca}),
        "another name": agent(ours),
        "speaks no TLS": None,
    }[stranger]
    if tls is None:
        endpoint = endpoint.replace("tls/", "tcp/")
    with pytest.raises(BusError) as error:
        await opened(BusConfig(connect=(endpoint,), tls=tls, connect_timeout_s=0.3))
    assert str(error.value).startswith(f"no router answered within 0.3 s at {endpoint} ({reason}")


async def test_nobody_takes_an_agent_for_a_router(opened: OpenBus, ours: Path) -> None:
    mallory = await opened(BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=agent(ours)))
    with pytest.raises(BusError, match="its certificate is not good: unsuit"):
        await opened(BusConfig(connect=mallory.endpoints, tls=files_of(ours, "host"), connect_timeout_s=0.3))
