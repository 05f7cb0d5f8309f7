"""Check the address of an endpoint: every recording shows it, so it must not hold a secret."""

from __future__ import annotations

from urllib.parse import urlsplit, urlunsplit


def checked_address(base_url: str) -> str:
    """Return `base_url` without a trailing slash.

    Raises:
        ValueError: it is not an http:// or https:// URL, or holds a user name, a password or a query.
    """
    try:
        parts = urlsplit(base_url)
        _ = parts.port
    except ValueError:
        raise ValueError("this is no URL") from None
    if "@" in parts.netloc or parts.query or parts.fragment:
        raise ValueError("a key, a password or a query does not belong into an address: name a variable in api_key_env")
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise ValueError(f"{base_url!r} is no URL that begins with http:// or https://")
    return urlunsplit((parts.scheme, parts.netloc, parts.path.rstrip("/"), "", ""))
