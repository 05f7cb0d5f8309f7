"""Keep Python's garbage collections out of the turn of a long-lived process."""

from __future__ import annotations

import gc


def tidy_memory() -> None:
    """Free what earlier matches left, and leave what was imported out of later garbage collections.

    To scan what was imported stops a process for 40 ms. A match leaves megabytes of observations in circles of few
    objects, which Python alone would collect too late, and never if they were left out as well: a process of many
    matches grew by 7 MB with each. What is there at the second call is therefore collected as usual.
    """
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()
