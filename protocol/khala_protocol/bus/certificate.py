"""Read a certificate: whose it is, where it may listen, and how long it is valid.

`khala_protocol.bus.config` checks the certificates of a session with it, and `khala_protocol.certificates`, which makes
them, shows them. Only these two know a library for them.
"""

from __future__ import annotations

import contextlib
import warnings
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.utils import CryptographyDeprecationWarning
from cryptography.x509.oid import NameOID

from khala_protocol.errors import BusError
from khala_protocol.files import MB, read_limited
from khala_protocol.platforms import others_can_read

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

DAY = timedelta(days=1)
SOON_DAYS = 30
"""A certificate with fewer days left is worth a word."""
MOST_BYTES = 1 * MB
"""Of a PEM file, far above a chain of certificates."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """What a certificate says.

    Attributes:
        path: its file.
        name: the common name of its holder.
        hosts: names and addresses at which its holder may listen.
        begins: the first moment of its validity.
        ends: the last moment of its validity.
    """

    path: Path
    name: str
    hosts: tuple[str, ...]
    begins: datetime
    ends: datetime

    @property
    def has_expired(self) -> bool:
        """Whether it is past its time."""
        return self.ends < datetime.now(UTC)

    @property
    def days_left(self) -> int:
        """Days until it expires, of which the last has begun."""
        return -((datetime.now(UTC) - self.ends) // DAY)

    @property
    def key(self) -> Path:
        """The file of its private key, if it is here."""
        return self.path.parent / "key.pem"

    @property
    def is_open(self) -> bool:
        """Whether others than its owner can read the private key."""
        return self.key.exists() and others_can_read(self.key)

    @property
    def warning(self) -> str:
        """One sentence if it expires soon or has expired; otherwise empty."""
        if self.has_expired:
            return f"the certificate of {self.name} expired on {self.ends:%Y-%m-%d} ({self.path}): {self.remedy}"
        if self.days_left < SOON_DAYS:
            return f"the certificate of {self.name} expires in {self.days_left} days ({self.path}): {self.remedy}"
        return ""

    @property
    def remedy(self) -> str:
        """The command that makes a new one, where the authority is; an authority itself stays as it is for good."""
        if self.name == "authority":
            return f"{command_for(self.name)} in a new directory makes another, and all certificates must be made there"
        return f"{command_for(self.name, self.path.parent.name)} makes a new one where the authority is"


def command_for(name: str, folder: str = "observer.NAME") -> str:
    """Return the command that makes the certificate with this common name, for this folder."""
    role, _, whose = name.partition(":")
    side, _, agent = whose.partition("/")
    observer = folder.removeprefix("observer.")
    commands = {
        "agent": f"agent {agent} DIR --side {side}",
        "adviser": f"adviser {agent} DIR --side {side}",
        "observer": f"observer {observer} DIR",
    }
    return f"`khala keys {commands.get(role, 'init DIR')}`"


def read(path: Path, what: str = "certificate") -> Certificate:
    """Read the first certificate of a PEM file.

    Raises:
        BusError: the file cannot be read, or holds none.
    """
    with _broken_refused(path, what):
        found = x509.load_pem_x509_certificate(_bytes(path, what))
        names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        name = str(names[0].value) if names else ""
        return Certificate(path, name, _hosts(found), found.not_valid_before_utc, found.not_valid_after_utc)


def check_valid(path: Path, what: str = "certificate") -> None:
    """Check that the certificate can be used at this moment.

    Raises:
        BusError: as `read` does, or it has expired, or is not valid yet.
    """
    found = read(path, what)
    if found.has_expired:
        raise BusError(found.warning)
    if found.begins > datetime.now(UTC):
        raise BusError(f"the TLS {what} {path} is valid from {found.begins:%Y-%m-%d} on: is the clock right here?")


def check_key(path: Path, certificate: Path) -> None:
    """Check that the file holds the private key of the certificate.

    Raises:
        BusError: it holds none in PKCS#8, or another one.
    """
    text = _bytes(path, "key")
    if b"-----BEGIN PRIVATE KEY-----" not in text:
        hint = "; convert it with `openssl pkcs8 -topk8 -nocrypt`" if b"PRIVATE KEY-----" in text else ""
        raise BusError(f"the TLS key {path} holds no private key in PEM{hint}")
    try:
        key = load_pem_private_key(text, password=None)
    except (ValueError, TypeError):
        raise BusError(f"the TLS key {path} cannot be read: is the file whole?") from None
    with _broken_refused(certificate, "certificate"):
        certified = x509.load_pem_x509_certificate(_bytes(certificate, "certificate")).public_key()
    if key.public_key() != certified:
        raise BusError(f"the TLS key {path} does not belong to the certificate {certificate}: copy both again")


@contextlib.contextmanager
def _broken_refused(path: Path, what: str) -> Iterator[None]:
    """Refuse what the library cannot parse, now or in later releases; it finds out when a part is asked for."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", CryptographyDeprecationWarning)
            yield
    except (
        ValueError,
        TypeError,
        x509.InvalidVersion,
        x509.DuplicateExtension,
        x509.UnsupportedGeneralNameType,
        CryptographyDeprecationWarning,
    ):
        raise BusError(f"the TLS {what} {path} holds no certificate in PEM: is the file whole?") from None


def _bytes(path: Path, what: str) -> bytes:
    try:
        return read_limited(path, MOST_BYTES)
    except OSError as error:
        raise BusError(f"cannot read the TLS {what} {path}: {error.strerror or error}") from None


def _hosts(found: x509.Certificate) -> tuple[str, ...]:
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)
