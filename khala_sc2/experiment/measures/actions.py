"""What became of decisions, and of the calls in them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

from khala_protocol.messages import Fate, RejectionReason, count_refusals

if TYPE_CHECKING:
    from khala_sc2.experiment.measures.evidence import SideStep


@dataclass(frozen=True, kw_only=True)
class Actions:
    """Decisions and actions."""

    decisions: int
    """How often agents were asked and the answer, or its absence, was reported."""
    unasked: int
    """How often an agent could have been asked and was not, because it had no units or was not due."""
    fresh: int
    """Decisions carried out at the game loop that the agent had seen."""
    stale: int
    """Decisions carried out later, as they were meant."""
    adapted: int
    """Decisions carried out later, as far as the game still allowed it."""
    refused: int
    """Decisions that held orders of which none was carried out."""
    dropped: int
    """Decisions that the end of the episode overtook."""
    accepted: int
    """Actions that were carried out; one for several teams counts once for each."""
    rejected: int
    """Calls that were not carried out, for any reason; calls that one rejection stands for count once."""
    rejected_malformed: int
    """Of these: looks like a call, but is not one."""
    rejected_unknown_action: int
    """Of these: the agent's catalogue has no action of this name."""
    rejected_wrong_arguments: int
    """Of these: wrong number or form of the arguments."""
    rejected_unknown_team: int
    """Of these: a team that the agent does not have, or that has no units left."""
    rejected_unknown_target: int
    """Of these: a tag that names no unit in sight."""
    rejected_dead_target: int
    """Of these: a tag of a unit that has died."""
    rejected_not_yours: int
    """Of these: a tag of a unit that does not obey this team."""
    rejected_invalid_target: int
    """Of these: a unit or a point that the action cannot be used on."""
    rejected_wrong_frame: int
    """Of these: a point that only makes sense in the other frame."""
    rejected_out_of_bounds: int
    """Of these: a point outside of its frame or of the map."""
    rejected_not_available: int
    """Of these: known, but not possible now, for cost, cooldown or a requirement."""
    rejected_too_many_actions: int
    """Of these: over the number of actions that a team may have in one reply."""
    rejected_unknown_recipient: int
    """Of these: a message to nobody."""
    rejected_unread: int
    """Of these: replies of which nothing, or not the end, could be read; no call was refused."""
    rejected_too_late: int
    """Of these: the reply took effect too long after its observation."""
    rejected_too_many_messages: int
    """Of these: over the number of messages that an agent may send in one reply."""
    rejected_refused_by_game: int
    """Of these: PySC2 or the game answered with an error."""


class ActionTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._decisions = self._unasked = self._accepted = 0
        self._fates: Counter[Fate | None] = Counter()
        self._reasons: Counter[RejectionReason] = Counter()

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        self._unasked += len(step.report.unasked)
        for agent in step.report.agents:
            self._decisions += 1
            self._accepted += len(agent.accepted)
            self._fates[agent.fate] += 1
            self._reasons.update(count_refusals(agent.rejections))

    def total(self) -> Actions:
        """Return the group."""
        return Actions(
            decisions=self._decisions,
            unasked=self._unasked,
            accepted=self._accepted,
            rejected=self._reasons.total(),
            **{fate: self._fates[fate] for fate in get_args(Fate)},
            **{f"rejected_{reason}": self._reasons[reason] for reason in get_args(RejectionReason)},
        )
