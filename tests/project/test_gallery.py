"""The gallery: its matches are played as the page says, and each has a small picture."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from docs import gallery

if TYPE_CHECKING:
    from pathlib import Path

PAGE = gallery.PAGE.read_text(encoding="utf-8")
MATCHES = gallery.matches(PAGE)
MOST_BYTES = 300_000
"""Of all pictures together: what is larger is made with the site."""


def test_five_matches_are_shown_a_whole_game_and_a_duel_among_them() -> None:
    tasks = [arguments[1] for arguments in MATCHES.values()]
    assert len(tasks) == 5
    assert any(task.startswith("simple64_") for task in tasks)
    assert any(task.startswith("duel_") for task in tasks)
    assert re.findall(r"^khala view (\w+)$", PAGE, re.MULTILINE) == list(MATCHES)


def test_each_match_has_a_picture_and_all_are_small() -> None:
    assert re.findall(r"!\[[^\]]+\]\(images/gallery/(\w+)\.webp\)", PAGE) == list(MATCHES)
    pictures = list(gallery.PICTURES.iterdir())
    assert {path.stem for path in pictures} == MATCHES.keys()
    assert sum(path.stat().st_size for path in pictures) <= MOST_BYTES


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.timeout(300)
def test_a_match_becomes_a_page_once(tmp_path: Path) -> None:
    commands = {"battle": [*MATCHES["battle"], "--max-steps", "3"]}
    (page,) = gallery.export(commands, tmp_path)
    assert 'id="khala-data"' in page.read_text(encoding="utf-8")
    assert gallery.export(commands, tmp_path) == []


@pytest.mark.slow
@pytest.mark.game
def test_a_match_that_cannot_be_played_says_why(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no_such_task"):
        gallery.export({"lost": ["run", "no_such_task", "--run", "lost"]}, tmp_path)
