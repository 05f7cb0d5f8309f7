"""What commands of an experiment write and print: for its user alone, whole or not at all, and nothing acts."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import stat
import subprocess
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.console import stderr_console
from khala_sc2.cli import main
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.played import unread
from khala_sc2.experiment.progress import Watcher
from khala_sc2.experiment.runner import Runner, RunnerEvent
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import MATCHES, Store
from tests.khala.experiment.made import MadeEngine, record

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_sc2.experiment.plan import PlannedMatch

FILE = "name: e\nfixed: {model: scripted}\nfactors: {task: [3s5z]}\nseeds: 2\n"
EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e[red][link=http://e]"


def played(directory: Path) -> Store:
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "e.yaml").write_text(FILE)
    store = Store(directory / "e")
    store.begin(directory / "e.yaml")
    store.adopt()
    for match in plan(store.experiment()):
        path = store.recording_for(match.key)
        record(path, match.config)
        store.take(path, attempts=1)
    return store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    umask = os.umask(0o022)
    yield played(tmp_path)
    os.umask(umask)


def run(*arguments: object) -> int | str | None:
    """Return the exit code of `khala experiment`; a traceback is an error of the test."""
    try:
        main(["experiment", *map(str, arguments)])
    except SystemExit as ended:
        return ended.code
    return 0


def open_to_others(directory: Path) -> list[str]:
    found = (path for path in directory.rglob("*") if stat.S_IMODE(path.stat().st_mode) & 0o077)
    return [str(path.relative_to(directory)) for path in found]


def contents(directory: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in directory.rglob("*") if path.is_file() and path.name != ".lock"}


def test_other_users_may_read_nothing_that_commands_write(store: Store) -> None:
    with store.lock():
        pass
    assert run("export", store.directory, "--csv", store.directory / "x.csv") == 0
    assert run("index", store.directory) == 0
    assert open_to_others(store.directory) == []
    assert stat.S_IMODE(store.directory.stat().st_mode) == 0o700


@pytest.mark.slow
def test_other_users_may_read_no_report_and_no_parquet(store: Store) -> None:
    assert run("export", store.directory, "--parquet", store.directory / "x.parquet") == 0
    assert run("report", store.directory) == 0
    assert len(list((store.directory / "report").iterdir())) == 7
    assert open_to_others(store.directory) == []


def test_an_export_on_a_full_disk_is_a_sentence_and_the_old_one_stays(
    store: Store, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = store.directory / "x.csv"
    assert run("export", store.directory, "--csv", out) == 0
    before = contents(store.directory)

    def full(*_: object) -> Any:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fdopen", full)
    assert run("export", store.directory, "--csv", out) == 1
    assert f"khala: {out}: No space left on device: make room there" in capsys.readouterr().err
    assert contents(store.directory) == before


@pytest.mark.slow
@pytest.mark.netns
def test_on_a_disk_of_900_kb_every_command_ends_in_a_sentence_and_nothing_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=900k", "tmpfs", disk], check=True, timeout=10)
    try:
        full = played(disk)
        results = sorted(map(str, full.results()))
        with contextlib.suppress(OSError), (disk / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(bytes(4096))
        before = contents(full.directory)
        for command in (["index"], ["export", "--csv", full.directory / "x.csv"], ["report"]):
            assert run(command[0], full.directory, *command[1:]) == 1
            assert "No space left on device" in capsys.readouterr().err
        assert contents(full.directory) == before
        assert sorted(map(str, Store(full.directory).results())) == results
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True, timeout=10)


def test_a_link_in_the_place_of_an_export_is_not_followed(store: Store, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    (store.directory / "x.csv").symlink_to(tmp_path / "precious")
    assert run("export", store.directory, "--csv", store.directory / "x.csv") == 0
    assert (tmp_path / "precious").read_text() == "mine"


@pytest.mark.parametrize(
    "labels",
    [{}, {"repetition": "many"}, {"match": "same"}, {"match": EVIL, f"factor.{EVIL}": EVIL}, {"repetition": "9" * 30}],
    ids=["none", "a word for a number", "of another match", "hostile", "a huge number"],
)
def test_recordings_with_labels_of_nobody_or_somebody_are_read_without_a_traceback(
    store: Store, labels: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    for match in plan(store.experiment()):
        path = store.directory / MATCHES / match.key / "recording.mcap"
        path.unlink()
        record(path, match.config.model_copy(update={"labels": labels}))
    assert run("index", store.directory) == 0
    codes = [run("status", store.directory), run("export", store.directory, "--csv", store.directory / "x.csv")]
    codes.append(run("report", store.directory, "--format", "html"))
    assert codes == [0, 0, 1 if "repetition" in labels else 0]
    assert visible(capsys)


@pytest.mark.parametrize(
    "make", [lambda data: data[:-300], lambda _: b"", lambda _: b"MZ" * 99, lambda data: data[:60]]
)
def test_torn_empty_and_foreign_recordings_are_read_without_a_traceback(store: Store, make: Any) -> None:
    for match in plan(store.experiment()):
        path = store.directory / MATCHES / match.key / "recording.mcap"
        path.write_bytes(make(path.read_bytes()))
    assert run("index", store.directory) == 0
    assert run("status", store.directory) == 0
    assert run("export", store.directory, "--csv", store.directory / "x.csv") == 0
    assert run("report", store.directory, "--format", "html") in {0, 1}


def visible(capsys: pytest.CaptureFixture[str]) -> str:
    """Return what was printed, of which every character can be seen."""
    said = capsys.readouterr()
    text = said.out + said.err
    assert not [c for c in text if not (c.isprintable() or c in "\n\t")]
    return text


@pytest.mark.parametrize("command", ["show", "status"])
def test_words_of_a_file_do_nothing_to_the_terminal(
    store: Store, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = FILE.replace("[3s5z]", f"[{{name: {json.dumps(EVIL)}, task: 3s5z}}]")
    file = store.directory / "experiment.yaml"
    file.write_text(text)
    assert run(command, file if command == "show" else store.directory) == 0
    assert "owned" in visible(capsys)


async def test_words_of_a_match_do_nothing_to_the_terminal(store: Store, capsys: pytest.CaptureFixture[str]) -> None:
    found = Experiment.model_validate({"name": "e", "fixed": {"model": "scripted"}, "factors": {
        "task": [{"name": EVIL, "task": "3s5z"}]}})  # fmt: skip
    matches: list[PlannedMatch] = plan(found)
    runner = Runner(found, store, MadeEngine(), ExperimentBudget())
    with Watcher(stderr_console(), runner, matches, EVIL) as watcher:
        watcher(RunnerEvent("begins", matches[0]))
        watcher(RunnerEvent("ends", matches[0], unread(matches[0], 1, EVIL, None), EVIL))
    assert visible(capsys).count("owned") >= 2
