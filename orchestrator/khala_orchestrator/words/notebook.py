"""The notes that agents keep for themselves, on the host: they outlive an agent's process and stand in the recording.

An agent writes `<Note('''text''')>` and `<Forget(2)>`. A note keeps its number for the episode, so that a reply that
takes effect late still forgets the note that it means. `khala_orchestrator.match.side` is above.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from khala_protocol.messages import NoteView, Rejection
from khala_protocol.speech import Note

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from khala_protocol.speech import Forget

MAX_NOTE_CHARACTERS = 200
"""Longest note; the rest is cut."""


@dataclass
class Notebook:
    """The notes of all agents of a side in one episode."""

    room: Mapping[str, int]
    """By agent, the number of its notes."""
    _notes: dict[str, list[NoteView]] = field(default_factory=lambda: defaultdict(list))
    _written: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def clear(self) -> None:
        """Forget the episode before."""
        self._notes.clear()
        self._written.clear()

    def of(self, agent: str) -> tuple[NoteView, ...]:
        """Return the notes of an agent, the oldest first."""
        return tuple(self._notes[agent])

    def take(self, agent: str, items: Iterable[Note | Forget], time_s: float) -> Iterator[Rejection]:
        """Keep and forget what an agent says; yield what cannot be done."""
        for item in items:
            if not self.room[agent]:
                yield _rejection("unknown_action", "No notes are kept in this task.", item)
                return
            if isinstance(item, Note):
                self._write(agent, item.text, time_s)
            elif item.number not in [note.number for note in self._notes[agent]]:
                yield _rejection("unknown_target", f"You have no note {item.number}.", item)
            else:
                self._notes[agent] = [note for note in self._notes[agent] if note.number != item.number]

    def _write(self, agent: str, text: str, time_s: float) -> None:
        self._written[agent] += 1
        line = " ".join(text.split())
        short = line if len(line) <= MAX_NOTE_CHARACTERS else line[: MAX_NOTE_CHARACTERS - 1] + "…"
        kept = [*self._notes[agent], NoteView(number=self._written[agent], time_s=time_s, text=short)]
        self._notes[agent] = kept[-self.room[agent] :]


def _rejection(reason: Literal["unknown_action", "unknown_target"], message: str, item: Note | Forget) -> Rejection:
    text = "<Note(…)>" if isinstance(item, Note) else f"<Forget({item.number})>"
    return Rejection(reason=reason, message=message, text=text, start=item.start)
