"""Read files that others name, and write files for their user alone.

What is read is a regular file of a limited size, so that no pipe or device stops or fills a process. What is written
holds prompts, replies or results: other users of the machine may not read it, whatever the umask says, and a file that
could not be written whole leaves what was in its place. The `strerror` of every `OSError`
says in words what was refused, as that of the operating system does.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Literal

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

MB = 2**20
_DEVICES = Path("/dev")
_PART = ".part-"
"""How the names of files and directories begin that are not whole yet."""


def check_regular(path: Path) -> None:
    """Raise `OSError` unless there is a regular file at `path`; opening a pipe would wait for its writer."""
    try:
        mode = path.stat().st_mode
    except ValueError:
        raise OSError(errno.EINVAL, "its name has a character that no file name has", str(path)) from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is a pipe or a device: name a file", str(path))


def read_limited(path: Path, most_bytes: int) -> bytes:
    """Return the bytes of a regular file.

    Raises:
        OSError: it cannot be read, is no regular file, or has more than `most_bytes` bytes.
    """
    check_regular(path)
    with path.open("rb") as file:
        data = file.read(most_bytes + 1)  # files of the kernel say that they have 0 bytes
    if len(data) > most_bytes:
        raise OSError(errno.EFBIG, f"it is larger than {most_bytes / MB:g} MB", str(path))
    return data


def make_private(directory: Path) -> None:
    """Create a directory, and those above it that are missing, for its user alone; one that is there stays as it is."""
    missing = [path for path in (directory, *directory.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)
    if not directory.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(directory))


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a new file that takes its place under `path` when it is whole.

    If writing fails, what was there stays, and nothing of the new file does. A link is replaced, not followed: it may
    have been put there to have another file overwritten. A pipe or a device is written as it is.
    """
    if _is_stream(path):
        with path.open("wb") as stream:
            yield stream
        return
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    with _name_file(path):
        descriptor, name = tempfile.mkstemp(prefix=_PART, dir=path.parent)  # its mode is 0600
    part = Path(name)
    try:
        with _name_file(path):
            with os.fdopen(descriptor, "wb") as file:
                yield file
            part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def replacing_directory(path: Path) -> Iterator[Path]:
    """Yield a new directory that takes the place of none or of an empty one under `path` when it is whole."""
    path = path.resolve()
    with _name_file(path):
        make_private(path.parent)
        part = Path(tempfile.mkdtemp(prefix=_PART, dir=path.parent))  # its mode is 0700
    try:
        yield part
        with _name_file(path):
            if path.exists():
                path.rmdir()
            part.rename(path)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise


def write_private(path: Path, content: bytes | str) -> None:
    """Write a whole file; see `replacing`."""
    write_together({path: content.encode() if isinstance(content, str) else content})


def write_together(files: Mapping[Path, bytes]) -> None:
    """Write files so that either all of them are new or none is; see `replacing`."""
    with contextlib.ExitStack() as stack:
        for path, content in files.items():
            file = stack.enter_context(replacing(path))
            file.write(content)
            file.flush()


def open_private(path: Path, mode: Literal["ab", "wb", "xb"]) -> BinaryIO:
    """Open a file that is written bit by bit, such as a log."""
    return open(path, mode, opener=_private)  # Path.open takes no opener


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)


def _is_stream(path: Path) -> bool:
    return path.parent == _DEVICES or (path.exists() and not path.is_file() and not path.is_dir())


@contextlib.contextmanager
def _name_file(path: Path) -> Iterator[None]:
    """Have an `OSError` name the file that is written: that of a full disk names none."""
    try:
        yield
    except OSError as error:
        if error.filename is not None and _PART not in str(error.filename):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
