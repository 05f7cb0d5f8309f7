"""The notebook to begin with: it runs without a key, and the outputs in it are those that it prints."""

from __future__ import annotations

import re
from typing import Any

import pytest

pytest.importorskip("nbclient")

from docs import quick_start

CHANGES = re.compile(r"step |recorded: |╭|│ (?:steps|latency|game| ) ")
"""Lines with times, the name of a run, or the build of the engine."""


def printed(notebook: Any) -> list[list[str]]:
    """Return the lines of each cell of code that are the same wherever and whenever it runs."""
    return [
        [line for output in cell.outputs for line in text_of(output).splitlines() if not CHANGES.match(line)]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def text_of(output: Any) -> str:
    return str(output.get("text") or output.get("data", {}).get("text/plain", ""))


def test_what_is_kept_is_small_and_tells_of_a_win() -> None:
    notebook = quick_start.read()
    assert quick_start.NOTEBOOK.stat().st_size < 60_000
    assert "win, enemy defeated" in str(notebook)
    assert any("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", ()))


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.timeout(600)
def test_it_prints_what_is_kept_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for key in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY"):
        monkeypatch.delenv(key, raising=False)
    monkeypatch.setenv("PATH", "/usr/bin:/bin")  # `execute` adds the khala of this Python
    notebook = quick_start.read()
    kept = printed(notebook)
    quick_start.execute(notebook)
    assert printed(notebook) == kept, "after an intended change: python -m docs.quick_start"
