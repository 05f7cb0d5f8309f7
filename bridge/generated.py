"""Text actions that follow from PySC2's functions, so that every function can be reached in words.

Below it: the table of functions and what is known of abilities. Above it: `bridge.catalog`, which checks what it makes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bridge.action import Action


def generated(curated: Mapping[str, Action]) -> Iterable[Action]:
    """The actions that the written ones leave out."""
    del curated
    return ()
