"""Requests of all agents of a process in one batch, which costs half as much and is answered within a day.

A batch leaves once no request has come for a moment, or when it is full. Then it is asked for until its answers are
there, and each call gets its own. A call that is cancelled leaves its batch; a batch that every call has left is
cancelled at the endpoint, which then bills only what was answered already.

OpenAI's batches are files of JSON lines, Anthropic's are lists. Above it is `khala_agents.llm.asking`, for which a
batch is a way to send a request; below it is `khala_agents.llm.http`.
"""

from __future__ import annotations

import asyncio
import logging
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final
from weakref import WeakKeyDictionary

from pydantic_core import from_json, to_json

from khala_agents.llm.client import Departure, EndpointUnavailable, LLMError, MalformedCompletion
from khala_agents.llm.faults import fault_of, is_error
from khala_agents.llm.http import OK, HttpAnswer, HttpEndpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence

log = logging.getLogger(__name__)

QUIET_S = 5.0
"""So long after its last request a batch leaves: agents of one step ask within a second or two."""
FULL = 256
"""Requests in a batch; the answers to so many fit into the longest body that is read."""
FIRST_LOOK_S = 10.0
LONGEST_LOOK_S = 60.0
"""Between two questions whether a batch has ended; the first is asked sooner, each later one half as soon again."""
GOODBYE_S = 2.0
"""Time for an endpoint to hear that a batch is cancelled; a process of agents that is told to end has three seconds."""
_BOUNDARY: Final = "khala-batch-5f1c7c1e9a"

BatchAnswers = dict[str, "HttpAnswer | LLMError"]
"""By the number of a request, its answer, or why there is none."""


class BatchApi(ABC):
    """The batches of one kind of endpoint.

    Args:
        http: the endpoint.
        path: of its requests, after the base URL.
    """

    def __init__(self, http: HttpEndpoint, path: str) -> None:
        self.http = http
        self._path = path
        self._url = http.address + path

    @abstractmethod
    async def submit(self, bodies: Mapping[str, bytes]) -> str:
        """Send a batch of requests by number; return its name."""

    @abstractmethod
    async def look(self, batch: str) -> BatchAnswers | None:
        """Return the answers of a batch; None while it is being answered."""

    @abstractmethod
    async def cancel(self, batch: str) -> None:
        """Stop a batch."""

    async def _ask(self, method: str, path: str, body: bytes | None = None, kind: str = "application/json") -> Any:
        """Return what an endpoint answers, or raise an `LLMError`."""
        answer = await self._bytes(method, path, body, kind)
        try:
            said = from_json(answer)
        except ValueError:
            said = None
        if not isinstance(said, dict):
            raise MalformedCompletion(f"{self.http.address}{path} answered with no object of JSON")
        return said

    async def _bytes(self, method: str, path: str, body: bytes | None = None, kind: str = "application/json") -> bytes:
        answer = await self.http.send(method, path, body, kind)
        if answer.status != OK:
            raise answer.error
        return answer.body


class OpenAIBatches(BatchApi):
    """OpenAI's: a file of requests, a batch, and files of answers and errors."""

    _ENDED: ClassVar = frozenset({"completed", "failed", "expired", "cancelled"})

    async def submit(self, bodies: Mapping[str, bytes]) -> str:
        """See `BatchApi`."""
        head = b'{"custom_id": "%s", "method": "POST", "url": "/v1%s", "body": %s}'
        path = self._path.encode()
        lines = b"\n".join(head % (number.encode(), path, body) for number, body in bodies.items())
        form = _form({"purpose": b"batch"}, lines)
        file = await self._ask("POST", "/files", form, f"multipart/form-data; boundary={_BOUNDARY}")
        asked = {
            "input_file_id": _name(file),
            "endpoint": f"/v1{self._path}",
            "completion_window": "24h",
        }
        return _name(await self._ask("POST", "/batches", to_json(asked)))

    async def look(self, batch: str) -> BatchAnswers | None:
        """See `BatchApi`."""
        said = await self._ask("GET", f"/batches/{batch}")
        if said.get("status") not in self._ENDED:
            return None
        if said["status"] == "failed":
            errors = said.get("errors")
            first = next(iter(errors.get("data") or ()), None) if isinstance(errors, dict) else None
            raise _no_answer(f"the batch {batch} failed: {fault_of(first or {'message': 'no reason given'}).message}")
        answers: BatchAnswers = {}
        for file in (said.get("output_file_id"), said.get("error_file_id")):
            if isinstance(file, str):
                for line in _lines(await self._bytes("GET", f"/files/{file}/content")):
                    answers |= self._read(line)
        return answers

    async def cancel(self, batch: str) -> None:
        """See `BatchApi`."""
        await self._ask("POST", f"/batches/{batch}/cancel", b"{}")

    def _read(self, line: Mapping[str, Any]) -> BatchAnswers:
        number = str(line.get("custom_id"))
        response = line.get("response")
        if isinstance(response, dict) and isinstance(status := response.get("status_code"), int):
            return {number: HttpAnswer(self._url, status, {}, to_json(response.get("body")))}
        why = fault_of(line["error"]).message if is_error(line.get("error")) else "it has no answer"
        return {number: _no_answer(why)}


