"""The page of `khala view` in Debian's Chromium: for its tests, its pictures and its measurements.

Needs the packages of the group `page`, which `make install-tests` installs, and a Chromium on PATH.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or ""
END_S = 20.0


@dataclass(frozen=True)
class Viewer:
    """A `khala view` that serves its page."""

    address: str
    """With the token."""
    pid: int

    @property
    def origin(self) -> str:
        """The address without path and token."""
        return self.address.partition("/?")[0]


@contextlib.contextmanager
def viewing(*arguments: Path | str) -> Iterator[Viewer]:
    """Start `khala view` with some arguments; end it."""
    process = subprocess.Popen(
        [sys.executable, "-m", "khala_sc2", "view", *map(str, arguments), "--no-open"],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        yield Viewer(_address(process), process.pid)
    finally:
        process.terminate()
        process.communicate(timeout=END_S)


def _address(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        if found := re.search(r"https?://\S+", line):
            return found.group()
        said.append(line)
    raise RuntimeError(f"khala view ended before it printed an address: {''.join(said)}")


@contextlib.contextmanager
def browsing() -> Iterator[Browser]:
    """Start Chromium; end it."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  # only the group `page` has it

    if not CHROMIUM:
        raise RuntimeError("there is no Chromium on PATH; Debian has it as the package chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


def answer(page: Page, path: str) -> Any:
    """Return what the server answers to a page that shows a match, by a path below that match."""
    run = page.url.partition("a=")[2].partition("&")[0]
    return page.evaluate("path => fetch(path).then(answer => answer.json())", f"/api/runs/{run}{path}")


def steps_of(page: Page) -> list[int]:
    """Return the steps of the first episode of the match that a page shows."""
    return list(answer(page, "/episodes/0/timeline")["steps"])


def go_to(page: Page, step: int) -> None:
    """Have a page show a step, by the link that holds it."""
    page.evaluate("step => { location.hash = location.hash.replace(/&s=\\d+/, '') + `&s=${step}` }", step)
    page.wait_for_selector(f"canvas[data-step='{step}']")
