"""The price of tokens: what a model file says, or else the list price of the model at its provider.

List prices stand in `prices.yaml` beside this module, each with its source and the day on which it was read there. They
are of a model at its provider's own address: a gateway may charge anything for the same name.
"""

from __future__ import annotations

import re
from datetime import date  # noqa: TC003  # pydantic evaluates it
from functools import cache
from importlib.resources import files
from urllib.parse import urlsplit

import yaml
from pydantic import Field, TypeAdapter

from khala_protocol.errors import ConfigError
from khala_protocol.messages import Frozen

PER_MILLION = 1e-6
_DATED = re.compile(r"-(\d{4}-\d{2}-\d{2}|\d{8}|\d{4})$")
"""The end of a name under which a provider keeps one version of a model."""


class Prices(Frozen):
    """Prices of one model in US dollars per million tokens; None for an unknown price."""

    prompt: float | None = Field(default=None, ge=0)
    completion: float | None = Field(default=None, ge=0)
    cached: float | None = Field(default=None, ge=0)
    """Prompt tokens that the provider had in its cache; the price of `prompt` if not given."""
    cache_write: float | None = Field(default=None, ge=0)
    """Prompt tokens that it put into its cache; the price of `prompt` if not given."""

    @property
    def in_batch(self) -> Prices:
        """The prices in a batch."""
        return Prices(**{name: None if usd is None else usd / 2 for name, usd in self})

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

    def most_usd(self, *, prompt: float, completion: int) -> float | None:
        """Return the price of a request if its whole prompt has the highest price; None if a price is not known."""
        if self.prompt is None or self.completion is None:
            return None
        dearest = max(self.prompt, _or(self.cached, self.prompt), _or(self.cache_write, self.prompt))
        return (prompt * dearest + completion * self.completion) * PER_MILLION


class Listed(Frozen):
    """The list prices of one provider."""

    hosts: tuple[str, ...]
    """Of its addresses."""
    source: str
    read: date
    """The day on which the source said so."""
    models: dict[str, Prices]
    """By the provider's own name of the model, without the date of a version."""


def price_of(model: str, base_url: str) -> Prices:
    """Return the list price of a model at an address; unknown prices if the table has none."""
    host = urlsplit(base_url).hostname or ""
    for provider in list_prices().values():
        if host in provider.hosts:
            return provider.models.get(model) or provider.models.get(_DATED.sub("", model)) or Prices()
    return Prices()


def check_priced(prices: Prices, model: str, base_url: str) -> None:
    """Check that a budget can be kept with a model.

    Raises:
        ConfigError: its price is not known.
    """
    if not prices.known:
        raise ConfigError(
            f"a budget needs the price of {model} at {urlsplit(base_url).netloc}, and no price is known: write "
            "`prices: {prompt: …, completion: …}` into its model file, in US dollars per million tokens; 0 for a model "
            "of your own"
        )


@cache
def list_prices() -> dict[str, Listed]:
    """Return the table of list prices, by provider."""
    text = files(__package__).joinpath("prices.yaml").read_text(encoding="utf-8")
    return TypeAdapter(dict[str, Listed]).validate_python(yaml.safe_load(text))


def _or(price: float | None, usual: float) -> float:
    return usual if price is None else price
