"""httpx's requests over aiohttp's connections.

httpx's own transport spends most of a call's CPU, and cancelled calls keep slots of its pool
(httpcore 1.0.9, encode/httpcore#1093). Over this one, a call costs half as much when many are made at once,
see `bench/http_client.py`. Bodies are read whole, because no completion is streamed here, and up to `MAX_BODY_BYTES`;
aiohttp unpacks them in pieces, so that a small body that unpacks to gigabytes is noticed after a few megabytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import aiohttp
import httpx
from aiohttp.http_exceptions import ContentEncodingError

if TYPE_CHECKING:
    import ssl

CONNECT_S = 5.0
KEEP_ALIVE_S = 120.0
MAX_BODY_BYTES = 8 * 2**20
"""Of an answer, unpacked; the longest completion of today's models has half a megabyte."""
_DONE = ("content-encoding", "content-length", "transfer-encoding")
"""Headers that no longer say what the body is."""
_OURS = frozenset({"Accept", "Accept-Encoding", "User-Agent", "Content-Type"})


class BodyTooLarge(httpx.DecodingError):
    """An answer has more than `MAX_BODY_BYTES`."""


class AiohttpTransport(httpx.AsyncBaseTransport):
    """The transport of one `httpx.AsyncClient`; may be cancelled at any moment, limits no connections.

    Args:
        tls: which certificates to trust.
        proxies: whether to use the proxies that the environment names; no proxy can reach our loopback.
    """

    def __init__(self, tls: ssl.SSLContext, *, proxies: bool) -> None:
        self._tls = tls
        self._proxies = proxies
        self._session: aiohttp.ClientSession | None = None

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Return the answer with its body.

        Raises:
            httpx.TransportError: there is no answer.
            httpx.DecodingError: it cannot be unpacked, or is too large.
        """
        try:
            async with self._open().request(
                request.method,
                str(request.url),
                headers=request.headers.multi_items(),
                data=request.content,
                allow_redirects=False,
            ) as answer:
                body = await _body(answer)
        except aiohttp.ServerTimeoutError as error:
            raise httpx.ConnectTimeout(str(error), request=request) from error
        except aiohttp.ClientConnectorError as error:
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
                trust_env=self._proxies,
                skip_auto_headers=_OURS,  # httpx has set them
            )
        return self._session


async def _body(answer: aiohttp.ClientResponse) -> bytes:
    body = bytearray()
    async for piece in answer.content.iter_any():
        body += piece
        if len(body) > MAX_BODY_BYTES:
            answer.close()  # the rest is not read for the sake of the connection
            raise BodyTooLarge(f"the answer is larger than {MAX_BODY_BYTES >> 20} MB")
    return bytes(body)
