"""A document as Markdown, with pictures beside it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala.experiment.report.document import Document, Section, Table

MEANS_SOMETHING = re.compile(r"([\\`*_\[\]<>#|~&$])")


def text(document: Document) -> str:
    """Return the document."""
    return "\n".join(_lines(document)).rstrip() + "\n"


def escaped(words: str) -> str:
    """Return words of which nothing is markup."""
    return MEANS_SOMETHING.sub(r"\\\1", visible_line(words))


def _lines(document: Document) -> Iterator[str]:
    yield f"# {escaped(document.title)}\n"
    for paragraph in document.paragraphs:
        yield f"{escaped(paragraph)}\n"
    if document.warnings:
        yield "> **Mind this**\n>"
        yield from (f"> * {escaped(warning)}" for warning in document.warnings)
        yield ""
    for section in document.sections:
        yield f"## {escaped(section.title)}\n"
        yield from _section(section)


def _section(section: Section) -> Iterator[str]:
    for paragraph in section.paragraphs:
        yield f"{escaped(paragraph)}\n"
    for table in section.tables:
        if table.title not in ("", section.title):
            yield f"### {escaped(table.title)}\n"
        yield from _table(table)
    for figure in section.figures:
        yield f"![{escaped(figure.caption)}]({figure.name}.png)\n"


def _table(table: Table) -> Iterator[str]:
    yield _row(table.columns)
    yield _row(["---" if i < table.words else "---:" for i in range(len(table.columns))], plain=True)
    for row in table.rows:
        yield _row(row)
    yield f"\n{escaped(table.note)}\n" if table.note else ""


def _row(cells: tuple[str, ...] | list[str], *, plain: bool = False) -> str:
    return f"| {' | '.join(cells if plain else map(escaped, cells))} |"
