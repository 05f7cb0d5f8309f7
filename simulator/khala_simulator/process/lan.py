"""Games over several processes on one machine: how the processes find each other, and their messages.

The process that created the game is the host. It listens on the port that all clients named when they joined, until all
guests are there; guests try until they find it. From then on each guest has a link to the host, and the host forwards
one guest's messages to the others. A broken link, for whatever reason, means that a member has left.

Above: `joining.py`, `play.py`. Below: `lockstep.py`, which knows what the messages mean.
"""

from __future__ import annotations

import asyncio
import contextlib
import struct
import sys
from typing import TYPE_CHECKING, cast

from khala_simulator.process.lockstep import Commit, LockstepError, decode

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.process.clock import RealtimeClock
    from khala_simulator.process.lockstep import Leave, Lockstep

HOST = "127.0.0.1"
CHUNK_LOOPS = 22
"""Loops at a time, about a second of the game: in between, the process handles signals, other clients and its peers."""

PARTING_S = 1.0
"""How long a client that leaves waits for its answer until the others have left, too."""

_HEAD = struct.Struct("<I")
_MAX_BYTES = 1 << 28  # of one message; the longest holds a map
_RETRY_S = 0.05


class NobodyCameError(Exception):
    """The other processes of the game did not show up."""


class JoinRefused(Exception):
    """A guest cannot be accepted; `answer` is the reason that it gets."""

    def __init__(self, answer: bytes) -> None:
        super().__init__(answer)
        self.answer = answer


