"""Measure how soon the page of `khala view` shows a match, how quickly it follows, and what it costs.

    python -m bench view [open] [units] [live] [match] [--decisions 20000]

open    a recording of many decisions (`long_recording.py`), first without an index, then with one: seconds from the
        command to the address, and from there to the first map; then the milliseconds from a jump of the clock to the
        map and the decisions of that moment, over jumps all through the match; memory of the server and of the tab
units   frames a second while a battle of `UNITS` units plays, and the longest frame
live    a match that is played: milliseconds from the host's report of a step to the page that shows the step
match   what a page costs the match that it watches over the bus, if its processor is `THROTTLE` times slower than ours:
        milliseconds of the host's own work a step (observe, publish, act), in turns with and without, the match on one
        core and the viewer on another
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import statistics
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import psutil

from bench.command_line import make_parser
from bench.recordings.browser import Viewer, answer, browsing, steps_of, viewing
from bench.recordings.long_recording import lengthen, play_short
from bench.survival.processes import Processes, free_port
from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import load_task
from khala_protocol.codec import encode
from khala_protocol.messages import Report, Scene, UnitMark
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from playwright.sync_api import Browser, Page

    from khala_protocol.messages import Briefing, Observation

UNITS = 400
JUMPS = 100
PLAYED_S = 8.0
ROUNDS = 3
THOUGHT_S = 0.1
THROTTLE = 20
"""How much slower the processor of the slow page is."""
WAIT_MS = 300_000
TASK = "3s5z"
PARTS = ("open", "units", "live", "match")
JUMP = """step => new Promise(done => {
    const begun = performance.now()
    location.hash = location.hash.replace(/&s=\\d+/, '') + `&s=${step}`
    const look = () => {
        const there = document.querySelector('canvas[data-step]')?.dataset.step == step
            && document.querySelector('main')?.dataset.moment == step
        there ? done(performance.now() - begun) : requestAnimationFrame(look)
    }
    look()
})"""
FRAMES = """seconds => new Promise(done => {
    const frames = []
    let last = performance.now()
    const begun = last
    const look = now => {
        frames.push(now - last)
        last = now
        now - begun > seconds * 1000 ? done(frames) : requestAnimationFrame(look)
    }
    requestAnimationFrame(look)
})"""
SHOWN = """() => {
    window.shown = {}
    new MutationObserver(() => {
        const step = document.querySelector('canvas[data-step]')?.dataset.step
        if (step !== undefined) window.shown[step] ??= Date.now()
    }).observe(document.body, {attributes: true, subtree: true, attributeFilter: ['data-step']})
}"""


@dataclass(frozen=True)
class Opened:
    """How a long recording opens."""

    decisions: int
    megabytes: float
    index: bool
    address_s: float
    first_map_s: float
    """From the command to the first map."""
    indexed_s: float | None = None
    """From the command to a complete index."""
    jump_p50_ms: float | None = None
    jump_p95_ms: float | None = None
    server_mb: float | None = None
    tab_mb: float | None = None


@dataclass(frozen=True)
class Frames:
    """How a battle plays."""

    units: int
    frames_per_s: float
    longest_ms: float


@dataclass(frozen=True)
class Lag:
    """How far a page is behind a match."""

    steps: int
    p50_ms: float
    p95_ms: float
    longest_ms: float


@dataclass(frozen=True)
class Cost:
    """What a slow page costs a match, in milliseconds of a step."""

    without_ms: float
    with_ms: float

    @property
    def ratio(self) -> float:
        """The one by the other."""
        return self.with_ms / self.without_ms


# --- open -------------------------------------------------------------------------------------------


def open_page(browser: Browser, path: Path, decisions: int) -> Iterator[Opened]:
    """Open a recording for the first time, and again."""
    for again in (False, True):
        begun = time.perf_counter()
        with viewing(path) as viewer:
            address_s = time.perf_counter() - begun
            page = browser.new_page()
            page.goto(viewer.address)
            page.wait_for_selector("canvas[data-step]", timeout=WAIT_MS)
            first_map_s = time.perf_counter() - begun
            _wait_for_index(page)
            indexed_s = time.perf_counter() - begun
            found = Opened(decisions, path.stat().st_size / 1e6, again, address_s, first_map_s)
            yield (_scrub(page, viewer, found) if again else Opened(**{**asdict(found), "indexed_s": indexed_s}))
            page.close()


def _wait_for_index(page: Page) -> None:
    while answer(page, "")["indexed"] < 1:
        page.wait_for_timeout(200)


def _scrub(page: Page, viewer: Viewer, found: Opened) -> Opened:
    steps = steps_of(page)
    chance = random.Random(1)
    jumps = [page.evaluate(JUMP, chance.choice(steps)) for _ in range(JUMPS)]
    return Opened(
        **asdict(found)
        | {
            "jump_p50_ms": statistics.median(jumps),
            "jump_p95_ms": statistics.quantiles(jumps, n=20)[-1],
            "server_mb": psutil.Process(viewer.pid).memory_info().rss / 1e6,
            "tab_mb": page.context.new_cdp_session(page).send("Runtime.getHeapUsage")["usedSize"] / 1e6,
        }
    )


# --- units ------------------------------------------------------------------------------------------


def frames(browser: Browser, directory: Path) -> Frames:
    """Play a battle of many units on the page."""
    path = write_crowd(play_short(directory / "battle", task=TASK, steps=60), directory / "crowd.mcap")
    with viewing(path) as viewer:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(viewer.address)
        page.wait_for_selector("canvas[data-step]", timeout=WAIT_MS)
        page.get_by_role("button", name="Play").click()
        took_ms = page.evaluate(FRAMES, PLAYED_S)
        page.close()
    return Frames(UNITS, len(took_ms) / sum(took_ms) * 1000, max(took_ms))


def write_crowd(path: Path, crowd: Path) -> Path:
    """Write a recording whose scenes have many units: those that are there, beside themselves."""
    with Recorder(crowd) as recorder:
        for sample in Recording.open(path):
            payload = sample.payload
            if isinstance(scene := sample.message, Scene):
                payload = encode(scene.but(units=tuple(_beside(scene.units))))
            recorder.write(sample.key, payload, log_time_ns=sample.log_time_ns)
    return crowd


def _beside(units: Sequence[UnitMark]) -> Iterator[UnitMark]:
    for copy in range(-(-UNITS // max(len(units), 1))):
        x, y = copy % 5 - 2, copy // 5 - 2
        for unit in units:
            yield unit._replace(tag=unit.tag + (copy << 40), x=unit.x + 2.0 * x, y=unit.y + 2.0 * y)


# --- live -------------------------------------------------------------------------------------------


def lag(browser: Browser, directory: Path) -> Lag:
    """Watch a match that is played on this machine."""
    directory.mkdir()
    with Processes(directory) as processes:
        path = directory / "live" / "recording.mcap"
        options = ("--run", "live", "--latency", "0.3", "--out", str(directory))
        match = processes.start("live", "run", TASK, *options)
        while not path.exists():
            assert match.poll() is None, processes.last_words("live")
            time.sleep(0.05)
        with viewing(path) as viewer:
            page = browser.new_page()
            page.goto(viewer.address)
            page.evaluate(SHOWN)
            while match.poll() is None:
                page.wait_for_timeout(200)
            page.wait_for_timeout(2000)
            shown = {int(step): at_ms for step, at_ms in page.evaluate("() => window.shown").items()}
            page.close()
    said = {s.message.step: s.log_time_ns / 1e6 for s in Recording.open(path) if isinstance(s.message, Scene)}
    late = [shown[step] - said[step] for step in sorted(said) if step in shown][1:]
    return Lag(len(late), statistics.median(late), statistics.quantiles(late, n=20)[-1], max(late))


# --- match ------------------------------------------------------------------------------------------


def cost(browser: Browser, directory: Path) -> Cost:
    """Play matches without and with a slow page that watches over the bus."""
    for child in psutil.Process().children(recursive=True):  # the browser
        child.cpu_affinity([1 % (os.cpu_count() or 1)])
    work: dict[bool, list[float]] = {False: [], True: []}
    for turn in range(ROUNDS):
        for watched in (False, True):
            work[watched] += _work_ms(browser, directory / f"{turn}-{watched}", watched=watched)
    return Cost(statistics.median(work[False]), statistics.median(work[True]))


async def decide(_: Briefing, observation: Observation) -> str:
    """Play as `focus-fire` does, and think as long as a quick model."""
    await asyncio.sleep(THOUGHT_S)
    return PLAYERS["focus-fire"](observation.text, random.Random(observation.step))


def _work_ms(browser: Browser, directory: Path, *, watched: bool) -> list[float]:
    """Play a match; return the milliseconds of the host's own work in each step."""
    directory.mkdir(parents=True)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Processes(directory) as processes, contextlib.ExitStack() as stack, _core(0):
        host = processes.start("host", "host", TASK, "--run", "cost", "--listen", endpoint, "--out", str(directory))
        names = [agent.name for agent in load_task(TASK).agents]
        policy = f"{__spec__.name}:decide"
        processes.start("agents", "agent", *names, "--run", "cost", "--connect", endpoint, "--policy", policy)
        if watched:
            stack.enter_context(_core(1))
            viewer = stack.enter_context(viewing("cost", "--connect", endpoint))
            page = browser.new_page()
            stack.callback(page.close)
            page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": THROTTLE})
            page.goto(viewer.address)
        if host.wait(WAIT_MS / 1000):
            raise RuntimeError(f"the host failed: {processes.last_words('host')}")
    (recording,) = directory.glob("cost/*.mcap")
    reports = Recording.open(recording).of(Report)
    return [1000 * (r.timings.observe_s + r.timings.publish_s + r.timings.act_s) for r in reports]


@contextlib.contextmanager
def _core(number: int) -> Iterator[None]:
    """Start processes on one core, as on a machine of their own."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {number % (os.cpu_count() or 1)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


# --- the command ------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="all of them, if none is named")
    parser.add_argument("--decisions", type=int, default=20_000)
    options = parser.parse_args(arguments)
    parts = options.parts or PARTS
    with tempfile.TemporaryDirectory() as name, browsing() as browser:
        directory = Path(name)
        if "open" in parts:
            long = directory / "long.mcap"
            decisions = lengthen(play_short(directory / "short"), long, options.decisions)
            for found in open_page(browser, long, decisions):
                _say("open", found)
        if "units" in parts:
            _say("units", frames(browser, directory))
        if "live" in parts:
            _say("live", lag(browser, directory / "watched"))
        if "match" in parts:
            _say("match", cost(browser, directory / "cost"))
    return 0


def _say(part: str, found: Opened | Frames | Lag | Cost) -> None:
    figures = {name: round(value, 2) if isinstance(value, float) else value for name, value in asdict(found).items()}
    print(part, json.dumps({name: value for name, value in figures.items() if value is not None}), flush=True)
