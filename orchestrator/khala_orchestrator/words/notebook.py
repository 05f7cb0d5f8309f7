"""The notes that an agent keeps for itself, on the host: they outlive its process and stand in the recording.

An agent writes `<Note('''text''')>` and `<Forget(2)>`. A note keeps its number for the episode, so that a reply that
takes effect late still forgets the note that it means. `khala_orchestrator.match.side` is above.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from khala_protocol.messages import NoteView, Rejection
from khala_protocol.speech import Note

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_protocol.speech import Forget

MAX_NOTE_CHARACTERS = 200
"""Longest note; the rest is cut."""


@dataclass(slots=True)
class Notebook:
    """The notes of one agent in one episode."""

    room: int
    """Number of notes that it keeps."""
    notes: tuple[NoteView, ...] = ()
    """The oldest first."""
    _last: int = 0
    """Number of the newest note."""

    def take(self, items: Iterable[Note | Forget], time_s: float) -> Iterator[Rejection]:
        """Write and forget notes; yield what cannot be done."""
        for item in items:
            if not self.room:
                yield _rejection("unknown_action", "No notes are kept in this task.", item)
                return
            if isinstance(item, Note):
                self._write(item.text, time_s)
            elif item.number not in [note.number for note in self.notes]:
                yield _rejection("unknown_target", f"You have no note {item.number}.", item)
            else:
                self.notes = tuple(note for note in self.notes if note.number != item.number)

    def _write(self, text: str, time_s: float) -> None:
        self._last += 1
        line = " ".join(text.split())
        short = line if len(line) <= MAX_NOTE_CHARACTERS else line[: MAX_NOTE_CHARACTERS - 1] + "…"
        note = NoteView(number=self._last, time_s=time_s, text=short)
        self.notes = (*self.notes, note)[-self.room :]


def _rejection(reason: Literal["unknown_action", "unknown_target"], message: str, item: Note | Forget) -> Rejection:
    text = "<Note(…)>" if isinstance(item, Note) else f"<Forget({item.number})>"
    return Rejection(reason=reason, message=message, text=text, start=item.start)
