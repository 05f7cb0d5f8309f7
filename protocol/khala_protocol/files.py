"""Read files that others name: regular ones of a limited size, so that no pipe or device stops or fills a process.

Every refusal is an `OSError` whose `strerror` is a sentence, as those of the operating system are.
"""

from __future__ import annotations

import errno
import os
import stat
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

MB = 2**20


def check_regular(path: Path) -> None:
    """Raise `OSError` unless there is a regular file at `path`; opening a pipe would wait for its writer."""
    try:
        mode = path.stat().st_mode
    except ValueError:
        raise OSError(errno.EINVAL, "its name has a character that no file name has", str(path)) from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is a pipe or a device, a file is wanted", str(path))


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
