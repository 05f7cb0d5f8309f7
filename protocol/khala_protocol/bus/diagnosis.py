"""Explain in one sentence why a session could not be opened, and what to do.

Zenoh reports a wrong host, a refused connection and a refused certificate all as a timeout; a plain connection
attempt of our own distinguishes them.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import ssl
from typing import TYPE_CHECKING

from khala_protocol.bus.config import SECURE, address_of, host_port_of, transport_of
from khala_protocol.platforms import open_unix_connection

if TYPE_CHECKING:
    from khala_protocol.bus.config import BusConfig, TlsFiles

ATTEMPT_S = 1.0
JUDGEMENT_S = 0.2
"""In TLS 1.3 a certificate is refused after the handshake."""
_LISTEN_ADVICE = (
    ("Address already in use", "another process uses it; stop that one or take another port (0 is any free one)"),
    ("Cannot assign requested address", "this machine has no such address; listen on one of its own"),
    ("Permission denied", "not allowed; take a port above 1023, or a directory that you may write to"),
    ("ENOENT", "its directory does not exist; make it first"),
    ("EACCES", "not allowed; take a directory that you may write to"),
    ("EAGAIN", "another process uses it; stop that one or take another path"),
    ("resolve", "this host name is unknown; write an address"),
    ("lookup", "this host name is unknown; write an address"),
)
_REASONS: tuple[tuple[type[OSError], str], ...] = (
    (TimeoutError, "no answer; is a firewall between?"),
    (ConnectionRefusedError, "nothing listens there"),
    (FileNotFoundError, "there is no such socket"),
    (socket.gaierror, "this host name is unknown"),
)
OTHER_AUTHORITY = {7, 18, 19, 20, 21}
"""Codes of OpenSSL (X509_V_ERR_…): a signature that does not fit, a chain that ends nowhere."""
_ALERTS = {
    "TLSV1_ALERT_UNKNOWN_CA": "it does not know the authority of our certificate; take one of the same `khala keys`",
    "TLSV1_ALERT_DECRYPT_ERROR": "it does not know the authority of our certificate; take one of the same `khala keys`",
    "SSLV3_ALERT_CERTIFICATE_EXPIRED": "our certificate has expired by its clock",
    "TLSV13_ALERT_CERTIFICATE_REQUIRED": "it asks for a certificate; give one with --tls",
}
_INNER_MESSAGE = re.compile(r'(?:Str\(|msg: )"(.+?)"(?:\)|, location)')
_SOURCE_PLACE = re.compile(r"\s+at /\S+\.rs:\d+\.?")


async def why_not_connected(config: BusConfig) -> str:
    """Return what a client found instead of a router."""
    reasons = [f"{endpoint} ({await _attempt(endpoint, config.tls)})" for endpoint in config.connect_to]
    return f"no router answered within {config.connect_timeout_s:g} s at {', '.join(reasons)}"


def why_not_listening(config: BusConfig, said: str) -> str:
    """Return the sentence for a session that cannot listen, from Zenoh's error."""
    endpoint = next((e for e in config.listen_on if address_of(e) in said), ", ".join(config.listen_on))
    advice = next((advice for needle, advice in _LISTEN_ADVICE if needle in said), plain(said))
    return f"cannot listen on {endpoint}: {advice}"


def plain(said: str) -> str:
    """Return an error text of Zenoh without its source places and type names."""
    said = _SOURCE_PLACE.sub("", said).strip()
    inner = _INNER_MESSAGE.search(said)
    return inner[1] if inner else said


async def _attempt(endpoint: str, tls: TlsFiles | None) -> str:
    secure = transport_of(endpoint) in SECURE
    try:
        async with asyncio.timeout(ATTEMPT_S):
            await _connect(endpoint, tls)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in OTHER_AUTHORITY:
            return "its certificate is of another authority; take keys of the same `khala keys`"
        return f"its certificate is not good: {error.verify_message.rstrip('.')}"
    except ssl.SSLError as error:
        return _ALERTS.get(error.reason or "", "something listens there, but it speaks no TLS")
    except OSError as error:
        return next((text for kind, text in _REASONS if isinstance(error, kind)), error.strerror or str(error))
    if secure:
        return "something listens there, but it is no Zenoh router"
    return "something listens there, but it is no Zenoh router without TLS"


async def _connect(endpoint: str, tls: TlsFiles | None) -> None:
    if transport_of(endpoint) == "quic":
        raise TimeoutError  # over UDP, an attempt shows nothing
    if transport_of(endpoint) == "unixsock-stream":
        _, writer = await open_unix_connection(address_of(endpoint))
    elif transport_of(endpoint) == "tls" and tls is not None:
        writer = await _shake_hands(endpoint, tls)
    else:
        _, writer = await asyncio.open_connection(*host_port_of(endpoint))
    writer.close()


async def _shake_hands(endpoint: str, tls: TlsFiles) -> asyncio.StreamWriter:
    """Connect over TLS, and wait a moment for the other side's judgement of our certificate."""
    context = ssl.create_default_context(cafile=str(tls.ca))
    context.load_cert_chain(tls.certificate, tls.key)
    host, port = host_port_of(endpoint)
    reader, writer = await asyncio.open_connection(host, port, ssl=context)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(JUDGEMENT_S):
            await reader.read(1)
    return writer
