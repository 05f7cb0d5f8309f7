"""Where the processes of a match on one machine meet: a unix socket in a directory that no other user can enter.

Any user of the machine can connect to a port of its loopback interface, and be an agent there.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from khala_protocol.platforms import HAS_UNIX_SOCKETS, is_mine, unix_socket

if TYPE_CHECKING:
    from collections.abc import Iterator

LOOPBACK = "tcp/127.0.0.1:0"
PREFIX = "khala-bus-"
SOCKET = "bus.sock"
LONGEST_PATH_BYTES = 103
"""Of a unix socket on macOS; Linux takes 107."""
SETTLED_S = 60.0
"""Age of a socket at which nobody is between binding it and listening on it, however busy the machine is."""


@contextlib.contextmanager
def local_endpoint() -> Iterator[str]:
    """Yield an endpoint to listen on, and remove what it leaves; where such a socket cannot be, it is a free port."""
    if not HAS_UNIX_SOCKETS:
        yield LOOPBACK
        return
    remove_forgotten()
    with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as directory:  # with mode 0700
        path = f"{directory}/{SOCKET}"
        yield f"unixsock-stream/{path}" if len(os.fsencode(path)) <= LONGEST_PATH_BYTES else LOOPBACK


def running() -> list[str]:
    """Return the endpoints of our matches on this machine that are being played, the newest first."""
    found = [path / SOCKET for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*") if is_mine(path)]
    alive = [path for path in found if path.exists() and not _is_dead(path)]
    return [f"unixsock-stream/{path}" for path in sorted(alive, key=lambda path: -path.stat().st_mtime)]


def remove_forgotten() -> None:
    """Remove the directories of our matches that were killed: nobody listens on their sockets."""
    for directory in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        if is_mine(directory) and _is_old(directory / SOCKET) and _is_dead(directory / SOCKET):
            shutil.rmtree(directory, ignore_errors=True)


def _is_old(path: Path) -> bool:
    with contextlib.suppress(OSError):
        return time.time() - path.stat(follow_symlinks=False).st_mtime > SETTLED_S
    return False


def _is_dead(path: Path) -> bool:
    with unix_socket() as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            return True
        except OSError:  # not there: its match may be about to listen
            return False
    return False
