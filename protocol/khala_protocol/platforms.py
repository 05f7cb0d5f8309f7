"""Whatever Linux, macOS and Windows do differently: signals, parents and children, sockets, pipes, modes of files.

No other module of Khala names anything of `os`, `signal` or `socket` that Windows lacks
(`tests/project/test_platforms.py`), so a port is a change of this file. The simulator, which stands alone, has a
module of the same name for its own process.

On Windows no process can be asked to end by a signal. A child leads a group of its own there, and gets Ctrl-Break in
place of SIGTERM. A parent that is gone keeps its number there, so a child waits for the end of the process itself.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, BinaryIO, Final, TypedDict

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from types import FrameType

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)
"""The signals that end a command in order."""
HAS_UNIX_SOCKETS: Final = sys.platform != "win32"
if sys.platform == "win32":
    NO_FOLLOW: Final = 0
else:
    NO_FOLLOW: Final = os.O_NOFOLLOW
"""The flag of `os.open` that refuses a link."""
_LOOK_S = 0.25

# --- signals ------------------------------------------------------------------------------------------


def on_signals(handle: Callable[[signal.Signals], None]) -> Callable[[], None]:
    """Have the running loop call `handle` with each of `SIGNALS` that comes; return what undoes it."""
    loop = asyncio.get_running_loop()
    try:
        for number in SIGNALS:
            loop.add_signal_handler(number, handle, number)
    except NotImplementedError:
        return _without_loop(loop, handle)

    def undo() -> None:
        for number in SIGNALS:
            loop.remove_signal_handler(number)

    return undo


def _without_loop(loop: asyncio.AbstractEventLoop, handle: Callable[[signal.Signals], None]) -> Callable[[], None]:
    """Set handlers of Python, as the loops of Windows have none; Ctrl-Break counts as SIGTERM there."""
    meanings = {number: number for number in SIGNALS}
    if sys.platform == "win32":
        meanings[signal.SIGBREAK] = signal.SIGTERM
    before = {number: signal.getsignal(number) for number in meanings}

    def take(number: int, _: FrameType | None) -> None:
        if loop.is_closed():
            raise KeyboardInterrupt
        loop.call_soon_threadsafe(handle, meanings[signal.Signals(number)])

    def undo() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in meanings:
        signal.signal(number, take)
    return undo


def end_this_process() -> None:
    """Ask this process to end in order, from any of its threads."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGTERM)
    else:
        os.kill(os.getpid(), signal.SIGTERM)


# --- parents and children -----------------------------------------------------------------------------


class ChildOptions(TypedDict, total=False):
    """Options of `subprocess` and of `asyncio.create_subprocess_exec`."""

    start_new_session: bool
    creationflags: int


def apart() -> ChildOptions:
    """Return the options of a child that Ctrl-C in our terminal does not reach."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def ask_to_end(process: asyncio.subprocess.Process) -> None:
    """Ask a child that was started with `apart` to end in order.

    Raises:
        ProcessLookupError: it has ended.
    """
    if sys.platform == "win32":
        with contextlib.suppress(OSError):  # neither of us has a console
            process.send_signal(signal.CTRL_BREAK_EVENT)
            return
    process.terminate()


def wait_for_end_of(parent: int) -> None:
    """Block until the parent of this process is gone.

    Args:
        parent: its number. It cannot mislead: the process that adopts an orphan had its number while the parent lived.
    """
    if sys.platform == "win32":
        _wait_on_windows(parent)
    else:
        while os.getppid() == parent:
            time.sleep(_LOOK_S)


if sys.platform == "win32":

    def _wait_on_windows(parent: int) -> None:
        """Wait for the process itself: `os.getppid` stays, and is that of the launcher of a virtual environment."""
        import _winapi  # noqa: PLC0415  # there is none elsewhere

        synchronize = 0x0010_0000
        try:
            handle = _winapi.OpenProcess(synchronize, False, parent)  # it takes no names
        except OSError:  # it is gone already
            return
        try:
            _winapi.WaitForSingleObject(handle, _winapi.INFINITE)
        finally:
            _winapi.CloseHandle(handle)


def cores() -> int:
    """Return how many cores this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    else:  # noqa: RET505  # for mypy, which takes what follows for dead code
        return os.cpu_count() or 1


# --- sockets and pipes --------------------------------------------------------------------------------


def unix_socket() -> socket.socket:
    """Return a unix socket.

    Raises:
        OSError: this platform has none.
    """
    if sys.platform == "win32":
        raise OSError(_NO_UNIX_SOCKETS)
    return socket.socket(socket.AF_UNIX)


async def open_unix_connection(path: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect to a unix socket.

    Raises:
        OSError: nobody listens there, or this platform has none.
    """
    if sys.platform == "win32":
        raise OSError(_NO_UNIX_SOCKETS)
    return await asyncio.open_unix_connection(path)


_NO_UNIX_SOCKETS = "Windows has no unix sockets here: name a tcp/ endpoint"


def reset_on_close(peer: socket.socket) -> None:
    """Have the peer of a connection see a reset instead of an end when it is closed."""
    pair = "hh" if sys.platform == "win32" else "ii"
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack(pair, 1, 0))


async def read_lines(pipe: BinaryIO, limit: int) -> asyncio.StreamReader:
    """Return a reader of a pipe, such as that of stdin.

    Args:
        pipe: its end of ours.
        limit: bytes of the longest line.
    """
    reader = asyncio.StreamReader(limit=limit)
    if sys.platform == "win32":
        read_in_thread(pipe, reader)
    else:
        await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), pipe)
    return reader


def read_in_thread(pipe: BinaryIO, reader: asyncio.StreamReader) -> None:
    """Feed a reader from a thread, where a loop can wait for no pipe that it has not made itself."""
    loop = asyncio.get_running_loop()

    def feed() -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed
            for line in pipe:
                loop.call_soon_threadsafe(reader.feed_data, line)
            loop.call_soon_threadsafe(reader.feed_eof)

    threading.Thread(target=feed, name="pipe", daemon=True).start()


# --- files --------------------------------------------------------------------------------------------


def is_mine(path: Path) -> bool:
    """Return whether a file or directory, not what it links to, belongs to the user of this process."""
    with contextlib.suppress(OSError):
        owner = path.stat(follow_symlinks=False).st_uid
        return sys.platform == "win32" or owner == os.getuid()  # Windows tells no owner; its rights come from above
    return False


def others_can_read(path: Path) -> bool:
    """Return whether users of this machine other than its owner may read a file; on Windows, without modes, never."""
    return sys.platform != "win32" and bool(path.stat().st_mode & 0o077)
