"""Which models were asked, and what that took."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala.experiment.measures.evidence import CallGlance, Step


@dataclass(frozen=True, kw_only=True)
class Spending:
    """Models, tokens and money. Values of several agents are sorted, and joined by `; `."""

    models: str
    """Names of the models, as their endpoints call them; empty if no request was recorded."""
    endpoints: str
    """Base URLs of their endpoints."""
    params: str
    """Parameters of the requests, `max_tokens=800, temperature=0`; one set for each that was used."""
    requests: int
    """Requests to models, repeated ones among them."""
    unknown_requests: int
    """Of these: cancelled or failed, so that their tokens are unknown."""
    prompt_tokens: int
    """Tokens read."""
    completion_tokens: int
    """Tokens written."""
    cached_tokens: int
    """Of `prompt_tokens`: found in the provider's cache."""
    reasoning_tokens: int
    """Of `completion_tokens`: reasoning."""
    images: int
    """Pictures sent along."""
    cost_usd: float | None
    """US dollars of the requests whose price is known, as the result has them; null if no price is known."""
    paid_usd: float | None
    """The same with requests whose answers came too late for any report: what the endpoints charged."""


class SpendingTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._models: set[str] = set()
        self._endpoints: set[str] = set()
        self._params: set[str] = set()
        self._reported: dict[str, Usage] = defaultdict(Usage)
        self._called: dict[str, Usage] = defaultdict(Usage)

    def call(self, call: CallGlance) -> None:
        """Take in a request to a model."""
        self._models.add(call.model)
        self._endpoints.add(call.endpoint)
        self._params.add(", ".join(f"{name}={value}" for name, value in sorted(call.params.items())))
        self._called[call.agent] += call.usage

    def add(self, step: Step) -> None:
        """Take in a step."""
        for agent in step.report.agents:
            self._reported[agent.agent] += agent.usage

    def total(self) -> Spending:
        """Return the group."""
        usage = sum(self._reported.values(), Usage())
        return Spending(
            models=_joined(self._models),
            endpoints=_joined(self._endpoints),
            params=_joined(self._params),
            requests=usage.requests,
            unknown_requests=usage.unknown_requests,
            prompt_tokens=usage.prompt_tokens,
            completion_tokens=usage.completion_tokens,
            cached_tokens=usage.cached_tokens,
            reasoning_tokens=usage.reasoning_tokens,
            images=usage.images,
            cost_usd=usage.cost_usd,
            paid_usd=self._paid_usd(),
        )

    def _paid_usd(self) -> float | None:
        """Return the sum over the agents of what was paid for each: see `khala.minds.spent_usd`."""
        both = [(self._called[name], self._reported[name]) for name in {*self._called, *self._reported}]
        costs = [[one.cost_usd for one in pair if one.cost_usd is not None] for pair in both]
        return sum(max(known) for known in costs if known) if any(costs) else None


def _joined(texts: Iterable[str]) -> str:
    return "; ".join(sorted(text for text in texts if text))
