"""Limits that agents share: requests in flight, requests and tokens a minute, money.

    async with limits.admit(tokens=900, answer_tokens=1000, deadline=…) as ticket:
        completion = await client.complete(request)
        ticket.settle(completion.usage)

`admit` waits for its turn, in the order of arrival, and raises `LimitExceeded` where waiting is useless: the
money is used up, or the turn would come after the deadline. It knows no model and no HTTP. `khala_agents.llm.retry`
handles a provider's own limits; these keep an experiment below them, and within its budget (`khala_agents.llm.money`).

Requests wait at a `Gate`. That of a process is `Turns`; on a cluster, those of all processes wait at the same one.
"""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

from pydantic import Field

from khala_agents.llm.client import LimitExceeded, LimitType
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.window import TokenScale
from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from khala_agents.llm.pricing import Prices
    from khala_protocol.messages import Usage

LONGEST_ANSWER = 4_000
"""Tokens that an answer may have under a budget where the model file has no `max_tokens`: they can be paid."""


class LimitRules(Frozen):
    """Limits for one endpoint, shared by all agents of a process that use it; None for no limit.

    With `khala experiment run --on ray`, the agents of all matches share them.
    """

    in_flight: int | None = Field(default=None, ge=1)
    """Requests at the same time."""
    requests_per_minute: float | None = Field(default=None, gt=0)
    tokens_per_minute: float | None = Field(default=None, gt=0)
    """Prompt and completion together; the prompt's tokens are estimated before, and corrected after."""


class Bucket:
    """So many units a minute; after a pause, a minute's worth may be taken at once.

    Turns follow the order of the calls: each caller reserves its units at once, and then waits until
    they have flowed in.
    """

    def __init__(self, kind: LimitType, per_minute: float, *, source: str) -> None:
        self._kind = kind
        self._capacity = per_minute
        self._rate = per_minute / 60.0
        self._level = per_minute
        self._filled_at: float | None = None
        self._source = source

    async def take(self, units: float, deadline: float | None) -> None:
        """Take `units` as soon as they are there; return them if cancelled.

        Raises:
            LimitExceeded: they will not be there before `deadline`.
        """
        now = self._fill()
        wait_s = max(units - self._level, 0.0) / self._rate
        if deadline is not None and now + wait_s >= deadline:
            value = self._capacity - self._level + units
            raise LimitExceeded(self._kind, value=value, limit=self._capacity, source=self._source)
        self._level -= units
        if wait_s:
            try:
                await asyncio.sleep(wait_s)
            except asyncio.CancelledError:
                self._level += units
                raise

    def correct(self, units: float) -> None:
        """Take `units` more without waiting; negative units are returned."""
        self._level = min(self._level - units, self._capacity)

    def _fill(self) -> float:
        now = asyncio.get_running_loop().time()
        if self._filled_at is not None:
            self._level = min(self._level + (now - self._filled_at) * self._rate, self._capacity)
        self._filled_at = now
        return now


class RequestGate(Protocol):
    """Where the requests to one endpoint wait for their turn, in the order of their arrival."""

    async def enter(self, tokens: int, patience_s: float | None) -> int:
        """Wait for the turn of a request with a prompt of about `tokens`; return its place.

        Raises:
            LimitExceeded: its turn would not come in `patience_s`.
        """

    def leave(self, place: int, more_tokens: int) -> None:
        """Give the place to the next request; this one had so many tokens more, or less, than was said."""


class Turns:
    """The gate of one process."""

    def __init__(self, rules: LimitRules | None = None, *, source: str = "the model file") -> None:
        rules = rules or LimitRules()
        self._in_flight = asyncio.Semaphore(rules.in_flight) if rules.in_flight else None
        self._requests = _bucket("requests_per_minute", rules.requests_per_minute, source)
        self._tokens = _bucket("tokens_per_minute", rules.tokens_per_minute, source)
        self._inside: set[int] = set()
        self._last = 0

    async def enter(self, tokens: int, patience_s: float | None) -> int:
        """See `Gate.enter`."""
        deadline = None if patience_s is None else asyncio.get_running_loop().time() + patience_s
        if self._in_flight:
            await self._in_flight.acquire()
        try:
            await self._take_turn(tokens, deadline)
        except BaseException:
            if self._in_flight:
                self._in_flight.release()
            raise
        self._last += 1
        self._inside.add(self._last)
        return self._last

    def leave(self, place: int, more_tokens: int) -> None:
        """See `Gate.leave`; a place that was given back already stays so."""
        if place not in self._inside:
            return
        self._inside.remove(place)
        if self._tokens:
            self._tokens.correct(more_tokens)
        if self._in_flight:
            self._in_flight.release()

    async def _take_turn(self, tokens: int, deadline: float | None) -> None:
        if self._requests:
            await self._requests.take(1, deadline)
        if self._tokens:
            try:
                await self._tokens.take(tokens, deadline)
            except BaseException:
                if self._requests:
                    self._requests.correct(-1)
                raise


