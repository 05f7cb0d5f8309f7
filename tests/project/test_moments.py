"""The pictures of rendered moments in the documentation: there, small, shown, and made by their command."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from docs import moments

PAGE = Path(moments.__file__).parent / "design" / "rendering.md"
NAMES = (*moments.MOMENTS, moments.GALLERY)


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_shipped_small_and_shown(name: str) -> None:
    path = moments.OUT / f"{name}.webp"
    assert path.stat().st_size < 150_000
    image = cv2.imread(str(path))
    assert image is not None
    assert min(image.shape[:2]) >= moments.SCREEN
    assert f"../images/moments/{name}.webp" in PAGE.read_text(encoding="utf-8")


def test_no_picture_is_left_that_nobody_makes() -> None:
    assert {path.stem for path in moments.OUT.iterdir()} == set(NAMES)
    shown = re.findall(r"images/moments/(\w+)\.webp", PAGE.read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(NAMES)


def test_a_moment_is_taken_the_same_each_time() -> None:
    one, other = (moments.take(moments.MOMENTS["clash"]) for _ in range(2))
    assert one.shape == (moments.SCREEN, moments.SCREEN + moments.GAP + moments.MINIMAP, 3)
    assert np.array_equal(one, other)
