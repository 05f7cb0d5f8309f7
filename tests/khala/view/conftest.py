"""Recordings to look at: a battle that was played, without scenes, and one made up, with them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.khala.view.made import make, opened

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala.view.runs import Opened

GOLDEN = Path(__file__).parents[1] / "golden.mcap"


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KHALA_CACHE", str(tmp_path / "cache"))


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    found = opened(make(tmp_path_factory.mktemp("made") / "made.mcap"))
    yield found
    found.index.close()


@pytest.fixture(scope="session")
def golden(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    found = opened(Path(shutil.copy(GOLDEN, tmp_path_factory.mktemp("golden") / "golden.mcap")))
    yield found
    found.index.close()
