"""Check the address of an endpoint: every recording shows it, so it must not hold a secret."""

from __future__ import annotations

import ipaddress
import re
from urllib.parse import urlsplit, urlunsplit

MAX_CHARACTERS = 1000
_PASTED = re.compile(r"/(?:chat/completions|messages|responses|models/[^/]+:\w+)$")
"""Paths that clients append, which people copy with the address from an endpoint's documentation."""
_VERSION = re.compile(r"/v\d\w*(?:/|$)")


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine, which no proxy reaches and no network lies before."""
    name = host.strip("[]").rstrip(".").lower()
    if name == "localhost" or name.endswith(".localhost"):
        return True
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return False
    mapped = getattr(address, "ipv4_mapped", None) or address
    return mapped.is_loopback or mapped.is_unspecified  # servers print 0.0.0.0, and people copy it


def sends_openly(base_url: str) -> bool:
    """Return whether a key in a request to this address crosses a network unencrypted."""
    parts = urlsplit(base_url)
    return parts.scheme == "http" and not is_loopback(parts.hostname or "")


def is_versioned(url: str) -> bool:
    """Return whether the path of an address names a version, as `/v1` does."""
    return bool(_VERSION.search(urlsplit(url).path))


def base_of(url: str) -> str:
    """Return an address without query and without the path that a client appends to its base."""
    parts = urlsplit(url)
    path = _PASTED.sub("", parts.path.rstrip("/"))
    return urlunsplit((parts.scheme, parts.netloc, path.rstrip("/"), "", ""))


def root_of(url: str) -> str:
    """Return scheme and host of an address."""
    parts = urlsplit(url)
    return urlunsplit((parts.scheme, parts.netloc, "", "", ""))


def checked_address(base_url: str) -> str:
    """Return `base_url` without a trailing slash, and without the path of a request.

    Raises:
        ValueError: it is not an http:// or https:// URL, is far too long, or holds a user name, a password or a query.
    """
    try:
        parts = urlsplit(base_url)
        _ = parts.port
    except ValueError:
        raise ValueError("this is not a URL") from None
    if "@" in parts.netloc or parts.query or parts.fragment:
        raise ValueError(
            "a key, a password or a query does not belong in an address: name a variable in api_key_env, "
            "and write a query such as api-version under `query`"
        )
    if len(base_url) > MAX_CHARACTERS or not (parts.hostname or "").isprintable():
        raise ValueError(f"an address has at most {MAX_CHARACTERS} characters, all of them visible")
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise ValueError(f"{base_url!r} is not a URL that begins with http:// or https://")
    return base_of(base_url)
