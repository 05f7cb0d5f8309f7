"""Check the address of an endpoint: every recording shows it, so it must not hold a secret."""

from __future__ import annotations

from urllib.parse import urlsplit, urlunsplit

MAX_CHARACTERS = 1000
LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})


def sends_openly(base_url: str) -> bool:
    """Return whether a key in a request to this address crosses a network unencrypted."""
    parts = urlsplit(base_url)
    return parts.scheme == "http" and parts.hostname not in LOOPBACK


def checked_address(base_url: str) -> str:
    """Return `base_url` without a trailing slash.

    Raises:
        ValueError: it is not an http:// or https:// URL, is far too long, or holds a user name, a password or a query.
    """
    try:
        parts = urlsplit(base_url)
        _ = parts.port
    except ValueError:
        raise ValueError("this is no URL") from None
    if "@" in parts.netloc or parts.query or parts.fragment:
        raise ValueError("a key, a password or a query does not belong into an address: name a variable in api_key_env")
    if len(base_url) > MAX_CHARACTERS or not (parts.hostname or "").isprintable():
        raise ValueError(f"an address has at most {MAX_CHARACTERS} characters, all of which can be seen")
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise ValueError(f"{base_url!r} is no URL that begins with http:// or https://")
    return urlunsplit((parts.scheme, parts.netloc, parts.path.rstrip("/"), "", ""))
