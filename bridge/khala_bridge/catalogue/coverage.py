"""The text actions that end in each of PySC2's functions: the proof that the catalogue is complete.

Above it: the pages of the documentation, and `khala actions --functions`. Below it: the catalogue.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import Function, functions
from khala_bridge.catalogue.generated import without_words


class Coverage(NamedTuple):
    """One function, and the text actions that reach it."""

    function: Function
    actions: tuple[str, ...]
    """Names of the text actions that end in it, in the order of the catalogue."""
    reason: str
    """Why there is no action; empty if there is one."""


@functools.cache
def coverage() -> tuple[Coverage, ...]:
    """Return every function of PySC2 once, in the order of their ids."""
    found: dict[str, list[str]] = {name: [] for name in functions()}
    for action in catalogue().values():
        if action.function is not None:
            found[action.function].append(action.name)
    return tuple(
        Coverage(function, tuple(found[name]), without_words().get(name, "")) for name, function in functions().items()
    )
