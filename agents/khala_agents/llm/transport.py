"""httpx's requests over aiohttp's connections, and over httpx's own where a SOCKS proxy is in between.

httpx's own transport spends most of a call's CPU, and cancelled calls keep slots of its pool
(httpcore 1.0.9, encode/httpcore#1093). Over aiohttp's connections, a call costs half as much when many are made at
once: `python -m bench http_client`. The package httpx-aiohttp joins the two as well, but a connection that was refused
and one that broke after the request was sent are the same `ConnectTimeout` there (0.2.0), and only the second may be
billed. Bodies are read whole, because no completion is streamed here, and up to `MAX_BODY_BYTES`; aiohttp unpacks them
in pieces, so that a small body that unpacks to gigabytes is noticed after a few megabytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import aiohttp
import httpx
from aiohttp.http_exceptions import ContentEncodingError

from khala_agents.llm.client import Departure

if TYPE_CHECKING:
    import ssl
    from collections.abc import AsyncIterator
    from types import SimpleNamespace

CONNECT_S = 5.0
KEEP_ALIVE_S = 120.0
MAX_BODY_BYTES = 8 * 2**20
"""Of an answer, unpacked; the longest completion of today's models has half a megabyte."""
MAX_HEADER_BYTES = 2**16
"""Of one header; gateways tell of a model in some that are longer than aiohttp's 8 kB."""
_DONE = ("content-encoding", "content-length", "transfer-encoding")
"""Headers that no longer say what the body is."""
_OURS = frozenset({"Accept", "Accept-Encoding", "User-Agent", "Content-Type"})


class BodyTooLarge(httpx.DecodingError):
    """An answer has more than `MAX_BODY_BYTES`."""


class AiohttpTransport(httpx.AsyncBaseTransport):
    """Connections to one endpoint; requests may be cancelled at any moment, and no connections are limited.

    Args:
        tls: which certificates to trust.
        proxy: address of the HTTP proxy to go through; None for a direct connection.
    """

    def __init__(self, tls: ssl.SSLContext, *, proxy: str | None = None) -> None:
        self._tls = tls
        self._proxy = proxy
        self._session: aiohttp.ClientSession | None = None

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Return the answer with its body.

        Raises:
            httpx.TransportError: there is no answer. It is a `ConnectError`, `ConnectTimeout` or `ProxyError` if the
                request never left.
            httpx.DecodingError: it cannot be unpacked, or is too large.
        """
        delivery: Departure | None = request.extensions.get(Departure.EXTENSION)
        if delivery is not None:
            delivery.left = False
        try:
            async with self._open().request(
                request.method,
                str(request.url),
                headers=request.headers.multi_items(),
                data=request.content,
                allow_redirects=False,
                proxy=self._proxy,
                trace_request_ctx=delivery,
            ) as answer:
                body = await _whole(answer.content.iter_any(), answer)
        except aiohttp.ServerTimeoutError as error:
            raise httpx.ConnectTimeout(str(error), request=request) from error
        except aiohttp.ClientHttpProxyError as error:
            said = f"the proxy refused the connection: http {error.status}"
            raise httpx.ProxyError(said, request=request) from None
        except aiohttp.ClientResponseError as error:  # its text has the whole address; the query may have a key
            raise httpx.RemoteProtocolError(f"that is not HTTP: {error.message}", request=request) from None
        except (aiohttp.ClientConnectorError, aiohttp.InvalidURL) as error:
            raise httpx.ConnectError(str(error), request=request) from error
        except (aiohttp.ClientError, OSError) as error:
            kind = httpx.DecodingError if isinstance(error.__cause__, ContentEncodingError) else httpx.ReadError
            raise kind(str(error), request=request) from error
        headers = [(name, value) for name, value in answer.raw_headers if name.decode("latin-1").lower() not in _DONE]
        return httpx.Response(answer.status, headers=headers, content=body, request=request)

    async def aclose(self) -> None:
        """Close the connections."""
        session, self._session = self._session, None
        if session is not None:
            await session.close()

    def _open(self) -> aiohttp.ClientSession:
        if self._session is None:
            self._session = aiohttp.ClientSession(
                connector=aiohttp.TCPConnector(limit=0, ssl=self._tls, keepalive_timeout=KEEP_ALIVE_S),
                timeout=aiohttp.ClientTimeout(total=None, sock_connect=CONNECT_S),
                cookie_jar=aiohttp.DummyCookieJar(),
                skip_auto_headers=_OURS,  # httpx has set them
                max_field_size=MAX_HEADER_BYTES,
                trace_configs=[_noting_departure()],
            )
        return self._session


class SocksTransport(httpx.AsyncBaseTransport):
    """The same through a SOCKS proxy, which aiohttp does not speak."""

    def __init__(self, tls: ssl.SSLContext, *, proxy: str) -> None:
        limits = httpx.Limits(max_connections=None, keepalive_expiry=KEEP_ALIVE_S)
        self._inner = httpx.AsyncHTTPTransport(verify=tls, limits=limits, proxy=proxy)

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Return the answer with its body; errors as above."""
        request.headers["Accept-Encoding"] = "identity"  # httpx unpacks without a limit
        request.extensions = {"timeout": {"connect": CONNECT_S, "read": None, "write": None, "pool": None}}
        answer = await self._inner.handle_async_request(request)
        try:
            if answer.headers.get("content-encoding", "identity") != "identity":
                raise httpx.DecodingError("the body is packed, which was not asked for", request=request)
            body = await _whole(answer.aiter_raw(), None)
        finally:
            await answer.aclose()
        headers = [(name, value) for name, value in answer.headers.raw if name.decode("latin-1").lower() not in _DONE]
        return httpx.Response(answer.status_code, headers=headers, content=body, request=request)

    async def aclose(self) -> None:
        """Close the connections."""
        await self._inner.aclose()


def _noting_departure() -> aiohttp.TraceConfig:
    """Return what notes that a request leaves, at its first byte."""

    async def note(_: object, context: SimpleNamespace, __: object) -> None:
        if context.trace_request_ctx is not None:
            context.trace_request_ctx.left = True

    tracing = aiohttp.TraceConfig()
    tracing.on_request_headers_sent.append(note)
    return tracing


async def _whole(pieces: AsyncIterator[bytes] | Any, answer: aiohttp.ClientResponse | None) -> bytes:
    body = bytearray()
    async for piece in pieces:
        body += piece
        if len(body) > MAX_BODY_BYTES:
            if answer is not None:
                answer.close()  # the rest is not read for the sake of the connection
            raise BodyTooLarge(f"the answer is larger than {MAX_BODY_BYTES >> 20} MB")
    return bytes(body)
