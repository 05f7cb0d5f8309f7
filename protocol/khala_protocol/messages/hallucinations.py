"""Which refused calls are hallucinations, by the three kinds of the paper.

LLM-PySC2 (arXiv 2411.05348) names three kinds: input-conflicting, an action that is not valid; fact-conflicting, an
ally taken for an enemy; context-conflicting, a point of the screen used as one of the minimap, or the reverse.
`HALLUCINATION_KINDS` is the whole mapping. It judges a call by the reason of its refusal alone.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_protocol.messages.reasons import RejectionReason

HallucinationKind = Literal["input_conflicting", "fact_conflicting", "context_conflicting"]


class Judgement(NamedTuple):
    """The kind of a rejection, None if it is no hallucination, and why."""

    kind: HallucinationKind | None
    because: str


HALLUCINATION_KINDS: Mapping[RejectionReason, Judgement] = {
    "malformed": Judgement("input_conflicting", "not an action: the prompt says how a call is written"),
    "unknown_action": Judgement("input_conflicting", "not an action: the prompt lists them"),
    "wrong_arguments": Judgement("input_conflicting", "not valid: the prompt says what each action takes"),
    "unknown_team": Judgement("input_conflicting", "not valid: the observation has a heading for each team with units"),
    "unknown_target": Judgement("input_conflicting", "not valid: the observation lists the tags of units in sight"),
    "dead_target": Judgement("input_conflicting", "not valid: an observation said that it died, or lists it no more"),
    "not_yours": Judgement("input_conflicting", "not valid: the observation lists the units of each team"),
    "invalid_target": Judgement("input_conflicting", "not valid: in the game the action cannot be used on it"),
    "friendly_target": Judgement("fact_conflicting", "an own or allied unit is taken for an enemy"),
    "wrong_frame": Judgement("context_conflicting", "a point of one frame is used as a point of the other"),
    "out_of_bounds": Judgement("input_conflicting", "not valid: the prompt gives the size of both frames"),
    "not_available": Judgement("input_conflicting", "not valid now: the observation lists the valid actions"),
    "unknown_recipient": Judgement("input_conflicting", "not valid: the prompt lists who can be written to"),
    "unread": Judgement(None, "no call was refused: there was none"),
    "too_late": Judgement(None, "a deadline, however right the call was"),
    "too_many_actions": Judgement(None, "a limit, however right the call was"),
    "too_many_messages": Judgement(None, "a limit, however right the message was"),
    "refused_by_game": Judgement(None, "the game refused what the rules allowed"),
}
"""Every reason for a rejection."""


def count_hallucinations(refusals: Mapping[RejectionReason, int]) -> Counter[HallucinationKind]:
    """Return how many of the refused calls are hallucinations, by kind; refusals are counted by reason."""
    found: Counter[HallucinationKind] = Counter()
    for reason, count in refusals.items():
        if (kind := HALLUCINATION_KINDS[reason].kind) is not None:
            found[kind] += count
    return found
