"""Messages that stay in an agent's observations until it has answered them, or they are too old.

An answer is any message of the reader to the sender, or to the channel, after the reader was shown the message.
`khala_orchestrator.words.mailbox` is before this: it says who gets which message. `khala_orchestrator.match.side` is
above.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_orchestrator.words.mailbox import newest
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_protocol.messages import Received


@dataclass(slots=True)
class _Letter:
    received: Received
    loop: int
    """When it was written."""
    shown: bool = False

    def at(self, loop: int) -> Received:
        """Return the message as its reader finds it at a game loop."""
        return self.received.but(age_s=round((loop - self.loop) / LOOPS_PER_S, 1), again=self.shown)

    def is_answered_by(self, recipient: str) -> bool:
        """Return True if a message to this recipient answers it."""
        return self.shown and recipient.casefold() in {
            self.received.sender.casefold(),
            self.received.recipient.casefold(),
        }


@dataclass
class Letters:
    """The open messages of all agents of a side in one episode."""

    keep_s: Mapping[str, float]
    """By agent, the seconds for which its messages stay; 0 for agents that are shown each once."""
    _open: dict[str, list[_Letter]] = field(default_factory=lambda: defaultdict(list))

    def clear(self) -> None:
        """Forget the episode before."""
        self._open.clear()

    def answered(self, agent: str, recipients: Iterable[str]) -> None:
        """Close the messages of an agent that it answers by writing to these."""
        for recipient in recipients:
            self._open[agent] = [letter for letter in self._open[agent] if not letter.is_answered_by(recipient)]

    def arrive(self, agent: str, messages: Iterable[Received], loop: int) -> None:
        """Keep the messages that were written to an agent at a game loop."""
        if self.keep_s[agent]:
            self._open[agent] += [_Letter(message, loop) for message in messages]

    def of(self, agent: str, new: tuple[Received, ...], loop: int) -> tuple[Received, ...]:
        """Return the messages that an agent finds now, the oldest first: all that are open, or the new ones alone."""
        oldest = loop - self.keep_s[agent] * LOOPS_PER_S
        if not self.keep_s[agent]:
            return new
        self._open[agent] = [letter for letter in self._open[agent] if letter.loop >= oldest or not letter.shown]
        return newest([letter.at(loop) for letter in self._open[agent]])

    def shown(self, agent: str) -> None:
        """Take note that an agent was shown all of its open messages."""
        for letter in self._open[agent]:
            letter.shown = True
