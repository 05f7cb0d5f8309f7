"""What code a task names: the one list that every door asks before any of it could run, see `khala_protocol.trust`."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from khala_protocol.trust import module_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.task.config import TaskConfig


def code_of(task: TaskConfig) -> Iterator[str]:
    """Yield the modules of sections that agents of any side read, and the command that starts a guest."""
    for side in task.per_side():
        for agent in side.agents:
            yield from filter(None, map(module_of, agent.sections))
    if task.opponent.command:
        yield shlex.join(task.opponent.command)
