"""Messages → an MCAP file; see `khala_protocol.recording`."""

from __future__ import annotations

import contextlib
import functools
import json
import platform
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, TYPE_CHECKING, Self

from mcap.writer import CompressionType, Writer

from khala_protocol.errors import PeerError, RecordingError
from khala_protocol.files import make_private
from khala_protocol.keys import Topic, parse
from khala_protocol.messages import MESSAGE_TYPES, SCHEMA_VERSION, Wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from types import TracebackType

KINDS: Mapping[Topic, type[Wire]] = {Topic(model.model_fields["kind"].default): model for model in MESSAGE_TYPES}
"""The kind of message under each topic."""

LIBRARY = "khala"
"""Name of the writer in a file's header; its samples are numbered from 0 without gaps, across all keys."""

METADATA = "khala"
"""Name of the metadata record that holds the versions."""
LEFT_OUT = "left out of "
"""In the metadata, before a key of which the recorder did not take everything."""


class Recorder:
    """The writer of one recording. A context manager; a file without `close` is readable up to the last flush.

    Args:
        path: the file, which must not exist yet; missing directories are created.
        clock: wall time in nanoseconds since 1970, for the log times.
        metadata: texts to keep with the versions of Khala, Python and the schema.

    Raises:
        RecordingError: the file exists or cannot be written.
    """

    def __init__(
        self, path: Path | str, *, clock: Callable[[], int] = time.time_ns, metadata: Mapping[str, str] | None = None
    ) -> None:
        self.path = Path(path)
        self._clock = clock
        self._schemas: dict[type[Wire], int] = {}
        self._channels: dict[str, int] = {}
        self._notes: dict[str, str] = {}
        self._count = 0
        self._file = _create(self.path)
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        try:
            with _writing(self.path):
                self._writer.start(library=f"{LIBRARY} {_khala_version()}")
                self._writer.add_metadata(METADATA, _versions() | dict(metadata or {}))
                self._flush()
        except RecordingError:
            with contextlib.suppress(OSError):  # it closes, but reports the same error again
                self._file.close()
            raise

    def write(self, key: str, payload: bytes, *, log_time_ns: int | None = None) -> None:
        """Write bytes as they went over the bus; bytes that are not a message are evidence and are kept too.

        Raises:
            RecordingError: the file can no longer be written.
        """
        self._require_open()
        now = self._clock() if log_time_ns is None else log_time_ns
        with _writing(self.path):
            channel = self._channels.get(key) or self._register(key)
            self._writer.add_message(channel, now, payload, publish_time=now, sequence=self._count)
        self._count += 1

    def flush(self) -> None:
        """Pass everything written so far to the operating system: a process killed later cannot lose it."""
        self._require_open()
        with _writing(self.path):
            self._flush()

    def note_left_out(self, key: str, words: str) -> None:
        """Keep how much of a key is not in the file, for its end; the last words count."""
        self._notes[LEFT_OUT + key] = words

    def close(self) -> None:
        """End the file, with notes, index and statistics. May be called twice."""
        if self._file.closed:
            return
        with _writing(self.path), self._file:
            if self._notes:
                self._writer.add_metadata(METADATA, self._notes)
            self._writer.finish()  # type: ignore[no-untyped-call]  # mcap annotates no return here

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _flush(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap annotates no return here

    def _register(self, key: str) -> int:
        model = _kind_of(key)
        if model is None:
            channel = self._writer.register_channel(key, "", 0)
        else:
            channel = self._writer.register_channel(
                key, "json", self._schemas.get(model) or self._register_schema(model)
            )
        self._channels[key] = channel
        return channel

    def _register_schema(self, model: type[Wire]) -> int:
        self._schemas[model] = self._writer.register_schema(f"khala.{model.__name__}", "jsonschema", _schema(model))
        return self._schemas[model]

    def _require_open(self) -> None:
        if self._file.closed:
            raise RecordingError(f"{self.path} was closed: open another recording to write more")


@functools.cache
def _schema(model: type[Wire]) -> bytes:
    """Return the JSON schema of a message; pydantic takes 20 ms to make one."""
    return json.dumps(model.model_json_schema()).encode()


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise RecordingError(
            f"{path} cannot be written: {error.strerror}; what was flushed before can still be read"
        ) from error


def _create(path: Path) -> IO[bytes]:
    try:
        make_private(path.parent)
        path.touch(0o600, exist_ok=False)  # prompts and replies are for its user alone
        return path.open("wb")
    except FileExistsError:
        if path.is_dir():
            raise RecordingError(f"{path} is a directory: name a file in it, such as {path / 'run.mcap'}") from None
        raise RecordingError(f"{path} exists already: choose another name: recordings are not overwritten") from None
    except NotADirectoryError:
        raise RecordingError(f"{path} cannot be written: a part of its path is a file, not a directory") from None
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}; choose another place") from None


def _kind_of(key: str) -> type[Wire] | None:
    try:
        return KINDS.get(parse(key).topic)
    except PeerError:
        return None


def _versions() -> dict[str, str]:
    return {"khala": _khala_version(), "python": platform.python_version(), "schema": str(SCHEMA_VERSION)}


def _khala_version() -> str:
    try:
        return version("khala-sc2")
    except PackageNotFoundError:  # run from a checkout that is not installed
        return "unknown"
