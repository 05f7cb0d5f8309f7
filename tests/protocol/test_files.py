"""Files for their user alone: new ones are whole or not there, and nothing that was there before is lost."""

from __future__ import annotations

import errno
import os
import stat
import threading
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.commandline import run_command, say
from khala_protocol.errors import ConfigError
from khala_protocol.files import (
    make_private,
    open_private,
    replacing,
    replacing_directory,
    write_private,
    write_together,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


@pytest.fixture(autouse=True)
def usual_umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


def full() -> OSError:
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_files_and_directories_are_for_their_user(tmp_path: Path) -> None:
    make_private(tmp_path / "a" / "b")
    write_private(tmp_path / "a" / "b" / "text", "words")
    with open_private(tmp_path / "a" / "log", "ab") as log:
        log.write(b"line")
    with replacing_directory(tmp_path / "set" / "made") as part:
        (part / "file").touch()
    assert {path.name: mode(path) for path in tmp_path.rglob("*") if path.name != "file"} == {
        "a": 0o700, "b": 0o700, "text": 0o600, "log": 0o600, "set": 0o700, "made": 0o700,
    }  # fmt: skip


def test_a_directory_that_is_there_keeps_its_mode(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir(0o755)
    make_private(tmp_path / "mine")
    assert mode(tmp_path / "mine") == 0o755


def test_a_file_that_others_could_read_is_theirs_no_longer_when_it_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("old")
    write_private(tmp_path / "x", "new")
    assert ((tmp_path / "x").read_text(), mode(tmp_path / "x")) == ("new", 0o600)


def test_what_cannot_be_written_whole_leaves_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("old")
    with pytest.raises(OSError, match="No space") as error, replacing(tmp_path / "x") as file:  # noqa: PT012  # half-way
        file.write(b"half of it")
        raise full()
    assert error.value.filename == str(tmp_path / "x")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("x", "old")]


def test_files_that_belong_together_are_all_new_or_none_is(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").mkdir()
    with pytest.raises(IsADirectoryError):
        write_together({tmp_path / "b": b"no file", tmp_path / "a": b"new"})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
    assert (tmp_path / "a").read_text() == "old"


def test_a_directory_that_cannot_be_made_whole_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No space"), replacing_directory(tmp_path / "set") as part:  # noqa: PT012  # half-way
        (part / "half").write_text("of it")
        raise full()
    assert not list(tmp_path.iterdir())


def test_a_link_is_replaced_and_what_it_points_to_stays(tmp_path: Path) -> None:
    (tmp_path / "theirs").write_text("precious")
    (tmp_path / "x").symlink_to("theirs")
    write_private(tmp_path / "x", "new")
    assert ((tmp_path / "theirs").read_text(), (tmp_path / "x").is_symlink()) == ("precious", False)


@pytest.mark.posix
def test_a_pipe_is_written_as_it_is(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    found: list[bytes] = []
    reader = threading.Thread(target=lambda: found.append((tmp_path / "pipe").read_bytes()))
    reader.start()
    write_private(tmp_path / "pipe", "words")
    reader.join(5)
    assert found == [b"words"]


def _raise(error: BaseException) -> Callable[[], Any]:
    def command() -> None:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (
            OSError(errno.ENOSPC, "No space left on device", "runs/x.csv"),
            "khala: runs/x.csv: No space left on device: make room there and do it again; every file that was whole be",
        ),
        (OSError(errno.EACCES, "Permission denied", "runs/\x1b]0;x"), "khala: runs/\\x1b]0;x: Permission denied\n"),
        (ExceptionGroup("many", [ExceptionGroup("", [full()]), ConfigError("give a name")]), "khala: give a name\n"),
    ],
)
def test_a_fault_of_the_disk_is_a_sentence(
    capsys: pytest.CaptureFixture[str], error: BaseException, words: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        run_command("khala", _raise(error))
    assert ended.value.code == 1
    assert words in capsys.readouterr().err


def test_an_error_of_ours_stays_one() -> None:
    with pytest.raises(ExceptionGroup):
        run_command("khala", _raise(OSError(errno.EBADF, "Bad file descriptor")))


def test_a_printed_line_does_nothing_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    say("\x1b[31m\x9b2J\u202e[red]")
    assert capsys.readouterr().out == "\\x1b[31m\\x9b2J\\u202e[red]\n"
