"""HTTP to one model endpoint: with `khala_agents.llm.transport` below it, which sends what httpx asks over aiohttp.

Each agent has its own client, and so its own connections: a cancelled call disturbs no other agent. The number of
connections is not limited, `khala_agents.llm.limits` holds requests back. `refresh` discards the client between
episodes, with whatever cancelled calls left behind. HTTP/2 stays off: a few long calls gain nothing from it.

httpx and aiohttp take 0.4 s to import, and a host that looks whether a model file is right makes no request: they are
imported when an endpoint connects.

Above it is `khala_agents.llm.asking`, which knows what a try is; `khala_agents.llm.network` knows the way.
"""

from __future__ import annotations

import asyncio
import ssl
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from khala_agents.llm.address import checked_address, root_of
from khala_agents.llm.client import (
    Departure,
    LLMError,
    MalformedCompletion,
    RequestRefused,
    Unauthorized,
    Unreachable,
)
from khala_agents.llm.faults import error_for
from khala_agents.llm.network import Trust, find_trust, proxy_for
from khala_agents.secret import excerpt

if TYPE_CHECKING:
    from collections.abc import Mapping

    import httpx
    from pydantic import SecretStr

_WARM_TIMEOUT_S = 5.0
OK = 200
UNAUTHORIZED = frozenset({400, 401})
"""Statuses with which the list of models is refused for a wrong key; the first is Gemini's."""


@dataclass(frozen=True, slots=True)
class HttpAnswer:
    """An HTTP answer.

    Attributes:
        url: what was asked, without its query.
    """

    url: str
    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def error(self) -> LLMError:
        """The error that its status stands for."""
        return error_for(self.url, self.status, self.headers, self.body)


