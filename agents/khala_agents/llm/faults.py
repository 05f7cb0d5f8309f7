"""What an endpoint says went wrong, and the error that it is: by HTTP status, or by the words of a body.

Errors also come with "200 OK": gateways do it, and servers that do not know the address that was asked. Their code, or
the name of their kind, then says what the status would have been. Texts of a server are quoted on one line, without
keys. Above it are the clients of all APIs.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urljoin

from pydantic_core import from_json, to_json

from khala_agents.llm.address import base_of, is_versioned
from khala_agents.llm.client import (
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    RequestRefused,
    Unauthorized,
)
from khala_agents.llm.retry import is_retried
from khala_agents.secret import excerpt

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.llm.verdict import Verdict

_LONGEST_MESSAGE = 400
_BOM = b"\xef\xbb\xbf"
_SPENT: Final = frozenset(
    {"insufficient_quota", "billing_hard_limit_reached", "billing_not_active", "enforced_spend_limit_reached"}
)
"""Codes under which "429 Too Many Requests" means that the account has no money left."""
_NO_CREDIT = re.compile(r"credit balance is too low|insufficient (?:credit|balance|funds)", re.IGNORECASE)
_NO_KEY = re.compile(r"api[ _]key (?:is )?(?:not valid|invalid)|API_KEY_INVALID|invalid_api_key", re.IGNORECASE)
_SPENT_ON_THOUGHTS = re.compile(r"could not finish the message because max_tokens", re.IGNORECASE)
_NO_SUCH_PATH = re.compile(
    r"unexpected endpoint|(?:unknown|invalid|no such) (?:endpoint|path|route|url)", re.IGNORECASE
)
_STREAM = re.compile(rb"\s*(?:event|data|id|retry)?:")
_STATUS: Final[tuple[tuple[re.Pattern[str], int], ...]] = tuple(
    (re.compile(pattern, re.IGNORECASE), status)
    for pattern, status in (
        (r"rate_?limit|too_many_requests|resource_exhausted|throttl", 429),
        (r"overloaded", 529),
        (r"unavailable|no_capacity", 503),
        (r"timeout|timed_out|deadline_exceeded", 504),
        (r"authentication|invalid_api_key|unauthori[sz]ed|unauthenticated", 401),
        (r"permission|forbidden", 403),
        (r"billing|payment|insufficient_(?:quota|balance|funds)", 402),
        (r"not_?found|does_not_exist", 404),
        (r"too_large", 413),
        (r"invalid_request|invalid_argument|bad_?request|context_length|content_filter|unsupported", 400),
        (r"server_error|internal|^api_error$|upstream|provider", 500),
    )
)
"""HTTP statuses by the names that endpoints give to kinds of errors; the first that fits."""


@dataclass(frozen=True, slots=True)
class EndpointFault:
    """What an error body says.

    Attributes:
        status: the HTTP status that its code or kind stands for; None if nobody knows.
        names: its code and its kind, in the endpoint's words.
        message: its text, on one line.
        retry_after_s: the time to wait before the next try, if it says so.
    """

    status: int | None
    names: tuple[str, ...]
    message: str
    retry_after_s: float | None = None


def without_byte_order_mark(body: bytes) -> bytes:
    """Return a body without the mark of byte order that some gateways put in front of JSON."""
    return body.removeprefix(_BOM)


def fault_in(body: bytes) -> EndpointFault | None:
    """Return what an error body in a known form says; None for any other body."""
    try:
        said = from_json(without_byte_order_mark(body))
    except ValueError:
        return None
    if isinstance(said, list) and said:  # Gemini
        said = said[0]
    if not isinstance(said, dict):
        return None
    error = said.get("error")
    if not is_error(error) and "error" in (said.get("object"), said.get("type")):  # vLLM
        error = said
    return fault_of(error) if is_error(error) else None


def is_error(error: Any) -> bool:
    """Return whether the `error` of a body says anything; some send it empty beside good answers."""
    return any(error.values()) if isinstance(error, dict) else bool(error)


def fault_of(error: Any) -> EndpointFault:
    """Return what the `error` of a body says."""
    if not isinstance(error, dict):
        return EndpointFault(None, (), excerpt(str(error), _LONGEST_MESSAGE))
    told = [error.get(name) for name in ("code", "type", "status")]
    names = tuple(str(name) for name in told if isinstance(name, str | int) and not isinstance(name, bool))
    metadata = error.get("metadata")
    raw = metadata.get("raw") if isinstance(metadata, dict) else None  # OpenRouter: what its provider said
    message = ": ".join(str(part) for part in (error.get("message"), raw) if part) or to_json(error)
    return EndpointFault(_status(names), names, excerpt(message, _LONGEST_MESSAGE), _retry_delay_s(error))


def _retry_delay_s(error: Mapping[str, Any]) -> float | None:
    """Return the wait that Gemini asks for: `{"retryDelay": "34s"}` among the details."""
    details = error.get("details")
    said = (
        [detail.get("retryDelay") for detail in details if isinstance(detail, dict)]
        if isinstance(details, list)
        else []
    )
    return next((_number(delay.removesuffix("s")) for delay in said if isinstance(delay, str)), None)


def _status(names: tuple[str, ...]) -> int | None:
    numbers = [int(name) for name in names if re.fullmatch(r"[45]\d\d", name)]
    if numbers:
        return numbers[0]
    return next((status for name in names for pattern, status in _STATUS if pattern.search(name)), None)


def error_for(url: str, status: int, headers: Mapping[str, str], body: bytes) -> LLMError:
    """Return the error for an answer with this status; `url` is the address that was asked."""
    fault = fault_in(body)
    names, message = (fault.names, fault.message) if fault else ((), excerpt(body))
    name = f"http {status}"
    said = f"{url} answered {name}" + (f": {message}" if message else "")
    if 300 <= status < 400:
        return RequestRefused(_why_moved(url, name, headers), status=name)
    if status in {401, 403} or (status == 400 and _NO_KEY.search(" ".join((*names, message)))):
        return Unauthorized(f"{said}; is the key right, and may it use this model?", status=name)
    if status == 402 or not _SPENT.isdisjoint(names) or (status == 400 and _NO_CREDIT.search(message)):
        return OutOfMoney(f"{said}; the account has no money or quota left", status=name)
    if is_retried(status):
        wait_s = retry_after_s(headers)
        if wait_s is None and fault is not None:
            wait_s = fault.retry_after_s
        return EndpointUnavailable(said, status=name, retry_after_s=wait_s)
    return RequestRefused(said + (_without_version(url) if status in {404, 405} else ""), status=name)


def no_completion(url: str, body: bytes, what: str) -> LLMError:
    """Return the error for "200 OK" without a completion in it."""
    fault = fault_in(body)
    if fault is None and _STREAM.match(body):
        return MalformedCompletion(
            f"{url} answered in pieces (text/event-stream), and Khala reads whole answers: "
            "switch streaming off at the endpoint or gateway"
        )
    if fault is None:
        return MalformedCompletion(f"{url} answered with no {what}: {excerpt(body)!r}{_without_version(url)}")
    if fault.status is not None:
        return error_for(url, fault.status, {}, body)
    said = f"{url} answered with no {what}, but an error: {fault.message}"
    hint = _without_version(url)
    if hint or _NO_SUCH_PATH.search(fault.message):
        return RequestRefused(said + hint, status="http 200")
    return MalformedCompletion(said)


def broken_off(url: str, error: Any) -> LLMError:
    """Return the error for an answer that the endpoint itself says broke off; part of it may be billed."""
    message = fault_of(error).message if error else ""
    why = f": {message}" if message else ""
    return EndpointUnavailable(f"{url} broke its answer off{why}", status="broken off")


def verdict_of(status: int, body: bytes) -> tuple[Verdict, str] | None:
    """Return what became of an answer that is withheld with 400, and why; None for any other answer.

    A model worked for it, and may be billed, though its status says that the request was wrong.
    """
    fault = fault_in(body) if status == 400 else None
    if fault is None:
        return None
    if "content_filter" in fault.names or b"ResponsibleAIPolicyViolation" in body:
        return "filtered", f"a filter took the prompt: {fault.message}"
    if _SPENT_ON_THOUGHTS.search(fault.message):
        return (
            "cut",
            f"the model used all tokens on its reasoning: raise max_tokens in the model file ({fault.message})",
        )
    return None


def _why_moved(url: str, name: str, headers: Mapping[str, str]) -> str:
    place = headers.get("location")
    if not place:
        return f"{url} answered {name}: it has moved, and does not say where"
    there = excerpt(base_of(urljoin(url, place)), _LONGEST_MESSAGE)
    return f"{url} answered {name}: it has moved, and keys are not sent after it: set base_url to {there}"


def _without_version(url: str) -> str:
    """Return a hint if an address names no version."""
    return "" if is_versioned(url) else f"; most addresses end in /v1: try base_url {base_of(url)}/v1"


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the seconds that the headers `Retry-After-Ms` or `Retry-After` (seconds, or a date) ask to wait."""
    milliseconds = _number(headers.get("retry-after-ms", ""))
    if milliseconds is not None:
        return milliseconds / 1000
    value = headers.get("retry-after")
    if value is None:
        return None
    seconds = _number(value)
    if seconds is not None:
        return seconds
    try:
        until = parsedate_to_datetime(value)
        # by the server's own clock if it sends the time: ours may differ
        now = parsedate_to_datetime(headers["date"]) if "date" in headers else datetime.now(UTC)
        return max((until - now).total_seconds(), 0.0)
    except (ValueError, TypeError):
        return None


def _number(text: str) -> float | None:
    """Return a time that can be waited for; None for anything else, such as `nan`."""
    try:
        number = float(text)
    except ValueError:
        return None
    return max(number, 0.0) if math.isfinite(number) else None
