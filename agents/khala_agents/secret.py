"""Keys of model providers: read from the environment, and never shown anywhere else.

A key is a `pydantic.SecretStr` from the moment it is read, so that neither `repr` nor a log line shows it. A
server may still echo it: every text from outside passes through `scrub`, which knows all keys that this process
has read, before it goes to a log, a message or a recording.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import SecretStr

from khala_protocol.errors import ConfigError
from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Mapping

MASK = "[key]"
_SENDABLE = re.compile(r"[!-~]{1,8192}")  # visible ASCII: an HTTP library quotes a header value it refuses
_read: set[str] = set()


def read_key(variable: str, environ: Mapping[str, str] | None = None) -> SecretStr:
    """Return the key in the environment variable `variable`, or in the file that `<variable>_FILE` names.

    Raises:
        ConfigError: there is no key, or it cannot be one; the text does not show it.
    """
    environ = os.environ if environ is None else environ
    file = environ.get(f"{variable}_FILE")
    value = environ.get(variable) or ""
    source = variable
    if not value and file:
        source = f"{variable}_FILE"
        try:
            value = Path(file).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            raise ConfigError(f"the file {file!r} cannot be read", source=source) from None
        if not value.strip():
            raise ConfigError(f"the file {file!r} is empty: it should hold the key", source=source)
    value = value.strip()
    if not value:
        raise ConfigError(
            f"no key: set the environment variable {variable}, or let {variable}_FILE name a file that holds it",
        )
    if not _SENDABLE.fullmatch(value):
        raise ConfigError("the key has blanks, line breaks or other characters that no key has", source=source)
    if len(value) >= 4:  # a shorter "key" is a dummy for a local server and would blot out ordinary words
        _read.add(value)
    return SecretStr(value)


def scrub(text: str) -> str:
    """Return `text` with a mask in place of every key that was read."""
    for value in _read:
        if value in text:
            text = text.replace(value, MASK)
    return text


def excerpt(said: str | bytes, most: int = 200) -> str:
    """Return what an endpoint said as one line of at most `most` characters, for a log or an error.

    Keys are masked before anything is cut, so that none is cut in two. Characters that a terminal would obey are
    replaced.
    """
    text = said.decode("utf-8", "replace") if isinstance(said, bytes) else said
    line = visible_line(scrub(text))
    return line if len(line) <= most else f"{line[: most - 1]}…"
