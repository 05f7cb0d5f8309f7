"""The walk through a document, which each format writes in its own markup."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_sc2.experiment.report.document import Figure, ReportDocument, ReportSection, ReportTable


class DocumentWriter(ABC):
    """A format. Each method returns lines in its markup, in which no given text is markup.

    Attributes:
        suffix: of the file.
        picture: suffix of the pictures beside the file; "" if the file holds them.
        end: last line of the file.
    """

    suffix: ClassVar[str]
    picture: ClassVar[str]
    end: ClassVar[str] = ""

    def text(self, document: ReportDocument) -> str:
        """Return the file of a document."""
        return "\n".join(self._lines(document)).rstrip() + "\n"

    @abstractmethod
    def _escape(self, words: str) -> str:
        """Return words of which nothing is markup."""

    @abstractmethod
    def _begin(self, title: str) -> str:
        """Return all that stands before the first paragraph."""

    @abstractmethod
    def _paragraph(self, words: str) -> str:
        """Return a paragraph."""

    @abstractmethod
    def _warnings(self, warnings: Sequence[str]) -> Iterator[str]:
        """Yield the warnings under a heading of their own."""

    @abstractmethod
    def _section(self, title: str, content: Iterable[str]) -> Iterator[str]:
        """Yield a section around lines that are written already."""

    @abstractmethod
    def _heading(self, title: str) -> str:
        """Return the heading of a table."""

    @abstractmethod
    def _table(self, table: ReportTable) -> Iterator[str]:
        """Yield a table without its heading."""

    @abstractmethod
    def _figure(self, figure: Figure) -> str:
        """Return a picture with its caption."""

    def _lines(self, document: ReportDocument) -> Iterator[str]:
        yield self._begin(document.title)
        yield from map(self._paragraph, document.paragraphs)
        if document.warnings:
            yield from self._warnings(document.warnings)
        for section in document.sections:
            yield from self._section(section.title, self._content(section))
        yield self.end

    def _content(self, section: ReportSection) -> Iterator[str]:
        yield from map(self._paragraph, section.paragraphs)
        for table in section.tables:
            if table.title not in ("", section.title):
                yield self._heading(table.title)
            yield from self._table(table)
        yield from map(self._figure, section.figures)
