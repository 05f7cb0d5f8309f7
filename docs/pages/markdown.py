"""Markdown from data: tables, links and page heads. It knows nothing of Khala."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_SPAN = re.compile(r"(`+)(.+?)\1", re.DOTALL)


def head(title: str, source: str) -> str:
    """Return the first lines of a page; `source` is what a reader would change instead of the page."""
    return f"<!-- Written by `make docs` from {source}: change that, not this page. -->\n\n# {title}\n"


def join(*parts: str) -> str:
    """Return a page of blocks with an empty line between them."""
    return "\n\n".join(part.strip("\n") for part in parts if part.strip()) + "\n"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; columns that are empty in every row are left out."""
    texts = [[cell(value) for value in row] for row in rows]
    shown = [index for index in range(len(header)) if not texts or any(row[index] for row in texts)]
    lines = [[header[index] for index in shown], ["---"] * len(shown)]
    lines += [[row[index] for index in shown] for row in texts]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def cell(value: object) -> str:
    """Return a value as it may stand in a table: one line, no bars, no accidental tags; None is nothing."""
    if value is None:
        return ""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return prose(" ".join(text.split())).replace("|", "\\|")


def prose(text: str) -> str:
    """Return a docstring as Markdown: double back-ticks become single ones, `<` outside of code is no tag."""
    parts, end = [], 0
    for span in _SPAN.finditer(text):
        parts += [text[end : span.start()].replace("<", "&lt;"), f"`{span.group(2)}`"]
        end = span.end()
    return "".join([*parts, text[end:].replace("<", "&lt;")])


def code(text: object) -> str:
    """Return text as code, in a line."""
    return f"`{text}`"


def codes(values: Iterable[object]) -> str:
    """Return several values as code, with commas between them."""
    return ", ".join(code(value) for value in values)


def fence(text: str, language: str = "text") -> str:
    """Return text as a block of code."""
    return f"```{language}\n{text.rstrip()}\n```"


def anchor(title: str) -> str:
    """Return the anchor that GitHub gives to a heading."""
    kept = re.sub(r"[^\w\- ]", "", title.lower())
    return "#" + kept.replace(" ", "-")
