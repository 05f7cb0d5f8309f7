"""What a report consists of. Its texts are plain: each format escapes what means something in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, slots=True)
class ReportTable:
    """A table of texts."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int
    """The first so many columns are words, which begin at the left; the others are numbers."""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture, drawn when a format takes it."""

    name: str
    """Of its files, without a suffix."""
    caption: str
    draw: Callable[[str], bytes]
    """Returns it as `svg`, `png` or `pdf`."""


@dataclass(frozen=True, slots=True)
class ReportSection:
    """A part with a heading."""

    title: str
    paragraphs: tuple[str, ...] = ()
    tables: tuple[ReportTable, ...] = ()
    figures: tuple[Figure, ...] = ()


@dataclass(frozen=True, slots=True)
class ReportDocument:
    """A whole report."""

    title: str
    paragraphs: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[ReportSection, ...]
