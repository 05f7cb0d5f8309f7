"""What travels between `khala serve` and those who use it; `khala_protocol.keys` has the keys.

A client sends an order under a number that it made itself, again and again until the list of matches shows what became
of it: the second time, the order changes nothing. The list is a state, so that a client which comes late has it at
once. Here a match is plain data: only the service knows what is in it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from khala_protocol.errors import MalformedMessage
from khala_protocol.keys import SERVICE
from khala_protocol.messages import Count, Frozen, Wire

MAX_ORDER_BYTES = 256 * 1024
"""The largest shipped task has 20 kB; longer orders are refused unread."""
MAX_WORDS = 500
"""Longest reason, in characters."""

MatchState = Literal[
    "queued",
    "running",
    "done",  # played to its end
    "failed",  # it could not be played
    "stopped",  # by an order, or because the service ended
    "refused",  # it was not taken
]
OPEN: frozenset[MatchState] = frozenset({"queued", "running"})


class Submit(Wire):
    """Client → service: play a match."""

    kind: Literal["submit"] = "submit"
    number: str
    """Of the order; the same order has the same number."""
    owner: str = Field(default="", max_length=64)
    """Who wants it: matches of different owners take turns."""
    match: dict[str, Any] = Field(default={})
    """A `khala_orchestrator.config.MatchConfig`; that of its recording if it is resumed."""
    minds: dict[str, Any] = Field(default={})
    """A `khala_sc2.playing.minds.Minds`: how the agents decide."""
    sides: dict[str, str] = Field(default={})
    """By side, the model or policy of agents that decide otherwise, as `khala run --side-model` takes it."""
    resume: bool = False
    """Whether to go on with the newest recording that the service has of this run."""


class Stop(Wire):
    """Client → service: end a match; its recording stays, and can be resumed."""

    kind: Literal["stop"] = "stop"
    number: str


class MatchCard(Frozen):
    """One match of the service."""

    run: str
    number: str
    """Of the order that it was asked for with."""
    owner: str = ""
    task: str
    state: MatchState
    reason: str = Field(default="", max_length=MAX_WORDS)
    """Why it failed, was stopped or was not taken."""
    episode: Count = 0
    step: Count = 0
    """Steps of the episode that were played."""
    episodes: Count = 1
    outcomes: tuple[str, ...] = ()
    """Of the episodes that are over, side by side."""
    cost_usd: float = 0.0
    rss_mb: Count = 0
    """Memory of all its processes."""
    starts: Count = 0
    """How often a worker began to play it; more than one if one was lost."""
    recording: str = ""
    """The directory where the service has its recordings and logs."""


class Matches(Wire):
    """Service → all: every match that it has, the newest last, and some that are over."""

    kind: Literal["matches"] = "matches"
    run: str = SERVICE
    matches: tuple[MatchCard, ...] = ()
    draining: bool = False
    """Whether it takes no more matches."""


Order = Submit | Stop
_ORDER: TypeAdapter[Order] = TypeAdapter(Annotated[Order, Field(discriminator="kind")])


def decode_order(payload: bytes) -> Order:
    """Return the order of these bytes.

    Raises:
        MalformedMessage: it is none, or longer than `MAX_ORDER_BYTES`.
    """
    if len(payload) > MAX_ORDER_BYTES:
        raise MalformedMessage(f"an order of {len(payload)} bytes is too long: it may have {MAX_ORDER_BYTES}")
    try:
        return _ORDER.validate_json(payload)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))[:100]
        raise MalformedMessage(f"no order: {place}: {first['msg'][:200]}") from None
