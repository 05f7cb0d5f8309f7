"""Limits of endpoints on a Ray cluster: one actor for each endpoint, at which the agents of all matches wait.

`_Endpoints` makes the actors, so that all of them end with the runner, whose actor it is. They live on the runner's
node: no other node takes them with it when it dies. `khala_agents.llm.limits` says how they let requests through.
"""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import ray
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from khala_agents.llm.client import LimitExceeded
from khala_agents.llm.limits import LimitRules, Turns, own_turns

if TYPE_CHECKING:
    from khala_agents.llm.client import LimitType
    from khala_agents.llm.limits import Gates, RequestGate

LEASE_S = 600.0
"""Then a request has lost its place: the node that made it is dead, as no try takes so long."""
MOST_WAITING = 10_000


@dataclass(frozen=True, slots=True)
class LimitRefusal:
    """A `LimitExceeded` as data: Ray would wrap the error."""

    kind: LimitType
    value: float
    limit: float
    source: str


class SharedTurns:
    """The gate of one endpoint, for processes that may die with a request in flight."""

    def __init__(self, rules: LimitRules, source: str) -> None:
        self._turns = Turns(rules, source=source)

    async def enter(self, tokens: int, patience_s: float | None) -> int | LimitRefusal:
        """Return the place of a request, or why it gets none."""
        try:
            place = await self._turns.enter(tokens, patience_s)
        except LimitExceeded as error:
            return LimitRefusal(error.type, error.value, error.limit, error.source)
        asyncio.get_running_loop().call_later(LEASE_S, self._turns.leave, place, 0)
        return place

    async def leave(self, place: int, more_tokens: int) -> None:
        """See `Gate.leave`."""
        self._turns.leave(place, more_tokens)


class _Endpoints:
    """Has an actor for each endpoint."""

    def __init__(self) -> None:
        self._turns: dict[str, Any] = {}

    def turns(self, endpoint: str, rules: LimitRules, source: str) -> Any:
        """Return the actor of an endpoint."""
        if endpoint not in self._turns:
            here = ray.get_runtime_context().get_node_id()
            self._turns[endpoint] = _actor(SharedTurns, here, max_concurrency=MOST_WAITING).remote(rules, source)
        return self._turns[endpoint]


class _RemoteGate:
    """The gate of an endpoint, as the process of a match has it."""

    def __init__(self, turns: Any) -> None:
        self._coming = turns
        self._turns: Any = None

    async def enter(self, tokens: int, patience_s: float | None) -> int:
        """See `Gate.enter`."""
        if self._turns is None:
            self._turns = await self._coming
        asked = self._turns.enter.remote(tokens, patience_s)
        try:
            answer: int | LimitRefusal = await asked
        except asyncio.CancelledError:
            ray.cancel(asked)
            raise
        if isinstance(answer, LimitRefusal):
            refused = asdict(answer)
            raise LimitExceeded(refused.pop("kind"), **refused)
        return answer

    def leave(self, place: int, more_tokens: int) -> None:
        """See `Gate.leave`."""
        assert self._turns is not None
        self._turns.leave.remote(place, more_tokens)


def endpoints() -> Any:
    """Return an actor on this node that has the gates of all endpoints."""
    return _actor(_Endpoints, ray.get_runtime_context().get_node_id()).remote()


def gates_at(actor: Any) -> Gates:
    """Return how a match gets its gates; an endpoint without limits has its own."""

    def gate(endpoint: str, rules: LimitRules, source: str) -> RequestGate:
        if rules == LimitRules():
            return own_turns(endpoint, rules, source)
        return _RemoteGate(actor.turns.remote(endpoint, rules, source))

    return gate


def _actor(kind: type, node: str, **options: Any) -> Any:
    here = NodeAffinitySchedulingStrategy(node, soft=False)
    return ray.remote(kind).options(num_cpus=0, scheduling_strategy=here, **options)
