"""A recording chunk by chunk: the same samples as read at once, from any chunk on, and within the same limits."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import pytest
from mcap.writer import CompressionType, Writer

from khala_protocol.errors import RecordingError
from khala_protocol.recording import Recorder, read
from khala_protocol.recording.chunks import Scan, chunk_at, footer, payload_at
from khala_protocol.recording.summary import Summary
from khala_protocol.recording.unpack import BROKEN

if TYPE_CHECKING:
    from pathlib import Path

STEPS = 6
KEYS = ("khala/r1/report", "khala/r1/blue/A/reply")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    with Recorder(path) as recorder:
        for step in range(STEPS):
            for key in KEYS:
                recorder.write(key, f"{key} {step}".encode())
            recorder.flush()
    return path


def scanned(path: Path, scan: Scan) -> list[tuple[str, bytes]]:
    with path.open("rb") as file:
        return [(scan.keys[one.channel], one.payload) for chunk in scan.chunks(file) for one in scan.samples(chunk)]


def test_a_scan_yields_what_reading_yields(path: Path) -> None:
    scan = Scan()
    assert scanned(path, scan) == [(one.key, one.payload) for one in read(path)]
    assert (scan.ended, scan.broken, scan.expected) == (True, False, STEPS * len(KEYS))


def test_a_sample_is_found_again_at_its_place(path: Path) -> None:
    scan = Scan()
    with path.open("rb") as file:
        for chunk in scan.chunks(file):
            data = chunk_at(file, chunk.offset)
            for sample in scan.samples(chunk):
                assert payload_at(data, sample.place) == sample.payload


def test_a_scan_goes_on_where_another_one_ended(path: Path) -> None:
    first, found, end = Scan(), [], 0
    with path.open("rb") as file:
        for chunk in itertools.islice(first.chunks(file), 3):
            found += [(first.keys[one.channel], one.payload) for one in first.samples(chunk)]
            end = chunk.end
    second = Scan(end, keys=first.keys, expected=first.expected)
    assert found + scanned(path, second) == [(one.key, one.payload) for one in read(path)]


def test_a_file_that_grows_is_read_as_far_as_it_is_whole(path: Path, tmp_path: Path) -> None:
    data, growing, scan = path.read_bytes(), tmp_path / "growing.mcap", Scan()
    found: list[tuple[str, bytes]] = []
    for end in (*range(0, len(data), 97), len(data)):
        growing.write_bytes(data[:end])
        found += scanned(growing, scan)
        assert not scan.broken
    assert found == [(one.key, one.payload) for one in read(path)]
    assert scan.ended


def test_damage_ends_a_scan(path: Path) -> None:
    whole = Scan()
    with path.open("rb") as file:
        offsets = [chunk.offset for chunk in whole.chunks(file) for _ in whole.samples(chunk)]
    data = bytearray(path.read_bytes())
    data[offsets[-1] + 60] ^= 0xFF
    path.write_bytes(bytes(data))
    scan = Scan()
    assert scanned(path, scan) == [(one.key, one.payload) for one in read(path)]
    assert scan.broken


def test_a_chunk_that_was_cut_out_is_missed(path: Path) -> None:
    whole = Scan()
    with path.open("rb") as file:
        chunks = [chunk for chunk in whole.chunks(file) if list(whole.samples(chunk))]
    data = path.read_bytes()
    path.write_bytes(data[: chunks[2].offset] + data[chunks[2].end :])
    scan = Scan()
    assert len(scanned(path, scan)) == 2 * len(KEYS)
    assert scan.broken


@pytest.mark.parametrize("place", [-1, 0, 7, 10**9])
def test_a_place_that_holds_no_sample_is_refused(path: Path, place: int) -> None:
    with path.open("rb") as file, pytest.raises(BROKEN):
        payload_at(chunk_at(file, place), 3)


def test_a_file_that_unpacks_to_far_too_much_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=2**26)
        writer.start(library="other")
        channel = writer.register_channel(KEYS[0], "", 0)
        for _ in range(3):
            writer.add_message(channel, 0, bytes(2**24), 0)
        writer.finish()  # type: ignore[no-untyped-call]
    scan = Scan()
    assert scanned(path, scan) == []
    assert scan.broken


def test_a_summary_counts_as_reading_does(path: Path) -> None:
    summary = Summary.of(path)
    assert summary.complete
    assert summary.counts == dict.fromkeys(KEYS, STEPS)
    assert list(summary.payloads(KEYS[1])) == [one.payload for one in read(path) if one.key == KEYS[1]]


def test_a_torn_file_has_the_summary_of_its_begin(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-50])
    summary = Summary.of(path)
    assert not summary.complete
    assert list(summary.payloads(KEYS[0])) == [f"{KEYS[0]} 0".encode()]
    with path.open("rb") as file:
        assert footer(file) is None


@pytest.mark.parametrize("content", [b"", b"no recording", b"\x89MCAP0\r\n"])
def test_what_is_no_recording_has_no_summary(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "no.mcap"
    path.write_bytes(content)
    if content.startswith(b"\x89"):
        assert Summary.of(path).keys == {}
        return
    with pytest.raises(RecordingError):
        Summary.of(path)
