"""Where the paper of LLM-PySC2 and its published maps and files differ, by task, and which of the two is played.

A typed reading of `bridge/khala_bridge/data/paper.yaml`, for the list of tasks. What a variant changes is in the task
files and the maps, not here.
"""

from __future__ import annotations

import fnmatch
import functools
from typing import Literal

from khala_bridge import data
from khala_protocol.messages import Frozen


class PapersDifference(Frozen):
    """One thing that the paper and its files have otherwise."""

    what: str
    paper: str
    """What the paper says; "" if it says nothing of it."""
    files: str
    """What the published maps and files do."""
    played: Literal["files", "paper", "variant"]
    """`variant`: what the files do, and what the paper says with `variant: paper`; else that, in both variants."""
    levels: tuple[int, ...] = ()
    """Of the task, in which it is so; () for all."""

    def holds_in(self, task: str) -> bool:
        """Return whether it is so on the level of a task of this name."""
        return not self.levels or task.endswith(tuple(f"_level{level}" for level in self.levels))


class PapersNotes(Frozen):
    """What there is to know of one task of the paper."""

    tasks: tuple[str, ...]
    """Names of tasks, or patterns of them."""
    called: str = ""
    """Its name in the paper."""
    differs: tuple[PapersDifference, ...]

    def of(self, task: str) -> tuple[PapersDifference, ...]:
        """Return the differences in a task of this name."""
        if not any(fnmatch.fnmatchcase(task, pattern) for pattern in self.tasks):
            return ()
        return tuple(row for row in self.differs if row.holds_in(task))


@functools.cache
def papers_notes() -> dict[str, PapersNotes]:
    """Return the notes by the title of the task, in the order of the file."""
    return data.table("paper.yaml", PapersNotes)


def differences_of(task: str) -> tuple[PapersDifference, ...]:
    """Return where the paper and its files differ in a task."""
    return tuple(row for notes in papers_notes().values() for row in notes.of(task))
