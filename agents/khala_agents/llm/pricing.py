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

    @property
    def known(self) -> bool:
        """Whether a request can be priced."""
        return self.prompt is not None and self.completion is not None

    def cost_usd(self, *, prompt: int, completion: int, cached: int = 0) -> float | None:
        """Return the price of one request; `cached` tokens are a part of `prompt`. None if a price is not known."""
        if self.prompt is None or self.completion is None:
            return None
        cached_price = self.prompt if self.cached is None else self.cached
        fresh = prompt - cached
        return (fresh * self.prompt + cached * cached_price + completion * self.completion) * PER_MILLION
