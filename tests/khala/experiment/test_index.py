"""The index of an experiment is made again of the recordings, whatever is wrong with it, and nothing is lost."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import sqlite3
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2 import indexes
from khala_sc2.experiment import index as rows
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.runner import Runner
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import INDEX, MATCHES, Store
from tests.khala.experiment.made import MadeEngine, record

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_sc2.experiment.plan import PlannedMatch

FOUND = Experiment.model_validate({"name": "e", "fixed": {"model": "scripted"}, "factors": {"task": ["3s5z"]}})


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("played") / "e"
    store = Store(directory)
    for match in matches():
        path = store.recording_for(match.key)
        record(path, match.config)
        store.take(path, attempts=1)
    return directory


@pytest.fixture
def directory(played: Path, tmp_path: Path) -> Path:
    return shutil.copytree(played, tmp_path / "e")


def matches() -> list[PlannedMatch]:
    return plan(FOUND.model_copy(update={"seeds": (1, 2)}))


def known(directory: Path) -> tuple[Any, ...]:
    store = Store(directory)
    rows = store.results(), store.calls(), list(store.matches().values())
    return tuple(sorted(map(repr, found)) for found in rows)


def damaged(change: Callable[[bytearray], object]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        data = bytearray(path.read_bytes())
        change(data)
        path.write_bytes(data)

    return apply


def sql(script: str) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        with contextlib.closing(sqlite3.connect(path)) as db:
            db.executescript(script)

    return apply


def replaced(make: Callable[[Path], object]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        path.unlink()
        make(path)

    return apply


def _a_directory_with_something(path: Path) -> None:
    path.mkdir()
    (path / "notes.txt").write_text("of somebody")


DAMAGES: dict[str, Callable[[Path], None]] = {
    "empty": damaged(lambda data: data.clear()),
    "torn": damaged(lambda data: data.__delitem__(slice(len(data) // 2, None))),
    "random bytes": damaged(lambda data: data.__setitem__(slice(None), os.urandom(len(data)))),
    "a page of random bytes": damaged(lambda data: data.__setitem__(slice(4096, 8192), os.urandom(4096))),
    "pages of zeros": damaged(lambda data: data.__setitem__(slice(4096, None), bytes(len(data) - 4096))),
    "missing": lambda path: path.unlink(),
    "a directory": replaced(lambda path: path.mkdir()),
    "a directory with something in it": replaced(_a_directory_with_something),
    "a link to nothing": replaced(lambda path: path.symlink_to("nowhere")),
    "a pipe": replaced(lambda path: os.mkfifo(path)),  # noqa: PLW0108  # Windows lacks it
    "of another version": sql("pragma user_version = 99"),
    "with another column": sql("alter table results add column more text"),
    "with a trigger": sql("create trigger t after insert on results begin delete from matches; end"),
    "with a view in place of a table": sql("drop table matches; create view matches as select 1 as key"),
    "a state that there is not": sql("update matches set state = 'splendid'"),
    "a cell that is no JSON": sql("update matches set cell = '{'"),
    "a cell of numbers": sql("update matches set cell = '7'"),
    "a word for a number": sql("update results set steps = 'many'"),
    "bytes for a word": sql("update results set outcome = x'00ff'"),
    "nothing for a word": sql("update results set outcome = null"),
    "a result of no match": sql("update results set match = 'nobody'"),
}
OFTEN = {"torn", "a page of random bytes", "a directory", "a word for a number"}


def test_results_can_be_read_while_the_experiment_goes_on(directory: Path, tmp_path: Path) -> None:
    store = Store(directory)
    first, second = store.matches().values()
    found = store.read(directory / second.recording, attempts=1)
    assert found is not None
    path = tmp_path / INDEX
    rows.create(path).close()
    statements: list[str] = []

    def finish_a_match(statement: str) -> None:
        statements.append(statement)
        if len(statements) == 2:
            with contextlib.closing(rows.connect(path)) as runner:
                rows.add(runner, *found)

    with contextlib.closing(rows.connect(path)) as reader:
        rows.add(reader, first, found[1])
        reader.set_trace_callback(finish_a_match)
        assert {row["match"] for row in rows.results_in(reader)} == {first.key}
        assert {row["match"] for row in rows.results_in(reader)} == {first.key, second.key}


@pytest.mark.parametrize(
    "name", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.slow) for name in DAMAGES]
)
def test_a_broken_one_is_made_again_with_one_sentence(
    directory: Path, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    before = known(directory)
    DAMAGES[name](directory / INDEX)
    assert known(directory) == before
    assert [record.getMessage().count("is rebuilt from the recordings") for record in caplog.records] == [1]
    caplog.clear()
    assert known(directory) == before
    assert not caplog.records
    assert (directory / INDEX).stat().st_mode & 0o177 == 0


def test_a_directory_in_its_place_that_holds_anything_is_put_aside(directory: Path) -> None:
    DAMAGES["a directory with something in it"](directory / INDEX)
    known(directory)
    (kept,) = directory.glob(f"{INDEX}.*/notes.txt")
    assert kept.read_text() == "of somebody"


def test_an_old_journal_beside_it_is_not_played_into_the_new_one(directory: Path) -> None:
    before = known(directory)
    DAMAGES["random bytes"](directory / INDEX)
    (directory / f"{INDEX}-journal").write_bytes(os.urandom(4096))
    assert known(directory) == before
    assert not list(directory.glob(f"{INDEX}-*"))


def test_while_another_process_plays_it_is_made_in_memory(directory: Path, caplog: pytest.LogCaptureFixture) -> None:
    before = known(directory)
    DAMAGES["torn"](directory / INDEX)
    torn = (directory / INDEX).read_bytes()
    with Store(directory).lock():
        assert known(directory) == before
        assert (directory / INDEX).read_bytes() == torn
        with pytest.raises(ConfigError, match="another process plays the experiment"):
            Store(directory).rebuild()
    assert "nothing is lost" in caplog.text


def test_on_a_full_disk_it_is_kept_in_memory(
    directory: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = known(directory)
    DAMAGES["torn"](directory / INDEX)
    monkeypatch.setattr(indexes, "create", _full)
    assert known(directory) == before
    assert os.strerror(errno.ENOSPC) in caplog.text
    assert sorted(path.name for path in directory.iterdir()) == [".lock", INDEX, MATCHES]


def test_a_disk_that_fills_up_while_it_is_made_anew_leaves_the_old_one(
    directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, old = known(directory), (directory / INDEX).read_bytes()
    monkeypatch.setattr(rows, "add", _full)
    with pytest.raises(OSError, match=os.strerror(errno.ENOSPC)):
        Store(directory).rebuild()
    assert (directory / INDEX).read_bytes() == old
    monkeypatch.undo()
    assert known(directory) == before


def test_a_match_that_the_disk_has_no_room_for_is_an_error_of_the_disk(directory: Path) -> None:
    """SQLite's own limit of pages stands for the disk."""
    before, store = known(directory), Store(directory)
    (pages,) = store._index.execute("pragma page_count").fetchone()
    store._index.execute(f"pragma max_page_count = {pages}")
    match = next(iter(store.matches().values()))
    with pytest.raises(OSError, match=os.strerror(errno.ENOSPC)) as error:
        store.add(replace(match, cause="c" * 100_000), [])
    assert str(error.value.filename).endswith(INDEX)
    assert known(directory) == before


