"""A recording: what goes in comes out byte for byte, whatever happened to the process that wrote it."""

from __future__ import annotations

import errno
import itertools
import json
import os
import random
import signal
import struct
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING

import jsonschema  # type: ignore[import-untyped]  # comes with check-jsonschema; one test is not worth its stubs
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC

from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import (
    Briefing,
    Casualties,
    ChatMessage,
    Clock,
    Message,
    ModelCall,
    Observation,
    Reply,
    Report,
    Result,
    Run,
    View,
    Wire,
)
from khala_protocol.recording import Recorded, Recorder, Recording, read, recover

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

AGENTS = ("A", "B")


def run_card() -> Run:
    return Run(
        run="r1",
        task="2s3z",
        map_name="2s3z",
        map_sha256="0" * 64,
        seed=7,
        episodes=1,
        game="simulator",
        executor="raw",
        clock=Clock(),
        agents=(),
        catalogue_sha256="1" * 64,
        versions={"khala": "0.1.0"},
    )


def result() -> Result:
    return Result(
        run="r1", episode=0, outcome="win", cause="enemy defeated", steps=2, game_loop=16, game_s=0.7, wall_s=2.0,
        killed=Casualties(units=3, value=300), lost=Casualties(), kd=None,
    )  # fmt: skip


def agent_messages(agent: str, step: int) -> Iterator[Wire]:
    where = {"run": "r1", "agent": agent, "side": "p1", "episode": 0, "step": step}
    yield Observation.model_validate(
        where
        | {"game_loop": 8 * step, "answer_within_s": 15, "text": f"seen {step} ünï", "view": View(time_s=0.4 * step)}
    )
    yield ModelCall.model_validate(
        where
        | {"attempt": 1, "model": "m", "endpoint": "http://x", "prompt": [ChatMessage(role="user", content="go")]}
        | {"completion": "<Stop()>", "status": "ok", "started_s": 0.0, "latency_s": 0.1}
    )
    yield Reply.model_validate(where | {"text": "<Stop()>"})
    yield Message.model_validate(where | {"recipient": "B", "text": "hi"})


def samples(steps: int = 3) -> Iterator[tuple[str, bytes]]:
    """Yield a run of some steps, as (key, payload)."""

    def keyed(message: Wire, agent: str | None = None) -> tuple[str, bytes]:
        topic = Topic(type(message).model_fields["kind"].default)
        key = run_key("r1", topic) if agent is None else agent_key("r1", "p1", agent, topic)
        return key, encode(message)

    yield keyed(run_card())
    for agent in AGENTS:
        yield keyed(Briefing(run="r1", agent=agent, side="p1", episode=0, role="fight"), agent)
    for step in range(steps):
        for kind in zip(*(agent_messages(agent, step) for agent in AGENTS), strict=True):
            for agent, message in zip(AGENTS, kind, strict=True):
                yield keyed(message, agent)
        yield keyed(Report(run="r1", episode=0, step=step, game_loop=8 * step, agents=()))
    yield keyed(result())


def write(path: Path, content: Iterable[tuple[str, bytes]], *, flush_each: bool = False) -> list[tuple[str, bytes]]:
    ticks = itertools.count(1_000)
    written = list(content)
    with Recorder(path, clock=lambda: next(ticks)) as recorder:
        for key, payload in written:
            recorder.write(key, payload)
            if flush_each:
                recorder.flush()
    return written


def pairs(recorded: Iterable[Recorded]) -> list[tuple[str, bytes]]:
    return [(sample.key, sample.payload) for sample in recorded]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.mcap"


def test_what_goes_in_comes_out_byte_for_byte_and_in_order(path: Path) -> None:
    written = write(path, samples())
    recorded = list(read(path))
    assert pairs(recorded) == written
    assert [sample.log_time_ns for sample in recorded] == list(range(1_000, 1_000 + len(written)))
    assert all(sample.message is not None and encode(sample.message) == sample.payload for sample in recorded)


def test_samples_are_numbered_in_the_order_of_the_file(path: Path) -> None:
    written = write(path, samples())
    assert [sample.sequence for sample in read(path)] == list(range(len(written)))


