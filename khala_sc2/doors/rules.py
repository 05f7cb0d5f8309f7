"""The rules by which every HTTP server of Khala lets a request in: a machine without input or output.

A `Door` reads the head of a request, and returns a refusal or None. It checks, in this order:

1. The name: exactly one `Host`. A server for this machine is asked under a name of this machine, by a peer on it: a
   name that somebody points at 127.0.0.1 does not reach it.
2. The page: a browser says which page asks, with `Origin` or `Sec-Fetch-Site`. Only the server's own page may.
3. The size that the request declares for its body. `khala_sc2.doors.asgi` counts what really comes.
4. The token, from the address, a cookie or `Authorization`; or the password. The brake holds up wrong tries.

No header that a proxy adds (`X-Forwarded-…`), and none that overrides the method, is read.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import math
import os
import secrets
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Final
from urllib.parse import parse_qs

from khala_protocol.bus.config import is_loopback
from khala_protocol.errors import ConfigError
from khala_sc2.doors.brake import Brake

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

TOKEN: Final = "token"  # noqa: S105  # its name in the address
MOST_BODY_BYTES: Final = 16_384
"""Of a request, where a server does not take more."""
LEAST_TOKEN_CHARACTERS: Final = 16
READ_ONLY: Final = frozenset({"GET", "HEAD"})
_OTHER_SITES: Final = frozenset({"cross-site", "same-site"})


@dataclass(frozen=True, slots=True)
class RequestHead:
    """What a request says before its body.

    Attributes:
        method: in upper case.
        path: without the query.
        query: what stands behind the question mark.
        headers: each as often as it came, with its name in lower case.
        peer: address of the other end; "" if there is none, as in memory.
    """

    method: str
    path: str
    query: str
    headers: tuple[tuple[str, str], ...]
    peer: str

    def all(self, name: str) -> list[str]:
        """Return each value of a header."""
        return [value for known, value in self.headers if known == name]

    def first(self, name: str) -> str:
        """Return the first value of a header, "" if there is none."""
        return next((value for known, value in self.headers if known == name), "")

    @property
    def opens_socket(self) -> bool:
        """Whether it asks for a websocket."""
        return self.first("upgrade").casefold() == "websocket"


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a request is not answered: a status of HTTP, a sentence that says what to do, and headers."""

    status: int
    text: str
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """The rules of one server.

    Attributes:
        command: that serves, such as `khala view`; refusals name it.
        is_near: whether it is for this machine alone.
        is_published: whether it is in a container whose port is published to this machine: its peers have the address
            of the container's gateway then.
        token: opens the door; "" if anybody may ask who passes the other rules.
        password: opens it as well; people choose it, so wrong tries are held up. "" for none.
        is_secure: whether the server speaks TLS.
        has_page: whether it serves a page that people open, and that asks it for more.
        open_paths: answered without a token, for programs that look whether the server is there.
        most_body_bytes: of the body of a request.
        denied: status for a missing or wrong token.
    """

    command: str
    is_near: bool = True
    is_published: bool = False
    token: str = ""
    password: str = ""
    is_secure: bool = False
    has_page: bool = False
    open_paths: frozenset[str] = frozenset()
    most_body_bytes: int = MOST_BODY_BYTES
    denied: int = 401
    brake: Brake = field(default_factory=Brake)

    def check(self, head: RequestHead) -> Refusal | None:
        """Return why a request is refused; None if it may come in."""
        return self._check_name(head) or self._check_page(head) or self._check_size(head) or self._check_token(head)

    @property
    def cookie(self) -> str:
        """Name of the cookie with the token: browsers send the cookies of one port to all others of the host."""
        return f"khala_{hashlib.sha256(self.token.encode()).hexdigest()[:8]}"

    def _check_name(self, head: RequestHead) -> Refusal | None:
        names = head.all("host")
        if len(names) > 1:
            return Refusal(400, "the request names two hosts: send one Host header")
        if not self.is_near:
            return None
        if head.peer and not self.is_published and not is_loopback(head.peer.partition("%")[0]):
            return Refusal(403, f"`{self.command}` serves this machine alone: say otherwise when you start it")
        if not names or not is_loopback(host_of(names[0])):
            return Refusal(
                403, f"this server is not asked under this name: open the address that `{self.command}` printed"
            )
        return None

    def _check_page(self, head: RequestHead) -> Refusal | None:
        if self._is_foreign(head):
            return Refusal(403, f"another page asked this: only the page of `{self.command}` may")
        return None

    def _is_foreign(self, head: RequestHead) -> bool:
        origins = head.all("origin")
        site = head.first("sec-fetch-site")
        if not self.has_page and not self.is_near and not self.token:
            # nothing tells a page of a name that points here from one of ours: no page may ask
            return bool(origins) or site not in {"", "none"}
        changes = head.method not in READ_ONLY or head.opens_socket
        if self.has_page and changes and not origins:
            return True
        if any(origin.casefold() != self._origin(head) for origin in origins):
            return True
        return site in _OTHER_SITES and not self._is_opened_by_a_person(head)

    def _is_opened_by_a_person(self, head: RequestHead) -> bool:
        """Return whether somebody followed a link to the page, which shows no other page what it answers."""
        return self.has_page and head.method in READ_ONLY and head.first("sec-fetch-mode") == "navigate"

    def _origin(self, head: RequestHead) -> str:
        return f"{'https' if self.is_secure else 'http'}://{head.first('host')}".casefold()

    def _check_size(self, head: RequestHead) -> Refusal | None:
        declared = head.all("content-length")
        if any(not (length.isascii() and length.isdigit()) for length in declared) or len({*declared}) > 1:
            return Refusal(400, "Content-Length is no number")
        if any(int(length[:20]) > self.most_body_bytes for length in declared):
            return self.too_large()
        return None

    def too_large(self) -> Refusal:
        """Return the refusal of a body that is longer than the server takes."""
        return Refusal(413, f"the body is longer than {self.most_body_bytes} bytes: send less at a time")

    def _check_token(self, head: RequestHead) -> Refusal | None:
        if not (self.token or self.password) or head.path in self.open_paths:
            return None
        scheme, credential = _authorization(head)
        given = [*cookies(head.all("cookie"), self.cookie), *parse_qs(head.query).get(TOKEN, ()), credential]
        # the token cannot be guessed, so whoever has it never waits for what others try
        if self.token and any(is_same(secret, self.token) for secret in given):
            return None
        if not any(given):
            return self._denial()
        if (wait_s := self.brake.wait_s(head.peer)) > 0:
            return Refusal(
                429,
                f"too many wrong tries: wait {math.ceil(wait_s)} s, or open the address that `{self.command}` printed",
                {"Retry-After": str(math.ceil(wait_s))},
            )
        if self.password and scheme == "basic" and is_same(credential, self.password):
            self.brake.note_right(head.peer)
            return None
        self.brake.note_wrong(head.peer)
        return self._denial()

    def _denial(self) -> Refusal:
        text = f"the token is missing or wrong: open the address that `{self.command}` printed"
        challenge = {"WWW-Authenticate": f'Basic realm="{self.command}", charset="UTF-8"'} if self.password else {}
        return Refusal(self.denied, text, challenge)


