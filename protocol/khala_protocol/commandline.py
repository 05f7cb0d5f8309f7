"""Run a command line, and print its lines: what comes from elsewhere does nothing to the terminal.

An error that the user can fix is one sentence on stderr and an exit code, never a traceback. Above: `khala_sc2.cli`, and
the commands of packages that are installed alone. It knows no library for options. Tables and colours are printed by
the consoles of `khala_orchestrator.console`; nothing else writes to a terminal.
"""

from __future__ import annotations

import errno
import io
import sys
from typing import TYPE_CHECKING, Any, Final

from khala_protocol.errors import KhalaError
from khala_protocol.visible import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT})
_OF_THE_MACHINE: Final = _FULL | {
    errno.EACCES, errno.EPERM, errno.EROFS, errno.EIO, errno.EFBIG, errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG,
    errno.ELOOP, errno.EBUSY, errno.EEXIST, errno.ENOENT, errno.EMFILE, errno.ENFILE,
}  # fmt: skip
"""Faults of a disk or of a path, which the user can mend."""


def say(text: str, *, err: bool = False) -> None:
    """Print a text on a line of its own, with all of its characters visible.

    Args:
        text: may come from anywhere.
        err: print it on stderr, where a person reads; stdout is for what other programs take.
    """
    stream = sys.stderr if err else sys.stdout
    stream.write(f"{visible(text)}\n")
    stream.flush()


def run_command(name: str, command: Callable[[], object], *errors: type[Exception]) -> None:
    """Run a command and end the process with exit code 1 if it raises an error that the user can fix.

    Args:
        name: of the command, as the user typed it.
        command: reads the options and does the work.
        errors: further types of such errors, in addition to `KhalaError`.
    """
    _escape_unknown_characters()
    user_errors: tuple[type[Exception], ...] = (KhalaError, *errors)
    all_errors: tuple[type[Exception], ...] = (*user_errors, OSError)
    faults: list[BaseException] = []
    try:
        command()
    except* all_errors as group:
        ours, others = group.split(lambda error: isinstance(error, user_errors) or _is_of_the_machine(error))
        if others is not None:
            raise others from None
        faults = list(_leaves(ours)) if ours is not None else []
    for fault in faults:
        say(f"{name}: {_sentence(fault)}", err=True)
    if faults:  # not within `except*`: early Pythons 3.11 raise an exit there as a part of a group
        sys.exit(1)


def _escape_unknown_characters() -> None:
    """Print what the encoding of a terminal lacks as an escape: in ASCII, `→` would end the command in a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _is_of_the_machine(error: BaseException) -> bool:
    return isinstance(error, OSError) and error.errno in _OF_THE_MACHINE


def _sentence(error: BaseException) -> str:
    """Return an error as a sentence."""
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    what = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if error.errno in _FULL:
        return f"{what}: make room there and do it again; every file that was whole before still is"
    return what


def _leaves(group: BaseExceptionGroup[Any]) -> Iterator[BaseException]:
    for error in group.exceptions:
        if isinstance(error, BaseExceptionGroup):
            yield from _leaves(error)
        else:
            yield error
