"""Recordings of a directory are listed by their begin and their end, and what the command line names is found."""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, get_type_hints

import pytest

from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.recording import Recording, summary
from khala_protocol.recording.chunks import chunk_at
from khala_protocol.recording.summary import Summary
from khala_sc2.doors.rules import TOKEN, RequestHead
from khala_sc2.view import library, serve
from khala_sc2.view.cli import view
from khala_sc2.view.library import found_in, lines, read_head, run_id
from khala_sc2.view.serve import PASSWORD, ViewOptions, door_of, is_near, password_of
from khala_sc2.view.sources import Sources, find
from tests.khala.view.made import AGENT, RUN, STEPS, make


def test_a_line_says_what_a_scan_of_the_whole_file_would(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap")
    (line,) = lines([path], tmp_path)
    recording = Recording.open(path)
    assert recording.run is not None
    assert (line.run, line.task, line.seed) == (RUN, recording.run.task, recording.run.seed)
    assert line.outcomes == {"blue": ("win",)}
    assert (line.complete, line.live, line.steps) == (True, False, STEPS)
    assert line.game_s == recording.results[0].game_s
    assert Summary.of(path).counts == dict(recording.counts)


def test_a_summary_reads_the_begin_and_the_end_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make(tmp_path / "made.mcap")
    seen: list[int] = []

    def noted(file: BinaryIO, at: int) -> bytes:
        seen.append(at)
        return chunk_at(file, at)

    monkeypatch.setattr(summary, "chunk_at", noted)
    read_head(path)
    assert len(set(seen)) == 2  # the chunk of the run card, and that of the result


def test_a_recording_that_is_torn_is_listed_by_its_begin(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap")
    path.write_bytes(path.read_bytes()[:-100])
    (line,) = lines([path], tmp_path)
    assert (line.run, line.complete, line.outcomes) == (RUN, False, {})


def test_what_is_known_of_a_recording_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make(tmp_path / "made.mcap")
    first = lines([path], tmp_path)
    monkeypatch.setattr(library, "read_head", lambda _: pytest.fail("it was read again"))
    assert lines([path], tmp_path) == first


def test_one_that_changed_is_read_again(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap")
    lines([path], tmp_path)
    path.unlink()
    make(path, steps=3)
    assert lines([path], tmp_path)[0].steps == 3


def test_one_that_was_replaced_with_its_size_and_its_time_kept_is_read_again(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap")
    before, data = path.stat(), path.read_bytes()
    assert lines([path], tmp_path)[0].complete
    path.write_bytes(data[:-8] + bytes(8))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    library._read_head.cache_clear()
    assert not lines([path], tmp_path)[0].complete


def test_a_directory_lists_what_is_below_it_and_nothing_else(tmp_path: Path) -> None:
    path = make(tmp_path / "a" / "b" / "made.mcap", steps=1)
    (tmp_path / "a" / "no.mcap").write_bytes(b"no recording")
    (tmp_path / "notes.txt").write_text("notes")
    (tmp_path / "loop").symlink_to(tmp_path)
    found = found_in(tmp_path)
    assert path in found.recordings
    assert [line.path for line in lines(found.recordings, tmp_path)] == ["a/b/made.mcap"]


def test_names_of_the_command_line_are_found(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    one = make(runs / "one" / "recording.mcap", steps=1)
    two = make(runs / "two" / "recording.mcap", steps=1)
    assert find(["one"], runs).library().opened == (run_id(one),)
    assert find([str(one), "two"], runs).library().opened == (run_id(one), run_id(two))
    assert {line.id for line in find([], runs).library().runs} == {run_id(one), run_id(two)}
    assert find([str(runs)], runs).library().opened == ()


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (["none"], "there is no none, nor .*runs/none: name a recording, a directory or a run"),
        (["a", "b", "c"], "at most two can be seen side by side, and these are 3"),
        (["..", "one"], ".. does not hold exactly one recording"),
    ],
)
def test_what_is_not_there_is_said(
    tmp_path: Path, given: list[str], error: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("one", "other"):
        make(tmp_path / "runs" / name / "recording.mcap", steps=1)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(ConfigError, match=error):
        find(given, tmp_path / "runs")


def test_a_file_that_is_no_recording_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_bytes(b"no recording at all")
    with pytest.raises(RecordingError, match="is not a recording"):
        find([str(tmp_path / "no.mcap")], tmp_path)


def test_without_runs_the_command_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=re.escape("play with `khala run`")):
        find([], tmp_path / "runs")


@pytest.mark.parametrize(
    ("host", "near"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("127.9.9.9", True), ("0.0.0.0", False),
     ("::", False), ("10.0.0.5", False), ("table", False)],
)  # fmt: skip
def test_only_this_machine_may_look_without_a_password(host: str, near: bool) -> None:
    assert is_near(host) is near
    look = ViewOptions(given=(), host=host)
    if near:
        assert door_of(look).is_near
    else:
        with pytest.raises(ConfigError, match="--password"):
            door_of(look)


def test_a_port_that_a_container_publishes_to_its_machine_alone_needs_no_password() -> None:
    look = ViewOptions(given=(), host="0.0.0.0", published="127.0.0.1:8000")  # nobody listens
    door = door_of(look)
    assert not door.password
    visit = RequestHead("GET", "/", f"{TOKEN}={door.token}", (("host", "127.0.0.1:8000"),), peer="10.89.0.1")
    assert door.check(visit) is None, "it comes through the gateway of the container"
    for refused in (replace(visit, query=""), replace(visit, headers=(("host", "example.org"),))):
        assert door.check(refused) is not None
    for published in ("10.0.0.5:8000", "8000", "example.org:8000"):
        with pytest.raises(ConfigError, match="is no port of this machine alone: give 127"):
            door_of(ViewOptions(given=(), host="0.0.0.0", published=published))


def test_a_password_comes_from_a_file_or_the_environment_or_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "password"
    file.write_text("from a file\nnot this\n")
    assert password_of(ViewOptions(given=())) == ""
    assert password_of(ViewOptions(given=(), password_file=file)) == "from a file"
    monkeypatch.setenv(PASSWORD, "from the environment")
    assert password_of(ViewOptions(given=())) == "from the environment"
    monkeypatch.setattr(serve, "getpass", lambda prompt: f"typed at {prompt}")
    assert password_of(ViewOptions(given=(), asks_password=True)) == "typed at Password: "


@pytest.mark.parametrize(
    ("written", "says"),
    [(b"", "is empty: its first line"), (b"\xff", "it is no text in UTF-8"), (None, "No such file or directory")],
)
def test_a_password_file_that_holds_none_is_refused(tmp_path: Path, written: bytes | None, says: str) -> None:
    file = tmp_path / "password"
    if written is not None:
        file.write_bytes(written)
    with pytest.raises(ConfigError, match=f"^--password-file: .*{says}"):
        password_of(ViewOptions(given=(), password_file=file))


def test_no_option_holds_a_password_that_others_could_read_in_the_list_of_processes() -> None:
    options = {name: kind for name, kind in get_type_hints(view).items() if "password" in name}
    assert options == {"password": bool, "password_file": Path | None}


def test_agents_are_those_of_the_run_card(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap", steps=1)
    opened = Sources("made", None, [path]).open(run_id(path))
    assert [agent.name for agent in opened.agents()] == [AGENT]
    opened.index.close()


def test_a_recording_goes_with_its_directory(tmp_path: Path) -> None:
    path = make(tmp_path / "made.mcap", steps=1)
    other = shutil.copy(path, tmp_path / "copy.mcap")
    assert run_id(path) != run_id(tmp_path / other)
