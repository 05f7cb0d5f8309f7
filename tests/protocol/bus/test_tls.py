"""Who may connect over TLS, and who may not."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus import Delivery, Sample
from khala_protocol.bus.config import BusConfig, TlsFiles
from khala_protocol.bus.testing import take
from khala_protocol.errors import BusError

if TYPE_CHECKING:
    from pathlib import Path

    from .conftest import OpenBus

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="makes its certificates with openssl")
NEW_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2")


class Authority:
    """A maker of certificates in its own directory."""

    def __init__(self, directory: Path) -> None:
        directory.mkdir()
        self._directory = directory
        self._openssl("req", "-x509", *NEW_KEY, "-subj", "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")

    def certify(self, name: str, trusting: Authority | None = None) -> TlsFiles:
        """Return a certificate for this machine, whose holder trusts `trusting`, or this authority."""
        (self._directory / "names").write_text("subjectAltName=IP:127.0.0.1,DNS:localhost")
        request = ("-keyout", f"{name}.key", "-out", f"{name}.csr")
        self._openssl("req", *NEW_KEY[:-2], "-subj", f"/CN={name}", *request)
        signed = ("-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2", "-extfile", "names")
        self._openssl("x509", "-req", "-in", f"{name}.csr", "-out", f"{name}.pem", *signed)
        return TlsFiles(
            ca=(trusting or self)._directory / "ca.pem",
            certificate=self._directory / f"{name}.pem",
            key=self._directory / f"{name}.key",
        )

    def _openssl(self, *arguments: str) -> None:
        subprocess.run(["openssl", *arguments], cwd=self._directory, check=True, capture_output=True)


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("tls") / "ours")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("tls") / "foreign")


async def test_who_shows_our_certificate_takes_part(opened: OpenBus, ours: Authority) -> None:
    host = await opened(BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=ours.certify("host")))
    agent = await opened(BusConfig(connect=host.endpoints, tls=ours.certify("agent")))
    subscription = await agent.subscribe("a/b", Delivery.STATE)
    await (await host.publisher("a/b", Delivery.STATE)).put(b"x")
    assert await take(subscription, 1) == [Sample("a/b", b"x")]


async def test_a_router_with_tls_may_listen_to_other_machines(opened: OpenBus, ours: Authority) -> None:
    host = await opened(BusConfig(mode="router", listen=("tls/0.0.0.0:0",), tls=ours.certify("host")))
    assert all(endpoint.startswith("tls/") for endpoint in host.endpoints)


@pytest.mark.parametrize("stranger", ["signed by others", "trusts others", "speaks no TLS"])
async def test_strangers_are_refused_and_told_why(
    opened: OpenBus, ours: Authority, foreign: Authority, stranger: str
) -> None:
    host = await opened(BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=ours.certify("host")))
    endpoint = host.endpoints[0]
    tls = {
        "signed by others": foreign.certify("agent", trusting=ours),
        "trusts others": ours.certify("agent", trusting=foreign),
        "speaks no TLS": None,
    }[stranger]
    reason = "something listens there, but it speaks no TLS or the certificates do not fit"
    if tls is None:
        endpoint = endpoint.replace("tls/", "tcp/")
        reason = "something listens there, but it is no Zenoh router without TLS"
    with pytest.raises(BusError) as error:
        await opened(BusConfig(connect=(endpoint,), tls=tls, connect_timeout_s=0.3))
    assert str(error.value).startswith(f"no router answered within 0.3 s at {endpoint} ({reason}): ")
