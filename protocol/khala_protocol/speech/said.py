"""The content of a reply, and which parts of it count.

`khala_protocol.speech.reader` walks over the text and collects here what it finds. At the end this module decides
which calls are orders, which are only mentioned, and which were repeated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from khala_protocol.messages import Call, Rejection
from khala_protocol.speech.headings import ReplySection

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


@dataclass(frozen=True, slots=True)
class MessageTo:
    """A message for another agent, or for all listeners of a channel; `reply[start:end]` is the call."""

    recipient: str
    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class ListenTo:
    """A request to hear a channel; `reply[start:end]` is the call."""

    channel: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Note:
    """A note of the agent to itself."""

    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Forget:
    """A request to remove a note of the agent."""

    number: int
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Standing:
    """An order to give `call` again and again; `reply[start:end]` is all of it."""

    call: Call
    until: str
    """Its end as written, `22 Probe`; "" if it has none."""
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Revoke:
    """A request to end a standing order."""

    number: int
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Speech:
    """The content of a reply, in the order of the text.

    Attributes:
        calls: actions to carry out.
        messages: messages to agents or channels.
        listens: channels to listen to.
        notes: notes to keep and to forget.
        standing: standing orders to begin and to end.
        faults: text that looks like one of these, but is not; reason `malformed`.
        mentions: actions that are only mentioned, not ordered (rules S10, S24, S25, S27, H18, H19, E1 to E6).
        echoes: number of calls, messages and faults that only repeat what was shown.
        headed: whether it has a heading of orders or messages, which says that it is an answer, whatever follows.
    """

    calls: tuple[Call, ...] = ()
    messages: tuple[MessageTo, ...] = ()
    listens: tuple[ListenTo, ...] = ()
    notes: tuple[Note | Forget, ...] = ()
    standing: tuple[Standing | Revoke, ...] = ()
    faults: tuple[Rejection, ...] = ()
    mentions: tuple[Call, ...] = ()
    echoes: int = 0
    headed: bool = False

    @property
    def is_silent(self) -> bool:
        """Whether it says nothing that counts, and nothing that is wrong."""
        return not any((self.calls, self.messages, self.listens, self.notes, self.standing, self.faults))


Item: TypeAlias = Call | MessageTo | ListenTo | Note | Forget | Standing | Revoke | Rejection


@dataclass(slots=True)
class _Found:
    item: Item
    kind: ReplySection
    """The section that it belongs under."""
    section: ReplySection
    """The section that contains it."""
    block: int
    taken_back: bool
    echoed: bool

    @property
    def in_prose(self) -> bool:
        return self.section in (ReplySection.NONE, ReplySection.ANALYSIS)


@dataclass(slots=True)
class Gathering:
    """Everything found in a reply so far."""

    headed: set[ReplySection] = field(default_factory=set)
    """The sections that have a heading."""
    _found: list[_Found] = field(default_factory=list)
    _orders: dict[str | None, list[_Found]] = field(default_factory=dict)
    """The calls that were ordered and not withdrawn, by team."""
    _gave_orders: bool = False
    _titles: list[str] = field(default_factory=lambda: [""])
    """Headings of the blocks of the reply, by their numbers; the first one has none."""

    def __bool__(self) -> bool:
        return bool(self._found)

    def open_block(self, title: str) -> None:
        """Begin a section under this heading."""
        self._titles.append("".join(filter(str.isalnum, title)).casefold())

    def add(
        self, item: Item, kind: ReplySection, section: ReplySection, *, taken_back: bool = False, echoed: bool = False
    ) -> None:
        """Add an item.

        Args:
            item: what it is.
            kind: the section that it belongs under.
            section: the section that contains it.
            taken_back: whether words around it say that it is not meant.
            echoed: whether it only repeats what the agent was shown.
        """
        found = _Found(item, kind, section, len(self._titles) - 1, taken_back or echoed, echoed)
        self._found.append(found)
        if echoed:
            return
        if isinstance(item, Call | Standing | Rejection) and kind is ReplySection.ACTIONS:
            team = item.call.team if isinstance(item, Standing) else item.team
            self._orders.setdefault(team, []).append(found)
            self._gave_orders |= section is ReplySection.ACTIONS

    def has_orders(self) -> bool:
        """Return whether a section of actions gave any."""
        return self._gave_orders

    def withdraw_orders(self, team: str | None) -> None:
        """Withdraw all orders so far; of one team only, if it is named."""
        for name in list(self._orders) if team is None else [team]:
            for found in self._orders.pop(name, ()):
                found.taken_back = True

    def speech(self) -> Speech:
        """Return what counts of it."""
        repeated = self._repeats()
        said: list[Item] = []
        mentioned: list[Call] = []
        for found in self._found:
            unheeded = found.in_prose and found.kind in self.headed
            if not (found.taken_back or unheeded or (found.kind, found.block) in repeated):
                said.append(found.item)
            elif isinstance(found.item, Call):
                mentioned.append(found.item)
            elif isinstance(found.item, Standing):
                mentioned.append(found.item.call)
        return Speech(
            calls=tuple(item for item in said if isinstance(item, Call)),
            messages=tuple(_once(item for item in said if isinstance(item, MessageTo))),
            listens=tuple(item for item in said if isinstance(item, ListenTo)),
            notes=tuple(item for item in said if isinstance(item, Note | Forget)),
            standing=tuple(item for item in said if isinstance(item, Standing | Revoke)),
            faults=tuple(item for item in said if isinstance(item, Rejection)),
            mentions=tuple(mentioned),
            echoes=sum(found.echoed for found in self._found),
            headed=bool(self.headed - {ReplySection.ANALYSIS}),
        )

    def _repeats(self) -> set[tuple[ReplySection, int]]:
        """Return the blocks that repeat an earlier one under the same heading (rule S27)."""
        if len(set(self._titles)) == len(self._titles):
            return set()
        blocks: dict[tuple[ReplySection, int], list[tuple[object, ...]]] = {}
        for found in self._found:
            if not (found.taken_back or found.in_prose):
                blocks.setdefault((found.kind, found.block), []).append(_content(found.item))
        seen: set[tuple[object, ...]] = set()
        repeated = set()
        for (kind, block), words in blocks.items():
            page = (kind, self._titles[block], tuple(words))
            if page in seen:
                repeated.add((kind, block))
            seen.add(page)
        return repeated


def _once(messages: Iterable[MessageTo]) -> Iterator[MessageTo]:
    """Yield messages without those that repeat an earlier one (rule S36)."""
    seen = set()
    for message in messages:
        if _content(message) not in seen:
            seen.add(_content(message))
            yield message


def _content(item: Item) -> tuple[object, ...]:
    """Return the words of an item, without its place."""
    match item:
        case Call():
            return item.team, item.name, item.args
        case MessageTo():
            return item.recipient, item.text
        case ListenTo(what, _, _) | Note(what, _, _) | Forget(what, _, _) | Revoke(what, _, _):
            return (what,)
        case Standing():
            return item.call.team, item.call.name, item.call.args, item.until
        case Rejection():
            return item.team, item.text
