"""The page of `khala view` that is committed is the one that its source makes."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from page.typescript import TYPES, typescript

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "page"
BUILT = ROOT / "khala_sc2" / "view" / "assets" / "index.html"
MOST_BYTES = 250_000


def test_the_types_of_the_page_are_those_of_the_server() -> None:
    assert TYPES.read_text(encoding="utf-8") == typescript(), "run `make page`"


def test_the_page_is_one_file_that_asks_for_nothing() -> None:
    page = BUILT.read_text(encoding="utf-8")
    assert len(page.encode()) < MOST_BYTES
    assert "src=" not in page.partition("<script")[0], "a file beside the page"
    assert page.count("<script") == 1
    assert "eval(" not in page


def test_nothing_of_a_text_can_become_html() -> None:
    files = [path for path in (SOURCE / "src").rglob("*") if path.suffix in {".ts", ".tsx"}]
    ways = ("dangerouslySetInnerHTML", "innerHTML", "outerHTML", "insertAdjacentHTML", "document.write")
    assert len(files) > 30
    assert not [f"{path.name}: {way}" for path in files for way in ways if way in path.read_text(encoding="utf-8")]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_committed_page_is_built_from_its_source(tmp_path: Path) -> None:
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("npm is not installed")
    source = tmp_path / "page"
    shutil.copytree(SOURCE, source, ignore=shutil.ignore_patterns("node_modules"))
    for command in (["ci", "--no-audit", "--no-fund"], ["run", "types"], ["test"], ["run", "build"]):
        subprocess.run([npm, *command], cwd=source, check=True, capture_output=True)
    assert (tmp_path / "khala_sc2" / "view" / "assets" / "index.html").read_bytes() == BUILT.read_bytes(), (
        "run `make page`"
    )
