"""`python -m bench doors`: every command has rows, a row that gets through is seen, and no row does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.doors import commands, playing
from bench.doors import doors as command
from bench.doors.registry import DOORS, load_rows
from bench.doors.rows import Row, Skipped

if TYPE_CHECKING:
    from pathlib import Path

CHEAP = (
    ("khala advise", "reports that are none"),
    ("khala calibrate", "--compare with a pipe"),
    ("khala knowledge write", "a disk that fills up"),
    ("khala llm", "a page of another site asks"),
    ("khala llm", "a name that somebody points at 127.0.0.1"),
    ("model file", "a key in a header or the query"),
)
"""Rows of each kind that take some milliseconds."""


def row(through: str | Exception, kind: str = "attack") -> Row:
    async def play(_: Path) -> str:
        if isinstance(through, Exception):
            raise through
        return through

    return Row("khala test", "made up", play, kind)  # type: ignore[arg-type]  # a kind


def test_every_command_has_rows_or_a_reason_for_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.check() == 0
    assert capsys.readouterr().err == ""


def test_a_command_without_rows_is_found(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    doors = {door for known in DOORS.values() for door in known}
    assert commands.missing(doors - {"khala llm", "khala keys show"}) == ["khala keys show", "khala llm"]
    monkeypatch.setitem(DOORS, "rest", ())
    assert command.main(["--check"]) == 1
    assert "`khala router` has no rows" in capsys.readouterr().err


def test_a_reason_that_no_longer_holds_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    doors = [door for known in DOORS.values() for door in known]
    monkeypatch.setitem(commands.WITHOUT_ROWS, "khala run", "reads nothing")
    monkeypatch.setitem(commands.WITHOUT_ROWS, "khala gone", "reads nothing")
    assert commands.missing(doors) == ["khala run", "khala gone"]


@pytest.mark.parametrize(
    ("through", "word", "said"),
    [
        ("", "held", ""),
        ("all of it", "GOT THROUGH", "all of it"),
        (ValueError("odd"), "GOT THROUGH", "ValueError: odd"),
        (Skipped("no root"), "skipped", ""),
    ],
)
def test_a_row_that_raises_gets_through(through: str | Exception, word: str, said: str) -> None:
    outcome = playing.play(row(through))
    assert (outcome.word, outcome.through) == (word, said)


def test_the_exit_code_is_1_if_a_row_gets_through(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.run([row(""), row(Skipped("no root"), "fault")], [0, 1]) == 0
    assert "2 rows: 1 attack, 0 quirks, 1 fault; 0 got through, 1 skipped" in capsys.readouterr().out
    assert command.run([row(""), row("all of it"), row("")], [0, 1]) == 1
    out, err = capsys.readouterr()
    assert "2 rows: 2 attacks, 0 quirks, 0 faults; 1 got through" in out
    assert "2 of 2  GOT THROUGH  khala test: made up" in err


@pytest.mark.parametrize(("door", "what"), CHEAP, ids=lambda word: word)
def test_a_cheap_row_is_held(door: str, what: str) -> None:
    (cheap,) = (row for row in load_rows(door) if (row.door, row.what) == (door, what))
    assert playing.play(cheap).through == ""
