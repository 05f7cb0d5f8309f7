"""What the server of a view adds to the door: a token that becomes a cookie, and the policy of its page.

Recordings hold prompts and replies, and the page writes to agents, so the door asks for a token. It comes in the
address that `khala view` prints, and becomes a cookie, so that it does not stay in the address bar. A page runs only
its own script.
"""

from __future__ import annotations

import base64
import hashlib
import re
import secrets
from typing import TYPE_CHECKING

from aiohttp import web

from khala_sc2.doors.rules import READ_ONLY, TOKEN, Door, is_same

if TYPE_CHECKING:
    from collections.abc import Iterator

    from aiohttp.typedefs import Middleware

    from khala_sc2.doors.pages import Handler

_SCRIPT = re.compile(r"<script(?P<tag>[^>]*)>(?P<body>.*?)</script\s*>", re.DOTALL | re.IGNORECASE)
_STYLE = re.compile(r"<style[^>]*>(?P<body>.*?)</style\s*>", re.DOTALL | re.IGNORECASE)
_DATA = re.compile(r"type\s*=\s*[\"']?application/json", re.IGNORECASE)


def view_door(
    *,
    password: str = "",
    is_near: bool = True,
    is_published: bool = False,
    is_secure: bool = False,
    command: str = "khala view",
) -> Door:
    """Return the rules of a view, with a new token; arguments are those of `Door`."""
    return Door(
        command=command,
        is_near=is_near,
        is_published=is_published,
        token=secrets.token_urlsafe(24),
        password=password,
        is_secure=is_secure,
        has_page=True,
    )


def welcoming(door: Door, *, redirects: bool = True) -> Middleware:
    """Return the middleware that gives whoever came in the cookie, and takes the token out of the address.

    Args:
        door: whose token it is.
        redirects: whether another address takes it out. A link that somebody follows from another site reaches that
            address without the cookie; there the page itself takes the token out.
    """

    @web.middleware
    async def welcome(request: web.Request, handler: Handler) -> web.StreamResponse:
        response = (_without_token(request) if redirects else None) or await handler(request)
        if not response.prepared and not is_same(request.cookies.get(door.cookie, ""), door.token):
            response.set_cookie(
                door.cookie, door.token, httponly=True, samesite="Strict", secure=door.is_secure, path="/"
            )
        return response

    return welcome


def _without_token(request: web.Request) -> web.Response | None:
    """Return a redirect to the same page without the token; None if its address has none."""
    if request.method not in READ_ONLY or TOKEN not in request.query or request.path.startswith("/api/"):
        return None
    query = request.rel_url.query.copy()
    query.popall(TOKEN)
    return web.Response(status=303, headers={"Location": str(request.rel_url.with_query(query))})


def policy_of(page: str) -> str:
    """Return the policy under which a page of one file runs: its own scripts and styles, by their hashes."""
    scripts = " ".join(_hashes(_scripts(page))) or "'none'"
    styles = " ".join(_hashes(_bodies(_STYLE, page))) or "'none'"
    return (
        f"default-src 'none'; script-src {scripts}; style-src {styles}; "
        "style-src-attr 'none'; img-src 'self' data: blob:; font-src data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def _scripts(page: str) -> Iterator[str]:
    return (found["body"] for found in _SCRIPT.finditer(page) if not _DATA.search(found["tag"]))


def _bodies(expression: re.Pattern[str], page: str) -> Iterator[str]:
    return (found["body"] for found in expression.finditer(page))


def _hashes(bodies: Iterator[str]) -> Iterator[str]:
    for body in dict.fromkeys(bodies):
        yield f"'sha256-{base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()}'"
