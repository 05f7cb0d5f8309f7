"""The rules around an aiohttp application, and the headers under which a browser reads what it answers.

Above: `khala_sc2.view.guard` and `khala_sc2.service.metrics`. Below: `khala_sc2.doors.rules`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from aiohttp import web

from khala_sc2.doors.rules import RequestHead

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from aiohttp.typedefs import Middleware

    from khala_sc2.doors.rules import Door, Refusal

    Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}
_DEFAULTS: Final = {"Content-Security-Policy": "default-src 'none'", "Cache-Control": "no-store"}


def guard(door: Door) -> Middleware:
    """Return the middleware that holds every request to the rules of a door."""

    @web.middleware
    async def check(request: web.Request, handler: Handler) -> web.StreamResponse:
        refusal = door.check(head_of(request))
        response = await _answer(request, handler) if refusal is None else _refusal(refusal)
        if not response.prepared:
            response.headers.update(HEADERS)
            for name, value in _DEFAULTS.items():
                response.headers.setdefault(name, value)
        return response

    return check


def head_of(request: web.Request) -> RequestHead:
    """Return the head of a request as the rules read it."""
    return RequestHead(
        method=request.method,
        path=request.path,
        query=request.rel_url.raw_query_string,
        headers=tuple((name.lower(), value) for name, value in request.headers.items()),
        peer=_peer(request),
    )


def _peer(request: web.Request) -> str:
    """Return the address of the other end; `request.remote` could be overridden."""
    name = request.transport.get_extra_info("peername") if request.transport else None
    return str(name[0]) if isinstance(name, tuple) else ""


async def _answer(request: web.Request, handler: Handler) -> web.StreamResponse:
    try:
        return await handler(request)
    except web.HTTPException as error:
        return web.Response(status=error.status, text=f"{(error.text or error.reason).strip()}\n")


def _refusal(refusal: Refusal) -> web.Response:
    response = web.Response(status=refusal.status, text=f"{refusal.text}\n", headers=dict(refusal.headers))
    response.force_close()  # its peer has to begin anew for the next try
    return response
