"""End a process as soon as the one that started it is gone, however that ended: SIGKILL leaves no time to say so.

A parent names itself in the environment of the processes that must not outlive it. A process that was started by hand
finds no such name, and lives as long as it likes. The simulator, which stands alone, reads the same variable.

Above: `python -m khala_sc2`, as which `khala run` starts its processes.
"""

from __future__ import annotations

import os
import threading
import time
from typing import Final

from khala_protocol.platforms import end_this_process, wait_for_end_of

PARENT: Final = "KHALA_PARENT"
"""The variable with the process id of the parent."""
UNWIND_S = 1.0
"""Time to end in order; a process that is too busy for it ends anyway."""


def named_parent() -> dict[str, str]:
    """Return what a process adds to the environment of one that must not outlive it."""
    return {PARENT: str(os.getpid())}


def end_with_parent() -> None:
    """End this process soon after its parent, if the environment names one.

    The name is taken out of the environment: processes that this one starts have another parent.
    """
    parent = os.environ.pop(PARENT, "")
    if parent.isdigit():
        threading.Thread(target=_watch, args=(int(parent),), name="parent watch", daemon=True).start()


def _watch(parent: int) -> None:
    # Not a task of the loop, which code of the user may block.
    wait_for_end_of(parent)
    end_this_process()
    time.sleep(UNWIND_S)
    os._exit(1)
