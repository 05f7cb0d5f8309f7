"""How the rules are compiled; the flags decide the last bits of a game, so a run card names them."""

from __future__ import annotations

import sys
from typing import Final

COMPILER: Final[tuple[str, ...]] = (
    ("/O2", "/fp:precise")
    if sys.platform == "win32"
    else ("-O3", "-g0", "-ffp-contract=off", "-fno-math-errno", "-fno-sanitize=undefined", "-w")
)
"""Products and sums are rounded one by one, as in the interpreter, and square roots set no errno."""
DECISIVE: Final = COMPILER[:2] if sys.platform == "win32" else (COMPILER[0], COMPILER[2])
"""Those on which results depend."""
CYTHON: Final[dict[str, object]] = {
    "language_level": 3,
    "boundscheck": True,  # of lists and tuples; memory is read by pointers, which nothing checks
    "wraparound": True,
    "cdivision": True,
    "initializedcheck": False,
    "binding": False,
    "embedsignature": False,
    "infer_types": True,
    "annotation_typing": False,  # a rule's annotations are for readers and type checkers; its .pxd has the types of C
}
