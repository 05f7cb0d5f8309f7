"""A document as LaTeX with the package booktabs; a table can be copied from it into a paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala.experiment.report.document import Document, Section, Table

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
}  # fmt: skip
SIZE = r"width=0.9\textwidth,height=0.85\textheight,keepaspectratio"
WIDE = 9
"""With more columns a table stands across the page."""
LONG_TEXT = 40
"""Characters; a column with longer words breaks lines."""


def text(document: Document) -> str:
    """Return the document."""
    return "\n".join([HEAD, *_lines(document), r"\end{document}"]) + "\n"


def escaped(words: str) -> str:
    """Return words of which nothing is markup; what the fonts do not have is named by its number."""
    return "".join(_character(one) for one in visible_line(words))


def _character(one: str) -> str:
    if one in SPECIAL:
        return SPECIAL[one]
    return one if ord(one) < 0x180 else rf"\texttt{{U+{ord(one):04X}}}"


def _lines(document: Document) -> Iterator[str]:
    yield rf"\section*{{{escaped(document.title)}}}"
    for paragraph in document.paragraphs:
        yield f"{escaped(paragraph)}\n"
    if document.warnings:
        yield r"\textbf{Mind this:}" + "\n" + r"\begin{itemize}"
        yield from (rf"\item {escaped(warning)}" for warning in document.warnings)
        yield r"\end{itemize}"
    for section in document.sections:
        yield rf"\subsection*{{{escaped(section.title)}}}"
        yield from _section(section)


def _section(section: Section) -> Iterator[str]:
    for paragraph in section.paragraphs:
        yield f"{escaped(paragraph)}\n"
    for table in section.tables:
        if table.title not in ("", section.title):
            yield rf"\subsubsection*{{{escaped(table.title)}}}"
        yield from _table(table)
    for figure in section.figures:
        yield rf"\begin{{center}}\includegraphics[{SIZE}]{{{figure.name}.pdf}}"
        yield rf"\\ {{\small {escaped(figure.caption)}}}\end{{center}}"


def _table(table: Table) -> Iterator[str]:
    wide = len(table.columns) > WIDE
    yield r"\begin{landscape}" if wide else r"\begingroup"
    yield rf"\small\begin{{longtable}}{{@{{}}{''.join(_columns(table))}@{{}}}}"
    if any(table.columns):
        yield rf"\toprule {_row(table.columns)} \midrule\endhead"
    else:
        yield r"\toprule\endhead"
    yield r"\bottomrule\endlastfoot"
    for row in table.rows:
        yield _row(row)
    yield r"\end{longtable}"
    if table.note:
        yield rf"{{\footnotesize {escaped(table.note)}\par}}"
    yield r"\end{landscape}" if wide else r"\endgroup"


def _columns(table: Table) -> Iterator[str]:
    for i in range(len(table.columns)):
        long = any(len(row[i]) > LONG_TEXT for row in table.rows)
        yield r"p{0.6\textwidth}" if long else "l" if i < table.words else "r"


def _row(cells: tuple[str, ...]) -> str:
    return f"{' & '.join(map(escaped, cells))} \\\\"