def test_a_log_time_can_be_given(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.write("khala/r1/run", encode(run_card()), log_time_ns=42)
    assert [sample.log_time_ns for sample in read(path)] == [42]


def test_bytes_and_keys_that_are_none_of_ours_are_kept(path: Path) -> None:
    written = [("khala/r1/p1/A/reply", b"\x00 garbage"), ("somewhere/else", b"\xff"), ("khala/r1/run", b"")]
    write(path, written)
    recorded = list(read(path))
    assert pairs(recorded) == written
    assert [sample.message for sample in recorded] == [None, None, None]
    assert [sample.address is None for sample in recorded] == [False, True, False]
    assert Recording.open(path).run is None


def test_a_recording_tells_what_it_holds(path: Path) -> None:
    write(path, samples(steps=2))
    recording = Recording.open(path)
    assert recording.complete
    assert recording.run == run_card()
    assert recording.results == (result(),)
    assert recording.counts["khala/r1/p1/A/observation"] == 2
    assert recording.counts["khala/r1/report"] == 2
    assert set(recording.metadata) == {"khala", "python", "schema"}
    assert [observation.step for observation in recording.observations("B")] == [0, 1]
    assert [(reply.agent, reply.step) for reply in recording.replies(1)] == [("A", 1), ("B", 1)]
    assert recording.replies(1, episode=1) == ()
    assert [exchange.agent for exchange in recording.of(ModelCall)] == ["A", "B"] * 2


def test_a_recording_is_read_step_by_step(path: Path) -> None:
    content = list(samples(steps=3))
    late = next(sample for sample in content if sample[0].endswith("/A/reply"))  # answers step 0
    write(path, [*content[:-1], late, content[-1]])
    steps = list(Recording.open(path).by_step())
    assert [(step.episode, step.step) for step in steps] == [(0, 0), (0, 1), (0, 2)]
    assert [observation.agent for observation in steps[1].of(Observation)] == ["A", "B"]
    assert [reply.step for reply in steps[2].of(Reply)] == [2, 2, 0]
    assert [len(step.of(Report)) for step in steps] == [1, 1, 1]
    assert steps[2].of(Result) == (result(),)
    assert sum(len(step.samples) for step in steps) == len(content) + 1 - 3  # card and briefings come before


def test_other_tools_read_it_by_its_index(path: Path) -> None:
    written = write(path, samples(), flush_each=True)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert summary.statistics.message_count == len(written)
        assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
        assert [chunk.compression for chunk in summary.chunk_indexes] == ["zstd"] * len(written)
        assert [(channel.topic, message.data) for _, channel, message in reader.iter_messages()] == written


def test_each_payload_obeys_the_schema_that_stands_beside_it(path: Path) -> None:
    write(path, samples())
    seen = set()
    with path.open("rb") as file:
        for schema, _, message in make_reader(file).iter_messages():
            assert schema is not None
            assert schema.encoding == "jsonschema"
            content = json.loads(schema.data)
            assert content["type"] == "object"  # Foxglove reads no other
            if schema.name not in seen:
                jsonschema.Draft202012Validator.check_schema(content)
            jsonschema.Draft202012Validator(content).validate(json.loads(message.data))
            seen.add(schema.name)
    names = "Run Briefing Observation Reply Message ModelCall Report Result"
    assert seen == {f"khala.{name}" for name in names.split()}


# --- torn and damaged files ------------------------------------------------------------------------


@pytest.mark.parametrize("every", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_a_file_cut_anywhere_gives_a_prefix(path: Path, tmp_path: Path, every: int) -> None:
    """At every so many bytes; each sample has its own chunk, so that many of them survive many of the cuts."""
    messages = [(key, payload) for key, payload in samples(steps=2) if key.endswith("/message")]
    written = write(path, messages, flush_each=True)
    whole = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    lengths = set()
    for end in range(0, len(whole), every):
        cut.write_bytes(whole[:end])
        try:
            recorded = pairs(read(cut))
            recording = Recording.open(cut)
        except RecordingError:
            assert end < 8
            continue
        assert recorded == written[: len(recorded)]
        assert not recording.complete
        assert sum(recording.counts.values()) == len(recorded)
        lengths.add(len(recorded))
    assert lengths == set(range(len(written) + 1))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))])
def test_a_damaged_file_gives_a_prefix(path: Path, tmp_path: Path, seed: int) -> None:
    written = write(path, samples(steps=2), flush_each=True)
    whole = path.read_bytes()
    damaged = tmp_path / "damaged.mcap"
    chance = random.Random(seed)
    for _ in range(100):
        flipped = bytearray(whole)
        flipped[chance.randrange(8, len(whole))] ^= 1 << chance.randrange(8)
        damaged.write_bytes(flipped)
        recorded = pairs(read(damaged))
        assert recorded == written[: len(recorded)]


WRITER = """
import itertools, sys
from khala_protocol.recording import Recorder, read

steps = [list(group) for _, group in itertools.groupby(read(sys.argv[1]), key=lambda s: s.message.step)]
with Recorder(sys.argv[2]) as recorder:
    for step in itertools.count():
        for sample in steps[step % len(steps)]:
            recorder.write(sample.key, sample.payload)
            if step == 20:
                print("in step 20", flush=True)
                sys.stdin.read()
        recorder.flush()
"""


