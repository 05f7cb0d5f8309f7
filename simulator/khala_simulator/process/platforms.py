"""Whatever Linux, macOS and Windows do differently for the process of a game: its parent, its socket, its launcher.

No other module of the simulator names anything of `os`, `signal` or `socket` that Windows lacks.
"""

from __future__ import annotations

import os
import shlex
import sys
import time
import zipfile
from importlib.resources import files
from io import BytesIO
from pathlib import PurePosixPath
from typing import Final

PARENT_LOOK_S: Final = 0.25

if sys.platform == "win32":
    import _winapi

    _SYNCHRONIZE: Final = 0x0010_0000

    def _await_windows(process: int, within_ms: int) -> bool:
        """Return whether a process has ended, after this time at the latest."""
        try:
            handle = _winapi.OpenProcess(_SYNCHRONIZE, False, process)  # it takes no names
        except OSError:
            return True
        try:
            return _winapi.WaitForSingleObject(handle, within_ms) == _winapi.WAIT_OBJECT_0
        finally:
            _winapi.CloseHandle(handle)


def wait_for_end_of(parent: int) -> None:
    """Block until the parent of this process is gone.

    Args:
        parent: its number. It cannot mislead: the process that adopts an orphan had its number while the parent lived.
            On Windows nobody adopts an orphan, so the process itself is waited for.
    """
    if sys.platform == "win32":
        _await_windows(parent, _winapi.INFINITE)
    else:
        while os.getppid() == parent:
            time.sleep(PARENT_LOOK_S)


def living_parent() -> int:
    """Return the number of the parent; another one when it is gone, which is 0 on Windows."""
    parent = os.getppid()
    if sys.platform == "win32" and _await_windows(parent, 0):
        return 0
    return parent


def launcher_name(platform: str = sys.platform) -> PurePosixPath:
    """Return which file clients start below `Versions/Base…`."""
    return PurePosixPath({"win32": "SC2_x64.exe", "darwin": "SC2.app/Contents/MacOS/SC2"}.get(platform, "SC2_x64"))


def directories_of_game(platform: str = sys.platform) -> tuple[str, ...]:
    """Return what clients expect of an install beside its versions and maps: on Windows they start the game there."""
    return ("Support64",) if platform == "win32" else ()


def launcher(code: str, mark: str, platform: str = sys.platform) -> bytes:
    """Return a program that becomes the game.

    Args:
        code: Python that begins it, with its arguments in `sys.argv`, and its own path after `-executable`.
        mark: a comment in its first or last 256 bytes.
        platform: on which it runs.
    """
    return _exe(code, mark) if platform == "win32" else _script(code, mark)


def _script(code: str, mark: str) -> bytes:
    # -I: the client's PYTHONPATH and its user site are not ours. exec: signals must reach the game itself.
    # malloc: half a megabyte is made and freed for every observation; by default it goes back to the kernel each time,
    # and fetching the pages again costs more (235 page faults, 0.5 ms) than drawing what is in them.
    malloc = "export MALLOC_TRIM_THRESHOLD_=268435456 MALLOC_MMAP_THRESHOLD_=33554432"
    command = f'exec {shlex.quote(sys.executable)} -I -c {shlex.quote(code)} -executable "$0" "$@"'
    return f"#!/bin/sh\n# {mark}\n{malloc}\n{command}\n".encode()


def _exe(code: str, mark: str) -> bytes:
    """Return what pip makes for a command on Windows: an executable, the path of a Python, and a ZIP file with code.

    It starts this Python as a child, which ends with it.
    """
    kind = "t64-arm.exe" if "ARM64" in sys.version else "t64.exe"
    start = files("distlib").joinpath(kind).read_bytes()
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        whole = f"import sys; sys.argv[1:1] = ['-executable', sys.argv[0]]; {code}"
        archive.writestr(zipfile.ZipInfo("__main__.py"), whole)  # with a fixed date: an install that is there stays
        archive.comment = mark.encode()
    return start + f'#!"{sys.executable}" -I\r\n'.encode() + packed.getvalue()
