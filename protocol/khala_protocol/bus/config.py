"""The settings of the bus: typed, checked before anything is opened, and free of Zenoh.

`settings` turns a `BusConfig` into the paths and values of Zenoh's own configuration; `khala_protocol.bus.zenoh` is the
only reader. Each number that differs from Zenoh's default has its reason next to it.
"""

from __future__ import annotations

import ipaddress
import re
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from khala_protocol.errors import BusError

SECURE = frozenset({"tls", "quic"})
PLAIN = frozenset({"tcp", "ws"})
TRANSPORTS = PLAIN | SECURE | {"unixsock-stream"}
TX_SLOTS = 16
"""Batches that may wait for the link, per priority; Zenoh's largest. With its default of 2, bursts of 300 kB on a
100 Mbit link lost 2 of 96, with 16 none."""
BATCH_BYTES = 65_535
"""Size of a batch; Zenoh's largest, and its default."""
WAIT_BEFORE_DROP_S = 0.02
"""How long a put of one batch waits for a slot before it is dropped. With Zenoh's 1 ms, bursts of 128 samples of 20 kB
were dropped on a busy machine, and came 0.3 s later; a batch takes 5 ms on a link of 100 Mbit."""
WAIT_BEFORE_CLOSE_S = 0.5
"""How long a put that must not be dropped waits for a slot before its link is closed."""
UNIX_PATH_BYTES = 107
_ENDPOINT = re.compile(r"(?P<transport>[a-z-]+)/(?P<address>[^?#]+)(?P<rest>[?#].*)?")
_HOST_PORT = re.compile(
    r"(?P<host>\[[\w:.%]{2,60}\]|(?=.{1,253}:)[\w-]{1,63}(\.[\w-]{1,63})*\.?):(?P<port>\d{1,5})", re.ASCII
)


class TlsFiles(BaseModel):
    """Our identity, and the authority that we trust; each file in PEM."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    ca: Path
    """Certificate of the authority that signed the other side's certificate."""
    certificate: Path
    """Our own certificate; that of a listener needs its host name or address as a subject alternative name."""
    key: Path
    """Private key of `certificate`, in PKCS#8."""
    mutual: bool = True
    """Ask connecting sessions for a certificate, too; `khala_protocol.access` ties what they may do to its name."""


class BusConfig(BaseModel):
    """The configuration of `khala_protocol.bus.zenoh.open_bus`.

    The default is a client of a router on this machine.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    mode: Literal["client", "router"] = "client"
    """`client` has one link, to a router; `router` joins clients and may itself publish. Zenoh's peers, and links
    between routers, are not offered: nobody learns when a subscription is known beyond such a link. Of 450 first
    samples between peers, 39 were lost."""
    connect: tuple[str, ...] = ()
    """Endpoints to connect to, such as `tcp/10.0.0.1:7447`, `tls/router.example:7447`, `unixsock-stream//run/bus.sock`;
    a client takes the first that answers. Empty means the default endpoint on this machine."""
    listen: tuple[str, ...] = ()
    """Endpoints for a router to listen on. Port 0 means a free port, see `ZenohBus.endpoints`. Empty means the default
    endpoint on this machine."""
    insecure: bool = False
    """Allow links to other machines without TLS, in both directions."""
    tls: TlsFiles | None = None
    """Encrypt, and show who we are. Then no endpoint is without TLS, but unix sockets."""
    connect_timeout_s: float = Field(default=5.0, gt=0)
    """How long a client tries to reach its router before it gives up; the router may start meanwhile."""
    lease_s: float = Field(default=2.5, gt=0)
    """A peer that is silent for this long is gone. Use more where processes are stopped or swapped for seconds."""
    send_buffer_bytes: int | None = Field(default=None, gt=0)
    """Size of the kernel's send buffer. On links of 100 Mbit or less 65536 lets small messages overtake large ones:
    13 ms instead of 100 ms beside a flood of 300 kB samples."""
    shared_memory: bool = False
    """Send large samples between processes of one machine through /dev/shm. It leaves files behind after a kill, and
    crosses network namespaces; useful for images only."""
    zenoh: dict[str, Any] = Field(default_factory=dict, repr=False)
    """Anything else, as paths and values of Zenoh's configuration: `{"transport/link/tx/batch_size": 8192}`. They are
    set last, and never printed, as they may hold passwords."""

    @property
    def connect_to(self) -> tuple[str, ...]:
        """`connect`, or its default."""
        return self.connect or ((self._default,) if self.mode == "client" else ())

    @property
    def listen_on(self) -> tuple[str, ...]:
        """`listen`, or its default."""
        return self.listen or ((self._default,) if self.mode == "router" else ())

    @property
    def exposed(self) -> tuple[str, ...]:
        """Endpoints beyond this machine without encryption, that only `insecure` allows."""
        endpoints = (*self.connect_to, *self.listen_on)
        return tuple(
            endpoint for endpoint in endpoints if transport_of(endpoint) not in SECURE and not is_local(endpoint)
        )

    @property
    def _default(self) -> str:
        return DEFAULT_ENDPOINT if self.tls is None else DEFAULT_TLS_ENDPOINT


DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""Zenoh's port, on this machine only."""
DEFAULT_TLS_ENDPOINT = "tls/127.0.0.1:7447"


