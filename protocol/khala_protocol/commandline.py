"""Run a command line: an error that the user can fix is one sentence on stderr and an exit code, never a traceback.

Above: `khala.cli`, and the commands of packages that are installed alone. It knows no library for options.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import KhalaError
from khala_protocol.visible import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def run_command(name: str, command: Callable[[], object], *errors: type[Exception]) -> None:
    """Run a command and end the process with exit code 1 if it raises an error that the user can fix.

    Args:
        name: of the command, as the user typed it.
        command: reads the options and does the work.
        errors: further types of such errors, in addition to `KhalaError`.
    """
    user_errors: tuple[type[Exception], ...] = (KhalaError, *errors)
    faults: list[BaseException] = []
    try:
        command()
    except* user_errors as group:
        faults = list(_leaves(group))
    for fault in faults:
        sys.stderr.write(f"{name}: {visible(str(fault))}\n")
    if faults:  # not within `except*`: early Pythons 3.11 raise an exit there as a part of a group
        sys.exit(1)


def _leaves(group: BaseExceptionGroup[Any]) -> Iterator[BaseException]:
    for error in group.exceptions:
        if isinstance(error, BaseExceptionGroup):
            yield from _leaves(error)
        else:
            yield error
