"""What a computer player remembers from one thought to the next: plain values, part of the world's digest.

``opponent`` has every rule about them. Units are remembered by their tag, times are game loops.
"""

from __future__ import annotations

from dataclasses import dataclass, field

Point = tuple[float, float]
NEVER = -1


@dataclass(slots=True)
class DropMemory:
    """A drop on its way: the phase it is in, since when, its transport and its passengers (tags), and where it goes."""

    phase: str = ""  # "" for none, then load, fly, fight
    since: int = 0
    transport: int = 0
    squad: list[int] = field(default_factory=list)
    target: Point = (0.0, 0.0)


@dataclass(slots=True)
class OpponentMemory:
    """One computer player's plan, and how far it is."""

    build: str  # name of the build that it plays
    patience: float  # factor on the later times of its plan, drawn at the start
    bases: tuple[Point, ...]  # where town halls can stand, the nearest to its own start first
    resources: tuple[Point, ...]  # where mineral fields and geysers were at the start
    enemy_start: Point
    actions: float = 0.0  # orders that it may give before it has to wait
    thought: int = 0  # when it thought last
    attacking: bool = False
    waves: int = 0  # attacks that are over
    wave_value: float = 0.0  # of the army at the start of the attack
    attack_from: int = 0  # no attack before
    searched: int = 0  # how many places the army has found empty
    searched_since: int = 0  # since when it goes to the next one
    alarm: int = NEVER  # since when enemies are seen at its bases
    threat: Point | None = None
    worst: float = 0.0  # worth of the enemies there at their most
    repelled: tuple[int, float] = (NEVER, 0.0)  # when the last threat was over, and its worth
    pulled: list[int] = field(default_factory=list)  # workers that defend
    scout: int = 0
    scouted: int = 0  # how many places the scout has seen
    next_scout: int = 0
    drop: DropMemory = field(default_factory=DropMemory)
    next_drop: int = 0
    seen: dict[int, tuple[int, int]] = field(default_factory=dict)  # enemy unit -> its type's row, and when
    taxed: list[float] = field(default_factory=lambda: [0.0, 0.0])  # income on which it has had its extra
