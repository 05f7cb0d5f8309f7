"""How a command joins the bus: its options become a `BusConfig`, and what the user should know goes to stderr.

Above: the command lines of host, router and agent, which have the same options for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from khala_protocol.bus.config import BusConfig, TlsFiles, check
from khala_protocol.commandline import say

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path


def client_config(
    connect: Iterable[str], *, tls: Path | None, names: tuple[str, ...] = (), insecure: bool, timeout_s: float = 5.0
) -> BusConfig:
    """Return the configuration of a session that connects to a router.

    Args:
        connect: endpoints; none means the default.
        tls: directory with certificates; None for a link without TLS.
        names: common names of which the first that has a certificate is shown to the router; none means any.
        insecure: allow links to other machines without TLS.
        timeout_s: how long to try.

    Raises:
        ConfigError: there is no certificate with such a name.
        BusError: as `khala_protocol.bus.config.check` does.
    """
    files = _files(tls, names)
    config = BusConfig(connect=tuple(connect), tls=files, insecure=insecure, connect_timeout_s=timeout_s)
    return _loudly(config)


def router_config(
    listen: Iterable[str], *, tls: Path | None, insecure: bool, rules: Mapping[str, Any] | None = None
) -> BusConfig:
    """Return the configuration of a session that is a router; `rules` are those of `khala_protocol.access`.

    Raises:
        ConfigError: there is no certificate of a router.
        BusError: as `khala_protocol.bus.config.check` does.
    """
    files = _files(tls, ("router",))
    return _loudly(
        BusConfig(mode="router", listen=tuple(listen), tls=files, insecure=insecure, zenoh=dict(rules or {}))
    )


def _files(tls: Path | None, names: tuple[str, ...]) -> TlsFiles | None:
    if tls is None:
        return None
    from khala_protocol.certificates import files_of  # noqa: PLC0415  # 60 ms, which links without TLS do without

    return files_of(tls, *names)


def _loudly(config: BusConfig) -> BusConfig:
    """Return the configuration if it is right, after a word on stderr about what is dangerous in it."""
    check(config)
    if config.insecure and config.exposed:
        _say(
            f"WARNING: {', '.join(config.exposed)} has no encryption and no identities: everyone who reaches it can "
            "read all, and speak as any agent or as the host; `khala keys` makes keys for --tls"
        )
    if config.tls is not None:
        from khala_protocol.bus.certificate import read  # noqa: PLC0415  # as above

        if warning := read(config.tls.certificate).warning:
            _say(f"WARNING: {warning}")
    return config


def _say(text: str) -> None:
    say(text, err=True)
