"""The tree of exceptions: the type says whose fault it is.

    KhalaError
    ├── ConfigError          the user's: a file, an option, an environment variable
    │   └── NotInstalled     a package of an extra is missing, see `khala_protocol.extras`
    ├── BusError             the link's: no router, refused, closed
    │   ├── NoRouter         nothing that could be joined is there
    │   └── BusClosed        the bus was closed, here or by the other side
    ├── PeerError            the other side's: a message that this protocol does not allow
    │   ├── MalformedMessage
    │   ├── WrongVersion
    │   └── WrongKey
    └── RecordingError       a file that cannot be written, or is not a recording

Each text is one sentence that says what is wrong, where, and what to do; the command line prints it
without a traceback. A wrong action of a model is none of these: it is data (`khala_protocol.messages.Rejection`).
"""

from __future__ import annotations


class KhalaError(Exception):
    """Base of all errors whose text may be shown to the user as it is."""


class ConfigError(KhalaError):
    """Something the user wrote or forgot to write.

    Attributes:
        source: the file, option or variable that is wrong, if known.
        line: line in that file, counted from 1, if known.
        field: dotted path of the field, if known.
    """

    def __init__(
        self,
        message: str,
        *,
        source: str | None = None,
        line: int | None = None,
        field: str | None = None,
    ) -> None:
        self.source, self.line, self.field = source, line, field
        where = source or ""
        if line is not None:
            where += f":{line}" if where else f"line {line}"
        if field:
            where += f" ({field})" if where else field
        super().__init__(f"{where}: {message}" if where else message)


class NotInstalled(ConfigError, ImportError):
    """A package of an extra is not installed; whoever imports a module of Khala may catch it as an ImportError."""


class BusError(KhalaError):
    """The bus could not be opened, or a link of it failed."""


class NoRouter(BusError):
    """Nothing that could be joined is at any of the endpoints.

    Attributes:
        found: what is there instead, without advice.
    """

    def __init__(self, text: str, *, found: str = "") -> None:
        super().__init__(text)
        self.found = found or text


class BusClosed(BusError):
    """The bus or the subscription was closed during a wait on it."""


class PeerError(KhalaError):
    """A peer broke the protocol; the message is dropped and counted, the match goes on."""


class MalformedMessage(PeerError):
    """Bytes that are not a message of this protocol."""


class WrongVersion(PeerError):
    """A message of another major version of the schema."""


class WrongKey(PeerError):
    """A key that is not of this protocol, or a message under another agent's key."""


class RecordingError(KhalaError):
    """A recording that cannot be written or read."""
