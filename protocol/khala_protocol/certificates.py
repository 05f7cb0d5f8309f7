"""Who a process is on the bus: a private authority, and certificates for router, host, agents, advisers, observers.

    DIR/ca                      the authority; its `key.pem` stays where it was made
    DIR/router                  for a process that listens: `khala router`, or a host that is its own router
    DIR/host                    for `khala host`
    DIR/agent.blue.Stalkers     for one agent
    DIR/adviser.blue.Ada        for one adviser, see `khala advise`
    DIR/observer.screen         for a program that reads everything and writes nothing

Each folder but the first is whole: `ca.pem`, `certificate.pem`, `key.pem`. It can be copied to another machine, and
used there by itself or beside others. The common name of a certificate is what `khala_protocol.access` makes rules
for. Only the certificate of a router is good for listening, so that no agent can stand in for one.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from khala_protocol.bus.certificate import Certificate, command_for, read
from khala_protocol.bus.config import TlsFiles
from khala_protocol.common_names import AUTHORITY, HOST, OBSERVER, ROUTER, adviser_name, agent_name
from khala_protocol.errors import ConfigError
from khala_protocol.keys import check_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

DEFAULT_DAYS = 365
AUTHORITY_DAYS = 3650
BEGINS_EARLIER = timedelta(days=1)
"""Certificates are valid from the day before, for machines whose clocks are behind."""
LONGEST_NAME = 64
"""Of a common name, in characters (RFC 5280, ub-common-name)."""
THIS_MACHINE = ("localhost", "127.0.0.1", "::1")


def make_authority(directory: Path, hosts: Iterable[str] = (), *, days: int = DEFAULT_DAYS) -> list[Path]:
    """Make an authority, if there is none yet, and new certificates for router and host; return their folders.

    Args:
        directory: gets one folder for each.
        hosts: names and addresses at which the router listens; if there are none, those of the router that there is,
            or else of this machine.
        days: how long the certificates are valid.

    Raises:
        ConfigError: the directory cannot be written, holds a broken authority, or certificates of one that is gone.
    """
    if not (directory / "ca" / "key.pem").exists():
        _check_empty(directory)
        with _writing(directory):
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            _make_ca(directory / "ca")
    names = tuple(hosts) or _router_hosts(directory) or (*THIS_MACHINE, *_own_names())
    return [issue(directory, ROUTER, "router", hosts=names, days=days), issue(directory, HOST, "host", days=days)]


def certify_agent(directory: Path, side: str, agent: str, *, days: int = DEFAULT_DAYS) -> Path:
    """Make a certificate for one agent, and return its folder; errors as in `issue`."""
    return issue(directory, agent_name(side, agent), f"agent.{side}.{agent}", days=days)


def certify_adviser(directory: Path, side: str, adviser: str, *, days: int = DEFAULT_DAYS) -> Path:
    """Make a certificate for one adviser, and return its folder; errors as in `issue`."""
    return issue(directory, adviser_name(side, adviser), f"adviser.{side}.{adviser}", days=days)


def certify_observer(directory: Path, name: str, *, days: int = DEFAULT_DAYS) -> Path:
    """Make a certificate that reads everything and writes nothing, and return its folder; errors as in `issue`."""
    return issue(directory, OBSERVER, f"observer.{check_name(name, 'observer')}", days=days)


def issue(directory: Path, name: str, folder: str, *, hosts: Iterable[str] = (), days: int = DEFAULT_DAYS) -> Path:
    """Make a key and a certificate in a folder of their own, and return the folder.

    Args:
        directory: of the authority.
        name: the common name.
        folder: is made, or gets new files.
        hosts: names and addresses at which its holder listens; without them it can only connect.
        days: how long it is valid, within the time of the authority.

    Raises:
        ConfigError: there is no authority, the name is too long or taken, or the folder cannot be written.
    """
    place = directory / folder
    if len(name) > LONGEST_NAME:
        raise ConfigError(f"{name!r} is too long for a certificate: it has {len(name)} characters of {LONGEST_NAME}")
    if (place / "certificate.pem").exists() and read(place / "certificate.pem").name != name:
        raise ConfigError(f"it holds the certificate of {read(place / 'certificate.pem').name}", source=str(place))
    ca, ca_key = _authority(directory)
    key = ec.generate_private_key(ec.SECP256R1())
    now = datetime.now(UTC)
    ends = min(now + timedelta(days=days), ca.not_valid_after_utc)
    draft = _draft(name, ca.subject, key.public_key(), now - BEGINS_EARLIER, ends)
    signer = x509.AuthorityKeyIdentifier.from_issuer_public_key(ca_key.public_key())
    for extension, critical in (*_extensions(tuple(hosts)), (signer, False)):
        draft = draft.add_extension(extension, critical=critical)
    with _writing(place):
        place.mkdir(mode=0o700, exist_ok=True)
        _write(place / "ca.pem", ca.public_bytes(Encoding.PEM))
        _write(place / "key.pem", _pem(key))
        _write(place / "certificate.pem", draft.sign(ca_key, SHA256()).public_bytes(Encoding.PEM))
    return place


def certificates(directory: Path) -> list[Certificate]:
    """Return the certificates of a directory, or the one of a folder; empty if there are none."""
    own = [directory / "certificate.pem", directory / "ca" / "ca.pem"]
    paths = [*own, *sorted(directory.glob("*/certificate.pem"))]
    return [read(path) for path in paths if path.exists()]


def files_of(directory: Path, *names: str) -> TlsFiles:
    """Return the files of the first of these common names for which there is a certificate, or of any.

    Raises:
        ConfigError: there is none for any of them.
        BusError: a certificate cannot be read.
    """
    found = {
        certificate.name: certificate.path.parent
        for certificate in reversed(certificates(directory))
        if certificate.name != AUTHORITY
    }
    for name in names or found:
        if name in found:
            place = found[name]
            return TlsFiles(ca=place / "ca.pem", certificate=place / "certificate.pem", key=place / "key.pem")
    there = f"there are {', '.join(sorted(found))}" if found else "there are none"
    wanted = names or (HOST,)
    remedy = f"make it with {command_for(wanted[0])}, and copy its folder"
    raise ConfigError(f"no certificate of {' or '.join(wanted)}, {there}: {remedy}", source=str(directory))


def _check_empty(directory: Path) -> None:
    """Raise ConfigError if there are certificates, which a new authority would make worthless."""
    if found := certificates(directory):
        names = ", ".join(sorted({certificate.name for certificate in found}))
        raise ConfigError(
            f"holds certificates ({names}) but not the key of their authority, ca/key.pem: put the key back, or "
            "make all certificates anew in another directory",
            source=str(directory),
        )


def _router_hosts(directory: Path) -> tuple[str, ...]:
    path = directory / "router" / "certificate.pem"
    return read(path).hosts if path.exists() else ()


def _make_ca(place: Path) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, AUTHORITY)])
    now = datetime.now(UTC)
    draft = _draft(AUTHORITY, subject, key.public_key(), now - BEGINS_EARLIER, now + timedelta(days=AUTHORITY_DAYS))
    usage = x509.KeyUsage(
        digital_signature=False, content_commitment=False, key_encipherment=False, data_encipherment=False,
        key_agreement=False, key_cert_sign=True, crl_sign=True, encipher_only=False, decipher_only=False,
    )  # fmt: skip
    draft = draft.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    draft = draft.add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    draft = draft.add_extension(usage, critical=True)
    place.mkdir(mode=0o700, exist_ok=True)
    _write(place / "key.pem", _pem(key))
    _write(place / "ca.pem", draft.sign(key, SHA256()).public_bytes(Encoding.PEM))


def _draft(
    name: str, issuer: x509.Name, public: ec.EllipticCurvePublicKey, begins: datetime, ends: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)]))
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(ends)
    )


def _extensions(hosts: tuple[str, ...]) -> list[tuple[x509.ExtensionType, bool]]:
    """Return extensions and whether they are critical; only a holder with hosts is good as a server."""
    extensions: list[tuple[x509.ExtensionType, bool]] = [(x509.BasicConstraints(ca=False, path_length=None), True)]
    if not hosts:
        return [*extensions, (x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH]), False)]
    uses = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH])
    names = x509.SubjectAlternativeName([_general_name(host) for host in dict.fromkeys(hosts)])
    return [*extensions, (uses, False), (names, False)]


def _general_name(host: str) -> x509.GeneralName:
    with contextlib.suppress(ValueError):
        return x509.IPAddress(ipaddress.ip_address(host.strip("[]")))
    try:
        return x509.DNSName(host)
    except ValueError:
        raise ConfigError(f"{host!r} is neither a host name in ASCII nor an address", source="--host") from None


def _own_names() -> list[str]:
    """Return the name of this machine and the addresses that it has for other machines."""
    name = socket.gethostname()
    with contextlib.suppress(OSError):
        return [name, *(str(info[4][0]).partition("%")[0] for info in socket.getaddrinfo(name, None)), *_outward()]
    return [name, *_outward()]


def _outward() -> list[str]:
    """Return the addresses from which packets would leave; nothing is sent. A name alone often means 127.0.1.1."""
    found = []
    for family, far in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((far, 9))
            found.append(str(probe.getsockname()[0]))
    return found


def _authority(directory: Path) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
    place = directory / "ca"
    try:
        key = load_pem_private_key((place / "key.pem").read_bytes(), password=None)
        ca = x509.load_pem_x509_certificate((place / "ca.pem").read_bytes())
    except (OSError, ValueError, TypeError):
        raise ConfigError("holds no authority: make one with `khala keys init DIR`", source=str(directory)) from None
    if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != ca.public_key():
        raise ConfigError("its key does not belong to its certificate", source=str(place))
    return ca, key


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _write(path: Path, content: bytes) -> None:
    """Write a file that nobody else can read, at no moment."""
    path.unlink(missing_ok=True)
    path.touch(mode=0o600, exist_ok=False)
    path.write_bytes(content)


@contextlib.contextmanager
def _writing(place: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror or error}", source=str(place)) from None
