"""The price of tokens. Prices come from model files, because a table here would soon be out of date."""

from __future__ import annotations

from pydantic import Field

from khala_protocol.messages import Frozen

PER_MILLION = 1e-6


class Prices(Frozen):
    """Prices of one model in US dollars per million tokens; None for an unknown price."""

    prompt: float | None = Field(default=None, ge=0)
    completion: float | None = Field(default=None, ge=0)
    cached: float | None = Field(default=None, ge=0)
    """Prompt tokens that the provider had in its cache; the price of `prompt` if not given."""
    cache_write: float | None = Field(default=None, ge=0)
    """Prompt tokens that it put into its cache; the price of `prompt` if not given."""

    @property
    def known(self) -> bool:
        """Whether a request can be priced."""
        return self.prompt is not None and self.completion is not None

    def cost_usd(self, *, prompt: int, completion: int, cached: int = 0, cache_write: int = 0) -> float | None:
        """Return the price of one request; None if a price is not known.

        Args:
            prompt: tokens of the prompt.
            completion: tokens of the answer.
            cached: those of `prompt` that the provider had in its cache.
            cache_write: those of `prompt` that it put there.
        """
        if self.prompt is None or self.completion is None:
            return None
        fresh = prompt - cached - cache_write
        kept = cached * _or(self.cached, self.prompt) + cache_write * _or(self.cache_write, self.prompt)
        return (fresh * self.prompt + kept + completion * self.completion) * PER_MILLION


def _or(price: float | None, usual: float) -> float:
    return usual if price is None else price
