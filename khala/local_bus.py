"""Where the processes of a match on one machine meet: a unix socket in a directory that no other user can enter.

Any user of the machine can connect to a port of its loopback interface, and be an agent there.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

LOOPBACK = "tcp/127.0.0.1:0"
PREFIX = "khala-bus-"
SOCKET = "bus.sock"
LONGEST_PATH_BYTES = 103
"""Of a unix socket on macOS; Linux takes 107."""


@contextlib.contextmanager
def local_endpoint() -> Iterator[str]:
    """Yield an endpoint to listen on, and remove what it leaves; where such a socket cannot be, it is a free port."""
    if not hasattr(socket, "AF_UNIX"):
        yield LOOPBACK
        return
    remove_forgotten()
    with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as directory:  # with mode 0700
        path = f"{directory}/{SOCKET}"
        yield f"unixsock-stream/{path}" if len(os.fsencode(path)) <= LONGEST_PATH_BYTES else LOOPBACK


def remove_forgotten() -> None:
    """Remove the directories of our matches that were killed: nobody listens on their sockets."""
    for directory in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            if directory.stat(follow_symlinks=False).st_uid == os.getuid() and _is_dead(directory / SOCKET):
                shutil.rmtree(directory, ignore_errors=True)


def _is_dead(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            return True
        except OSError:  # not there: its match may be about to listen
            return False
    return False