class AnthropicBatches(BatchApi):
    """Anthropic's: a list of requests, and lines of results."""

    async def submit(self, bodies: Mapping[str, bytes]) -> str:
        """See `BatchApi`."""
        asked = (b'{"custom_id": "%s", "params": %s}' % (number.encode(), body) for number, body in bodies.items())
        return _name(await self._ask("POST", f"{self._path}/batches", b'{"requests": [%s]}' % b", ".join(asked)))

    async def look(self, batch: str) -> BatchAnswers | None:
        """See `BatchApi`."""
        said = await self._ask("GET", f"{self._path}/batches/{batch}")
        if said.get("processing_status") != "ended":
            return None
        answers: BatchAnswers = {}
        for line in _lines(await self._bytes("GET", f"{self._path}/batches/{batch}/results")):
            result = line.get("result")
            answers[str(line.get("custom_id"))] = self._read(result if isinstance(result, dict) else {})
        return answers

    async def cancel(self, batch: str) -> None:
        """See `BatchApi`."""
        await self._ask("POST", f"{self._path}/batches/{batch}/cancel", b"{}")

    def _read(self, result: Mapping[str, Any]) -> HttpAnswer | LLMError:
        match result.get("type"):
            case "succeeded":
                return HttpAnswer(self._url, OK, {}, to_json(result.get("message")))
            case "errored":
                body = result.get("error")
                inner = body.get("error") if isinstance(body, dict) else None
                return HttpAnswer(self._url, fault_of(inner).status or 500, {}, to_json(body))
            case kind:
                return _no_answer(f"its request is {kind or 'without a result'}")


@dataclass(eq=False, slots=True)
class _Call:
    """A call that waits for its answer.

    Attributes:
        journey: of its batch; None until that leaves.
    """

    body: bytes
    delivery: Departure
    answer: asyncio.Future[HttpAnswer]
    journey: _Journey | None = None


@dataclass(eq=False, slots=True)
class _Journey:
    """A batch on its way."""

    calls: Sequence[_Call]
    task: asyncio.Task[None] | None = field(default=None)


