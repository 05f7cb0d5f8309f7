"""Shorthands for short arrays, where a call costs more than its work.

A loop of a ten-unit battle is some hundred array calls; ``flatnonzero`` and ``any`` go through several Python layers
and cost three to ten times what these do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]


def which(mask: Bools) -> NDArray[np.int64]:
    """Return the indices at which a one-dimensional mask is true, ascending."""
    return mask.nonzero()[0]


def some(mask: Bools) -> bool:
    """Return whether the mask is true anywhere."""
    return b"\x01" in mask.tobytes()
