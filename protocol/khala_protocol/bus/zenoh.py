"""The bus over Zenoh, and the only module that imports it.

The promises of a bus are in `khala_protocol.bus`, its settings in `khala_protocol.bus.config`.

Every callback of Zenoh runs on one of its own threads and only fills a mailbox: a callback that waits stops
everything that its session receives, and one that publishes deadlocks. Callbacks are direct, as each indirect one has a
thread that keeps the process from ending. A session does not survive a fork: start other processes with spawn or exec.
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import json
import logging
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
from zenoh import CongestionControl, Priority, SampleKind
from zenoh.ext import (
    AdvancedPublisher,
    CacheConfig,
    HistoryConfig,
    MissDetectionConfig,
    RecoveryConfig,
    RepliesConfig,
    declare_advanced_publisher,
    declare_advanced_subscriber,
)
from zenoh.handlers import Callback

from khala_protocol.bus import Delivery, Liveness, Sample
from khala_protocol.bus.audience import Audience
from khala_protocol.bus.config import WAIT_BEFORE_CLOSE_S, BusConfig, check, settings
from khala_protocol.bus.diagnosis import plain, why_not_connected, why_not_listening
from khala_protocol.bus.inbox import Doorbell, Inbox
from khala_protocol.bus.keyexpr import check_key, check_key_expr
from khala_protocol.bus.lane import DropGate, Lane, Shut, Window
from khala_protocol.bus.sightings import PATIENCE_S, Sightings
from khala_protocol.bus.threads import run_detached
from khala_protocol.errors import BusClosed, BusError, NoRouter

if TYPE_CHECKING:
    from collections.abc import Callable

    from zenoh.ext import Miss

    from khala_protocol.bus import Publisher, Subscription, Token

log = logging.getLogger(__name__)

CLOSE_TIMEOUT_S = 1.8
ANSWER_TIMEOUT_S = 1.0
STATE_CACHE = 1
"""Only the newest of a state is worth anything: a larger cache would deliver old ones to a late joiner."""
HEARTBEAT_S = 0.3
"""A dropped last sample is noticed after this time. With a sporadic heartbeat, which comes once after each change, the
newest sample was lost for good when its heartbeat was dropped too."""

_SPEECH: dict[str, Any] = {"congestion_control": CongestionControl.BLOCK, "priority": Priority.INTERACTIVE_HIGH}
"""Not express, which brought no earlier arrival: each express sample takes a whole slot of the queue."""
_LOG: dict[str, Any] = {"congestion_control": CongestionControl.DROP, "priority": Priority.DATA_LOW}


async def open_bus(config: BusConfig) -> ZenohBus:
    """Open a session.

    Raises:
        BusError: the configuration is wrong, there is no router, or it cannot listen; the text says what to do.
    """
    check(config)
    zenoh_config = zenoh.Config()
    for path, value in settings(config).items():
        try:
            zenoh_config.insert_json5(path, json.dumps(value))
        except zenoh.ZError as error:
            raise BusError(f"Zenoh does not accept the setting {path!r}: {plain(str(error))}") from None
    try:
        session = await run_detached(lambda: zenoh.open(zenoh_config))
    except zenoh.ZError as error:
        said = str(error)
        if "Unable to connect" in said:
            found = await why_not_connected(config)
            advice = "start one there with `khala router`, or connect elsewhere"
            raise NoRouter(f"{found}: {advice}", found=found) from None
        raise BusError(why_not_listening(config, said) if config.listen_on else plain(said)) from None
    return ZenohBus(session, config)


async def probe(config: BusConfig) -> tuple[str, ...]:
    """Return the identities of the routers that a client of `config` gets connected to; at least one.

    Raises:
        BusError: as `open_bus` does.
    """
    bus = await open_bus(config.model_copy(update={"mode": "client", "listen": ()}))
    try:
        return bus.routers
    finally:
        await bus.close()


_unclosed: set[ZenohBus] = set()


@atexit.register
def _close_what_was_forgotten() -> None:
    """Close sessions that are still open: a callback that meets an exiting interpreter aborts the process."""
    for bus in tuple(_unclosed):
        with contextlib.suppress(zenoh.ZError):
            bus._session.close()  # type: ignore[no-untyped-call]  # noqa: SLF001  # as in `_shut`; the module's own class


class ZenohBus:
    """A session of Zenoh; keeps the promises of `khala_protocol.bus`. Made by `open_bus`."""

    def __init__(self, session: zenoh.Session, config: BusConfig) -> None:
        self._session = session
        self._config = config
        self._loop = asyncio.get_running_loop()
        self._is_client = config.mode == "client"
        self._held = _Held()
        self._question = ""
        self._threads = [ThreadPoolExecutor(1, f"khala-{name}") for name in ("speech", "bulk")]
        self._speech = Lane(self._threads[0], Window(self._ask) if self._is_client else Shut())
        self._stopwatch = DropGate()
        self._doorbell = Doorbell()
        self._mailboxes: set[Inbox[Any]] = set()
        self._sightings: set[Sightings] = set()
        self._links = {str(transport.zid) for transport in session.info.transports()}
        events = Callback(partial(self._hand_over, self._on_transport), indirect=False)
        self._held.add(session.info.declare_transport_events_listener(events, history=True))
        _unclosed.add(self)

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Where this session listens, with its actual ports; or where it connects to, if it does not listen."""
        if not self._config.listen_on:
            return self._config.connect_to
        if not any(endpoint.endswith(":0") for endpoint in self._config.listen_on):
            return self._config.listen_on
        for reply in self._session.get(f"@/{self._session.zid()}/router", timeout=ANSWER_TIMEOUT_S):
            if reply.ok is not None:
                return tuple(json.loads(reply.ok.payload.to_bytes())["locators"])
        raise BusError("the session did not tell where it listens")

    @property
    def identity(self) -> str:
        """How this session appears among the `routers` of others."""
        return str(self._session.zid())

    @property
    def routers(self) -> tuple[str, ...]:
        """Identities of the routers that this session is connected to."""
        return tuple(str(zid) for zid in self._session.info.routers_zid())

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """See `khala_protocol.bus.Bus.publisher`."""
        self._check_open()
        check_key(key)
        self._question = self._question or key
        if delivery is Delivery.STATE:
            state = _declare_state_publisher(self._session, key)
            self._held.add(state)
            return _Publisher(key, self._held, self._bulk_lane(), state.put, (state,))
        qos, lane = (_SPEECH, self._speech) if delivery is Delivery.SPEECH else (_LOG, self._bulk_lane())
        publisher = self._session.declare_publisher(key, **qos)
        audience = Audience(
            partial(self._settle, self._session.get, key, WAIT_BEFORE_CLOSE_S), once=delivery is Delivery.LOG
        )
        listener = Callback(partial(self._hand_over, partial(_see_audience, audience)), indirect=False)
        declared = (publisher, publisher.declare_matching_listener(listener))
        self._held.add(*declared)
        _see_audience(audience, publisher.matching_status)  # type: ignore[arg-type]  # no bool, as its stub has it
        return _Publisher(key, self._held, lane, publisher.put, declared, audience)

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """See `khala_protocol.bus.Bus.subscribe`."""
        self._check_open()
        check_key_expr(key_expr)
        mailbox: Inbox[Sample] = Inbox(
            depth, on_close=lambda: self._forget(mailbox, *declared), doorbell=self._doorbell
        )
        take = Callback(partial(_take, mailbox), indirect=False)
        if delivery is Delivery.STATE:
            declared = _declare_state_subscriber(self._session, key_expr, take, mailbox)
        else:
            declared = (self._session.declare_subscriber(key_expr, take),)
        self._mailboxes.add(mailbox)
        self._held.add(*declared)
        await self._settle_or_close(self._session.get, key_expr, mailbox)
        return mailbox

    async def announce(self, key: str) -> Token:
        """See `khala_protocol.bus.Bus.announce`."""
        self._check_open()
        token = self._session.liveliness().declare_token(check_key(key))
        self._held.add(token)
        return _Token(self._held, token)

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """See `khala_protocol.bus.Bus.watch`."""
        self._check_open()
        check_key_expr(key_expr)
        mailbox: Inbox[Liveness] = Inbox(depth, on_close=lambda: self._stop_watching(mailbox, sightings, watcher))
        # Only a client has one link, which is its own; a router that loses one has lost the other side.
        patience_s = PATIENCE_S if self._is_client else 0.0
        sightings = Sightings(mailbox, patience_s=patience_s, link_up=bool(self._links) or not self._is_client)
        see = Callback(partial(self._hand_over, partial(_see, sightings)), indirect=False)
        watcher = self._session.liveliness().declare_subscriber(key_expr, see, history=True)
        self._mailboxes.add(mailbox)
        self._sightings.add(sightings)
        self._held.add(watcher)
        # A token that ends while its session tells of it was often reported after its end, and for good.
        await self._settle_or_close(self._session.liveliness().get, key_expr, mailbox)
        return mailbox

    async def close(self) -> None:
        """See `khala_protocol.bus.Bus.close`."""
        if self._held.closed:
            return
        self._held.closed = True
        _unclosed.discard(self)
        for mailbox in self._mailboxes:
            mailbox.shut()
        try:
            async with asyncio.timeout(CLOSE_TIMEOUT_S):
                await run_detached(self._shut)
        except TimeoutError:
            log.warning("the bus did not close within %g s and was left behind", CLOSE_TIMEOUT_S)
        except zenoh.ZError as error:
            log.warning("closing the bus: %s", plain(str(error)))

    def _bulk_lane(self) -> Lane:
        # One link is slow for all publishers of a client; of a router's links, each has its own.
        return Lane(self._threads[1], self._stopwatch if self._is_client else DropGate())

    def _shut(self) -> None:
        for thread in self._threads:
            thread.shutdown()
        if self._is_client and self._question:
            self._settle_puts()
        self._session.close()  # type: ignore[no-untyped-call]  # Zenoh's stub lacks the `-> None`

    def _settle_puts(self) -> None:
        """Return when all puts have arrived at the router: closing a session drops what its link has not taken yet."""
        last = self._session.get(
            self._question,
            priority=_LOG["priority"],
            congestion_control=CongestionControl.BLOCK,
            timeout=ANSWER_TIMEOUT_S,
        )
        for _ in last:  # nobody answers; it ends when the question was everywhere
            pass

    def _check_open(self) -> None:
        if self._held.closed:
            raise BusClosed("the bus is closed")

    def _forget(self, mailbox: Inbox[Any], *declared: Any) -> None:
        self._mailboxes.discard(mailbox)
        self._held.take_back(*declared)

    def _stop_watching(self, mailbox: Inbox[Liveness], sightings: Sightings, watcher: Any) -> None:
        self._sightings.discard(sightings)
        self._forget(mailbox, watcher)

    async def _settle_or_close(self, get: Callable[..., Any], key_expr: str, mailbox: Inbox[Any]) -> None:
        """Settle what fills a mailbox, or close it."""
        try:
            await self._settle(get, key_expr)
            self._check_open()
        except BaseException:  # also if cancelled: nothing else could close it
            await mailbox.close()
            raise

    async def _settle(self, get: Callable[..., Any], key_expr: str, timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Wait until the router knows what was declared here, and we what it had to tell.

        A question without a listener follows the one, and its end the other.
        """
        back = self._loop.create_future()
        done = partial(self._hand_over, _resolve, back)
        get(key_expr, Callback(_ignore, done, indirect=False), timeout=timeout_s)
        await back

    def _ask(self, answer: Callable[[bool], None]) -> None:
        """Send a question behind the SPEECH puts, for `Window`."""
        errors: list[zenoh.Reply] = []  # a timeout comes as an error
        self._session.get(
            self._question,
            Callback(errors.append, lambda: answer(not errors), indirect=False),
            priority=Priority.INTERACTIVE_HIGH,
            congestion_control=CongestionControl.DROP,
            timeout=ANSWER_TIMEOUT_S,
        )

    def _hand_over(self, action: Callable[..., None], *args: Any) -> None:
        """Pass a rare event from a thread of Zenoh to the loop; samples go through mailboxes."""
        try:
            self._loop.call_soon_threadsafe(action, *args)
        except RuntimeError:
            log.debug("the loop is closed; %s is not called", action)

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        other = str(event.transport.zid)
        if event.kind == SampleKind.PUT:
            self._links.add(other)
        else:
            self._links.discard(other)
        if not self._is_client or self._held.closed:
            return
        log.info("the link to router %s is %s", other, "up" if self._links else "down; trying to get it back")
        for sightings in self._sightings:
            sightings.link(up=bool(self._links))


class _Held:
    """The declarations of a session: Zenoh withdraws those that nothing refers to."""

    def __init__(self) -> None:
        self.closed = False
        self._declared: set[Any] = set()

    def add(self, *declared: Any) -> None:
        self._declared.update(declared)

    def take_back(self, *declared: Any) -> None:
        """Withdraw declarations; an advanced publisher goes when the caller drops the last reference to it.

        Its `undeclare` keeps the GIL while it waits for its heartbeat, which runs on a thread of Zenoh that may wait
        for the GIL itself, in a callback: both wait for 10 s. When it is dropped, it lets go of the GIL first.
        """
        self._declared.difference_update(declared)
        if not self.closed:
            for handle in reversed(declared):  # a listener goes before what it listens to
                if not isinstance(handle, AdvancedPublisher):
                    handle.undeclare()


class _Publisher:
    def __init__(
        self,
        key: str,
        held: _Held,
        lane: Lane,
        put: Callable[[bytes], None],
        declared: tuple[Any, ...],
        audience: Audience | None = None,
    ) -> None:
        self._key = key
        self._held = held
        self._lane = lane
        self._put = put
        self._declared = declared
        self._audience = audience
        self._closed = False

    @property
    def key(self) -> str:
        return self._key

    async def put(self, payload: bytes) -> None:
        self._check_open()
        try:
            if self._audience is not None:
                await self._audience.wait()
                self._check_open()
            await self._lane.put(self._put, payload)
        except zenoh.ZError as error:
            if self._held.closed:
                raise BusClosed("the bus was closed while something was put") from None
            raise BusError(f"cannot put under {self._key!r}: {plain(str(error))}") from None

    async def close(self) -> None:
        if not self._closed:
            self._closed = True
            await self._lane.settle()  # Zenoh refuses to undeclare what a put on a thread still uses
            declared, self._declared = self._declared, ()
            del self._put
            self._held.take_back(*declared)

    def _check_open(self) -> None:
        if self._closed or self._held.closed:
            raise BusClosed(f"the publisher of {self._key!r} is closed")


class _Token:
    def __init__(self, held: _Held, token: zenoh.LivelinessToken) -> None:
        self._held = held
        self._token: zenoh.LivelinessToken | None = token

    async def close(self) -> None:
        token, self._token = self._token, None
        if token is not None:
            self._held.take_back(token)


def _declare_state_publisher(session: zenoh.Session, key: str) -> AdvancedPublisher:
    # With BLOCK, one stopped agent froze all others for seconds; DROP with a cache and a heartbeat kept their
    # worst gap at 0.1 s, and the stopped one had the newest sample 0.08 s after it went on.
    replies = RepliesConfig(congestion_control=CongestionControl.DROP, priority=Priority.DATA_HIGH)
    return declare_advanced_publisher(
        session,
        key,
        congestion_control=CongestionControl.DROP,
        priority=Priority.DATA_HIGH,
        cache=CacheConfig(max_samples=STATE_CACHE, replies_config=replies),
        sample_miss_detection=MissDetectionConfig(heartbeat=HEARTBEAT_S, sporadic_heartbeat=None),
        publisher_detection=True,
    )


def _declare_state_subscriber(
    session: zenoh.Session, key_expr: str, take: Callback[zenoh.Sample], mailbox: Inbox[Sample]
) -> tuple[Any, ...]:
    subscriber = declare_advanced_subscriber(
        session,
        key_expr,
        take,
        history=HistoryConfig(detect_late_publishers=True, max_samples=1),
        recovery=RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
    listener = subscriber.sample_miss_listener(Callback(partial(_count, mailbox), indirect=False))
    return subscriber, listener


# --- callbacks, on threads of Zenoh -----------------------------------------------------------------


def _take(mailbox: Inbox[Sample], sample: zenoh.Sample) -> None:
    if sample.kind == SampleKind.PUT:
        mailbox.offer_from_thread(Sample(str(sample.key_expr), sample.payload.to_bytes()))


def _count(mailbox: Inbox[Sample], miss: Miss) -> None:
    mailbox.miss(miss.nb)


def _ignore(reply: zenoh.Reply) -> None:
    """Ignore a reply: for questions whose end is the answer."""


# --- on the loop ------------------------------------------------------------------------------------


def _see_audience(audience: Audience, status: zenoh.MatchingStatus) -> None:
    audience.see(present=status.matching)


def _see(sightings: Sightings, sample: zenoh.Sample) -> None:
    sightings.token(str(sample.key_expr), alive=sample.kind == SampleKind.PUT)


def _resolve(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)
