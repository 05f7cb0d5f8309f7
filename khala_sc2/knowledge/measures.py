"""Numbers of the tables as the bridge gives them: per second of the speed "faster", rounded, without zeros.

The tables count game loops, and "normal" seconds of 16 loops; agents read seconds of 22.4 loops, as the game's own
clock shows them.
"""

from __future__ import annotations

from typing import Any, Final

from khala_protocol.messages import LOOPS_PER_S
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND

FASTER: Final = LOOPS_PER_S / LOOPS_PER_NORMAL_SECOND
"""Normal seconds in a second of the speed "faster"."""
DIGITS: Final = 2
"""Digits after the point of a converted number; the tables' own numbers have up to four."""
TABLE_DIGITS: Final = 4


def seconds(loops: float) -> float:
    """Return game loops as seconds."""
    return plain(loops / LOOPS_PER_S, DIGITS)


def per_second(per_normal_second: float) -> float:
    """Return a rate per "normal" second as one per second."""
    return plain(per_normal_second * FASTER, DIGITS)


def plain(value: float, digits: int = TABLE_DIGITS) -> float:
    """Return a number without needless digits, a whole one without a point."""
    rounded = round(value, digits)
    return int(rounded) if rounded == int(rounded) else rounded


def sparse(record: dict[str, Any]) -> dict[str, Any]:
    """Return the entries of a record that are not zero, not empty and not None."""
    return {key: value for key, value in record.items() if value or value is True}


def in_seconds(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return a skill's own figures, with loops and "normal" seconds converted to seconds, in names and values."""
    return dict(_in_seconds(key, value) for key, value in numbers.items())


RATES: Final = (("_per_s_normal", "_per_s"), ("_per_n", "_per_s"), ("_normal", ""), ("_n", ""))
"""Endings of figures per "normal" second, and their names per second."""


def _in_seconds(key: str, value: Any) -> tuple[str, Any]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return key, value
    if key.endswith("_loops"):
        return f"{key.removesuffix('_loops')}_s", seconds(value)
    for ending, ours in RATES:
        if key.endswith(ending):
            return key.removesuffix(ending) + ours, per_second(value)
    return key, plain(value)
