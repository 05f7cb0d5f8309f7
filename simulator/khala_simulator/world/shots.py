"""Shots under way: missiles in flight, hits that are due later, and sweeps.

``systems.weapons`` adds to them, ``systems.hits``, ``missiles`` and ``sweeps`` remove from them. A reference to a unit
that died becomes -1; the shot keeps its last point.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

NOBODY: Final = -1
_SHOT: Final = "<6q4d"


class Shot:
    """One hit of one attack on its way.

    Attributes:
        source: Slot of the attacker, or NOBODY.
        owner: The attacker's owner.
        target: Slot of the target, or NOBODY.
        prior: Slot from which a bounce came, or NOBODY.
        weapon: Row in ``catalog.weapons``.
        hit: Index in the weapon's hits.
        start_x: Where the attacker stood.
        start_y: See ``start_x``.
        goal_x: Where the target is, or was when it died.
        goal_y: See ``goal_x``.
    """

    def __init__(
        self,
        source: int,
        owner: int,
        target: int,
        prior: int,
        weapon: int,
        hit: int,
        start: tuple[float, float],
        goal: tuple[float, float],
    ) -> None:
        self.source = int(source)
        self.owner = int(owner)
        self.target = int(target)
        self.prior = int(prior)
        self.weapon = int(weapon)
        self.hit = int(hit)
        self.start_x, self.start_y = map(float, start)
        self.goal_x, self.goal_y = map(float, goal)

    def __reduce__(self) -> tuple[type[Shot], tuple[Any, ...]]:
        """Return what makes a copy."""
        return Shot, self.fields()

    def __repr__(self) -> str:
        """Return its fields, which the digest of the world reads."""
        names = ("source", "owner", "target", "prior", "weapon", "hit", "start", "goal")
        return f"Shot({', '.join(f'{name}={value}' for name, value in zip(names, self.fields(), strict=True))})"

    def fields(self) -> tuple[Any, ...]:
        """Return the arguments that make it."""
        start, goal = (self.start_x, self.start_y), (self.goal_x, self.goal_y)
        return self.source, self.owner, self.target, self.prior, self.weapon, self.hit, start, goal

    def content(self) -> bytes:
        """Return it as bytes, for the digest of the world."""
        *numbers, start, goal = self.fields()
        return struct.pack(_SHOT, *numbers, *start, *goal)

    def at(self, target: int) -> Shot:
        """Return the shot at another target."""
        shot = Shot.__new__(Shot)
        shot.source = self.source
        shot.owner = self.owner
        shot.target = target
        shot.prior = self.prior
        shot.weapon = self.weapon
        shot.hit = self.hit
        shot.start_x = self.start_x
        shot.start_y = self.start_y
        shot.goal_x = self.goal_x
        shot.goal_y = self.goal_y
        return shot

    def forget(self, slot: int) -> None:
        """Drop references to the unit in ``slot``, which is gone."""
        if self.source == slot:
            self.source = NOBODY
        if self.target == slot:
            self.target = NOBODY
        if self.prior == slot:
            self.prior = NOBODY


class Missile:
    """A shot in flight.

    Attributes:
        shot: What it does where it arrives.
        x: Where it is.
        y: See ``x``.
        step: Its speed now, in world units per loop.
        top: Its highest speed.
        gain: By which its speed grows per loop.
    """

    def __init__(self, shot: Shot, x: float, y: float, step: float, top: float, gain: float) -> None:
        self.shot = shot
        self.x = x
        self.y = y
        self.step = step
        self.top = top
        self.gain = gain

    def __reduce__(self) -> tuple[type[Missile], tuple[Any, ...]]:
        """Return what makes a copy."""
        return Missile, (self.shot, self.x, self.y, self.step, self.top, self.gain)

    def content(self) -> bytes:
        """Return it as bytes, for the digest of the world."""
        return self.shot.content() + struct.pack("<5d", self.x, self.y, self.step, self.top, self.gain)


class PendingHit:
    """A hit that falls due at a later loop.

    Attributes:
        shot: What it does.
        due: That loop, with its fraction.
        single: Whether it hurts the target alone, as what a sweep has touched.
    """

    def __init__(self, shot: Shot, due: float, single: bool = False) -> None:
        self.shot = shot
        self.due = due
        self.single = single

    def __reduce__(self) -> tuple[type[PendingHit], tuple[Any, ...]]:
        """Return what makes a copy."""
        return PendingHit, (self.shot, self.due, bool(self.single))

    def content(self) -> bytes:
        """Return it as bytes, for the digest of the world."""
        return self.shot.content() + struct.pack("<d?", self.due, self.single)


class Sweep:
    """A sweep that is under way.

    Attributes:
        shot: Its shot.
        begun: The loop, with its fraction, at which it began.
        ahead: Index of the next point.
        touched: Slots of the units that it has touched.
    """

    def __init__(self, shot: Shot, begun: float, ahead: int, touched: list[int]) -> None:
        self.shot = shot
        self.begun = begun
        self.ahead = ahead
        self.touched = touched

    def __reduce__(self) -> tuple[type[Sweep], tuple[Any, ...]]:
        """Return what makes a copy."""
        return Sweep, (self.shot, self.begun, self.ahead, self.touched)

    def __repr__(self) -> str:
        """Return its fields, which the digest of the world reads."""
        return f"Sweep(shot={self.shot!r}, begun={self.begun}, ahead={self.ahead}, touched={self.touched})"

    def forget(self, slot: int) -> None:
        """Drop references to the unit in ``slot``, which is gone."""
        self.touched = [other for other in self.touched if other != slot]
        self.shot.forget(slot)


def content(shots: Iterable[Missile | PendingHit]) -> bytes:
    """Return missiles or hits as bytes, for the digest of the world."""
    return b"".join(shot.content() for shot in shots)