def check(config: BusConfig) -> None:
    """Find what is wrong before a socket is opened.

    Raises:
        BusError: an endpoint is malformed, would admit strangers or show them what is sent, or its TLS files are
            missing, wrong or expired.
    """
    for endpoint in (*config.connect_to, *config.listen_on):
        _check_endpoint(endpoint, listening=endpoint in config.listen_on)
        if transport_of(endpoint) in SECURE and config.tls is None:
            raise BusError(f"{endpoint} needs TLS files: give `tls` with ca, certificate and key, or --tls DIR")
        if config.tls is not None and transport_of(endpoint) in PLAIN:
            raise BusError(f"{endpoint} is not encrypted, though TLS is asked for: write {_over_tls(endpoint)}")
    if config.mode == "client" and config.listen:
        raise BusError("a client does not listen: remove `listen`, or use mode 'router'")
    if config.mode == "router" and config.connect:
        raise BusError("a router does not connect: remove `connect`, and let clients connect to it")
    if config.exposed and not config.insecure:
        raise BusError(_exposure(config.exposed[0], listening=config.exposed[0] in config.listen_on))
    if config.tls is not None:
        _check_tls(config.tls)


def settings(config: BusConfig) -> dict[str, Any]:
    """Return the same configuration for Zenoh: paths and JSON values, in the order in which to set them."""
    queue = "transport/link/tx/queue"
    values: dict[str, Any] = {
        "mode": config.mode,
        "connect/endpoints": list(config.connect_to),
        "listen/endpoints": list(config.listen_on),
        "connect/timeout_ms": round(config.connect_timeout_s * 1000),
        "connect/exit_on_failure": True,
        # Default is 1 s, doubling to 4 s. After a router's restart of 8 s: back in 0.01 s instead of 2.48 s.
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        "listen/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # otherwise a router sleeps 0.5 s in open
        "transport/link/tx/lease": round(config.lease_s * 1000),
        "transport/shared_memory/enabled": config.shared_memory,
        # Default is 5 s, after which the link is closed. SPEECH promises to wait half a second at most.
        f"{queue}/congestion_control/drop/wait_before_drop": round(WAIT_BEFORE_DROP_S * 1e6),
        f"{queue}/congestion_control/block/wait_before_close": round(WAIT_BEFORE_CLOSE_S * 1e6),
        "transport/link/tx/batch_size": BATCH_BYTES,
        # Only a session that picked a free port has to be asked for it.
        "adminspace/enabled": any(endpoint.endswith(":0") for endpoint in config.listen_on),
    }
    for priority in ("interactive_high", "data_high", "data", "data_low"):
        values[f"{queue}/size/{priority}"] = TX_SLOTS
    if config.send_buffer_bytes:
        values["transport/link/tcp/so_sndbuf"] = config.send_buffer_bytes
        values["transport/link/tls/so_sndbuf"] = config.send_buffer_bytes
    if config.tls is not None:
        values |= _tls_settings(config.tls)
    return values | config.zenoh


