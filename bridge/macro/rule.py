"""What a rule is asked, and what it answers: orders, or why there are none.

Rules are pure functions of a snapshot, the ground and the ledger of the turn. Above them is `bridge.act.translate`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from bridge.action import Action
    from bridge.frames import WorldPoint
    from bridge.functions import Function
    from bridge.macro.ledger import Ledger
    from bridge.snapshot import Snapshot
    from protocol.messages import RejectionReason


@dataclass(frozen=True, slots=True)
class Ask:
    """An action, and what the words of the agent left to find out."""

    action: Action
    snapshot: Snapshot
    ledger: Ledger
    units: tuple[int, ...] = ()
    """Those of the team that are alive, or the unit that was named; () for a side team."""
    tag: int | None = None
    """The unit among the arguments that is the target or says where."""
    point: WorldPoint | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """A function for some units."""

    function: Function
    units: tuple[int, ...]
    target: int | WorldPoint | None = None
    """Tag of a unit, or a point of the world."""
    queued: bool = False


class Impossible(Exception):
    """There is nothing that the rule could answer; the message is a sentence for the model."""

    def __init__(self, reason: RejectionReason, message: str) -> None:
        self.reason, self.message = reason, message
        super().__init__(message)


Rule: TypeAlias = Callable[[Ask], list[Order]]
