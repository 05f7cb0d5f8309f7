"""Rejected calls: a reason, and a sentence that a model can act on.

The lowest module of `khala_bridge.act`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_protocol.messages import Rejection
from khala_protocol.speech import render

if TYPE_CHECKING:
    from khala_protocol.messages import Call, RejectionReason


class CallRejected(Exception):
    """Raised by the checks of a call, with the reason of its rejection."""

    def __init__(self, reason: RejectionReason, message: str) -> None:
        self.reason, self.message = reason, message
        super().__init__(message)


def reject(call: Call, refused: CallRejected, team: str | None = None) -> Rejection:
    """Return a rejection of a call, with its place in the reply."""
    return Rejection(
        reason=refused.reason, message=refused.message, text=render(call), start=call.start, team=team or call.team
    )
