"""How much of what agents send a recording takes: so much for each step, and some steps' worth at once.

Ordinary exchanges have 8 to 17 kB (scripted model, a battle and the first minutes of a game with pictures, which are in
them by their hashes only). Without a limit an agent could send 500 of 4 MiB a second, which is what a router passes.
Above it: `khala_orchestrator.publish.record`.
"""

from __future__ import annotations

import logging
from collections import Counter

from khala_protocol.access import EXCHANGE_BYTES

log = logging.getLogger(__name__)

STEP_BYTES = 1024 * 1024
"""Of each agent and topic: sixty times the largest ordinary exchange."""


class Allowance:
    """The room that is left for each key. What does not fit is counted, and the first of each key is in the log.

    Args:
        reports: of one step; as many as there are sides.
    """

    def __init__(self, reports: int = 1) -> None:
        self._step_bytes = STEP_BYTES // reports
        self._left: dict[str, int] = {}
        self._samples, self._bytes = Counter[str](), Counter[str]()

    def report(self) -> None:
        """Give every key what a step has: a report was published."""
        self._left = {key: min(left + self._step_bytes, EXCHANGE_BYTES) for key, left in self._left.items()}

    def takes(self, key: str, size: int) -> bool:
        """Return whether there is room for a sample, and take it."""
        left = self._left.get(key, EXCHANGE_BYTES) - size
        if left >= 0:
            self._left[key] = left
            return True
        if key not in self._samples:
            log.warning("%s sends more than %d MB a step: the rest is left out", key, STEP_BYTES >> 20)
        self._samples[key] += 1
        self._bytes[key] += size
        return False

    def left_out(self, key: str) -> str:
        """Return what did not fit, in words; "" if all did."""
        return "" if not self._samples[key] else f"{self._samples[key]} samples of {self._bytes[key]} bytes"
