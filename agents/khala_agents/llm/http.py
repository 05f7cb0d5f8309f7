"""HTTP to one model endpoint: with `khala_agents.llm.transport` below it, the only module that knows httpx.

Each agent has its own client, and so its own connections: a cancelled call disturbs no other agent. The number of
connections is not limited, `khala_agents.llm.limits` holds requests back. `refresh` discards the client between
episodes, with whatever cancelled calls left behind. HTTP/2 stays off: a few long calls gain nothing from it.

httpx and aiohttp take 0.4 s to import, and a host that looks whether a model file is right makes no request: they are
imported when an endpoint connects.

Above it are `openai_compatible` and `anthropic`, which know what the bytes mean.
"""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from functools import cache
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from pydantic_core import from_json

from khala_agents.llm.address import LOOPBACK, checked_address
from khala_agents.llm.client import (
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    RequestRefused,
    TryTimeout,
    Unauthorized,
    Unreachable,
)
from khala_agents.llm.retry import is_retried
from khala_agents.secret import excerpt

if TYPE_CHECKING:
    import ssl
    from collections.abc import Mapping

    import httpx
    from pydantic import SecretStr

    from khala_agents.llm.transport import AiohttpTransport

log = logging.getLogger(__name__)

_WARM_TIMEOUT_S = 5.0
_SPENT_CODES = frozenset(
    {"insufficient_quota", "billing_hard_limit_reached", "billing_not_active", "enforced_spend_limit_reached"}
)
"""Codes under which "429 Too Many Requests" means that the account has no money left."""


class HttpEndpoint:
    """An endpoint that accepts JSON by POST, over its own connection.

    Args:
        base_url: `https://host/v1`; paths are appended to it.
        headers: sent with each request.
        key_header: name and prefix of the header that carries the key.
        key: None for no key.
    """

    def __init__(
        self,
        base_url: str,
        *,
        headers: Mapping[str, str] | None = None,
        key_header: tuple[str, str] = ("Authorization", "Bearer "),
        key: SecretStr | None = None,
    ) -> None:
        self.address = checked_address(base_url)
        self._headers = {
            "Content-Type": "application/json",
            "Accept": "application/json",
            "Accept-Encoding": "gzip, deflate",
            "User-Agent": "khala",
        }
        self._headers |= headers or {}
        if key is not None:
            name, prefix = key_header
            self._headers[name] = prefix + key.get_secret_value()
        self._urls: dict[str, httpx.URL] = {}
        self._transport: AiohttpTransport | None = None

    async def post(self, path: str, body: bytes, timeout_s: float | None) -> bytes:
        """Return the body of the answer.

        Raises:
            LLMError: there was no answer within `timeout_s` seconds, or its status is an error.
        """
        import httpx  # noqa: PLC0415  # see above

        from khala_agents.llm.transport import BodyTooLarge  # noqa: PLC0415

        try:
            async with asyncio.timeout(timeout_s):
                response = await self._answer("POST", path, body)
        except TimeoutError:
            raise TryTimeout(f"{self.address} gave no answer within {timeout_s:g} s") from None
        except BodyTooLarge as error:
            raise MalformedCompletion(f"{self.address} cannot be used: {error}") from None
        except httpx.DecodingError:
            raise MalformedCompletion(f"{self.address} sent a body that cannot be unpacked") from None
        except httpx.TransportError as error:
            raise Unreachable(f"{self.address} cannot be reached: {_words(error)}") from None
        if response.status_code != httpx.codes.OK:
            raise error_for(self.address, response.status_code, response.headers, response.content)
        return response.content

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

        with suppress(httpx.HTTPError, TimeoutError):
            async with asyncio.timeout(_WARM_TIMEOUT_S):
                response = await self._answer("GET", "/models")
            if response.status_code == httpx.codes.UNAUTHORIZED:
                raise error_for(self.address, response.status_code, response.headers, response.content)

    async def close(self) -> None:
        """Close the connections; the next request opens new ones."""
        transport, self._transport = self._transport, None
        if transport is not None:
            await transport.aclose()

    async def _answer(self, method: str, path: str, body: bytes | None = None) -> httpx.Response:
        """Return the answer to a request.

        It goes to the transport itself: an `httpx.AsyncClient`, with redirects, authentication and cookies that no
        endpoint uses, would take three quarters of the time that httpx takes.
        """
        import httpx  # noqa: PLC0415  # see above

        if path not in self._urls:
            self._urls[path] = httpx.URL(self.address + path)
        request = httpx.Request(method, self._urls[path], headers=self._headers, content=body)
        return await self._connected().handle_async_request(request)

    def _connected(self) -> AiohttpTransport:
        if self._transport is None:
            from khala_agents.llm.transport import AiohttpTransport  # noqa: PLC0415  # see above

            proxies = urlsplit(self.address).hostname not in LOOPBACK
            self._transport = AiohttpTransport(_tls(), proxies=proxies)
        return self._transport


def error_for(address: str, status: int, headers: Mapping[str, str], body: bytes) -> LLMError:
    """Return the error for an answer with this status. The server's text is quoted briefly, without keys."""
    code, message = _said(body)
    name = f"http {status}"
    said = f"{address} answered {name}" + (f": {message}" if message else "")
    if status in {401, 403}:
        return Unauthorized(f"{said}; is the key right, and may it use this model?", status=name)
    if status == 402 or code in _SPENT_CODES:
        return OutOfMoney(f"{said}; the account has no money or quota left", status=name)
    if is_retried(status):
        return EndpointUnavailable(said, status=name, retry_after_s=retry_after_s(headers))
    return RequestRefused(said, status=name)


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the seconds that the headers `Retry-After-Ms` or `Retry-After` (seconds, or a date) ask to wait."""
    with suppress(KeyError, ValueError):
        return max(float(headers["retry-after-ms"]) / 1000, 0.0)
    value = headers.get("retry-after")
    if value is None:
        return None
    with suppress(ValueError):
        return max(float(value), 0.0)
    try:
        until = parsedate_to_datetime(value)
        # by the server's own clock if it sends the time: ours may differ
        now = parsedate_to_datetime(headers["date"]) if "date" in headers else datetime.now(UTC)
        return max((until - now).total_seconds(), 0.0)
    except (ValueError, TypeError):
        return None


def _said(body: bytes) -> tuple[str, str]:
    """Return code and message of an error body in the known forms; ("", beginning of the text) otherwise."""
    try:
        error = from_json(body)["error"]
    except (ValueError, KeyError, TypeError):
        return "", excerpt(body)
    if not isinstance(error, dict):
        return "", excerpt(str(error))
    return str(error.get("code") or error.get("type") or ""), excerpt(str(error.get("message") or ""))


def _words(error: httpx.TransportError) -> str:
    text = excerpt(str(error))
    return f"{text} ({type(error).__name__})" if text else type(error).__name__


@cache
def _tls() -> ssl.SSLContext:
    import httpx  # noqa: PLC0415  # see above

    return httpx.create_ssl_context()  # 28 ms: once per process, not once per agent
