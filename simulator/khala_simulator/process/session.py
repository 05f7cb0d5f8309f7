"""One game process without its socket: the bytes of a request in, the bytes of its response out.

Most answers are there at once. Some wait: for the other processes of a game, for the wall clock, or, in a long step,
for the event loop to handle everything else.

Every response carries the status and the request's id. A request that is not legal now, or that is no request at
all, is a usage error: `Response.error` and no body. A legal request that fails has its own body with its own error.
Nothing that a client sends may raise out of `Session.answer`.

Above: `server.py`. Below: `status.py` (what is legal when), `api/` (what a request means to a game).
"""

from __future__ import annotations

import inspect
import traceback
from typing import TYPE_CHECKING

from google.protobuf.message import DecodeError, Message
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import wire
from khala_simulator.process.process import Failure, Process
from khala_simulator.process.requests import HANDLERS
from khala_simulator.process.status import Machine, Status, UsageError
from khala_simulator.process.texts import broken_text

if TYPE_CHECKING:
    from pathlib import Path

    from khala_simulator.api.wire import Part

_BODY = {field.name: field.number for field in sc.Response.DESCRIPTOR.oneofs_by_name["response"].fields}
_ID = sc.Response.DESCRIPTOR.fields_by_name["id"].number
_STATUS = sc.Response.DESCRIPTOR.fields_by_name["status"].number
_ERROR = sc.Response.DESCRIPTOR.fields_by_name["error"].number


class Session:
    """The game process, as a function from requests to responses."""

    def __init__(self, data_dir: str | Path, base_build: int = 75689, data_version: str | None = None) -> None:
        self._machine = Machine()
        self._process = Process(data_dir, base_build, data_version)

    @property
    def status(self) -> Status:
        """The state that the last response reported."""
        return self._machine.status

    def handle(self, data: bytes) -> bytes:
        """Answer a request of a caller without an event loop that plays alone.

        Raises:
            RuntimeError: the answer has to wait for something outside of this process.
        """
        answering = self.answer(data)
        try:
            while answering.send(None) is None:
                pass  # a pause for an event loop that is not there
        except StopIteration as answered:
            response: bytes = answered.value
            return response
        answering.close()
        raise RuntimeError("this request waits for other processes or for the time: use Session.answer")

    async def answer(self, data: bytes) -> bytes:
        """Answer one request, one at a time; never raise. If cancelled, it leaves the process in its former state."""
        try:
            request = sc.Request.FromString(data)
        except DecodeError:
            return self._respond([_error("The request is not a protobuf message of the SC2 API")], None)
        if field := broken_text(request):
            return self._respond([_error(f"{field} in the request is not a text in UTF-8")], request)
        return self._respond(await self._answer(request), request)

    async def _answer(self, request: sc.Request) -> list[Part]:
        kind = request.WhichOneof("request")
        if kind is None:
            return [_error("The request is empty or of an unknown kind")]
        try:
            return await self._dispatch(kind, request)
        except UsageError as error:
            return [_error(str(error))]
        except Exception as error:  # noqa: BLE001  # a fault of ours: the client must get an answer, and we a trace
            traceback.print_exc()
            return [_error(f"The simulator failed in {kind}: {type(error).__name__}: {error}")]

    async def _dispatch(self, kind: str, request: sc.Request) -> list[Part]:
        move = "join_lan" if kind == "join_game" and request.join_game.HasField("server_ports") else kind
        self._machine.check(move)
        try:
            body = HANDLERS[kind](self._process, getattr(request, kind))
            if inspect.isawaitable(body):
                body = await body
        except Failure as failure:
            body = failure.body
        else:
            self._machine.move_on(move)
        if self._process.over:
            self._machine.end()
        parts: list[Part] = [body.SerializeToString()] if isinstance(body, Message) else body
        return wire.embed(_BODY[kind], parts)

    def _respond(self, parts: list[Part], request: sc.Request | None) -> bytes:
        if request is not None and request.HasField("id"):
            parts = [*parts, wire.scalar(_ID, request.id)]
        return b"".join([*parts, wire.scalar(_STATUS, self._machine.status)])


def _error(text: str) -> bytes:
    data = text.encode()
    return wire.head(_ERROR, len(data)) + data