@pytest.mark.posix
def test_a_killed_process_loses_less_than_the_step_under_way(path: Path, tmp_path: Path) -> None:
    source = tmp_path / "source.mcap"
    content = [(key, payload) for key, payload in samples(steps=2) if "/p1/" in key and "/briefing" not in key]
    write(source, content)
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, source, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "in step 20\n"
        writer.send_signal(signal.SIGKILL)
    assert writer.returncode == -signal.SIGKILL
    recording = Recording.open(path)
    assert not recording.complete
    assert pairs(recording) == content * 10


def test_a_torn_recording_is_recovered_as_a_whole_one(path: Path, tmp_path: Path) -> None:
    written = write(path, samples(), flush_each=True)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 4])
    torn = Recording.open(path)
    whole = recover(path, tmp_path / "whole.mcap")
    assert (torn.complete, whole.complete) == (False, True)
    assert 0 < sum(whole.counts.values()) < len(written)
    assert [(s.key, s.payload, s.log_time_ns, s.sequence) for s in whole] == [
        (s.key, s.payload, s.log_time_ns, s.sequence) for s in torn
    ]
    assert whole.metadata == torn.metadata


def test_a_large_recording_is_read_in_the_memory_of_a_chunk(path: Path) -> None:
    with Recorder(path) as recorder:
        for number in range(400):
            recorder.write("khala/r1/p1/A/reply", random.Random(number).randbytes(100_000))
    tracemalloc.start()
    total = sum(len(sample.payload) for sample in read(path))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert total == 40_000_000
    assert peak < 8_000_000


def chunk_of(records: bytes, *, compression: str = "zstd", said: int | None = None) -> bytes:
    """Return a chunk whose head may say another size than its frame."""
    data = zstandard.compress(records) if compression else records
    head = struct.pack("<QQQI", 0, 0, len(records) if said is None else said, 0)
    body = head + struct.pack("<I", len(compression)) + compression.encode() + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", Opcode.CHUNK, len(body)) + body


def sample_of(payload: bytes, key: str = "khala/r1/run") -> bytes:
    """Return the records of a channel and of a sample of it."""
    name = struct.pack("<HHI", 1, 0, len(key)) + key.encode() + struct.pack("<II", 0, 0)
    channel = struct.pack("<BQ", Opcode.CHANNEL, len(name)) + name
    head = struct.pack("<HIQQ", 1, 0, 0, 0)
    return channel + struct.pack("<BQ", Opcode.MESSAGE, len(head) + len(payload)) + head + payload


def hostile(path: Path, *chunks: bytes) -> Path:
    header = struct.pack("<II", 0, 0)
    path.write_bytes(MCAP0_MAGIC + struct.pack("<BQ", Opcode.HEADER, len(header)) + header + b"".join(chunks))
    return path


BOMBS = {
    "a large sample": lambda: [chunk_of(sample_of(b" " * 100 * 2**20))],
    "a frame that is larger than said": lambda: [chunk_of(sample_of(b" " * 100 * 2**20), said=1000)],
    "many small chunks": lambda: [chunk_of(sample_of(b" " * 4 * 2**20))] * 100,
    "many small samples": lambda: [chunk_of(sample_of(b"") * 100_000)] * 40,
    "a deep message": lambda: [chunk_of(sample_of(b"[" * 7 * 2**20))],
}


@pytest.mark.parametrize("kind", BOMBS)
def test_a_file_that_unpacks_to_far_more_than_its_size_is_read_within_limits(kind: str, path: Path) -> None:
    size = hostile(path, *BOMBS[kind]()).stat().st_size
    began = time.process_time()
    assert not Recording.open(path).complete
    assert time.process_time() - began < 2.0  # to unpack it would take a minute
    tracemalloc.start()
    assert len(list(Recording.open(path).by_step())) == 0
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert size < 500_000
    assert peak < 80e6


def test_a_large_sample_that_is_hard_to_compress_is_read(path: Path) -> None:
    picture = random.Random(1).randbytes(20 * 2**20)
    written = write(path, [("khala/r1/p1/A/image/0", picture), *samples()])
    assert pairs(read(path)) == written
    assert Recording.open(path).complete


def test_a_payload_that_is_far_too_long_is_no_message(path: Path) -> None:
    card = run_card().model_copy(update={"task": random.Random(1).randbytes(5 * 2**20).hex()})
    write(path, [("khala/r1/run", encode(card))])
    assert Recording.open(path).run is None
    assert Recording.open(path).samples == 1