async def test_the_runner_goes_on_with_one_that_is_broken(directory: Path, caplog: pytest.LogCaptureFixture) -> None:
    DAMAGES["torn"](directory / INDEX)
    engine, store = MadeEngine(), Store(directory)
    with store.lock():
        runner = Runner(FOUND, store, engine, ExperimentBudget())
        await runner.play(matches())
    assert engine.jobs == []
    assert len(caplog.records) == 1


def test_a_finished_try_is_known_although_a_crashed_one_was_copied_last(directory: Path) -> None:
    before = known(directory)
    for match in matches():
        crashed = Store(directory).recording_for(match.key)
        record(crashed, match.config, result=False)
        finished = crashed.with_name("recording.mcap")
        os.utime(finished, (0, 0))
    Store(directory).rebuild()
    assert {one.state for one in Store(directory).matches().values()} == {"done"}
    assert {one.attempts for one in Store(directory).matches().values()} == {2}
    assert known(directory)[0] == before[0]


def test_of_tries_that_all_crashed_the_one_with_the_largest_number_counts(directory: Path) -> None:
    key = matches()[0].key
    shutil.rmtree(directory / MATCHES / key)
    for number in range(1, 12):
        path = Store(directory).recording_for(key)
        record(path, matches()[0].config, result=False)
        os.utime(path, (1000 - number, 1000 - number))
    Store(directory).rebuild()
    assert Store(directory).matches()[key].recording == f"{MATCHES}/{key}/recording-11.mcap"


def test_a_recording_with_a_number_that_no_index_holds_is_left_out(
    directory: Path, caplog: pytest.LogCaptureFixture
) -> None:
    match = matches()[0]
    path = directory / MATCHES / match.key / "recording.mcap"
    path.unlink()
    record(path, match.config.model_copy(update={"seed": 2**70}))
    assert Store(directory).rebuild() == 1
    assert f"{path} has a number that is larger than SQLite's" in caplog.text


def _full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
