"""The bus in one process, for tests and for matches without a network.

A `MemoryBroker` is what a router is to Zenoh; each of its `session()`s is its own `khala_protocol.bus.Bus`, as a
process would have one. A `put` delivers before it returns, session by session as they were opened, so that a test is
the same each time it runs. To the others, `kill`, `cut` and `mend` look like a SIGKILL, a pulled cable and a cable put
back.

    broker = MemoryBroker()
    host, agent = broker.session(), broker.session()
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_protocol.bus import Delivery, Liveness, Sample
from khala_protocol.bus.inbox import Inbox
from khala_protocol.bus.keyexpr import check_key, check_key_expr, matches
from khala_protocol.errors import BusClosed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_protocol.bus import Publisher, Subscription, Token


class MemoryBroker:
    """A broker that joins the sessions that it opens. It is made, used and discarded on one loop."""

    def __init__(self) -> None:
        self._hub = _Hub()

    def session(self) -> MemoryBus:
        """Open a session."""
        return MemoryBus(self._hub)


class MemoryBus:
    """A session of a `MemoryBroker`; keeps the promises of `khala_protocol.bus`."""

    def __init__(self, hub: _Hub) -> None:
        self._hub = hub
        self._node = _Node()
        hub.nodes.append(self._node)

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """See `khala_protocol.bus.Bus.publisher`."""
        self._check_open()
        publisher = _Publisher(check_key(key), delivery, self._node, self._hub)
        self._node.publishers.append(publisher)
        return publisher

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """See `khala_protocol.bus.Bus.subscribe`."""
        self._check_open()
        mailbox: Inbox[Sample] = Inbox(depth, on_close=lambda: self._node.subscribers.remove(subscriber))
        subscriber = _Subscriber(check_key_expr(key_expr), delivery, mailbox)
        self._node.subscribers.append(subscriber)
        self._hub.catch_up(self._node, subscriber)
        return mailbox

    async def announce(self, key: str) -> Token:
        """See `khala_protocol.bus.Bus.announce`."""
        self._check_open()
        token = _Token(check_key(key), self._node, self._hub)
        self._node.tokens.append(token)
        self._hub.report_tokens()
        return token

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """See `khala_protocol.bus.Bus.watch`."""
        self._check_open()
        mailbox: Inbox[Liveness] = Inbox(depth, on_close=lambda: self._node.watchers.remove(watcher))
        watcher = _Watcher(check_key_expr(key_expr), mailbox)
        self._node.watchers.append(watcher)
        self._hub.report_tokens()
        return mailbox

    async def close(self) -> None:
        """See `khala_protocol.bus.Bus.close`."""
        self.kill()

    def kill(self) -> None:
        """Act like a SIGKILL of this session's process: tokens gone, caches gone, silence."""
        if not self._node.closed:
            self._node.shut()
            self._hub.nodes.remove(self._node)
            self._hub.report_tokens()

    def cut(self) -> None:
        """Take this session's link down: neither side hears the other until `mend`."""
        self._node.linked = False
        self._hub.report_tokens()

    def mend(self) -> None:
        """Bring the link back: tokens reappear, and STATE subscriptions get the newest samples that they missed."""
        self._node.linked = True
        self._hub.report_tokens()
        for node in self._hub.nodes:
            for subscriber in node.subscribers:
                self._hub.catch_up(node, subscriber)

    def _check_open(self) -> None:
        if self._node.closed:
            raise BusClosed("the bus is closed")


@dataclass(eq=False)
class _Node:
    """The declarations of one session, and whether others hear it."""

    linked: bool = True
    closed: bool = False
    publishers: list[_Publisher] = field(default_factory=list)
    subscribers: list[_Subscriber] = field(default_factory=list)
    watchers: list[_Watcher] = field(default_factory=list)
    tokens: list[_Token] = field(default_factory=list)

    def shut(self) -> None:
        self.closed = True
        for subscriber in self.subscribers:
            subscriber.mailbox.shut()
        for watcher in self.watchers:
            watcher.mailbox.shut()
        self.publishers, self.subscribers, self.watchers, self.tokens = [], [], [], []


class _Hub:
    """All nodes, and the samples between them."""

    def __init__(self) -> None:
        self.nodes: list[_Node] = []

    def heard_by(self, node: _Node) -> Iterator[_Node]:
        """Return the nodes that reach `node`, itself included, in the order in which they were opened."""
        return (other for other in self.nodes if other is node or (other.linked and node.linked))

    def carry(self, publisher: _Publisher, payload: bytes) -> None:
        for node in self.heard_by(publisher.node):
            for subscriber in node.subscribers:
                subscriber.take(publisher, payload)

    def catch_up(self, node: _Node, subscriber: _Subscriber) -> None:
        for other in self.heard_by(node):
            for publisher in other.publishers:
                if publisher.newest is not None and Delivery.STATE is subscriber.delivery:
                    subscriber.take(publisher, publisher.newest)

    def report_tokens(self) -> None:
        for node in self.nodes:
            keys = dict.fromkeys(token.key for other in self.heard_by(node) for token in other.tokens)
            for watcher in node.watchers:
                watcher.see(keys, link_up=node.linked)


@dataclass(eq=False)
class _Subscriber:
    key_expr: str
    delivery: Delivery
    mailbox: Inbox[Sample]
    taken: dict[_Publisher, int] = field(default_factory=dict)
    """How many samples of each STATE publisher had been put when the last one arrived here."""

    def take(self, publisher: _Publisher, payload: bytes) -> None:
        if not matches(self.key_expr, publisher.key):
            return
        if publisher.newest is not None:
            last = self.taken.get(publisher)
            if last == publisher.count:
                return
            self.mailbox.missed += 0 if last is None else publisher.count - last - 1
            self.taken[publisher] = publisher.count
        self.mailbox.offer(Sample(publisher.key, payload))


@dataclass(eq=False)
class _Watcher:
    key_expr: str
    mailbox: Inbox[Liveness]
    alive: set[str] = field(default_factory=set)

    def see(self, keys: dict[str, None], *, link_up: bool) -> None:
        """Report what changed since the last look: first lost tokens by name, then new ones by age."""
        for key in sorted(self.alive - keys.keys()):
            self.alive.remove(key)
            self.mailbox.offer(Liveness(key, alive=False, link_up=link_up))
        for key in keys:
            if key not in self.alive and matches(self.key_expr, key):
                self.alive.add(key)
                self.mailbox.offer(Liveness(key, alive=True))


@dataclass(eq=False)
class _Publisher:
    key: str
    delivery: Delivery
    node: _Node
    hub: _Hub
    newest: bytes | None = None
    """The cache of a STATE publisher; None before the first put and for other deliveries."""
    count: int = 0
    closed: bool = False

    async def put(self, payload: bytes) -> None:
        if self.closed or self.node.closed:
            raise BusClosed(f"the publisher of {self.key!r} is closed")
        if self.delivery is Delivery.STATE:
            self.newest = payload
            self.count += 1
        self.hub.carry(self, payload)

    async def close(self) -> None:
        if not self.closed and not self.node.closed:
            self.node.publishers.remove(self)
        self.closed = True


@dataclass(eq=False)
class _Token:
    key: str
    node: _Node
    hub: _Hub
    closed: bool = False

    async def close(self) -> None:
        if not self.closed and not self.node.closed:
            self.node.tokens.remove(self)
            self.hub.report_tokens()
        self.closed = True
