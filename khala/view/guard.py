"""Who may ask the server of a view, and what its page may do: a token, the host, the origin, headers.

Recordings hold prompts and replies, and the page writes to agents, so no other user of the machine, no other page of
the browser and no name that somebody points at 127.0.0.1 may reach it. A token in the address becomes a cookie, so that
it does not stay in the address bar. Every answer has headers under which a page runs only its own script.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import re
import secrets
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from aiohttp import web

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator

    from aiohttp.typedefs import Middleware

    Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

TOKEN = "token"  # noqa: S105  # its name in the address
LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")
_SCRIPT = re.compile(r"<script(?P<tag>[^>]*)>(?P<body>.*?)</script\s*>", re.DOTALL | re.IGNORECASE)
_STYLE = re.compile(r"<style[^>]*>(?P<body>.*?)</style\s*>", re.DOTALL | re.IGNORECASE)
_DATA = re.compile(r"type\s*=\s*[\"']?application/json", re.IGNORECASE)
READ_ONLY = frozenset({"GET", "HEAD"})
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True)
class Guard:
    """The rules of one server.

    Attributes:
        token: whoever has it may ask; a new one for each start.
        password: for a server that other machines reach; its user name does not matter. "" for none.
        names: hosts under which it may be addressed; () for any, which only a password makes safe.
        secure: whether it speaks TLS.
    """

    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    password: str = ""
    names: tuple[str, ...] = LOOPBACK
    secure: bool = False

    def middleware(self) -> Middleware:
        """Return the middleware that holds every request to the rules."""

        @web.middleware
        async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
            response: web.StreamResponse | None = self._refused(request)
            if response is None:
                response = self._welcomed(request)
            if response is None:
                response = await _handled(request, handler)
            if not response.prepared:
                response.headers.update(HEADERS)
                response.headers.setdefault("Content-Security-Policy", "default-src 'none'")
                response.headers.setdefault("Cache-Control", "no-store")
            return response

        return guarded

    def _refused(self, request: web.Request) -> web.Response | None:
        if self.names and host_of(request.headers.get("Host", "")) not in self.names:
            return _refusal(403, "this server is not asked under this name: open the address that `khala view` printed")
        if not self._is_own_page(request):
            return _refusal(403, "another page asked this: only the page of `khala view` may")
        if not self._knows(request):
            refusal = _refusal(401, "the token is missing or wrong: open the address that `khala view` printed")
            if self.password:
                refusal.headers["WWW-Authenticate"] = 'Basic realm="khala view", charset="UTF-8"'
            return refusal
        return None

    def _is_own_page(self, request: web.Request) -> bool:
        """Return False if a page of another origin asked for a websocket or for a change."""
        opens = request.headers.get("Upgrade", "").casefold() == "websocket"
        if request.method in READ_ONLY and not opens:
            return True
        scheme = "https" if self.secure else "http"
        return request.headers.get("Origin") == f"{scheme}://{request.headers.get('Host', '')}"

    def _knows(self, request: web.Request) -> bool:
        given = (request.cookies.get(self.cookie, ""), request.query.get(TOKEN, ""))
        if any(_same(one, self.token) for one in given):
            return True
        return bool(self.password) and _same(_password(request.headers.get("Authorization", "")), self.password)

    def _welcomed(self, request: web.Request) -> web.Response | None:
        """Return a redirect to the same address without the token, which a cookie has from then on."""
        if request.method != "GET" or TOKEN not in request.query or request.path.startswith("/api/"):
            return None
        query = request.rel_url.query.copy()
        query.pop(TOKEN, None)
        response = web.Response(status=303, headers={"Location": str(request.rel_url.with_query(query))})
        response.set_cookie(self.cookie, self.token, httponly=True, samesite="Strict", secure=self.secure, path="/")
        return response

    @property
    def cookie(self) -> str:
        """Name of the cookie: browsers send the cookies of one port to all others of the host."""
        return f"khala_view_{hashlib.sha256(self.token.encode()).hexdigest()[:8]}"


async def _handled(request: web.Request, handler: Handler) -> web.StreamResponse:
    try:
        return await handler(request)
    except web.HTTPException as error:
        return _refusal(error.status, (error.text or error.reason).strip())


def _password(authorization: str) -> str:
    """Return the password of a header, in which a name stands before it; "" if there is none."""
    scheme, _, packed = authorization.partition(" ")
    try:
        login = base64.b64decode(packed, validate=True).decode() if scheme.casefold() == "basic" else ""
    except ValueError:
        return ""
    return login.partition(":")[2]


def policy_of(page: str) -> str:
    """Return the policy under which a page of one file runs: its own scripts and styles, by their hashes."""
    scripts = " ".join(_hashes(_scripts(page))) or "'none'"
    styles = " ".join(_hashes(_bodies(_STYLE, page))) or "'none'"
    return (
        f"default-src 'none'; script-src {scripts}; style-src {styles}; "
        "style-src-attr 'none'; img-src 'self' data: blob:; font-src data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def host_of(header: str) -> str:
    """Return the name in a `Host` header, without its port."""
    name, _, port = header.rpartition(":")
    return (name if port.isdigit() else header).casefold()


def _scripts(page: str) -> Iterator[str]:
    return (found["body"] for found in _SCRIPT.finditer(page) if not _DATA.search(found["tag"]))


def _bodies(expression: re.Pattern[str], page: str) -> Iterator[str]:
    return (found["body"] for found in expression.finditer(page))


def _hashes(bodies: Iterator[str]) -> Iterator[str]:
    for body in dict.fromkeys(bodies):
        yield f"'sha256-{base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()}'"


def _same(given: str, right: str) -> bool:
    return hmac.compare_digest(given.encode(), right.encode())


def _refusal(status: int, text: str) -> web.Response:
    return web.Response(status=status, text=f"{text}\n")