# --- error texts -----------------------------------------------------------------------------------


def make(base: Path, kind: str) -> Path:
    target = base / "run.mcap"
    match kind:
        case "directory":
            target.mkdir()
        case "file":
            target.write_bytes(b"precious")
        case "empty":
            target.touch()
        case "below a file":
            target.write_bytes(b"")
            target /= "run.mcap"
    return target


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("directory", "{path} is a directory: name a file in it, such as {path}/run.mcap"),
        ("file", "{path} exists already: choose another name: recordings are not overwritten"),
        ("below a file", "{path} cannot be written: a part of its path is a file, not a directory"),
    ],
)
def test_a_place_that_cannot_be_written_is_named(tmp_path: Path, kind: str, text: str) -> None:
    target = make(tmp_path, kind)
    with pytest.raises(RecordingError) as raised:
        Recorder(target)
    assert str(raised.value) == text.format(path=target)


def test_a_directory_that_may_not_be_written_is_named() -> None:
    if not Path("/proc/self").is_dir():
        pytest.skip("needs /proc, where nobody may make a file")
    with pytest.raises(RecordingError, match=r"^/proc/run\.mcap cannot be written: .+; choose another place$"):
        Recorder("/proc/run.mcap")


def test_a_full_disk_is_said_and_leaves_nothing_open(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    full = Path("/dev/full").open("wb")  # noqa: SIM115 - whether it is closed is what is tested
    monkeypatch.setattr("khala_protocol.recording.recorder._create", lambda _: full)
    with pytest.raises(RecordingError) as raised:
        Recorder(path)
    assert str(raised.value) == (
        f"{path} cannot be written: No space left on device; what was flushed before can still be read"
    )
    assert full.closed


def test_missing_directories_are_made(tmp_path: Path) -> None:
    target = tmp_path / "runs" / "today" / "run.mcap"
    written = write(target, samples(steps=1))
    assert pairs(read(target)) == written


def test_a_closed_recorder_says_so(path: Path) -> None:
    recorder = Recorder(path)
    recorder.close()
    recorder.close()
    with pytest.raises(RecordingError, match="was closed: open another recording to write more"):
        recorder.write("khala/r1/run", b"")


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("missing", "{path}: there is no such file"),
        ("directory", "{path} is a directory: name the recording in it"),
        ("file", "{path} is not a recording: it does not begin as an MCAP file"),
        ("empty", "{path} is empty: the program that recorded it was stopped before it wrote anything"),
        ("below a file", "{path} cannot be read: Not a directory"),
    ],
)
@pytest.mark.parametrize("reading", [read, Recording.open])
def test_a_file_that_is_no_recording_is_named(tmp_path: Path, kind: str, text: str, reading: object) -> None:
    target = make(tmp_path, kind)
    assert callable(reading)
    with pytest.raises(RecordingError) as raised:
        reading(target)
    assert str(raised.value) == text.format(path=target)


# --- who spoke ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "key",
    [
        agent_key("r1", "p1", "B", Topic.REPLY),
        agent_key("r1", "p2", "A", Topic.REPLY),
        agent_key("r2", "p1", "A", Topic.REPLY),
        agent_key("r1", "p1", "A", Topic.EXCHANGE),
        run_key("r1", Topic.REPORT),
        "no/key/of/ours",
    ],
    ids=["another agent", "another side", "another run", "another topic", "of the host", "no key"],
)
def test_words_under_a_key_that_says_something_else_are_nobodys(tmp_path: Path, key: str) -> None:
    """Old recordings hold them: `recover`, transcripts, data sets and measures all read them as nothing."""
    (reply,) = (message for message in agent_messages("A", 0) if isinstance(message, Reply))
    right = agent_key("r1", "p1", "A", Topic.REPLY)
    with Recorder(tmp_path / "a.mcap") as recorder:
        for place in (right, key):
            recorder.write(place, encode(reply))
    recording = Recording.open(tmp_path / "a.mcap")
    assert [sample.message for sample in recording] == [reply, None]
    assert list(recording.of(Reply)) == [reply]
    assert recording.replies(0) == (reply,)
    assert recording.samples == 2, "the bytes stay, as evidence"


def test_a_copy_for_which_the_disk_has_no_room_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with Recorder(tmp_path / "a.mcap") as recorder:
        for key, payload in samples():
            recorder.write(key, payload)
    before = (tmp_path / "a.mcap").read_bytes()
    monkeypatch.setattr("mcap.writer.Writer.add_message", full)
    with pytest.raises(RecordingError, match="No space left on device"):
        recover(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a.mcap", before)]
