"""How much of the time to answer is for deciding, and how much is reserved for sending the answer."""

from __future__ import annotations

MARGIN_FRACTION = 0.05
MARGIN_MIN_S = 0.05
MARGIN_MAX_S = 0.5
"""128 agents of one process send their empty replies in about 0.1 s on two cores."""


def time_to_decide_s(answer_within_s: float | None) -> float | None:
    """Return the seconds a policy may take from the arrival of an observation; None for no limit.

    At most half of a very short time is reserved.
    """
    if answer_within_s is None:
        return None
    margin = min(max(MARGIN_FRACTION * answer_within_s, MARGIN_MIN_S), MARGIN_MAX_S, answer_within_s / 2)
    return max(answer_within_s - margin, 0.0)
