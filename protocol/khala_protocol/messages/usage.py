"""What requests to a model cost, in tokens, money and time."""

from __future__ import annotations

from pydantic import Field

from khala_protocol.messages.base import MOST, Count, Frozen


class Usage(Frozen):
    """The usage of requests to a model. Sums with `+`, and no sum is more than `MOST`."""

    requests: Count = 0
    prompt_tokens: Count = 0
    completion_tokens: Count = 0
    cached_tokens: Count = 0
    """The part of `prompt_tokens` that the provider had in its cache."""
    cache_write_tokens: Count = 0
    """The part of `prompt_tokens` that the provider put into its cache."""
    reasoning_tokens: Count = 0
    """The part of `completion_tokens` that was reasoning."""
    cost_usd: float | None = Field(default=None, ge=0, le=MOST)
    """None if no price is known for the model."""
    unknown_requests: Count = 0
    """Requests that were cancelled or failed, whose tokens are unknown."""
    unknown_usd: float | None = Field(default=None, ge=0, le=MOST)
    """The most that these may have cost; None if no price is known for the model."""
    shortened_requests: Count = 0
    """Requests whose prompt was shortened to fit the model's context."""
    left_out: dict[str, int] = {}
    """By part of a prompt: from how many of these requests it was left out."""
    images: Count = 0
    """Number of pictures that were sent along."""
    image_tokens: Count = 0
    """The part of `prompt_tokens` for pictures, as the model file's rule estimates it."""

    def __add__(self, other: Usage) -> Usage:
        return Usage(
            requests=min(self.requests + other.requests, MOST),
            prompt_tokens=min(self.prompt_tokens + other.prompt_tokens, MOST),
            completion_tokens=min(self.completion_tokens + other.completion_tokens, MOST),
            cached_tokens=min(self.cached_tokens + other.cached_tokens, MOST),
            cache_write_tokens=min(self.cache_write_tokens + other.cache_write_tokens, MOST),
            reasoning_tokens=min(self.reasoning_tokens + other.reasoning_tokens, MOST),
            cost_usd=_sum_usd(self.cost_usd, other.cost_usd),
            unknown_requests=min(self.unknown_requests + other.unknown_requests, MOST),
            unknown_usd=_sum_usd(self.unknown_usd, other.unknown_usd),
            shortened_requests=min(self.shortened_requests + other.shortened_requests, MOST),
            left_out=_sum_counts(self.left_out, other.left_out),
            images=min(self.images + other.images, MOST),
            image_tokens=min(self.image_tokens + other.image_tokens, MOST),
        )


def _sum_counts(first: dict[str, int], second: dict[str, int]) -> dict[str, int]:
    if not (first and second):
        return first or second
    return {name: min(first.get(name, 0) + second.get(name, 0), MOST) for name in {**first, **second}}


def _sum_usd(*sums: float | None) -> float | None:
    known = [usd for usd in sums if usd is not None]
    return min(sum(known), MOST) if known else None


class Pace(Frozen):
    """How long a model takes, as a function of what it reads and writes, so that the same reply always costs the same.

    seconds = requests * latency_s + tokens read / read_tokens_per_s + tokens written / write_tokens_per_s
    """

    latency_s: float = Field(default=0.5, ge=0, le=3600)
    """Seconds of each request, whatever its length."""
    read_tokens_per_s: float = Field(default=5000.0, gt=0)
    write_tokens_per_s: float = Field(default=50.0, gt=0)

    def seconds(self, usage: Usage) -> float:
        """Return the seconds that this usage takes."""
        reading_s = usage.prompt_tokens / self.read_tokens_per_s
        writing_s = usage.completion_tokens / self.write_tokens_per_s
        return usage.requests * self.latency_s + reading_s + writing_s
