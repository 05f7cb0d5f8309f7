"""The index beside a recording: it goes on where it was left, and is made again when it is not of this recording."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from typing import TYPE_CHECKING

import pytest

from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic
from khala_protocol.recording import Recorder, Recording
from khala_sc2.view.index import Index, Spot, index_path
from khala_sc2.view.scan import Scanner, whole
from tests.khala.view.made import STEPS, begin, card, end, key_of, make, opened, put, step_of

if TYPE_CHECKING:
    from pathlib import Path

TABLES = ("sample", "image", "step", "decision", "loss", "mark", "model")


def dump(index: Index) -> dict[str, list[str]]:
    """Return everything that answers are made from."""
    return {table: sorted(map(repr, index.rows(f"select * from {table}"))) for table in TABLES}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return make(tmp_path / "made.mcap")


def test_it_says_of_every_sample_where_it_lies(path: Path) -> None:
    with contextlib.closing(opened(path).index) as index:
        found = index.rows("select topic, chunk, place from sample")
        samples = [one for one in Recording.open(path) if "/image/" not in one.key]
        assert [(one.key.rsplit("/", 1)[1], one.payload) for one in samples] == [
            (topic, index.payload(Spot(chunk, place))) for topic, chunk, place in found
        ]


def test_one_made_bit_by_bit_is_the_one_made_at_once(path: Path, tmp_path: Path) -> None:
    at_once = opened(path).index
    other = tmp_path / "other.mcap"
    other.write_bytes(path.read_bytes())
    bit_by_bit = Index(other)
    while True:
        with contextlib.closing(Scanner(bit_by_bit, lambda: True)) as scanner:  # stops after each chunk
            if not scanner.advance():
                break
    assert dump(bit_by_bit) == dump(at_once)
    assert bit_by_bit.meta("ended")


def test_one_of_a_recording_that_grew_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "grows.mcap"
    with Recorder(path) as recorder:
        put(recorder, *begin())
        put(recorder, *step_of(0))
        index = opened(path).index
        first = index.rows("select rowid, * from sample")
        for step in range(1, STEPS):
            put(recorder, *step_of(step))
        put(recorder, end())
    whole(index)
    assert index.rows("select rowid, * from sample")[: len(first)] == first
    assert index.rows("select * from mark") == opened(make(tmp_path / "made.mcap")).index.rows("select * from mark")
    assert len(index.rows("select * from step")) == STEPS


def test_one_of_another_recording_under_the_same_name_is_made_again(path: Path, tmp_path: Path) -> None:
    opened(path).index.close()
    path.unlink()
    make(path, steps=7)
    assert len(opened(path).index.rows("select * from step")) == 7


@pytest.mark.parametrize("content", [b"", b"no database", b"SQLite format 3\0" + bytes(4096)])
def test_a_broken_one_is_made_again(path: Path, content: bytes) -> None:
    index_path(path).write_bytes(content)
    assert len(opened(path).index.rows("select * from step")) == STEPS


def test_one_with_a_table_of_somebody_else_is_made_again(path: Path) -> None:
    opened(path).index.close()
    with contextlib.closing(sqlite3.connect(index_path(path))) as db:
        db.execute("create trigger evil after insert on sample begin delete from step; end")
    index = opened(path).index
    assert index.rows("select count(*) from sqlite_master where type = 'trigger'") == [(0,)]
    assert len(index.rows("select * from step")) == STEPS


def test_one_with_values_of_somebody_else_makes_no_answer_lie(path: Path) -> None:
    found = opened(path)
    with contextlib.closing(sqlite3.connect(found.index.path)) as db:
        db.execute("update sample set place = 12345678")
        db.commit()
    with pytest.raises(RecordingError, match="open it again"):
        found.moment(0, 3)


@pytest.mark.posix
def test_what_is_no_file_in_its_place_is_removed(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.write_text("of somebody else")
    index_path(path).symlink_to(other)
    assert len(opened(path).index.rows("select * from step")) == STEPS
    assert other.read_text() == "of somebody else"
    index_path(path).unlink()
    os.mkfifo(index_path(path))
    assert len(opened(path).index.rows("select * from step")) == STEPS


def test_two_viewers_share_it(path: Path) -> None:
    index = Index(path)
    with contextlib.closing(Scanner(index, lambda: True)) as first, contextlib.closing(Scanner(index)) as second:
        assert first.advance()
        assert second.advance() is None  # the first one does it
        first.close()
        assert second.advance()
    assert len(index.rows("select * from step")) == STEPS


def test_it_is_in_the_cache_and_one_beside_the_recording_is_not_believed(path: Path, tmp_path: Path) -> None:
    """Whoever made the recording may have put one there, with any fingerprint."""
    found = opened(path).index
    forged = path.with_name(f".{path.name}.index")
    forged.write_bytes(found.path.read_bytes())
    with contextlib.closing(sqlite3.connect(forged)) as db:
        db.execute("delete from step where step > 1")
        db.commit()
    found.is_broken = True
    found.close()
    index = opened(path).index
    assert index.path.parent == tmp_path / "cache" / "view"
    assert len(index.rows("select * from step")) == STEPS


def test_one_of_a_recording_that_was_changed_inside_is_made_again(path: Path) -> None:
    """Its beginning, its end, its size and its time of change are what they were."""
    with contextlib.closing(opened(path).index) as index:
        (chunk,) = index.rows("select chunk from sample where topic = 'report' and step = 20")[0]
    before, data = path.stat(), bytearray(path.read_bytes())
    data[chunk + 60] ^= 0xFF
    path.write_bytes(bytes(data))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert opened(path).index.rows("select count(*) from step") == [(20,)]


def test_those_that_nobody_looked_at_for_long_are_forgotten(path: Path, tmp_path: Path) -> None:
    old, new = (opened(make(tmp_path / f"{name}.mcap")).index.path for name in ("old", "new"))
    os.utime(old, (0, 0))
    opened(path)
    assert (old.exists(), new.exists()) == (False, True)


def test_only_its_user_may_read_it(path: Path) -> None:
    assert opened(path).index.path.stat().st_mode & 0o077 == 0


def test_a_torn_recording_is_indexed_up_to_the_tear(path: Path) -> None:
    (chunk,) = opened(path).index.rows("select chunk from sample where topic = 'report' and step = 20")[0]
    path.write_bytes(path.read_bytes()[: chunk + 100])
    found = opened(path)
    readable = sum(1 for sample in Recording.open(path) if sample.key.endswith("/observation"))
    assert readable == 20
    assert found.index.rows("select count(*) from sample where topic = 'observation'") == [(readable,)]
    assert found.line().complete is False
    assert found.indexed_share() == 1.0


def test_a_damaged_recording_is_indexed_up_to_the_damage(path: Path) -> None:
    chunks = [row[0] for row in opened(path).index.rows("select distinct chunk from sample order by chunk")]
    data = bytearray(path.read_bytes())
    data[chunks[10] + 60] ^= 0xFF
    path.write_bytes(bytes(data))
    index_path(path).unlink()
    found = opened(path)
    assert found.index.meta("broken")
    assert found.indexed_share() == 1.0
    assert 0 < len(found.index.rows("select * from step")) < STEPS


NONSENSE = (
    b"", b"{", b"[]", b"null", b'{"v":1,"run":"made","kind":"report","side":"blue","episode":0,"step":1,"agents":[{}]}',
    b'{"v":1,"run":"made","kind":"scene","episode":0,"step":1,"game_loop":1,"players":[{"player":"x"}],"units":[[1]]}',
    b'{"v":1,"run":"made","kind":"observation","agent":"Stalkers","side":"blue","episode":0,"step":1,"view":7}',
    b'{"v":1,"run":"made","kind":"reply","agent":"Stalkers","side":"blue","episode":0,"step":1,"text":NaN}',
    b'{"episode":1e999,"step":-1}', b'{"episode":"0","step":[]}', bytes(range(256)),
)  # fmt: skip


def test_messages_that_are_none_change_no_answer(tmp_path: Path) -> None:
    keys = [key_of(message) for message in (*step_of(5), card(), end())]
    path = tmp_path / "odd.mcap"
    with Recorder(path) as recorder:
        put(recorder, *begin())
        for step in range(3):
            put(recorder, *step_of(step))
            for key in keys:
                for payload in NONSENSE:
                    recorder.write(key, payload)
        recorder.write("khala/made/blue/Stalkers/reply", encode(card()))
        recorder.write("not/a/key", b"{}")
        recorder.flush()
    found = opened(path)
    answers = (found.view(), found.timeline(0), found.terrain(0), found.scenes(0, 0, 2), found.moment(0, 2))
    assert all(answers)
    assert b"qwen" not in found.moment(0, 2)


def test_replies_need_not_be_read_to_be_found(path: Path) -> None:
    found = opened(path).index.rows("select count(*), count(distinct step) from sample where topic = ?", Topic.REPLY)
    assert found == [(STEPS, STEPS)]


def test_words_in_the_mouth_of_another_agent_are_found_under_no_agent(tmp_path: Path) -> None:
    """Neither where a message is read nor where only its beginning is looked at."""
    path = tmp_path / "foreign.mcap"
    with Recorder(path) as recorder:
        put(recorder, *begin())
        put(recorder, *step_of(0))
        for message in step_of(0):
            key = key_of(message)
            if key.endswith(("/reply", "/exchange", "/observation")):
                recorder.write(key.replace("/blue/", "/red/"), encode(message))
                recorder.write(key, encode(message).replace(b'"run":"made"', b'"run":"other"', 1))
    with contextlib.closing(opened(path).index) as index:
        found = index.rows("select topic, side, count(*) from sample where agent != '' group by topic, side")
    assert {side for _, side, _ in found} == {"blue"}
    assert {topic: count for topic, _, count in found}["reply"] == 1