def transport_of(endpoint: str) -> str:
    """Return `tcp` of `tcp/127.0.0.1:7447`."""
    return endpoint.partition("/")[0]


def address_of(endpoint: str) -> str:
    """Return `127.0.0.1:7447` of `tcp/127.0.0.1:7447`, a path of a unix socket; without metadata and configuration."""
    return re.split(r"[?#]", endpoint.partition("/")[2])[0]


def host_port_of(endpoint: str) -> tuple[str, int]:
    """Return host, without brackets, and port of an endpoint that `check` accepts and that is no unix socket."""
    host, _, port = address_of(endpoint).rpartition(":")
    return host.strip("[]"), int(port)


def is_local(endpoint: str) -> bool:
    """Return whether only this machine can reach the endpoint."""
    if transport_of(endpoint) == "unixsock-stream":
        return True
    return is_loopback(host_port_of(endpoint)[0])


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach a host, a name or an address without brackets."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _check_endpoint(endpoint: str, *, listening: bool) -> None:
    found = _ENDPOINT.fullmatch(endpoint)
    if not found or found["transport"] not in TRANSPORTS:
        raise BusError(
            f"{endpoint[:100]!r} is not an endpoint: write <transport>/<address>, such as tcp/127.0.0.1:7447; "
            f"transports are {', '.join(sorted(TRANSPORTS))}"
        )
    if found["transport"] == "unixsock-stream":
        if len(found["address"].encode()) > UNIX_PATH_BYTES:
            raise BusError(
                f"{endpoint[:200]!r} is too long: the path of a unix socket has at most {UNIX_PATH_BYTES} bytes"
            )
        return
    place = _HOST_PORT.fullmatch(found["address"])
    port = int(place["port"]) if place else -1
    if not (0 if listening else 1) <= port <= 65535:
        raise BusError(f"{endpoint[:100]!r} needs a host and a port between 1 and 65535, such as tcp/127.0.0.1:7447")


def _exposure(endpoint: str, *, listening: bool) -> str:
    if listening:
        harm = "would let every machine that reaches it join without TLS"
        remedy = f"make keys with `khala keys init DIR` and say `--tls DIR --listen {_over_tls(endpoint)}`"
    else:
        harm = "would send everything to another machine without TLS"
        remedy = f"say `--tls DIR --connect {_over_tls(endpoint)}`, with keys of `khala keys`"
    return f"{endpoint} {harm}: {remedy}, or `--insecure` if the network is yours alone"


def _over_tls(endpoint: str) -> str:
    return f"tls/{endpoint.partition('/')[2]}"


def _check_tls(tls: TlsFiles) -> None:
    from khala_protocol.bus import certificate  # noqa: PLC0415  # 60 ms, which links without TLS do without

    certificate.check_valid(tls.ca, "ca")
    certificate.check_valid(tls.certificate)
    certificate.check_key(tls.key, tls.certificate)


def _tls_settings(tls: TlsFiles) -> dict[str, Any]:
    return {
        "transport/link/tls/root_ca_certificate": str(tls.ca),
        "transport/link/tls/listen_certificate": str(tls.certificate),
        "transport/link/tls/listen_private_key": str(tls.key),
        "transport/link/tls/connect_certificate": str(tls.certificate),
        "transport/link/tls/connect_private_key": str(tls.key),
        "transport/link/tls/enable_mtls": tls.mutual,
    }
