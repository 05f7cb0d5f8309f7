"""Messages that stay in an agent's observations until it has answered them, or they are too old.

An answer is any message of the reader to the sender, or to the channel, after the reader was shown the message.
`khala_orchestrator.words.mailbox` is before this: it says who gets which message. `khala_orchestrator.match.side` is
above.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_orchestrator.words.mailbox import newest
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_protocol.messages import Received


@dataclass(slots=True)
class _Letter:
    received: Received
    loop: int
    """When it was written."""
    shown: bool = False

    def as_read(self, loop: int) -> Received:
        """Return the message as its reader finds it at a game loop."""
        return self.received.but(age_s=round((loop - self.loop) / LOOPS_PER_S, 1), again=self.shown)

    def is_answered_by(self, recipient: str) -> bool:
        """Return True if a message to this recipient answers it."""
        return self.shown and recipient.casefold() in {
            self.received.sender.casefold(),
            self.received.recipient.casefold(),
        }


@dataclass(slots=True)
class Letters:
    """The open messages of one agent in one episode."""

    keep_s: float
    """Seconds for which they stay; 0 if the agent is shown each once."""
    _open: list[_Letter] = field(default_factory=list)

    def close(self, recipient: str) -> None:
        """Close the messages that the agent answers by writing to this recipient."""
        self._open = [letter for letter in self._open if not letter.is_answered_by(recipient)]

    def add(self, messages: Iterable[Received], loop: int) -> None:
        """Keep the messages that were written to the agent at a game loop."""
        if self.keep_s:
            self._open += [_Letter(message, loop) for message in messages]

    def read(self, new: tuple[Received, ...], loop: int) -> tuple[Received, ...]:
        """Return the messages that the agent finds now, the oldest first: all that are open, or the new ones alone."""
        if not self.keep_s:
            return new
        oldest = loop - self.keep_s * LOOPS_PER_S
        self._open = [letter for letter in self._open if letter.loop >= oldest or not letter.shown]
        return newest([letter.as_read(loop) for letter in self._open])

    def mark_shown(self) -> None:
        """Take note that the agent was shown all of its open messages."""
        for letter in self._open:
            letter.shown = True
