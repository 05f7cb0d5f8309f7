"""Numbers of experiments as people read them, and as JSON."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from khala_sc2.experiment.statistics import Interval

NONE = DASH = "\N{EN DASH}"
"""Stands where there is no number, and between the bounds of an interval."""
MINUS = "\N{MINUS SIGN}"


def number(value: float | None, *, signed: bool = False) -> str:
    """Return a number with three digits that count; larger ones keep all before the point."""
    if value is None or math.isnan(value):
        return NONE
    sign = MINUS if value < 0 else "+" if signed and value > 0 else ""
    return sign + ("∞" if math.isinf(value) else _digits(abs(value)))


def _digits(value: float) -> str:
    decimals = max(0, 2 - math.floor(math.log10(value))) if value else 0
    words = f"{value:,.{decimals}f}"
    return words.rstrip("0").rstrip(".") if "." in words else words


def share(value: float | None, *, digits: int = 0) -> str:
    """Return a share of 1 in percent."""
    return NONE if value is None else f"{100 * value:.{digits}f} %"


def share_with(interval: Interval) -> str:
    """Return a share with its interval, in percent."""
    if interval.value is None:
        return NONE
    return f"{share(interval.value)} ({100 * interval.low:.0f}{DASH}{100 * interval.high:.0f})"


def ratio(value: float | None) -> str:
    """Return a ratio, such as K/D, with two digits after the point."""
    return number(value) if value is None or math.isinf(value) else f"{value:.2f}"


def ratio_with(interval: Interval) -> str:
    """Return a ratio with its interval."""
    if interval.value is None:
        return NONE
    return f"{ratio(interval.value)} ({ratio(interval.low)}{DASH}{ratio(interval.high)})"


def number_with(interval: Interval) -> str:
    """Return a number with its interval."""
    if interval.value is None:
        return NONE
    return f"{number(interval.value)} ({number(interval.low)}{DASH}{number(interval.high)})"


def points_with(interval: Interval) -> str:
    """Return a difference of shares in percentage points, with their signs."""
    if interval.value is None:
        return NONE
    value, low, high = (_points(bound) for bound in (interval.value, interval.low, interval.high))
    return f"{value} ({low} to {high})"


def difference_with(interval: Interval) -> str:
    """Return a difference, with its sign."""
    if interval.value is None:
        return NONE
    value, low, high = (number(bound, signed=True) for bound in (interval.value, interval.low, interval.high))
    return f"{value} ({low} to {high})"


def p_value(p: float | None) -> str:
    """Return a p as tables have it."""
    if p is None:
        return NONE
    return "< 0.001" if p < 0.001 else f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def plain(value: Any) -> Any:
    """Return a value of which JSON can be made; JSON has no infinite numbers, they become null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _points(share: float) -> str:
    rounded = round(100 * share)
    return f"{MINUS if rounded < 0 else '+' if rounded > 0 else ''}{abs(rounded)}"
