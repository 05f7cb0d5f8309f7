from __future__ import annotations

import contextlib
import json
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from bench.recordings.browser import CHROMIUM, Viewer, answer, browsing, go_to, steps_of, viewing
from khala_protocol.keys import Topic
from khala_protocol.messages import Observation, Reply, Report, Scene
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser, BrowserContext, Page

GOLDEN = Path(__file__).parents[1] / "golden.mcap"
HOSTILE = (
    '<img src=x onerror="window.taken=1"><script>window.taken=1</script>'
    "<svg onload=window.taken=1> javascript:window.taken=1 </script></textarea>\u202e<b>bold</b>"
)
WAIT_MS = 20_000
NAME_OF_FOCUS = """() => {
    const it = document.activeElement
    return it.getAttribute('aria-label') || it.labels?.[0]?.firstChild.textContent.trim() || it.innerText
}"""

pytestmark = [
    pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium; Debian has it as the package chromium"),
    pytest.mark.timeout(300),
]


@pytest.fixture(scope="module")
def view() -> Iterator[Callable[..., Viewer]]:
    """Start `khala view` with some arguments; end all of them."""
    with contextlib.ExitStack() as stack:
        yield lambda *arguments: stack.enter_context(viewing(*arguments))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsing() as started:
        yield started


