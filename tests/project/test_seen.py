"""The page of four observations: its pictures are there, each is shown, and no other is left."""

from __future__ import annotations

import re

import cv2
import pytest

from docs import seen
from khala_bridge.observe.text import SECTIONS_OF
from khala_bridge.task.images import PAPER

PAGE = seen.PAGE.read_text(encoding="utf-8")
SHOWN = re.findall(r"!\[[^\]]*\]\(\.\./images/seen/([\w-]+)\.webp\)", PAGE)


def test_every_kind_of_agent_is_shown() -> None:
    assert set(seen.SCENES) == set(SECTIONS_OF) == set(PAPER)


@pytest.mark.parametrize("kind", seen.SCENES)
def test_an_observation_is_shown_with_all_its_pictures(kind: str) -> None:
    scene = seen.SCENES[kind]
    assert f"## {scene.title}\n\n{scene.about}" in PAGE
    assert [name for name in SHOWN if name.startswith(f"{kind}-")] == [
        f"{kind}-{place}" for place in range(1, len(PAPER[kind]) + 1)
    ]


def test_texts_are_those_of_agents() -> None:
    texts = re.findall(r"```text\n(.*?)\n```", PAGE, re.DOTALL)
    assert len(texts) == len(seen.SCENES)
    assert all("Game\n    Time: " in text and "\nAnswer\n" in text for text in texts)


@pytest.mark.parametrize("name", SHOWN)
def test_a_picture_is_small_and_decodes(name: str) -> None:
    path = seen.OUT / f"{name}.webp"
    assert path.stat().st_size < 80_000
    image = cv2.imread(str(path))
    assert image is not None
    assert image.shape == (512, 512, 3)


def test_no_picture_is_left_that_nobody_shows() -> None:
    assert sorted(path.stem for path in seen.OUT.iterdir()) == sorted(SHOWN)
