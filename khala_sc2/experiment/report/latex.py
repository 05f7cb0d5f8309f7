"""A document as LaTeX with the package booktabs; a table can be copied from it into a paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_protocol.visible import visible_line
from khala_sc2.experiment.report.writer import DocumentWriter

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_sc2.experiment.report.document import Figure, ReportTable

HEAD = r"""\documentclass[10pt,a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{lmodern}
\usepackage[margin=2cm]{geometry}
\usepackage{booktabs,longtable,graphicx,pdflscape}
\setlength{\tabcolsep}{4pt}
\setlength{\parindent}{0pt}
\setlength{\parskip}{4pt}
\begin{document}"""
SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "_": r"\_", "%": r"\%",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "[": "{[}", "]": "{]}", "*": "{*}",  # would be options of the command before them, such as the end of a row
    "|": r"\textbar{}", '"': r"\textquotedbl{}", "\N{EN DASH}": "--", "—": "---", "\N{MINUS SIGN}": "$-$",
    "∞": r"$\infty$", "…": r"\ldots{}", "·": r"$\cdot$", "\N{MULTIPLICATION SIGN}": r"$\times$",
    "\N{DAGGER}": r"\dag{}",
}  # fmt: skip
SIZE = r"width=0.9\textwidth,height=0.85\textheight,keepaspectratio"
WIDE = 9
"""With more columns a table stands across the page."""
PORTRAIT = 110
"""Characters of the longest cells of a row; with more a table stands across the page, with more than `LANDSCAPE` in the
smallest letters."""
LANDSCAPE = 150
LONG_TEXT = 40
"""Characters; a column with longer words breaks lines."""


class Latex(DocumentWriter):
    """LaTeX for pdflatex. What its fonts do not have is named by its number."""

    suffix = "tex"
    picture = "pdf"
    end = r"\end{document}"

    def _escape(self, words: str) -> str:
        return "".join(map(_character, visible_line(words)))

    def _begin(self, title: str) -> str:
        return f"{HEAD}\n" + rf"\section*{{{self._escape(title)}}}"

    def _paragraph(self, words: str) -> str:
        return f"{self._escape(words)}\n"

    def _warnings(self, warnings: Sequence[str]) -> Iterator[str]:
        yield r"\textbf{Mind this:}"
        yield r"\begin{itemize}"
        yield from (rf"\item {self._escape(warning)}" for warning in warnings)
        yield r"\end{itemize}"

    def _section(self, title: str, content: Iterable[str]) -> Iterator[str]:
        yield rf"\subsection*{{{self._escape(title)}}}"
        yield from content

    def _heading(self, title: str) -> str:
        return rf"\subsubsection*{{{self._escape(title)}}}"

    def _table(self, table: ReportTable) -> Iterator[str]:
        width = sum(min(max(map(len, cells)), LONG_TEXT) for cells in zip(table.columns, *table.rows, strict=True))
        wide = len(table.columns) > WIDE or width > PORTRAIT
        size = r"\small" if width <= LANDSCAPE else r"\scriptsize"
        yield r"\begin{landscape}" if wide else r"\begingroup"
        yield rf"{size}\begin{{longtable}}{{@{{}}{''.join(_columns(table))}@{{}}}}"
        if any(table.columns):
            yield rf"\toprule {self._row(table.columns)} \midrule\endhead"
        else:
            yield r"\toprule\endhead"
        yield r"\bottomrule\endlastfoot"
        yield from map(self._row, table.rows)
        yield r"\end{longtable}"
        if table.note:
            yield rf"{{\footnotesize {self._escape(table.note)}\par}}"
        yield r"\end{landscape}" if wide else r"\endgroup"

    def _figure(self, figure: Figure) -> str:
        picture = rf"\begin{{center}}\includegraphics[{SIZE}]{{{figure.name}.pdf}}"
        return f"{picture}\n" + rf"\\ {{\small {self._escape(figure.caption)}}}\end{{center}}"

    def _row(self, cells: Iterable[str]) -> str:
        return f"{' & '.join(map(self._escape, cells))} \\\\"


def _character(character: str) -> str:
    if character in SPECIAL:
        return SPECIAL[character]
    return character if ord(character) < 0x180 else rf"\texttt{{U+{ord(character):04X}}}"


def _columns(table: ReportTable) -> Iterator[str]:
    for i in range(len(table.columns)):
        long = any(len(row[i]) > LONG_TEXT for row in table.rows)
        yield r"p{0.6\textwidth}" if long else "l" if i < table.words else "r"
