"""Lock-step: one game that several processes simulate, each of them the whole of it.

Members are the players and observers that have a process of their own. They exchange what their clients do, and how far
each client allows the world to go; a world never goes further than the most hesitant member allows. The same setup and
the same log produce the same world, so they need to agree on nothing else. They compare digests of the worlds now and
then, because a world that has diverged is worse than one that has ended.

No I/O: `lan.py` carries the messages. Below: `game.py`.
"""

from __future__ import annotations

import dataclasses
import json
import struct
from typing import TYPE_CHECKING, Any

from google.protobuf.message import DecodeError
from s2clientprotocol import debug_pb2

from khala_simulator.api.game import LogEntry
from khala_simulator.process.replay import pack, unpack

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.api.game import HostedGame

CHECK_LOOPS = 448
"""Loops between two comparisons of the worlds: 20 s, as a digest takes as long as a loop."""


class LockstepError(Exception):
    """A message that no member of this game can have sent, or worlds that differ."""


@dataclasses.dataclass(frozen=True)
class Commit:
    """A member's client has done `entries`, and does nothing more that takes effect before loop `through`."""

    member: int
    through: int
    entries: tuple[LogEntry, ...] = ()
    digests: dict[int, str] = dataclasses.field(default_factory=dict)  # of its world, by loop

    def encode(self) -> bytes:
        """Return the bytes of the message."""
        head = {"member": self.member, "through": self.through, "digests": self.digests}
        return json.dumps(head).encode() + b"\n" + pack(self.entries)


@dataclasses.dataclass(frozen=True)
class Leave:
    """A member is gone: no other waits for it after `loop`, at which a player surrenders."""

    member: int
    loop: int

    def encode(self) -> bytes:
        """Return the bytes of the message."""
        return json.dumps({"member": self.member, "leaves": self.loop}).encode() + b"\n"


def decode(data: bytes, members: frozenset[int]) -> Commit | Leave:
    """Return the message in bytes, which must be about one of these members.

    Raises:
        LockstepError: there is none, or it is about another member.
    """
    head, _, log = data.partition(b"\n")
    try:
        fields: dict[str, Any] = json.loads(head)
        if (member := int(fields["member"])) not in members:
            raise LockstepError(f"another process sends as member {member}")
        if "leaves" in fields:
            return Leave(member, int(fields["leaves"]))
        digests = {int(loop): str(digest) for loop, digest in fields["digests"].items()}
        return Commit(member, int(fields["through"]), tuple(unpack(log)), digests)
    except (ValueError, LookupError, TypeError, AttributeError, struct.error, DecodeError) as error:
        raise LockstepError(f"not a message of a game over several processes: {error}") from error


class Lockstep:
    """One process's account of how far the world may go."""

    def __init__(self, game: HostedGame, me: int, members: Iterable[int]) -> None:
        self.game, self.me = game, me
        self._through = dict.fromkeys(members, 0)
        self._digests: dict[int, str] = {}  # of the own world, by loop
        self._untold: dict[int, str] = {}  # those not yet sent to the others
        self._unchecked: list[Commit] = []  # with digests of loops that the own world has not reached
        game.unsent = []
        game.delay = 1  # an action needs a loop to reach the others, as in the game

    @property
    def horizon(self) -> int:
        """The loop up to which the world may go."""
        return min(self._through.values())

    @property
    def members(self) -> frozenset[int]:
        """The members that are still there."""
        return frozenset(self._through)

    def commit(self, loop: int) -> Commit:
        """Allow the world to go up to a loop for the own client; return the message for all others."""
        through = self._through[self.me] = max(loop, self._through[self.me])
        message = Commit(self.me, through, tuple(self.game.unsent or ()), self._untold)
        self.game.unsent = []
        self._untold = {}
        self.game.not_before = through
        return message

    def receive(self, message: Commit | Leave) -> None:
        """Apply another member's message; ignore members that have left.

        Raises:
            LockstepError: it cannot have sent that, or its world differs.
        """
        if message.member not in self._through:
            return
        if isinstance(message, Leave):
            self._drop(message.member, message.loop)
            return
        before = self._through[message.member]
        foreign = any(entry.loop < before or entry.player != message.member for entry in message.entries)
        if foreign or message.through < before:
            raise LockstepError(f"member {message.member} says what it has said before, or what is not its to say")
        if message.digests:
            self._unchecked.append(message)
            self._check()
        for entry in message.entries:
            self.game.note(entry)
        self._through[message.member] = message.through

    def leave(self, member: int) -> Leave:
        """Stop waiting for a member that is gone; return the message for all others."""
        message = Leave(member, self.horizon)  # no world can be further than that
        self._drop(member, message.loop)
        return message

    def resign(self) -> Leave:
        """Take the own client out of the game; return the message for all others, whose worlds are not further yet."""
        message = Leave(self.me, self._through[self.me])
        self._drop(self.me, message.loop)
        return message

    @property
    def is_decided(self) -> bool:
        """Whether the game ends for the members that are still there: it is over, or one player is left."""
        players = [member for member in self._through if member <= len(self.game.setup.players)]
        return self.game.over or len(players) <= 1

    def advance(self, loops: int) -> None:
        """Advance the own world by up to so many loops, as far as it may go.

        Raises:
            LockstepError: another member's world differed.
        """
        world = self.game.world
        target = min(world.loop + loops, self.horizon)
        while world.loop < target and not self.game.over:
            check = (world.loop // CHECK_LOOPS + 1) * CHECK_LOOPS
            if self.game.step(min(check, target) - world.loop) == check:
                self._digests[check] = self._untold[check] = world.digest()
                self._check()

    def _drop(self, member: int, loop: int) -> None:
        if self._through.pop(member, None) is not None and member <= len(self.game.setup.players):
            self.game.note(LogEntry(loop, member, _surrender()))

    def _check(self) -> None:
        waiting, self._unchecked = self._unchecked, []
        for message in waiting:
            for loop, digest in message.digests.items():
                if self._digests.get(loop, digest) != digest:
                    raise LockstepError(f"at loop {loop} the world of member {message.member} is another one")
            if not message.digests.keys() <= self._digests.keys():
                self._unchecked.append(message)


def _surrender() -> debug_pb2.DebugCommand:
    return debug_pb2.DebugCommand(end_game=debug_pb2.DebugEndGame(end_result=debug_pb2.DebugEndGame.Surrender))
