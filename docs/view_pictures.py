"""Play matches and draw the pictures of their page: `python -m docs.view_pictures [NAME …]`, docs/images/view.

Each picture is the page itself in Chromium, at a moment that a link names. Matches are played by the scripted player
`skilled`, from fixed seeds.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np

from bench.recordings.browser import browsing, go_to, steps_of, viewing
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser

OUT = Path(__file__).parent / "images" / "view"
WIDE, PHONE = (1440, 900), (390, 844)
QUALITY = 82
Role = Literal["button", "checkbox", "link"]
FIT: tuple[Role, str] = ("button", "Fit")
CURVES: tuple[Role, str] = ("button", "Curves")
SETTLED_MS = 2500
"""Until the pictures of the page have come and its map is drawn."""


@dataclass(frozen=True)
class Picture:
    """One picture of the page.

    Attributes:
        name: of the file.
        made: makes what is looked at in a directory, and returns it.
        share: of the match, where the clock stands.
        size: of the window.
        dark: whether the page is dark.
        click: what to click, by its role and name.
    """

    name: str
    made: Callable[[Path], tuple[Path, ...]]
    share: float = 0.5
    size: tuple[int, int] = WIDE
    dark: bool = False
    click: tuple[tuple[Role, str], ...] = ()


def battle(directory: Path) -> tuple[Path, ...]:
    """Play a battle of several agents."""
    return (played(directory, "pvz_task6_level1"),)


def full_game(directory: Path) -> tuple[Path, ...]:
    """Play a whole game."""
    return (played(directory, "simple64_eceb"),)


def two_runs(directory: Path) -> tuple[Path, ...]:
    """Play the same battle with two players."""
    return played(directory, "3s5z", "focus-fire"), played(directory, "3s5z")


def going_on(directory: Path) -> tuple[Path, ...]:
    """Return a match that is not over: what its file held after two thirds of it."""
    whole, path = Recording.open(played(directory, "pvz_task5_level1")), directory / "live.mcap"
    recorder = Recorder(path)  # it stays open, as that of a host does
    samples = list(whole)
    for sample in samples[: len(samples) * 2 // 3]:
        recorder.write(sample.key, sample.payload)
    recorder.flush()
    return (path,)


def experiment(directory: Path) -> tuple[Path, ...]:
    """Play an experiment of a few matches."""
    khala("experiment", "run", "smoke", "--out", str(directory / "experiments"))
    return (directory / "experiments",)


def played(directory: Path, task: str, player: str = "skilled") -> Path:
    """Play a match; return its recording."""
    run = f"{task}-{player}"
    path = directory / run / "recording.mcap"
    if not path.exists():
        khala("run", task, "--model-name", player, "--latency", "0", "--run", run, "--out", str(directory))
    return path


def khala(*arguments: str) -> None:
    """Call khala."""
    command = [sys.executable, "-m", "khala_sc2", *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603  # ours


PICTURES = (
    Picture("battle", battle, 0.7, click=(FIT,)),
    Picture("full-game", full_game, 0.85, click=(CURVES, ("checkbox", "Workers"), ("checkbox", "Supply"), CURVES)),
    Picture("live", going_on, 1.0, dark=True, click=(FIT,)),
    Picture("two-runs", two_runs, 0.6),
    Picture("experiment", experiment, click=(("link", "smoke"),)),
    Picture("phone", battle, 0.7, size=PHONE, click=(FIT,)),
)


def draw(browser: Browser, picture: Picture, directory: Path) -> Path:
    """Draw one picture."""
    width, height = picture.size
    scheme: Literal["dark", "light"] = "dark" if picture.dark else "light"
    with viewing(*picture.made(directory)) as viewer:
        context = browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme=scheme,
            device_scale_factor=2 if width < 500 else 1,
        )
        page = context.new_page()
        page.goto(viewer.address)
        page.wait_for_timeout(SETTLED_MS)
        if page.get_by_role("slider", name="Moment").count():
            steps = steps_of(page)
            go_to(page, steps[round((len(steps) - 1) * picture.share)])
        for role, name in picture.click:
            page.get_by_role(role, name=name, exact=True).click()
        page.wait_for_timeout(SETTLED_MS)
        pixels = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
        context.close()
    OUT.mkdir(parents=True, exist_ok=True)
    path = OUT / f"{picture.name}.webp"
    assert pixels is not None
    cv2.imwrite(str(path), pixels, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    return path


def drawn(names: list[str]) -> Iterator[Path]:
    """Draw the pictures of these names, or all; yield their files."""
    with tempfile.TemporaryDirectory() as directory, browsing() as browser:
        for picture in PICTURES:
            if not names or picture.name in names:
                yield draw(browser, picture, Path(directory))


if __name__ == "__main__":
    for path in drawn(sys.argv[1:]):
        sys.stderr.write(f"{path}\n")