def token_of(variable: str) -> str:
    """Return the token that a variable of the environment holds, or a new one.

    Raises:
        ConfigError: it could be guessed.
    """
    given = os.environ.get(variable, "")
    if not given:
        return secrets.token_urlsafe(24)
    if len(given) < LEAST_TOKEN_CHARACTERS or not given.isascii():
        raise ConfigError(
            f"it can be guessed: take at least {LEAST_TOKEN_CHARACTERS} characters of ASCII, such as those of "
            "`openssl rand -hex 16`",
            source=variable,
        )
    return given


def host_of(header: str) -> str:
    """Return the name in a `Host` header, without its port and without brackets."""
    name, _, port = header.rpartition(":")
    return (name if port.isdigit() else header).casefold().removeprefix("[").removesuffix("]")


def cookies(headers: Iterable[str], name: str) -> Iterator[str]:
    """Yield the values of a cookie in the `Cookie` headers of a request; a malformed header has none."""
    for header in headers:
        try:
            found = SimpleCookie(header).get(name)
        except CookieError:
            continue
        if found is not None:
            yield found.value


def is_same(given: str, right: str) -> bool:
    """Return whether two secrets are the same, in a time that does not tell how much of them is."""
    return hmac.compare_digest(given.encode("utf-8", "surrogateescape"), right.encode())


def _authorization(head: RequestHead) -> tuple[str, str]:
    """Return the scheme of `Authorization` in lower case, and its secret: of a login the part behind the name."""
    scheme, _, packed = head.first("authorization").partition(" ")
    scheme = scheme.casefold()
    if scheme != "basic":
        return scheme, packed.strip()
    try:
        return scheme, base64.b64decode(packed, validate=True).decode().partition(":")[2]
    except ValueError:
        return scheme, ""
