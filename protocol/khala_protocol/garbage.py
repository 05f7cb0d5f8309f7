"""Keep Python's garbage collections out of the turn of a long-lived process."""

from __future__ import annotations

import gc
import time
from typing import Final

_SHARE: Final = 0.1
"""Of a process's time that collections may take here: each match of many in a process asks for one."""
_frozen = False
_next_s = 0.0


def tidy_memory() -> None:
    """Free what earlier matches left, and leave what was imported out of later garbage collections.

    To scan what was imported stops a process for 40 ms. A match leaves megabytes of observations in circles of few
    objects, which Python alone would collect too late, and never if they were left out as well: a process of many
    matches grew by 7 MB with each. What is there at the second call is therefore collected as usual. A process of
    hundreds of matches at a time takes longer for each collection, and collects less often.
    """
    global _frozen, _next_s  # noqa: PLW0603  # of the process, as the collector is
    began_s = time.monotonic()
    if began_s < _next_s:
        return
    gc.collect()
    if not _frozen:
        gc.freeze()
        _frozen = True
    ended_s = time.monotonic()
    _next_s = ended_s + (ended_s - began_s) / _SHARE
