"""A document as one HTML file that loads nothing, for light and dark screens and for paper."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

from khala.experiment.report.figures import FAINT, INK
from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala.experiment.report.document import Document, Figure, Section, Table

STYLE = """
:root { color-scheme: light dark; --ink: #1c2430; --faint: #66707f; --line: #e3e6eb; --back: #ffffff; --band: #f6f7f9;
  --warn: #fff6e0; --warn-line: #e69f00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ee; --faint: #98a2b1; --line: #2e3642; --back: #14181f;
  --band: #1b212a; --warn: #2c2510; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 72rem; background: var(--back); color: var(--ink);
  font: 15px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { margin: 0 0 .3rem; font-size: 2rem; line-height: 1.2; letter-spacing: -.01em; overflow-wrap: anywhere; }
h2 { margin: 3rem 0 1rem; padding-top: 1rem; border-top: 1px solid var(--line); font-size: 1.3rem; }
h3 { margin: 2rem 0 .5rem; font-size: 1rem; }
p { max-width: 46rem; overflow-wrap: anywhere; }
.warnings { margin: 1.5rem 0; padding: .8rem 1.1rem; border-left: 4px solid var(--warn-line); border-radius: 4px;
  background: var(--warn); overflow-wrap: anywhere; }
.warnings ul { margin: .3rem 0 0; padding-left: 1.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .32rem .8rem; text-align: left; vertical-align: top; white-space: nowrap; }
th:first-child, td:first-child { padding-left: .4rem; }
thead th { border-bottom: 2px solid var(--ink); font-weight: 600; vertical-align: bottom; }
tbody td { border-bottom: 1px solid var(--line); }
tbody tr:hover { background: var(--band); }
th.number, td.number { text-align: right; }
table.facts td { white-space: normal; overflow-wrap: anywhere; }
table.facts td:first-child { color: var(--faint); white-space: nowrap; }
.note, figcaption { max-width: 46rem; color: var(--faint); font-size: .85rem; }
figure { margin: 1.5rem 0 2rem; }
figure svg { display: block; width: 100%; max-width: 50rem; height: auto; }
@media print { body { max-width: none; padding: 0; font-size: 11px; } tr, figure { break-inside: avoid; } }
"""


def text(document: Document) -> str:
    """Return the document."""
    return "\n".join(_lines(document)) + "\n"


def escaped(words: str) -> str:
    """Return words of which nothing is markup."""
    return html.escape(visible_line(words))


def _lines(document: Document) -> Iterator[str]:
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield """<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">"""
    yield f"<title>{escaped(document.title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>"
    yield f"<h1>{escaped(document.title)}</h1>"
    yield from _paragraphs(document.paragraphs)
    if document.warnings:
        yield '<div class="warnings" role="note"><strong>Mind this</strong><ul>'
        yield from (f"<li>{escaped(warning)}</li>" for warning in document.warnings)
        yield "</ul></div>"
    for section in document.sections:
        yield f"<section>\n<h2>{escaped(section.title)}</h2>"
        yield from _section(section)
        yield "</section>"
    yield "</body>\n</html>"


def _paragraphs(paragraphs: Iterable[str]) -> Iterator[str]:
    yield from (f"<p>{escaped(paragraph)}</p>" for paragraph in paragraphs)


def _section(section: Section) -> Iterator[str]:
    yield from _paragraphs(section.paragraphs)
    for table in section.tables:
        if table.title not in ("", section.title):
            yield f"<h3>{escaped(table.title)}</h3>"
        yield from _table(table)
    for figure in section.figures:
        yield f"<figure>\n{_svg(figure)}\n<figcaption>{escaped(figure.caption)}</figcaption>\n</figure>"


def _table(table: Table) -> Iterator[str]:
    named = any(table.columns)
    yield '<div class="scroll"><table>' if named else '<div class="scroll"><table class="facts">'
    if named:
        yield f"<thead><tr>{''.join(_cells('th', table.columns, table.words))}</tr></thead>"
    yield "<tbody>"
    for row in table.rows:
        yield f"<tr>{''.join(_cells('td', row, table.words))}</tr>"
    yield "</tbody></table></div>"
    if table.note:
        yield f'<p class="note">{escaped(table.note)}</p>'


def _cells(tag: str, cells: tuple[str, ...], words: int) -> Iterator[str]:
    for i, cell in enumerate(cells):
        kind = "" if i < words else ' class="number"'
        yield f"<{tag}{kind}>{escaped(cell)}</{tag}>"


def _svg(figure: Figure) -> str:
    """Return a picture as a part of the page: in its colours, under ids that no other picture has."""
    svg = figure.draw("svg").decode()
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{figure.name}-", svg)
    svg = svg.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return svg.replace(INK, "var(--ink)").replace(FAINT, "var(--faint)").replace("<svg ", '<svg role="img" ', 1)
