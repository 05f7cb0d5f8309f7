"""Which models were asked, and what that took."""

from __future__ import annotations

from dataclasses import dataclass


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
    """US dollars of the requests whose price is known; null if no price is known."""
