"""The page of all results that are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from bench.history import PAGE, PICTURES, kept_results, lines, page, write
from bench.paths import ROOT
from bench.results import write as write_results

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bench.results import Results, Series

    Made = Callable[..., Results]
    Step = Callable[..., Series]


def test_the_page_is_that_of_the_results_that_are_kept() -> None:
    kept = kept_results()
    assert PAGE.read_text(encoding="utf-8") == page(kept), "`python -m bench history` writes it again"
    assert {path.name for path in PICTURES.glob("*")} == {line.file for line in lines(kept)}


def test_the_site_lists_the_page() -> None:
    assert PAGE.name in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


def test_each_figure_has_a_picture_and_a_row(made: Made, step: Step, tmp_path: Path) -> None:
    kept = [
        made(step(20.0, 21.0), step(1.2, name="ours / theirs", limit=1.5), day=1),
        made(step(10.0, 12.0), commit="b" * 40, day=2),
        made(step(30.0), commit="c" * 40, day=3, cpu="a slow one"),
        made(step(9.0), commit="d" * 40, day=4),
    ]
    (tmp_path / "images").mkdir()
    gone = tmp_path / "images" / "turn-gone.svg"
    gone.write_text("")
    text, *pictures = write(kept, tmp_path / "page.md", tmp_path / "images")
    assert [path.name for path in pictures] == ["turn-a-step.svg", "turn-ours-theirs.svg"]
    assert not gone.exists()
    assert "| a step | 11 | 9 | ms | less is better |" in text.read_text()
    assert "| 2026-11-02 | `bbbbbbbb` | a quick one, 2 cores, 8 GB, Linux, Python 3.11.9 | 2 | 0 |" in text.read_text()
    words = "".join(ET.parse(pictures[0]).getroot().itertext())
    for part in ("turn: a step", "less is better", "2026-11-03", "cccccccc", "a slow one"):
        assert part in words
    before = pictures[0].read_bytes()
    write(kept, tmp_path / "page.md", tmp_path / "images")
    assert pictures[0].read_bytes() == before, "the same results must give the same file"


def test_results_of_changed_code_are_not_part_of_it(made: Made, step: Step, tmp_path: Path) -> None:
    for one in (made(step(1.0), day=2), made(step(1.0), changed=True), made(step(1.0), commit="")):
        write_results(one, into=tmp_path)
    assert [one.date.day for one in kept_results(tmp_path)] == [2]
