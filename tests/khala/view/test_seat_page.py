"""The page of a person's seat in Debian's Chromium: with the keyboard alone, on a phone, and for everybody."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
from itertools import islice
from typing import TYPE_CHECKING, Any

import pytest

from bench.recordings.browser import CHROMIUM, browsing
from khala_protocol.messages import Message, Reply, Result
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser, Page

WAIT_MS = 30_000
END_S = 60.0
ASKED = "step => document.querySelector('.seat-standing').innerText.includes(`Your turn: step ${step}\\n`)"
PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

pytestmark = [
    pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium; Debian has it as the package chromium"),
    pytest.mark.timeout(300),
    pytest.mark.game,
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsing() as started:
        yield started


@contextlib.contextmanager
def match(out: Path, *options: str) -> Iterator[tuple[list[str], subprocess.Popen[str]]]:
    """Start a match with persons; yield their links, and its process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "khala_sc2", "run", *options, "--run", "people", "--out", str(out)],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        found = (re.search(r"https?://\S+", line) for line in process.stderr)
        yield list(islice((link.group() for link in found if link), options.count("--person"))), process
    finally:
        process.terminate()
        process.communicate(timeout=END_S)


def seated(browser: Browser, link: str, **options: Any) -> Page:
    """Open a link in a window of its own."""
    page = browser.new_context(**options).new_page()
    page.set_default_timeout(WAIT_MS)
    failed: list[str] = []
    page.on("pageerror", lambda error: failed.append(str(error)))
    page.on("console", lambda message: failed.append(message.text) if message.type == "error" else None)
    page.goto(link)
    page.wait_for_selector(".seat-standing")
    page.failed = failed  # type: ignore[attr-defined]
    return page


def step(page: Page, number: int) -> None:
    """Wait until a step is asked."""
    page.wait_for_function(ASKED, arg=number)


def ended(page: Page, process: subprocess.Popen[str]) -> str:
    """Return what a page says once the match is over."""
    page.get_by_text("The match is over.").wait_for()
    assert process.wait(timeout=END_S) == 0
    assert not page.failed  # type: ignore[attr-defined]
    return page.inner_text(".seat-result")


def test_a_person_plays_with_the_keyboard_alone(browser: Browser, tmp_path: Path) -> None:
    with match(tmp_path, "2s3z_pair", "--person", "Stalkers", "--max-steps", "4") as ((link,), process):
        page = seated(browser, link)
        keys = page.keyboard
        step(page, 0)
        assert "token" not in page.url
        keys.press("w")  # Move Screen: its point is picked by the cross
        for _ in range(40):
            keys.press("Tab")
            if page.evaluate("() => document.activeElement.getAttribute('role')") == "application":
                break
        keys.press("ArrowRight")
        keys.press("Enter")
        assert re.fullmatch(
            r"Actions:\n    Team Stalker-1:\n        <Move_Screen\(\[\d[\d.]*, \d[\d.]*\]\)>\n",
            page.input_value("textarea"),
        )
        keys.press("Control+Enter")
        step(page, 1)
        page.get_by_role("img", name="accepted").wait_for()
        page.get_by_label("Your answer").focus()
        keys.insert_text("Analysis: I think\n")
        keys.press("Control+Enter")
        step(page, 2)
        keys.press("Shift+Tab")  # out of the text
        keys.press("z")
        keys.press("Control+Enter")
        step(page, 3)
        keys.press("Control+Enter")
        assert ended(page, process).startswith("Episode 1: cut at 4 steps.")
    recording = Recording.open(tmp_path / "people" / "recording.mcap")
    said = [reply.text for reply in recording.of(Reply) if reply.human]
    assert [text.split("\n")[0] for text in said] == ["Actions:", "Analysis: I think", "", ""]
    (result,) = recording.of(Result)
    assert (result.humans, result.valid) == ({"Stalkers": 4}, True)


@pytest.mark.slow
def test_two_persons_play_against_each_other_one_of_them_on_a_phone(browser: Browser, tmp_path: Path) -> None:
    seats = ("--person", "blue/Stalkers", "--person", "red/Zealots")
    with match(tmp_path, "duel_2s3z", *seats, "--max-steps", "3") as ((blue, red), process):
        desk = seated(browser, blue)
        phone = seated(browser, red, **PHONE)
        for number in range(3):
            step(phone, number)
            phone.get_by_role("button", name="Attack Unit", exact=True).tap()
            phone.get_by_role("group", name="Targets").get_by_role("button").first.tap()
            phone.get_by_label("Message", exact=True).fill(f"I go {number}")
            phone.get_by_role("button", name="Add to the answer").tap()
            phone.get_by_role("button", name="Send for step").tap()
            step(desk, number)
            desk.get_by_role("button", name="Carry on without orders").click()
        for page in (desk, phone):
            assert ended(page, process).startswith("Episode 1: cut at 3 steps.")
    recording = Recording.open(tmp_path / "people" / "recording.mcap")
    assert [said.text for said in recording.of(Message) if said.agent == "Zealots" and said.side == "red"] == [
        "I go 0", "I go 1", "I go 2",
    ]  # fmt: skip
    assert [result.humans for result in recording.of(Result)] == [{"Stalkers": 3}, {"Zealots": 3}]


@pytest.mark.slow
def test_a_draft_outlives_a_reload_and_the_time_of_its_step(browser: Browser, tmp_path: Path) -> None:
    options = ("--person", "Stalkers", "--max-steps", "5", "--max-wait", "4")
    with match(tmp_path, "2s3z_pair", *options) as ((link,), _):
        page = seated(browser, link)
        step(page, 0)
        page.get_by_label("Your answer").fill("Analysis: slowly")
        page.reload()
        step(page, 1)
        assert page.input_value("textarea") == "Analysis: slowly"
        other = page.context.new_page()
        other.goto(page.url)
        other.get_by_text("Another window plays this seat.").wait_for()
        other.get_by_role("button", name="Play here").click()
        page.get_by_text("Another window plays this seat.").wait_for()


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everybody_can_read_and_reach_it(browser: Browser, tmp_path: Path, scheme: Any) -> None:
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]  # it has no types

    with match(tmp_path, "duel_2s3z", "--person", "red/Zealots", "--max-wait", "200") as ((link,), _):
        for view in ({"viewport": {"width": 1280, "height": 800}}, PHONE):
            page = seated(browser, link, color_scheme=scheme, bypass_csp=True, **view)
            step(page, 0)
            page.get_by_role("button", name="Attack Unit", exact=True).click()
            page.get_by_role("group", name="Targets").wait_for()
            found = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]})
            assert found.violations_count == 0, found.generate_report()
            page.context.close()
