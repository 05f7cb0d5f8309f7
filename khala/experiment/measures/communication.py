"""Whether messages between agents arrived, and whether their readers did anything about them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Communication:
    """Communication between the agents of the side. Advice from outside is not among it."""

    messages_sent: int
    """Messages that agents wrote, undeliverable ones among them."""
    messages_undeliverable: int
    """Of these: for nobody that the sender can write to."""
    messages_read: int
    """Pairs of a message and a reader: it stood in an observation that the reader's policy answered."""
    messages_answered: int
    """Of `messages_read`: in that answer the reader wrote to the sender, or to the channel of the message."""
    messages_acted_on: int
    """Of `messages_read`: in that answer the reader gave an order about something that the message names, and that
    its answer before had not given."""
    messages_heeded: int
    """Of `messages_read`: answered, acted on, or both."""
    heeded_share: float | None
    """`messages_heeded` / `messages_read`, 0 to 1; null if nothing was read."""
