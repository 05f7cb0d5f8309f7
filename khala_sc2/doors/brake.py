"""A brake on guesses: after some wrong tries a peer waits, each time for longer, and so do all peers together.

A machine without input or output. `khala_sc2.doors.rules` above asks it before it compares a password.
"""

from __future__ import annotations

import ipaddress
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

FREE: Final = 5
"""Wrong tries of one peer that cost it nothing: people mistype."""
FREE_TOGETHER: Final = 50
"""Wrong tries of all peers that cost nobody anything."""
MOST_WAIT_S: Final = 300.0
MOST_WAIT_TOGETHER_S: Final = 10.0
"""Short, since it holds up an honest peer that has not been right yet; it leaves 360 guesses an hour."""
FORGET_S: Final = 900.0
"""Wrong tries count for this long after the last of them."""
MOST_PEERS: Final = 4096
"""Peers that are remembered; beyond it the oldest is forgotten, and the brake on all together still holds."""
_NETWORK_BITS: Final = 64
"""Of an IPv6 address: everything below belongs to one user."""


@dataclass(slots=True)
class _Tries:
    """The wrong tries of a peer, or of all."""

    wrong: int = 0
    last_s: float = 0.0

    def wait_s(self, now_s: float, free: int, most_s: float) -> float:
        """Return the seconds until the next try counts."""
        since_s = now_s - self.last_s
        if self.wrong < free or since_s > FORGET_S:
            return 0.0
        doublings = min(self.wrong - free, 16)
        return max(0.0, min(2.0**doublings, most_s) - since_s)

    def add(self, now_s: float) -> None:
        """Count a wrong try."""
        self.wrong = 1 if now_s - self.last_s > FORGET_S else self.wrong + 1
        self.last_s = now_s


@dataclass(slots=True)
class Brake:
    """The wrong tries at one server.

    Attributes:
        clock: monotonic seconds.
    """

    clock: Callable[[], float] = time.monotonic
    _peers: OrderedDict[str, _Tries] = field(default_factory=OrderedDict)
    _right: OrderedDict[str, None] = field(default_factory=OrderedDict)
    """Peers that were right once: what others guess does not hold them up."""
    _together: _Tries = field(default_factory=_Tries)

    def wait_s(self, peer: str) -> float:
        """Return the seconds for which tries of a peer are not looked at."""
        now_s = self.clock()
        name = _network(peer)
        known = self._peers.get(name)
        own_s = known.wait_s(now_s, FREE, MOST_WAIT_S) if known else 0.0
        if name in self._right:
            return own_s
        return max(own_s, self._together.wait_s(now_s, FREE_TOGETHER, MOST_WAIT_TOGETHER_S))

    def note_wrong(self, peer: str) -> None:
        """Count a wrong try of a peer."""
        name = _network(peer)
        tries = self._peers.setdefault(name, _Tries())
        tries.add(self.clock())
        self._together.add(self.clock())
        _keep_newest(self._peers, name)

    def note_right(self, peer: str) -> None:
        """Forget the wrong tries of a peer that knows the password after all."""
        name = _network(peer)
        self._peers.pop(name, None)
        self._right[name] = None
        _keep_newest(self._right, name)


def _keep_newest(peers: OrderedDict[str, _Tries] | OrderedDict[str, None], name: str) -> None:
    peers.move_to_end(name)
    while len(peers) > MOST_PEERS:
        peers.popitem(last=False)


def _network(peer: str) -> str:
    """Return what one user has of addresses: an IPv4 address, or the network of an IPv6 one."""
    try:
        address = ipaddress.ip_address(peer.partition("%")[0])
    except ValueError:
        return peer
    if isinstance(address, ipaddress.IPv4Address):
        return peer
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((address, _NETWORK_BITS), strict=False))
