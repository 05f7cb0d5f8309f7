"""Recordings to look at: a battle that was played, the same without its map, and one that is made up."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_protocol.keys import Topic
from khala_protocol.recording import Recorder, read
from tests.khala.view.made import make, opened

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_sc2.view.runs import Opened

GOLDEN = Path(__file__).parents[1] / "golden.mcap"


@pytest.fixture(scope="session", autouse=True)
def cache_of_the_session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the indexes of recordings of the session out of the user's cache directory."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KHALA_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


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
    """A battle that was played."""
    found = opened(Path(shutil.copy(GOLDEN, tmp_path_factory.mktemp("golden") / "golden.mcap")))
    yield found
    found.index.close()


@pytest.fixture(scope="session")
def old(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    """The battle as older versions recorded it: without its map."""
    path = tmp_path_factory.mktemp("old") / "old.mcap"
    with Recorder(path) as recorder:
        for sample in read(GOLDEN):
            if not sample.key.endswith((f"/{Topic.SCENE}", f"/{Topic.TERRAIN}")):
                recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
    found = opened(path)
    yield found
    found.index.close()
