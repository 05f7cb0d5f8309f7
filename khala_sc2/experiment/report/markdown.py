"""A document as Markdown, with pictures beside it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from khala_protocol.visible import visible_line
from khala_sc2.experiment.report.writer import DocumentWriter

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_sc2.experiment.report.document import Figure, ReportTable

MEANS_SOMETHING = re.compile(r"([\\`*_\[\]<>#|~&$])")


class Markdown(DocumentWriter):
    """Markdown with the tables of GitHub."""

    suffix = "md"
    picture = "png"

    def _escape(self, words: str) -> str:
        return MEANS_SOMETHING.sub(r"\\\1", visible_line(words))

    def _begin(self, title: str) -> str:
        return f"# {self._escape(title)}\n"

    def _paragraph(self, words: str) -> str:
        return f"{self._escape(words)}\n"

    def _warnings(self, warnings: Sequence[str]) -> Iterator[str]:
        yield "> **Mind this**\n>"
        yield from (f"> * {self._escape(warning)}" for warning in warnings)
        yield ""

    def _section(self, title: str, content: Iterable[str]) -> Iterator[str]:
        yield f"## {self._escape(title)}\n"
        yield from content

    def _heading(self, title: str) -> str:
        return f"### {self._escape(title)}\n"

    def _table(self, table: ReportTable) -> Iterator[str]:
        yield _row(map(self._escape, table.columns))
        yield _row("---" if i < table.words else "---:" for i in range(len(table.columns)))
        for row in table.rows:
            yield _row(map(self._escape, row))
        yield f"\n{self._escape(table.note)}\n" if table.note else ""

    def _figure(self, figure: Figure) -> str:
        return f"![{self._escape(figure.caption)}]({figure.name}.png)\n"


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"