class Batcher:
    """The batches of one model at one endpoint, of all clients in an event loop.

    Args:
        api: of the endpoint.
        quiet_s, look_s: as `QUIET_S` and `FIRST_LOOK_S`.
    """

    def __init__(self, api: BatchApi, *, quiet_s: float = QUIET_S, look_s: float = FIRST_LOOK_S) -> None:
        self._api = api
        self._quiet_s = quiet_s
        self._look_s = look_s
        self._waiting: list[_Call] = []
        self._timer: asyncio.TimerHandle | None = None
        self._journeys: set[asyncio.Task[None]] = set()

    async def post(self, body: bytes, delivery: Departure) -> HttpAnswer:
        """Return the answer to a request, once its batch has been answered.

        Raises:
            LLMError: there is none.
        """
        delivery.left = False
        call = _Call(body, delivery, asyncio.get_running_loop().create_future())
        self._waiting.append(call)
        self._wait_for_quiet()
        try:
            return await call.answer
        except asyncio.CancelledError:
            self._leave(call)
            raise

    async def settle(self) -> None:
        """Wait until the batches that every call has left are cancelled at the endpoint."""
        left = [task for task in self._journeys if task.cancelling()]
        if left:
            await asyncio.wait(left, timeout=GOODBYE_S)

    def _wait_for_quiet(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if len(self._waiting) >= FULL:
            self._depart()
        elif self._waiting:
            self._timer = asyncio.get_running_loop().call_later(self._quiet_s, self._depart)

    def _depart(self) -> None:
        journey = _Journey(tuple(self._waiting))
        self._waiting.clear()
        self._timer = None
        for call in journey.calls:
            call.journey = journey
        journey.task = asyncio.create_task(self._travel(journey.calls), name="batch")
        self._journeys.add(journey.task)
        journey.task.add_done_callback(self._journeys.discard)

    def _leave(self, call: _Call) -> None:
        if call.journey is None:
            if call in self._waiting:
                self._waiting.remove(call)
                self._wait_for_quiet()
        elif call.journey.task is not None and all(other.answer.done() for other in call.journey.calls):
            call.journey.task.cancel()

    async def _travel(self, calls: Sequence[_Call]) -> None:
        """Send a batch, wait for its answers, and give each call its own."""
        for call in calls:
            call.delivery.left = True
        numbers = {f"request-{place}": call for place, call in enumerate(calls)}
        submitting = asyncio.create_task(self._api.submit({number: call.body for number, call in numbers.items()}))
        try:
            batch = await asyncio.shield(submitting)
            log.info("batch %s: %d requests are sent", batch, len(calls))
            answers = await self._wait(batch)
        except asyncio.CancelledError:
            await self._cancel(submitting)
            raise
        except LLMError as error:
            for call in calls:
                _deliver(call, _again(error))
        else:
            log.info("batch %s: %d of %d requests are answered", batch, len(answers), len(calls))
            for number, call in numbers.items():
                _deliver(call, answers.get(number) or _no_answer("the batch has no answer to it"))
        finally:
            if len(self._journeys) <= 1 and not self._waiting:
                await self._api.http.close()

    async def _wait(self, batch: str) -> BatchAnswers:
        """Return the answers of a batch. An endpoint that is away for a while answers later."""
        pause_s = self._look_s
        while True:
            await asyncio.sleep(pause_s)
            pause_s = min(1.5 * pause_s, LONGEST_LOOK_S)
            try:
                answers = await self._api.look(batch)
            except LLMError as error:
                if not error.retryable or error.status == EXPIRED:
                    raise
                log.info("batch %s: %s", batch, error)
                continue
            if answers is not None:
                return answers

    async def _cancel(self, submitting: asyncio.Task[str]) -> None:
        with suppress(LLMError, TimeoutError):
            async with asyncio.timeout(GOODBYE_S):
                batch = await submitting
                await self._api.cancel(batch)
                log.info("batch %s: cancelled", batch)


EXPIRED: Final = "batch"
"""The status of a request whose batch has no answer to it. Such a request is not billed."""
_batchers: WeakKeyDictionary[asyncio.AbstractEventLoop, dict[Hashable, Batcher]] = WeakKeyDictionary()


def batcher_for(account: Hashable, make: Callable[[], Batcher]) -> Batcher:
    """Return the batcher of a model, an endpoint and a key in the running event loop; it is made if there is none."""
    batchers = _batchers.setdefault(asyncio.get_running_loop(), {})
    if account not in batchers:
        batchers[account] = make()
    return batchers[account]


def _deliver(call: _Call, said: HttpAnswer | LLMError) -> None:
    if call.answer.done():  # it has left
        return
    if isinstance(said, LLMError):
        call.answer.set_exception(said)
    else:
        call.answer.set_result(said)


def _again(error: LLMError) -> LLMError:
    """Return an error of its own for each call, with the same words."""
    copy = error.__class__.__new__(error.__class__)
    copy.__dict__.update(error.__dict__)
    copy.args = error.args
    return copy


def _no_answer(why: str) -> LLMError:
    error = EndpointUnavailable(why, status=EXPIRED)
    error.may_be_billed = False
    return error


def _name(said: Mapping[str, Any]) -> str:
    """Return the name of what was made at an endpoint, or raise an `LLMError`."""
    name = said.get("id")
    if not isinstance(name, str):
        raise MalformedCompletion("a batch was sent, and the endpoint does not say its name")
    return name


def _lines(body: bytes) -> Iterator[Mapping[str, Any]]:
    """Yield the objects of lines of JSON, without those that are none."""
    for line in body.splitlines():
        with suppress(ValueError):
            said = from_json(line)
            if isinstance(said, dict):
                yield said


def _form(fields: Mapping[str, bytes], file: bytes) -> bytes:
    """Return a form with fields and a file, in parts."""
    part = b"--%s\r\nContent-Disposition: form-data; name=%s\r\n\r\n%s\r\n"
    boundary = _BOUNDARY.encode()
    parts = [part % (boundary, b'"%s"' % name.encode(), value) for name, value in fields.items()]
    parts.append(part % (boundary, b'"file"; filename="khala.jsonl"', file))
    return b"".join(parts) + b"--%s--\r\n" % boundary