class HttpEndpoint:
    """An endpoint that accepts JSON by POST, over its own connection.

    Args:
        base_url: `https://host/v1`; paths are appended to it.
        headers: sent with each request.
        query: of each request's address.
        key_header: name and prefix of the header that carries the key.
        key: None for no key.

    Raises:
        ConfigError: the environment names a proxy or certificates that cannot be used.
    """

    def __init__(
        self,
        base_url: str,
        *,
        headers: Mapping[str, str] | None = None,
        query: Mapping[str, str] | None = None,
        key_header: tuple[str, str] = ("Authorization", "Bearer "),
        key: SecretStr | None = None,
    ) -> None:
        self.address = checked_address(base_url)
        self._proxy = proxy_for(self.address)
        self._trust = find_trust() if self.address.startswith("https:") else None
        self._headers = {
            "Accept": "application/json",
            "Accept-Encoding": "gzip, deflate",
            "User-Agent": "khala",
        }
        self._headers |= headers or {}
        if key is not None:
            name, prefix = key_header
            self._headers[name] = prefix + key.get_secret_value()
        self._query = f"?{urlencode(query)}" if query else ""
        self._urls: dict[str, httpx.URL] = {}
        self._transport: httpx.AsyncBaseTransport | None = None

    async def post(self, path: str, body: bytes, delivery: Departure | None = None) -> HttpAnswer:
        """Return the answer, whatever its status, and note whether the request has left.

        Raises:
            LLMError: there is none.
        """
        return await self.send("POST", path, body, delivery=delivery)

    async def send(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        kind: str = "application/json",
        delivery: Departure | None = None,
    ) -> HttpAnswer:
        """Return the answer to any request; `kind` is the media type of its body.

        Raises:
            LLMError: there is none.
        """
        import httpx  # noqa: PLC0415  # see above

        from khala_agents.llm.transport import BodyTooLarge  # noqa: PLC0415

        try:
            return await self._answer(method, path, body, delivery, kind)
        except BodyTooLarge as error:
            raise MalformedCompletion(f"{self.address} cannot be used: {error}") from None
        except httpx.DecodingError:
            raise MalformedCompletion(f"{self.address} sent a body that cannot be unpacked") from None
        except httpx.InvalidURL as error:
            raise RequestRefused(f"{self.address} is no URL: {_explain(error)}", status="connection") from None
        except httpx.TransportError as error:
            never_sent = isinstance(error, httpx.ConnectError | httpx.ConnectTimeout | httpx.ProxyError)
            raise Unreachable(self._unreachable(error), sent=not never_sent) from None

    async def refresh(self) -> None:
        """Discard the connections and open a new one, so that the first request of an episode finds it warm."""
        await self.close()
        with suppress(LLMError):
            await self.check()

    async def check(self) -> None:
        """Ask for the list of models, which costs nothing, to see whether the key is accepted.

        Only a refused key is an error: an endpoint may come up later, or have no such list. (403 is no error:
        keys may be restricted to completions.)

        Raises:
            Unauthorized: the endpoint refuses the key.
        """
        import httpx  # noqa: PLC0415  # see above

        with suppress(httpx.HTTPError, httpx.InvalidURL, TimeoutError):
            async with asyncio.timeout(_WARM_TIMEOUT_S):
                answer = await self._answer("GET", "/models")
            if answer.status in UNAUTHORIZED and isinstance(error := answer.error, Unauthorized):
                raise error

    async def read(self, path: str) -> bytes | None:
        """Return what a GET of an address below the base URL has, or of `//path` below the root of its host.

        Not every endpoint has every address: None for any other answer than "200 OK".
        """
        import httpx  # noqa: PLC0415  # see above

        with suppress(httpx.HTTPError, httpx.InvalidURL, TimeoutError, LLMError):
            async with asyncio.timeout(_WARM_TIMEOUT_S):
                answer = await self._answer("GET", path)
            return answer.body if answer.status == OK else None
        return None

    async def close(self) -> None:
        """Close the connections; the next request opens new ones."""
        transport, self._transport = self._transport, None
        if transport is not None:
            await transport.aclose()

    async def _answer(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        delivery: Departure | None = None,
        kind: str = "application/json",
    ) -> HttpAnswer:
        """Return the answer to a request.

        It goes to the transport itself: an `httpx.AsyncClient`, with redirects, authentication and cookies that no
        endpoint uses, would take three quarters of the time that httpx takes.
        """
        import httpx  # noqa: PLC0415  # see above

        if path not in self._urls:
            base = root_of(self.address) if path.startswith("//") else self.address
            self._urls[path] = httpx.URL(base + path.replace("//", "/", 1) + self._query)
        extensions = {} if delivery is None else {Departure.EXTENSION: delivery}
        headers = self._headers | {"Content-Type": kind}
        request = httpx.Request(method, self._urls[path], headers=headers, content=body, extensions=extensions)
        answer = await self._connect().handle_async_request(request)
        return HttpAnswer(self.address + path, answer.status_code, answer.headers, answer.content)

    def _connect(self) -> httpx.AsyncBaseTransport:
        if self._transport is None:
            from khala_agents.llm.transport import AiohttpTransport, SocksTransport  # noqa: PLC0415  # see above

            tls = _tls(self._trust)
            if self._proxy is not None and self._proxy.is_socks:
                self._transport = SocksTransport(tls, proxy=self._proxy.url)
            else:
                self._transport = AiohttpTransport(tls, proxy=self._proxy.url if self._proxy else None)
        return self._transport

    def _unreachable(self, error: httpx.TransportError) -> str:
        said = f"{self.address} cannot be reached"
        if self._proxy is not None:
            said += f" through the proxy {self._proxy}"
        hint = ""
        if "CERTIFICATE_VERIFY_FAILED" in str(error):
            hint = "; if a company's proxy signs its certificate, name the company's own in SSL_CERT_FILE"
        return f"{said}: {_explain(error)}{hint}"


def _explain(error: Exception) -> str:
    text = excerpt(str(error))
    return f"{text} ({type(error).__name__})" if text else type(error).__name__


@cache
def _tls(trust: Trust | None) -> ssl.SSLContext:
    """Return the certificates to trust: 28 ms, once per process and not once per agent.

    Raises:
        RequestRefused: the file that the environment names holds none.
    """
    import httpx  # noqa: PLC0415  # see above

    if trust is None:
        return httpx.create_ssl_context(trust_env=False)
    try:
        if trust.path.is_dir():
            return ssl.create_default_context(capath=str(trust.path))
        return ssl.create_default_context(cafile=str(trust.path))
    except (OSError, ssl.SSLError) as error:
        raise RequestRefused(f"{trust} holds no certificates: {excerpt(str(error))}", status="certificates") from None
