"""What is refused before a socket is opened, and the settings that Zenoh gets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError

from khala_protocol.bus.config import BusConfig, TlsFiles, check, host_port_of, is_local, settings
from khala_protocol.certificates import files_of, make_authority
from khala_protocol.errors import BusError

if TYPE_CHECKING:
    from pathlib import Path

TRANSPORTS = "quic, tcp, tls, unixsock-stream, ws"


def no_endpoint(text: str) -> str:
    return (
        f"{text!r} is not an endpoint: write <transport>/<address>, such as tcp/127.0.0.1:7447; "
        f"transports are {TRANSPORTS}"
    )


def needs_port(text: str) -> str:
    return f"{text!r} needs a host and a port between 1 and 65535, such as tcp/127.0.0.1:7447"


def open_to_all(endpoint: str) -> str:
    return (
        f"{endpoint} would let every machine that reaches it join without TLS: make keys with `khala keys init DIR` "
        f"and say `--tls DIR --listen tls/{endpoint.partition('/')[2]}`, or `--insecure` if the network is yours alone"
    )


def in_the_open(address: str) -> str:
    return (
        f"tcp/{address} would send everything to another machine without TLS: say `--tls DIR --connect "
        f"tls/{address}`, with keys of `khala keys`, or `--insecure` if the network is yours alone"
    )


LONG = "unixsock-stream//tmp/" + "x" * 103


@pytest.mark.parametrize(
    ("config", "text"),
    [
        ({"connect": ["nonsense"]}, no_endpoint("nonsense")),
        ({"connect": ["127.0.0.1:7447"]}, no_endpoint("127.0.0.1:7447")),
        ({"connect": ["udp/127.0.0.1:7447"]}, no_endpoint("udp/127.0.0.1:7447")),
        ({"connect": ["tcp/"]}, no_endpoint("tcp/")),
        ({"connect": ["tcp/127.0.0.1"]}, needs_port("tcp/127.0.0.1")),
        ({"connect": ["tcp/:7447"]}, needs_port("tcp/:7447")),
        ({"connect": ["tcp/\u202eabc:1"]}, needs_port("tcp/\u202eabc:1")),
        ({"connect": [f"tcp/{'a' * 64}:1"]}, needs_port(f"tcp/{'a' * 64}:1")),
        ({"connect": [f"tcp/{'a.' * 35_000}:1"]}, needs_port(f"tcp/{'a.' * 48}")),
        ({"connect": ["tcp/127.0.0.1:0"]}, needs_port("tcp/127.0.0.1:0")),
        ({"connect": ["tcp/127.0.0.1:70000"]}, needs_port("tcp/127.0.0.1:70000")),
        ({"mode": "router", "listen": ["tcp/::1:7447"]}, needs_port("tcp/::1:7447")),
        ({"connect": [LONG]}, f"{LONG!r} is too long: the path of a unix socket has at most 107 bytes"),
        ({"listen": ["tcp/127.0.0.1:7447"]}, "a client does not listen: remove `listen`, or use mode 'router'"),
        (
            {"mode": "router", "connect": ["tcp/127.0.0.1:7447"]},
            "a router does not connect: remove `connect`, and let clients connect to it",
        ),
        ({"mode": "router", "listen": ["tcp/0.0.0.0:7447"]}, open_to_all("tcp/0.0.0.0:7447")),
        ({"mode": "router", "listen": ["tcp/[::]:7447"]}, open_to_all("tcp/[::]:7447")),
        ({"mode": "router", "listen": ["tcp/10.1.2.3:0"]}, open_to_all("tcp/10.1.2.3:0")),
        ({"mode": "router", "listen": ["ws/router.example:80"]}, open_to_all("ws/router.example:80")),
        (
            {"connect": ["tls/router.example:7447"]},
            "tls/router.example:7447 needs TLS files: give `tls` with ca, certificate and key, or --tls DIR",
        ),
        ({"connect": ["tcp/10.0.0.5:7447"]}, in_the_open("10.0.0.5:7447")),
        ({"connect": ["tcp/router.example:1"]}, in_the_open("router.example:1")),
    ],
)
def test_a_wrong_configuration_is_refused_with_what_to_do(config: dict[str, Any], text: str) -> None:
    with pytest.raises(BusError) as error:
        check(BusConfig.model_validate(config))
    assert str(error.value) == text


@pytest.mark.parametrize(
    "config",
    [
        {},
        {"connect": ["tcp/router.example:7447", "ws/10.0.0.1:80", "unixsock-stream//run/bus.sock"], "insecure": True},
        {"connect": ["tcp/[fe80::1]:7447#so_sndbuf=65536"], "insecure": True},
        {"connect": ["tcp/127.0.0.1:7447", "tcp/[::1]:7447"]},
        {"mode": "router"},
        {"mode": "router", "listen": ["tcp/127.0.0.1:0", "tcp/[::1]:7447", "tcp/localhost:7447"]},
        {"mode": "router", "listen": ["unixsock-stream//run/bus.sock"]},
        {"mode": "router", "listen": ["tcp/0.0.0.0:7447"], "insecure": True},
    ],
)
def test_a_right_configuration_is_accepted(config: dict[str, Any]) -> None:
    check(BusConfig.model_validate(config))


def test_a_word_that_is_not_in_the_configuration_is_refused() -> None:
    with pytest.raises(ValidationError, match="conect"):
        BusConfig.model_validate({"conect": ["tcp/127.0.0.1:7447"]})


@pytest.fixture
def tls(tmp_path: Path) -> TlsFiles:
    make_authority(tmp_path, ["router.example"])
    return files_of(tmp_path, "router")


def test_with_tls_a_router_may_listen_anywhere(tls: TlsFiles) -> None:
    config = BusConfig(mode="router", listen=("tls/0.0.0.0:7447",), tls=tls)
    check(config)
    assert settings(config)["transport/link/tls/enable_mtls"] is True


@pytest.mark.parametrize(
    ("broken", "content", "text"),
    [
        ("ca", None, "cannot read the TLS ca {}: No such file or directory"),
        ("certificate", "hello", "the TLS certificate {} holds no certificate in PEM: is the file whole?"),
        ("key", "-----BEGIN CERTIFICATE-----", "the TLS key {} holds no private key in PEM"),
        ("key", "-----BEGIN PRIVATE KEY-----", "the TLS key {} cannot be read: is the file whole?"),
        (
            "key",
            "-----BEGIN RSA PRIVATE KEY-----",
            "the TLS key {} holds no private key in PEM; convert it with `openssl pkcs8 -topk8 -nocrypt`",
        ),
    ],
)
def test_a_wrong_tls_file_is_named(tls: TlsFiles, broken: str, content: str | None, text: str) -> None:
    path: Path = getattr(tls, broken)
    if content is None:
        path.unlink()
    else:
        path.write_text(content)
    with pytest.raises(BusError) as error:
        check(BusConfig(connect=("tls/router.example:7447",), tls=tls))
    assert str(error.value) == text.format(path)


def test_the_key_of_another_certificate_is_refused(tls: TlsFiles, tmp_path: Path) -> None:
    theirs = files_of(tmp_path, "host").key
    with pytest.raises(BusError, match=f"the TLS key {theirs} does not belong to the certificate {tls.certificate}"):
        check(BusConfig(tls=tls.model_copy(update={"key": theirs})))


@pytest.mark.parametrize("transport", ["tcp", "ws"])
def test_with_tls_no_endpoint_is_without_it(tls: TlsFiles, transport: str) -> None:
    with pytest.raises(BusError) as error:
        check(BusConfig(connect=(f"{transport}/127.0.0.1:1",), tls=tls))
    assert str(error.value) == (
        f"{transport}/127.0.0.1:1 is not encrypted, though TLS is asked for: write tls/127.0.0.1:1"
    )


def test_a_client_and_a_router_without_endpoints_meet_on_this_machine(tls: TlsFiles) -> None:
    assert BusConfig().connect_to == BusConfig(mode="router").listen_on == ("tcp/127.0.0.1:7447",)
    assert BusConfig(tls=tls).connect_to == BusConfig(mode="router", tls=tls).listen_on == ("tls/127.0.0.1:7447",)


def test_nobody_is_looked_for_and_memory_is_not_shared_unless_asked() -> None:
    quiet = settings(BusConfig())
    assert not any(
        quiet[path]
        for path in (
            "scouting/multicast/enabled",
            "scouting/gossip/enabled",
            "scouting/delay",
            "transport/shared_memory/enabled",
            "adminspace/enabled",
        )
    )
    assert settings(BusConfig(shared_memory=True))["transport/shared_memory/enabled"] is True


@pytest.mark.parametrize(
    ("config", "path", "value"),
    [
        ({"lease_s": 10}, "transport/link/tx/lease", 10_000),
        ({"connect_timeout_s": 0.5}, "connect/timeout_ms", 500),
        ({"send_buffer_bytes": 65536}, "transport/link/tcp/so_sndbuf", 65536),
        ({"mode": "router", "listen": ["tcp/127.0.0.1:0"]}, "adminspace/enabled", True),
        ({"zenoh": {"mode": "peer", "qos/network": []}}, "mode", "peer"),
    ],
)
def test_a_setting_reaches_zenoh(config: dict[str, Any], path: str, value: object) -> None:
    assert settings(BusConfig.model_validate(config))[path] == value


def test_extras_may_hold_passwords_and_are_not_printed() -> None:
    config = BusConfig(zenoh={"transport/auth/usrpwd": {"user": "a", "password": "hunter2"}})
    assert "hunter2" not in repr(config)


@pytest.mark.parametrize(
    ("endpoint", "local"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/127.9.9.9:7447", True),
        ("tcp/[::1]:7447", True),
        ("tcp/localhost:7447", True),
        ("unixsock-stream//run/bus.sock", True),
        ("tcp/0.0.0.0:7447", False),
        ("tcp/[::]:7447", False),
        ("tcp/192.168.1.1:7447", False),
        ("tcp/router.example:7447", False),
    ],
)
def test_local_is_what_only_this_machine_reaches(endpoint: str, local: bool) -> None:
    assert is_local(endpoint) is local


def test_host_and_port_of_an_endpoint_with_all_its_parts() -> None:
    assert host_port_of("tcp/[fe80::1]:7447?prio=1#so_sndbuf=1") == ("fe80::1", 7447)
