"""Who hears what next turn.

Messages that arrived in a step are put into the next observations of their recipients: an agent of the same
side by name, or everybody on that side who listens to a channel, the sender excepted. What nobody can get
goes back to the sender as a rejection. Listening to a channel lasts until the end of the episode.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.messages import Message, Received, Rejection

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MAX_CHARACTERS = 4000
"""Longer messages are cut: what one agent says is read by all others, and paid for by them."""


@dataclass(frozen=True, slots=True)
class Post:
    """What was delivered after a step: by recipient, in order of arrival; and what could not be."""

    received: Mapping[Seat, tuple[Received, ...]] = field(default_factory=dict)
    rejections: Mapping[Seat, tuple[Rejection, ...]] = field(default_factory=dict)


class Mailbox:
    """Sorts messages into boxes; knows who listens to which channel."""

    def __init__(self, reach: Mapping[Seat, Sequence[Seat]], channels: Iterable[str] = ()) -> None:
        """Takes whom each seat may write to, and the channels that everybody may."""
        self._reach = dict(reach)
        self._channels = tuple(channels)
        self._listeners: dict[tuple[str, str], list[Seat]] = defaultdict(list)

    def clear(self) -> None:
        """Forgets who listens, at the beginning of an episode."""
        self._listeners.clear()

    def listen(self, seat: Seat, channel: str) -> None:
        """From now on `seat` hears what is said on `channel`; unknown channels are heard by nobody."""
        listeners = self._listeners[seat.side, channel.casefold()]
        if seat not in listeners:
            listeners.append(seat)

    def deliver(self, messages: Iterable[Message]) -> Post:
        """Sorts the messages of one step."""
        boxes: dict[Seat, list[Received]] = defaultdict(list)
        returned: dict[Seat, list[Rejection]] = defaultdict(list)
        for message in messages:
            sender = Seat(message.side, message.agent)
            recipients = self._recipients(sender, message.recipient)
            if recipients is None:
                returned[sender].append(self._return(sender, message))
                continue
            text = message.text[:MAX_CHARACTERS]
            for seat in recipients:
                boxes[seat].append(Received(sender=message.agent, recipient=message.recipient, text=text))
        return Post({s: tuple(m) for s, m in boxes.items()}, {s: tuple(r) for s, r in returned.items()})

    def _recipients(self, sender: Seat, name: str) -> list[Seat] | None:
        wanted = name.casefold()
        if wanted in (channel.casefold() for channel in self._channels):
            return [seat for seat in self._listeners[sender.side, wanted] if seat != sender]
        return [seat for seat in self._reach[sender] if seat.agent.casefold() == wanted] or None

    def _return(self, sender: Seat, message: Message) -> Rejection:
        names = [seat.agent for seat in self._reach[sender]] + list(self._channels)
        known = "you can write to " + ", ".join(names) if names else "there is nobody to write to"
        return Rejection(
            reason="unknown_recipient",
            message=f"You cannot write to {message.recipient!r}: {known}.",
            text=message.recipient,
            start=0,
        )