@pytest.fixture(scope="module")
def golden(view: Callable[..., Viewer], browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Viewer:
    """The golden battle, in a view of its own, which has read all of it: until then keys stop at the last step read."""
    path = tmp_path_factory.mktemp("golden") / "recording.mcap"
    shutil.copy(GOLDEN, path)
    viewer = view(path)
    last = max(report.step for report in Recording.open(GOLDEN).of(Report))
    page = browser.new_page()
    page.goto(viewer.address)
    page.wait_for_function("last => document.body.innerText.includes(`step 0 of ${last}`)", arg=last)
    page.close()
    return viewer


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A window whose page may ask its own server and nobody else, and must not fail."""
    made = browser.new_context(viewport={"width": 1280, "height": 800})
    yield made
    made.close()


def opened(context: BrowserContext, address: str, wait_for: str = "canvas[data-step]") -> Page:
    """Open an address; wait until something is there, by default the map of a match. Keys before it move nothing."""
    page = context.new_page()
    page.set_default_timeout(WAIT_MS)
    asked: list[str] = []
    failed: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: failed.append(str(error)))
    page.on("console", lambda message: failed.append(message.text) if message.type == "error" else None)
    page.goto(address)
    page.wait_for_selector(wait_for)
    page.asked, page.failed = asked, failed  # type: ignore[attr-defined]
    return page


def asked_hosts(page: Page) -> set[str]:
    """Return whom the page has asked for anything."""
    return {url.partition("/api")[0].partition("/?")[0].rstrip("/") for url in page.asked}  # type: ignore[attr-defined]


# --- what a reader does -----------------------------------------------------------------------------


def test_a_stranger_sees_who_plays_and_who_wins(context: BrowserContext, golden: Viewer) -> None:
    page = opened(context, golden.address)
    for text in (re.compile(r"^(Blue|Opponent) wins: "), re.compile("Army value")):
        page.get_by_text(text).first.wait_for()
    assert {"Blue", "Opponent", "Army value"} <= set(re.split(r"\s*\n\s*|(?<=\d) | (?=\d)", page.inner_text("main")))
    assert page.get_by_role("img", name=re.compile("^Map of")).is_visible()
    colours = page.evaluate(
        """() => { const map = document.querySelector('[aria-label^="Map of"]');
            const canvas = map.tagName === 'CANVAS' ? map : map.querySelector('canvas');
            const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
            return new Set(new Uint32Array(data.buffer)).size }"""
    )
    assert colours > 20
    assert not page.failed  # type: ignore[attr-defined]
    assert asked_hosts(page) == {golden.origin}


@pytest.mark.slow
def test_keys_scrub_and_a_link_brings_another_reader_to_the_moment(context: BrowserContext, golden: Viewer) -> None:
    page = opened(context, golden.address)
    page.get_by_role("slider", name="Moment").focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    page.wait_for_function("() => document.body.innerText.includes('step 13 of')")
    page.wait_for_function("() => location.hash.includes('s=13')")
    other = opened(context, page.url)
    other.wait_for_function("() => document.body.innerText.includes('step 13 of')")
    page.keyboard.press("Home")
    page.wait_for_function("() => document.body.innerText.includes('step 0 of')")
    go_to(page, 20)
    page.wait_for_function("() => location.hash.includes('s=20')")


@pytest.mark.slow
def test_a_link_holds_though_the_address_is_written_over_before_the_page_hears_of_it(
    context: BrowserContext, golden: Viewer
) -> None:
    page = opened(context, golden.address)
    page.evaluate(
        """() => { const old = location.hash
            location.hash = old.replace(/&s=\\d+/, '') + '&s=9'
            history.replaceState(null, '', old) }"""
    )
    page.wait_for_selector("canvas[data-step='9']")


@pytest.mark.slow
def test_play_moves_the_clock_to_the_end_and_stops_there(context: BrowserContext, golden: Viewer) -> None:
    page = opened(context, golden.address)
    page.get_by_label("Speed").select_option(label="×16")
    page.get_by_role("button", name="Play").click()
    last = len(steps_of(page)) - 1
    page.wait_for_function("last => document.body.innerText.includes(`step ${last} of`)", arg=last)
    page.get_by_role("button", name="Play").wait_for()


def test_what_stands_on_the_page_is_what_the_recording_says(context: BrowserContext, golden: Viewer) -> None:
    page = opened(context, golden.address)
    recording = Recording.open(GOLDEN)
    reports = {report.step: report for report in recording.of(Report)}
    replies = {(reply.step, reply.agent): reply for reply in recording.of(Reply)}
    scenes = {scene.step: scene for scene in recording.of(Scene)}
    for step in sorted(reports)[::9]:
        go_to(page, step)
        for agent in reports[step].agents:
            column = page.get_by_role("region", name=re.compile(f"^Agent {agent.agent} "))
            said = replies[agent.asked_step if agent.asked_step is not None else step, agent.agent]
            column.get_by_text(str(agent.fate or agent.status), exact=True).wait_for()
            column.get_by_role("tab", name="Reply").click()
            column.get_by_text(" ".join(said.text.split())[:80]).first.wait_for()
            column.get_by_role("tab", name="Decision").click()
            assert column.get_by_role("img", name="accepted").count() == len(agent.accepted)
        units = answer(page, f"/episodes/0/scenes?from={step}&to={step}")["scenes"][0]["units"]
        assert units == json.loads(scenes[step].model_dump_json())["units"]


@pytest.mark.slow
def test_two_runs_stand_on_one_clock(context: BrowserContext, view: Callable[..., Viewer], tmp_path: Path) -> None:
    for name in ("a", "b"):
        shutil.copy(GOLDEN, tmp_path / f"{name}.mcap")
    page = opened(context, view(tmp_path / "a.mcap", tmp_path / "b.mcap").address)
    assert page.get_by_role("img", name=re.compile("^Map of")).count() == 2
    assert re.search(r"#a=\w+&b=\w+", page.url) or "b=" in page.url


@pytest.mark.slow
def test_a_list_of_runs_leads_to_a_match(context: BrowserContext, view: Callable[..., Viewer], tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        shutil.copy(GOLDEN, tmp_path / name / "recording.mcap")
    page = opened(context, view(tmp_path).address, "role=table")
    assert page.get_by_role("row").count() == 3
    page.get_by_role("searchbox").fill("no such match")
    page.wait_for_function("() => document.querySelectorAll('tbody tr').length === 0")
    page.get_by_role("searchbox").fill("2s3z")
    page.get_by_role("link", name="2s3z_pair").first.click()
    page.get_by_role("slider", name="Moment").wait_for()


@pytest.mark.slow
def test_a_match_that_is_played_grows_on_the_page(
    context: BrowserContext, view: Callable[..., Viewer], tmp_path: Path
) -> None:
    samples = list(Recording.open(GOLDEN))
    path = tmp_path / "recording.mcap"
    steps = [i for i, sample in enumerate(samples) if sample.address and sample.address.topic is Topic.REPORT]
    with Recorder(path) as recorder:

        def write(begin: int, end: int) -> None:
            for sample in samples[begin:end]:
                recorder.write(sample.key, sample.payload)
            recorder.flush()

        write(0, steps[4] + 1)
        page = opened(context, view(path).address)
        page.wait_for_function("() => document.body.innerText.includes('step 4 of 4')")
        write(steps[4] + 1, steps[9] + 1)
        page.wait_for_function("() => document.body.innerText.includes('step 9 of 9')")
        write(steps[9] + 1, len(samples))
    page.wait_for_function("() => / wins/.test(document.body.innerText)")


# --- safety -----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_hostile_texts_stay_texts(context: BrowserContext, view: Callable[..., Viewer], tmp_path: Path) -> None:
    path = tmp_path / "hostile.mcap"
    with Recorder(path) as recorder:
        for sample in Recording.open(GOLDEN):
            recorder.write(sample.key, _made_hostile(sample.message, sample.payload), log_time_ns=sample.log_time_ns)
    page = opened(context, view(path).address)
    page.on("dialog", lambda dialog: pytest.fail(f"a dialog: {dialog.message}"))
    go_to(page, 5)
    column = page.get_by_role("region", name=re.compile("^Agent ")).first
    for tab in ("Saw", "Reply", "Requests", "Decision"):
        column.get_by_role("tab", name=tab).click()
        page.wait_for_timeout(200)
    for tab in ("Messages", "What happened", "Run card", "Agents"):
        page.get_by_role("tab", name=tab, exact=True).click()
        page.wait_for_timeout(100)
    assert "onerror" in page.inner_text("main")
    assert page.evaluate("() => window.taken") is None
    assert page.locator("main img[src], main script, main svg[onload]").count() == 0
    assert asked_hosts(page) == {page.evaluate("location.origin")}


def _made_hostile(message: object, payload: bytes) -> bytes:
    match message:
        case Reply():
            said = f"{HOSTILE}\n{message.text}\n<MessageTo(everyone, '''{HOSTILE}''')>"
            return message.but(text=said).model_dump_json().encode()
        case Observation():
            return message.but(text=HOSTILE + message.text).model_dump_json().encode()
        case Report():
            agents = tuple(agent.but(detail=HOSTILE) for agent in message.agents)
            return message.but(agents=agents, incidents=(HOSTILE,)).model_dump_json().encode()
    return payload


# --- for everybody ----------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", [pytest.param("light", marks=pytest.mark.slow), "dark"])
@pytest.mark.parametrize(
    "width", [1280, pytest.param(820, marks=pytest.mark.slow), pytest.param(390, marks=pytest.mark.slow)]
)
def test_everybody_can_read_and_reach_it(browser: Browser, golden: Viewer, scheme: Any, width: int) -> None:
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]  # it has no types

    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, bypass_csp=True)
    page = opened(context, golden.address)
    go_to(page, 12)
    found = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]})
    assert found.violations_count == 0, found.generate_report()
    context.close()


@pytest.mark.slow
def test_the_keyboard_alone_reaches_everything(context: BrowserContext, golden: Viewer) -> None:
    page = opened(context, golden.address)
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(NAME_OF_FOCUS))
    assert {"Moment", "Play", "Eyes", "Speed", "Layers", "Help"} <= reached
    page.keyboard.press("?")
    page.get_by_role("dialog").wait_for()
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
