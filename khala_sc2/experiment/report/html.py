"""A document as one HTML file that loads nothing, for light and dark screens and for paper."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

from khala_protocol.visible import visible_line
from khala_sc2.experiment.report.figures import FAINT, INK
from khala_sc2.experiment.report.writer import DocumentWriter

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_sc2.experiment.report.document import Figure, ReportTable

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


class Html(DocumentWriter):
    """HTML with its style and its pictures inside."""

    suffix = "html"
    picture = ""
    end = "</body>\n</html>"

    def _escape(self, words: str) -> str:
        return html.escape(visible_line(words))

    def _begin(self, title: str) -> str:
        return (
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            """<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">\n"""
            f"<title>{self._escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
            f"<h1>{self._escape(title)}</h1>"
        )

    def _paragraph(self, words: str) -> str:
        return f"<p>{self._escape(words)}</p>"

    def _warnings(self, warnings: Sequence[str]) -> Iterator[str]:
        yield '<div class="warnings" role="note"><strong>Mind this</strong><ul>'
        yield from (f"<li>{self._escape(warning)}</li>" for warning in warnings)
        yield "</ul></div>"

    def _section(self, title: str, content: Iterable[str]) -> Iterator[str]:
        yield f"<section>\n<h2>{self._escape(title)}</h2>"
        yield from content
        yield "</section>"

    def _heading(self, title: str) -> str:
        return f"<h3>{self._escape(title)}</h3>"

    def _table(self, table: ReportTable) -> Iterator[str]:
        if any(table.columns):
            yield '<div class="scroll"><table>'
            yield f"<thead><tr>{self._cells('th', table.columns, table.words)}</tr></thead>"
        else:
            yield '<div class="scroll"><table class="facts">'
        yield "<tbody>"
        for row in table.rows:
            yield f"<tr>{self._cells('td', row, table.words)}</tr>"
        yield "</tbody></table></div>"
        if table.note:
            yield f'<p class="note">{self._escape(table.note)}</p>'

    def _figure(self, figure: Figure) -> str:
        return f"<figure>\n{_svg(figure)}\n<figcaption>{self._escape(figure.caption)}</figcaption>\n</figure>"

    def _cells(self, tag: str, cells: Sequence[str], words: int) -> str:
        kinds = ("" if i < words else ' class="number"' for i in range(len(cells)))
        return "".join(f"<{tag}{kind}>{self._escape(cell)}</{tag}>" for kind, cell in zip(kinds, cells, strict=True))


def _svg(figure: Figure) -> str:
    """Return a picture as a part of the page: in its colours, under ids that no other picture has."""
    svg = figure.draw("svg").decode()
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{figure.name}-", svg)
    svg = svg.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return svg.replace(INK, "var(--ink)").replace(FAINT, "var(--faint)").replace("<svg ", '<svg role="img" ', 1)
