"""What the groups of measures are found from: the steps of a recording, and what agents saw in them.

Observations and requests to models are nine tenths of a recording, and most measures need a few of their fields. So
only these are read, and an observation as a whole where a measure asks for it. At most one observation of each agent is
kept: an agent is not asked again before its decision took effect.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, ValidationError

from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic
from khala_protocol.messages import (
    AgentReport,
    Count,
    Observation,
    Production,
    Received,
    Report,
    Resources,
    TypeCount,
    Usage,
)
from khala_protocol.recording.reader import MAX_MESSAGE_BYTES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_protocol.recording import Recorded


class _Glance(BaseModel):
    """Some fields of a message, with their names there."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    v: Literal[1] = 1
    agent: str
    side: str
    episode: Count
    step: Count


class CountsGlance(BaseModel):
    """The numbers of a side's units and structures, and what is in production."""

    units: tuple[TypeCount, ...] = ()
    structures: tuple[TypeCount, ...] = ()
    production: tuple[Production, ...] = ()


class ViewGlance(BaseModel):
    """The economy in a view."""

    time_s: float
    resources: Resources = Resources()
    counts: CountsGlance | None = None


class ObservationGlance(_Glance):
    """What most measures need of an observation."""

    view: ViewGlance
    messages: tuple[Received, ...] = ()


class CallGlance(_Glance):
    """What measures need of a request to a model."""

    model: str
    answered_by: str = ""
    endpoint: str
    params: dict[str, str | int | float | bool | None] = {}
    usage: Usage = Usage()


Evidence: TypeAlias = ObservationGlance | CallGlance | Report
_KINDS: dict[str, type[Evidence]] = {
    Topic.OBSERVATION: ObservationGlance,
    Topic.EXCHANGE: CallGlance,
    Topic.REPORT: Report,
}


def evidence(sample: Recorded) -> Evidence | None:
    """Return what measures need of a sample; None if that is nothing, or if its bytes are no message."""
    kind = _KINDS.get(sample.key.rpartition("/")[2])
    if kind is None or len(sample.payload) > MAX_MESSAGE_BYTES:
        return None
    try:
        return kind.model_validate_json(sample.payload)
    except ValidationError:
        return None


_TAG = re.compile(r"0x[0-9a-f]+", re.IGNORECASE)


def tags(text: str) -> frozenset[str]:
    """Return the tags in a text, in small letters."""
    return frozenset(tag.casefold() for tag in _TAG.findall(text))


@dataclass(frozen=True)
class RecordedQuestion:
    """An observation that an agent was asked to answer."""

    glance: ObservationGlance
    payload: bytes

    @cached_property
    def whole(self) -> Observation | None:
        """The observation as it was sent; None if its bytes are not one."""
        try:
            return decode_as(Observation, self.payload)
        except PeerError:
            return None


@dataclass(frozen=True)
class RecordedDecision:
    """A decision as it was reported, and the observation that it answers, if it was recorded."""

    report: AgentReport
    question: RecordedQuestion | None

    @property
    def is_of_policy(self) -> bool:
        """Whether the agent's policy made it; if not, the task's default reply may have stood in."""
        return self.report.status == "ok"


@dataclass(frozen=True)
class SideStep:
    """One step of a side."""

    report: Report
    decisions: Sequence[RecordedDecision]

    @cached_property
    def messages(self) -> Sequence[Received]:
        """What agents of the side wrote, without advice from outside."""
        return [message for message in self.report.messages if message.sender not in self.report.advisers]
