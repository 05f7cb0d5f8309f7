"""Which models were asked, and what that took."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_sc2.experiment.measures.evidence import CallGlance, SideStep


@dataclass(frozen=True, kw_only=True)
class Spending:
    """Models, tokens and money. Values of several agents are sorted, and joined by `; `."""

    models: str
    """Names of the models, as they were asked for; empty if no request was recorded."""
    answered_by: str
    """Names of the models that answered, as their endpoints call them; empty if none said."""
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
    """US dollars of the requests whose price is known, as the result has them; None if no price is known."""
    paid_usd: float | None
    """The most that the endpoints charged: the same with requests whose answers came too late for any report, and with
    the most that those of unknown usage may have cost."""


class SpendingTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._models: set[str] = set()
        self._answered_by: set[str] = set()
        self._endpoints: set[str] = set()
        self._params: set[str] = set()
        self._reported: dict[str, Usage] = defaultdict(Usage)
        self._paid_usd: dict[str, float] = defaultdict(float)
        """By agent, what its recorded requests cost."""

    def call(self, call: CallGlance) -> None:
        """Take in a request to a model."""
        self._models.add(call.model)
        self._answered_by.add(call.answered_by)
        self._endpoints.add(call.endpoint)
        self._params.add(", ".join(f"{name}={value}" for name, value in sorted(call.params.items())))
        if (most_usd := _most_usd(call.usage)) is not None:
            self._paid_usd[call.agent] += most_usd

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        for agent in step.report.agents:
            self._reported[agent.agent] += agent.usage

    def total(self) -> Spending:
        """Return the group."""
        usage = sum(self._reported.values(), Usage())
        return Spending(
            models=_join(self._models),
            answered_by=_join(self._answered_by),
            endpoints=_join(self._endpoints),
            params=_join(self._params),
            requests=usage.requests,
            unknown_requests=usage.unknown_requests,
            prompt_tokens=usage.prompt_tokens,
            completion_tokens=usage.completion_tokens,
            cached_tokens=usage.cached_tokens,
            reasoning_tokens=usage.reasoning_tokens,
            images=usage.images,
            cost_usd=usage.cost_usd,
            paid_usd=self._paid(),
        )

    def _paid(self) -> float | None:
        """Return what was paid for all agents; the larger sum counts for each, as in `khala_sc2.playing.spending`."""
        paid = dict(self._paid_usd)
        for agent, usage in self._reported.items():
            if (most_usd := _most_usd(usage)) is not None:
                paid[agent] = max(paid.get(agent, 0.0), most_usd)
        return sum(paid.values()) if paid else None


def _most_usd(usage: Usage) -> float | None:
    known = [usd for usd in (usage.cost_usd, usage.unknown_usd) if usd is not None]
    return sum(known) if known else None


def _join(texts: Iterable[str]) -> str:
    return "; ".join(sorted(text for text in texts if text))