Gates: TypeAlias = "Callable[[str, LimitRules, str], RequestGate]"
"""Makes the gate of an endpoint: from its name, its rules, and where they stand."""


def own_turns(_: str, rules: LimitRules, source: str) -> RequestGate:
    """Return a gate for this process alone."""
    return Turns(rules, source=source)


@dataclass(slots=True)
class Ticket:
    """The right to make one request.

    Attributes:
        waited_s: how long the request waited for its turn.
        most_usd: what it may cost at most; None if no price is known.
        usage: the usage of the request, once settled; None for one that failed or was cancelled.
    """

    waited_s: float
    most_usd: float | None = None
    usage: Usage | None = None

    def settle(self, usage: Usage) -> None:
        """Note the usage of the request."""
        self.usage = usage


class RequestLimits:
    """The limits of one endpoint: its gate, and the money of those who ask it.

    Args:
        rules: of the endpoint.
        prices: of its model.
        budget: what may be spent; shared with the limits of other endpoints.
        gate: in place of one by the rules.

    Attributes:
        budget: what may be spent.
        scale: tokens of the model for each that was estimated.
    """

    def __init__(
        self,
        rules: LimitRules | None = None,
        *,
        prices: Prices | None = None,
        budget: SharedBudget | None = None,
        gate: RequestGate | None = None,
    ) -> None:
        self.budget = budget or SharedBudget(None)
        self._prices = prices
        self._gate = gate or Turns(rules)
        self.scale = TokenScale()

    @asynccontextmanager
    async def admit(self, *, tokens: int, answer_tokens: int | None, deadline: float | None) -> AsyncIterator[Ticket]:
        """Wait until one request may be made, and book what it costs.

        A request that is not settled (failed, cancelled), or of unknown usage, counts with the most that it may cost:
        an answer may have been generated and billed.

        Args:
            tokens: the estimated tokens of the prompt.
            answer_tokens: the limit of generated tokens.
            deadline: until when it is worth waiting, on the clock of the running loop; None for ever.

        Raises:
            LimitExceeded: it may not be made, or not before `deadline`.
        """
        clock = asyncio.get_running_loop().time
        arrived = clock()
        if most_usd := self._most_usd(tokens, answer_tokens):
            self.budget.check()
        expected = round(tokens * self.scale.factor)
        place = await self._gate.enter(expected, None if deadline is None else deadline - arrived)
        ticket = Ticket(clock() - arrived, most_usd)
        try:
            async with self.budget.holding(ticket.most_usd or 0.0, deadline) as bill:
                try:
                    yield ticket
                finally:
                    if ticket.usage is not None and not ticket.usage.unknown_requests:
                        bill.settle(ticket.usage.cost_usd or 0.0)
                        self.scale.learn_from(ticket.usage, tokens)
        finally:
            self._gate.leave(place, _more_tokens(ticket.usage, expected))

    def _most_usd(self, tokens: int, answer_tokens: int | None) -> float | None:
        """Return the price of the longest prompt of about `tokens` and of the longest answer; None if not known."""
        longest = LONGEST_ANSWER if answer_tokens is None else answer_tokens
        return self._prices.most_usd(prompt=self.scale.most(tokens), completion=longest) if self._prices else None


def _more_tokens(usage: Usage | None, estimated: int) -> int:
    if usage is None or usage.unknown_requests:
        return 0
    return usage.prompt_tokens + usage.completion_tokens - estimated


def _bucket(kind: LimitType, per_minute: float | None, source: str) -> Bucket | None:
    return None if per_minute is None else Bucket(kind, per_minute, source=source)
