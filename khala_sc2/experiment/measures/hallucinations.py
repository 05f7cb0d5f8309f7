"""Calls that contradict what the agent knew or could know, by kind of contradiction.

The kinds are those of the paper (LLM-PySC2, arXiv 2411.05348) and of the survey that names them (arXiv 2309.01219).
The survey counts a contradiction of anything in the prompt as input-conflicting. Here the part of the prompt that stays
the same all episode is the input, and what observations said is the context, so that a model that does not follow
instructions can be distinguished from one that loses track of the game. `KINDS` is the whole mapping.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias, get_args

from khala_protocol.messages import count_refusals
from khala_sc2.experiment.measures.evidence import tags

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from khala_protocol.messages import Observation, Rejection, RejectionReason
    from khala_sc2.experiment.measures.evidence import RecordedDecision, SideStep

Kind: TypeAlias = Literal["input_conflicting", "context_conflicting", "fact_conflicting", "not_hallucinated"]


class Judgement(NamedTuple):
    """The kind of a rejection, and why."""

    kind: Kind
    because: str


KINDS: Mapping[RejectionReason, Judgement] = {
    "malformed": Judgement("input_conflicting", "the prompt says how a call is written"),
    "unknown_action": Judgement("input_conflicting", "the prompt lists the actions"),
    "wrong_arguments": Judgement("input_conflicting", "the prompt says what each action takes"),
    "wrong_frame": Judgement("input_conflicting", "the prompt says in which frame an action takes a point"),
    "out_of_bounds": Judgement("input_conflicting", "the prompt gives the size of both frames"),
    "unknown_recipient": Judgement("input_conflicting", "the prompt lists who can be written to"),
    "unknown_team": Judgement("context_conflicting", "the observation has a heading for each team that has units"),
    "unknown_target": Judgement("context_conflicting", "the observation lists the tags of the units in sight"),
    "dead_target": Judgement("context_conflicting", "an observation said that it died, or no longer lists it"),
    "not_yours": Judgement("context_conflicting", "the observation lists the units of each team"),
    "invalid_target": Judgement("fact_conflicting", "in the game the action cannot be used on it"),
    "not_available": Judgement("fact_conflicting", "in the game it costs, needs or waits for more"),
    "unread": Judgement("not_hallucinated", "no call was refused: there was none"),
    "too_late": Judgement("not_hallucinated", "a deadline, however right the call was"),
    "too_many_actions": Judgement("not_hallucinated", "a limit, however right the call was"),
    "too_many_messages": Judgement("not_hallucinated", "a limit, however right the message was"),
    "refused_by_game": Judgement("not_hallucinated", "the game refused what the rules allowed"),
}
"""Every reason for a rejection."""

_NAME = re.compile(r"<(?:Standing\()?\s*(\w+)")


@dataclass(frozen=True, kw_only=True)
class Hallucinations:
    """Hallucinations, by kind. The three kinds and `not_hallucinated` add up to `rejected`."""

    calls: int
    """Calls that policies said: accepted, rejected, and messages. Those of the task's default reply do not count."""
    input_conflicting: int
    """Rejected calls that break the rules of the prompt."""
    context_conflicting: int
    """Rejected calls that contradict the observation that they answer, or earlier ones."""
    fact_conflicting: int
    """Rejected calls that contradict how the game works, or what is possible in it at the moment."""
    not_hallucinated: int
    """Rejected calls that are none of these: limits, deadlines, errors of the game, calls of default replies, and
    those that are `outdated`."""
    outdated: int
    """Rejected calls that were right when the agent saw the game, and wrong when they took effect: the observation
    listed the team, the tag, or the action as valid. Always 0 with the clock `frozen`."""
    hallucinated_share: float | None
    """Hallucinations of all three kinds / `calls`, 0 to 1; None without calls."""


class HallucinationTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._kinds: Counter[Kind] = Counter()
        self._calls = self._outdated = 0

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        speakers = {decision.report.agent for decision in step.decisions if decision.is_of_policy}
        self._calls += sum(message.sender in speakers for message in step.messages)
        for decision in step.decisions:
            self._kinds.update(self._judge(decision))
            if decision.is_of_policy:
                refusals = count_refusals(decision.report.rejections)
                rejected = sum(count for reason, count in refusals.items() if reason not in _OF_MESSAGES)
                self._calls += len(decision.report.accepted) + rejected

    def _judge(self, decision: RecordedDecision) -> Iterator[Kind]:
        for rejection in decision.report.rejections:
            if not decision.is_of_policy:
                yield "not_hallucinated"
            elif is_outdated(rejection, decision):
                self._outdated += 1
                yield "not_hallucinated"
            else:
                for reason in count_refusals([rejection]).elements():
                    yield KINDS[reason].kind

    def total(self) -> Hallucinations:
        """Return the group."""
        hallucinated = self._kinds.total() - self._kinds["not_hallucinated"]
        return Hallucinations(
            calls=self._calls,
            outdated=self._outdated,
            hallucinated_share=hallucinated / self._calls if self._calls else None,
            **{kind: self._kinds[kind] for kind in get_args(Kind)},
        )


_OF_MESSAGES = frozenset({"unknown_recipient", "too_many_messages"})
"""Reasons against messages, which a report has among its messages already, or in one rejection for many."""


def is_outdated(rejection: Rejection, decision: RecordedDecision) -> bool:
    """Return True if time made a call wrong: the observation that it answers allowed it.

    What an action can be used on hardly changes with time, so `invalid_target` is never outdated; nor is `not_yours`.
    """
    if not decision.report.age_loops or decision.question is None or (seen := decision.question.whole) is None:
        return False
    match rejection.reason:
        case "unknown_team":
            team = (rejection.team or "").casefold()
            return team in {view.name.casefold() for view in seen.view.teams if view.units}
        case "unknown_target" | "dead_target":
            return _has_shown_all(rejection, seen)
        case "not_available":
            return _has_offered(rejection, seen) and _has_shown_all(rejection, seen)
    return False


def _has_shown_all(rejection: Rejection, seen: Observation) -> bool:
    """Return True if the observation has every tag of a call."""
    return tags(rejection.text) <= tags(seen.text)


def _has_offered(rejection: Rejection, seen: Observation) -> bool:
    """Return True if the action of a call was valid for its team, or for any if it names none."""
    name = _NAME.search(rejection.text)
    team = (rejection.team or "").casefold()
    views = [view for view in seen.view.teams if team in ("", view.name.casefold())]
    return name is not None and name[1] in {action.name for view in views for action in view.actions}
