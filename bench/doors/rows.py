"""A row of the suite: one thing that comes through a door, and what must become of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from pathlib import Path

Kind: TypeAlias = Literal["attack", "quirk", "fault"]
"""Somebody means harm, an endpoint or a file is odd, or a machine fails."""


class Skipped(Exception):
    """The machine lacks what a row needs; the text says what."""


@dataclass(frozen=True, slots=True)
class Row:
    """One row.

    Attributes:
        door: the command, server or file that it comes through: `khala view`, `khala experiment status`, `endpoint`.
        what: what comes, in a few words.
        play: plays it in an empty directory; returns how it got through, "" if the door held.
        kind: who or what is behind it.
    """

    door: str
    what: str
    play: Callable[[Path], Coroutine[Any, Any, str]]
    kind: Kind = "attack"
