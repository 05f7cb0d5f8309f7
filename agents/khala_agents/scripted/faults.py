"""Faults that the scripted endpoint has on request, each for a given part of the requests.

    429=0.1      "too many requests", with `Retry-After`; any status from 400 to 599 works the same way
    quota=0.1    429 as a provider sends it when the money is used up
    garbage=0.1  "200 OK", and a body that is not JSON
    nonsense=0.1 a completion whose text is not a reply
    half=0.1     half of the body, then the connection is closed
    reset=0.1    the connection is reset before a byte of the answer
    drip=0.1     the body, one byte every now and then
    stall=0.1    no answer at all

The choice depends on the seed, on the prompt and on how often it was sent: a repeated request may succeed,
a repeated run goes the same way.
"""

from __future__ import annotations

import random
from collections import Counter
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

NAMED = ("quota", "garbage", "nonsense", "half", "reset", "drip", "stall")
_MAX_COUNTED = 100_000


class InjectedFaults:
    """Which request gets which fault.

    Args:
        rates: part of the requests, 0 to 1, by the name of the fault; the other requests are answered.
        seed: changes which requests get a fault, not how many.
    """

    def __init__(self, rates: Mapping[str, float] | None = None, *, seed: int = 0) -> None:
        self._rates = dict(rates or {})
        self._seed = seed
        self._sent: Counter[str] = Counter()

    def pick(self, prompt: str) -> str | None:
        """Return the fault of this request, or None."""
        if not self._rates:
            return None
        if len(self._sent) > _MAX_COUNTED:
            self._sent.clear()
        self._sent[prompt] += 1
        chance = random.Random(f"{self._seed} {self._sent[prompt]} {prompt}").random()
        for fault, rate in self._rates.items():
            if chance < rate:
                return fault
            chance -= rate
        return None


def parse_faults(options: Iterable[str]) -> dict[str, float]:
    """Return the rates from options such as `429=0.1`.

    Raises:
        ConfigError: one of them is not a fault with a rate, or their sum is more than 1.
    """
    rates: dict[str, float] = {}
    for option in options:
        name, _, number = option.partition("=")
        known = name in NAMED or (name.isdigit() and 400 <= int(name) <= 599)
        if not known:
            raise ConfigError(
                f"'{name}' is not a fault: use an HTTP status from 400 to 599 or one of {', '.join(NAMED)}, "
                "such as --fault 429=0.1",
                source="--fault",
            )
        try:
            rate = float(number)
        except ValueError:
            rate = -1.0
        if not 0.0 <= rate <= 1.0:
            raise ConfigError(f"'{option}' needs a rate between 0 and 1, such as {name}=0.1", source="--fault")
        rates[name] = rate
    if sum(rates.values()) > 1.0:
        raise ConfigError(f"the rates add up to {sum(rates.values()):g}: they may not exceed 1", source="--fault")
    return rates
