"""What the environment says of the way to an endpoint: the proxy to go through, the certificates to trust.

The rules are httpx's, and those of most tools: `HTTP_PROXY`, `HTTPS_PROXY`, `ALL_PROXY` and `NO_PROXY`, in lower case
too, or what the system's settings say; `SSL_CERT_FILE`, `SSL_CERT_DIR`, and `REQUESTS_CA_BUNDLE` or `CURL_CA_BUNDLE`
where a company sets only those. No proxy is ever used for this machine. `khala_agents.llm.http` goes this way,
`khala doctor` says what it is. Nothing here imports an HTTP library.
"""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

from khala_agents.llm.address import is_loopback
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping

_SOCKS = ("socks5", "socks5h")
_KINDS = ("http", "https", *_SOCKS)
CERTIFICATES = ("SSL_CERT_FILE", "SSL_CERT_DIR", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")
"""Variables that name the certificates to trust, the first that is set first."""


@dataclass(frozen=True, slots=True)
class Proxy:
    """A proxy.

    Attributes:
        url: with its password, if it has one.
        source: the kind of address it is meant for, as in the name of its variable: `https`, `all`.
    """

    url: str
    source: str

    @property
    def is_socks(self) -> bool:
        """Whether it speaks SOCKS."""
        return urlsplit(self.url).scheme in _SOCKS

    def __str__(self) -> str:
        """Return its address without user and password."""
        parts = urlsplit(self.url)
        return f"{parts.scheme}://{parts.netloc.rpartition('@')[2]} ({self.source.upper()}_PROXY)"


@dataclass(frozen=True, slots=True)
class Trust:
    """A file or directory of certificates, and the variable that names it."""

    variable: str
    path: Path

    def __str__(self) -> str:
        return f"{self.variable}={self.path}"


def proxy_for(address: str) -> Proxy | None:
    """Return the proxy through which an address is reached; None if it is asked directly.

    Raises:
        ConfigError: the environment names a proxy that cannot be used.
    """
    parts = urlsplit(address)
    host = parts.hostname or ""
    if is_loopback(host) or proxy_bypass(parts.netloc):
        return None
    proxies = getproxies()
    source = next((name for name in (parts.scheme, "all") if proxies.get(name)), None)
    if source is None:
        return None
    return _usable(proxies[source].strip(), source)


def _usable(url: str, source: str) -> Proxy:
    url = url if "://" in url else f"http://{url}"
    variable = f"{source.upper()}_PROXY"
    try:
        parts = urlsplit(url)
        _ = parts.port
    except ValueError:
        raise ConfigError("this is not a proxy's URL", source=variable) from None  # not quoted: it may have a password
    if parts.scheme not in _KINDS or not parts.hostname:
        raise ConfigError(f"a proxy of the kind {parts.scheme!r} cannot be used: {', '.join(_KINDS)}", source=variable)
    if parts.scheme in _SOCKS and importlib.util.find_spec("socksio") is None:
        raise ConfigError(
            "a SOCKS proxy needs a package that is not installed: `pip install 'khala-sc2[socks]'`", source=variable
        )
    return Proxy(url, source)


def find_trust(environ: Mapping[str, str] = os.environ) -> Trust | None:
    """Return the certificates that the environment names; None for those that httpx brings.

    Raises:
        ConfigError: there is nothing at that path.
    """
    variable = next((name for name in CERTIFICATES if environ.get(name)), None)
    if variable is None:
        return None
    path = Path(environ[variable])
    if not path.exists():
        raise ConfigError(f"there is no file or directory {str(path)!r} with certificates", source=variable)
    return Trust(variable, path)