class LanLink(asyncio.Protocol):
    """Messages to and from another process; None arrives when it is gone.

    Messages that come before a listener are kept.
    """

    def __init__(self) -> None:
        self._listener: Callable[[bytes | None], None] | None = None
        self._kept: list[bytes | None] = []
        self._buffer = bytearray()
        self._transport: asyncio.Transport | None = None

    def listen(self, listener: Callable[[bytes | None], None]) -> None:
        """Call `listener` with each message from now on, first with those that have already come."""
        self._listener = listener
        kept, self._kept = self._kept, []
        for message in kept:
            listener(message)

    async def hear(self) -> bytes | None:
        """Return the next message."""
        heard: asyncio.Future[bytes | None] = asyncio.get_running_loop().create_future()

        def listener(message: bytes | None) -> None:
            if heard.done():
                self._kept.append(message)
            else:
                heard.set_result(message)

        self.listen(listener)
        try:
            return await heard
        finally:
            self._listener = None

    def send(self, message: bytes) -> None:
        """Send a message, if the other process is still there."""
        if self._transport is not None:
            self._transport.write(_HEAD.pack(len(message)) + message)

    def close(self) -> None:
        """Hang up after the sent messages."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self._transport = cast("asyncio.Transport", transport)

    def data_received(self, data: bytes) -> None:
        """Pass on the complete messages."""
        self._buffer += data
        while len(self._buffer) >= _HEAD.size:
            (size,) = _HEAD.unpack_from(self._buffer)
            if size > _MAX_BYTES:
                self.close()  # not one of our processes
                return
            if len(self._buffer) < _HEAD.size + size:
                return
            message = bytes(self._buffer[_HEAD.size : _HEAD.size + size])
            del self._buffer[: _HEAD.size + size]
            self._tell(message)

    def connection_lost(self, _: Exception | None) -> None:
        """Tell the listener that the link is gone."""
        self._transport = None
        self._tell(None)

    def _tell(self, message: bytes | None) -> None:
        if self._listener is None:
            self._kept.append(message)
        else:
            self._listener(message)


async def knock(port: int, patience_s: float, join: bytes) -> tuple[LanLink, bytes]:
    """Return a link to the host of the game on this port, and its answer to the request to join.

    Raises:
        NobodyCameError: no host accepted a guest for so long.
    """
    loop = asyncio.get_running_loop()
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(patience_s):
            while True:
                with contextlib.suppress(OSError):  # no host yet, or one that went away again
                    _, link = await loop.create_connection(LanLink, HOST, port)
                    link.send(join)
                    try:
                        answer = await link.hear()
                    except asyncio.CancelledError:
                        link.close()
                        raise
                    if answer is not None:
                        return link, answer
                await asyncio.sleep(_RETRY_S)
    raise NobodyCameError(f"No game to join on port {port} of {HOST} for {patience_s:g} s")


class LanDoor:
    """Where the host accepts guests, until all are there.

    `admit` takes a guest's message and returns its member number, or raises `JoinRefused`; `release` takes the number
    of a guest that went away again.
    """

    def __init__(self, admit: Callable[[bytes], int], release: Callable[[int], None]) -> None:
        self.guests: dict[int, LanLink] = {}
        self._admit, self._release = admit, release
        self._strangers: set[LanLink] = set()  # guests without a request so far
        self._changed = asyncio.Event()

    async def wait(self, port: int, patience_s: float, full: Callable[[], bool]) -> None:
        """Wait until all guests are there.

        Raises:
            NobodyCameError: not all guests came.
            OSError: the port is taken.
        """
        server = await asyncio.get_running_loop().create_server(self._open, HOST, port)
        try:
            async with asyncio.timeout(patience_s):
                while not full():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            self.send_away()
            raise NobodyCameError(f"Not everybody joined on port {port} of {HOST} within {patience_s:g} s") from None
        except asyncio.CancelledError:
            self.send_away()
            raise
        finally:
            server.close()
            for link in self._strangers:
                link.close()

    def send_away(self) -> None:
        """Hang up on all guests."""
        for link in self.guests.values():
            link.close()
        self.guests.clear()

    def _open(self) -> LanLink:
        link = LanLink()
        link.listen(lambda message: self._hear(link, message))
        self._strangers.add(link)
        return link

    def _hear(self, link: LanLink, message: bytes | None) -> None:
        self._strangers.discard(link)
        number = next((number for number, guest in self.guests.items() if guest is link), None)
        if number is not None:  # gone, or not following the protocol
            del self.guests[number]
            self._release(number)
            link.close()
        elif message is not None:
            try:
                self.guests[self._admit(message)] = link
            except JoinRefused as refused:
                link.send(refused.answer)
                link.close()
        self._changed.set()


class Peers:
    """The other processes of a game that has begun."""

    def __init__(self, lockstep: Lockstep, links: dict[LanLink, frozenset[int]]) -> None:
        """Take part in a game; `links` maps each link to the members behind it."""
        self._lockstep, self._links = lockstep, links
        self._news = asyncio.Event()
        self._keeper: asyncio.Task[None] | None = None
        for link in tuple(links):
            link.listen(lambda message, link=link: self._hear(link, message))  # type: ignore[misc]  # of a lambda with a default mypy infers nothing

    async def step(self, count: int) -> None:
        """Advance the game by up to `count` loops from here, together with the others."""
        game = self._lockstep.game
        commit = self._lockstep.commit(game.world.loop + count)
        self._tell(commit)
        while game.world.loop < commit.through and not game.over:
            if not await self._advance():
                self._news.clear()
                await self._news.wait()

    def keep_time(self, clock: RealtimeClock) -> None:
        """Advance the game by the clock from now on, until it is over or left."""
        self._keeper = asyncio.create_task(self._keep_time(clock))

    async def _keep_time(self, clock: RealtimeClock) -> None:
        while not self._lockstep.game.over:
            due = clock.due
            self._tell(self._lockstep.commit(due))
            while await self._advance():
                pass
            await clock.sleep_until(due + 1)

    async def farewell(self) -> None:
        """Leave a game, and wait a little for the others to leave it, if this was the end of it.

        The first client that is answered may kill the games of all, as python-sc2 does; the others want to hear their
        result before. The game itself takes longer than this to go back to its menu.
        """
        if self._keeper is not None:
            self._keeper.cancel()
        self._tell(self._lockstep.resign())
        try:
            async with asyncio.timeout(PARTING_S if self._lockstep.is_decided else 0.0):
                while self._lockstep.members:
                    self._news.clear()
                    await self._news.wait()
        except TimeoutError:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """Break with the other processes."""
        if self._keeper is not None:
            self._keeper.cancel()
        links, self._links = tuple(self._links), {}
        for link in links:
            link.close()

    async def _advance(self) -> bool:
        """Advance the game a little, if the others allow it; return whether they do."""
        game = self._lockstep.game
        if self._lockstep.horizon <= game.world.loop or game.over:
            return False
        try:
            self._lockstep.advance(CHUNK_LOOPS)
        except LockstepError as error:
            self._part(error)
        await asyncio.sleep(0)
        return True

    def _hear(self, link: LanLink, data: bytes | None) -> None:
        if link not in self._links:
            return
        if data is None:
            self._lose(link)
            return
        try:
            message = decode(data, self._links[link])
            self._lockstep.receive(message)
        except LockstepError as error:
            self._part(error)
            return
        self._tell(message, but=link)
        self._news.set()

    def _lose(self, link: LanLink) -> None:
        for member in sorted(self._links.pop(link) & self._lockstep.members):
            self._tell(self._lockstep.leave(member))
        self._news.set()

    def _part(self, error: LockstepError) -> None:
        """End the game for every member: it is no longer one game."""
        words = str(error).encode("unicode_escape").decode()  # it may quote another process
        print(f"StarCraft II simulator: {words}; the game ends", file=sys.stderr)  # noqa: T201  # there is no other log
        for link in tuple(self._links):
            link.close()
            self._lose(link)

    def _tell(self, message: Commit | Leave, but: LanLink | None = None) -> None:
        data = message.encode()
        for link in self._links:
            if link is not but:
                link.send(data)
