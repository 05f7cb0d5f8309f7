"""What the host tells one agent: its briefing, and an observation in each step."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from pydantic import Field, model_validator

from khala_protocol.clock_rule import ClockRule
from khala_protocol.messages.base import Count, Frozen, Wire
from khala_protocol.messages.hallucinations import HALLUCINATION_KINDS, HallucinationKind
from khala_protocol.messages.reasons import RejectionReason
from khala_protocol.messages.usage import Pace
from khala_protocol.messages.view import ActionSpec, View
from khala_protocol.rethinks import MAX_RETHINKS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

R = TypeVar("R", bound=str)

AgentKind = Literal["combat_group", "commander", "developer", "builder"]


class TeamSpec(Frozen):
    """One team of an agent, as configured."""

    name: str
    unit_types: tuple[str, ...]
    task: str = ""


class Contact(Frozen):
    """An agent or channel that an agent may write to."""

    name: str
    role: str = ""


class Frames(Frozen):
    """Sizes of the two frames that positions are given in; x right, y down, from 0 to below the size."""

    screen: float = 24.0
    minimap: float = 64.0


class Clock(Frozen):
    """How game time and thinking time relate in this run."""

    rule: ClockRule = "frozen"
    """`frozen`: the game stands still while agents decide. `budget`: each decision takes effect `thinking_loops` after
    its observation. `token`: as many loops later as `pace` says of the tokens that were read and written. `realtime`:
    the game goes on at `speed` and waits for nobody; a decision takes effect when it arrives."""
    max_wait_s: float | None = Field(default=15.0, gt=0, le=1e6)
    """Longest time the host waits for the answer to an observation; None for no limit."""
    step_loops: int = Field(default=8, ge=1, le=100_000)
    """Game loops from a decision's effect to the agent's next observation; with `realtime`, also those between two
    looks of the host at the game and at its inbox."""
    thinking_loops: int = Field(default=22, ge=0, le=100_000)
    """With `budget`: game loops that each decision costs."""
    pace: Pace = Pace()
    """With `token`: the pace of models whose model file gives none."""
    speed: float = Field(default=1.0, gt=0, le=1000)
    """With `realtime`: 1 is 22.4 game loops in a second."""
    max_age_loops: int | None = Field(default=None, ge=0, le=1_000_000)
    """A decision that takes effect more game loops after its observation is refused; None for no limit."""
    grace_s: float = Field(default=15.0, ge=0, le=86_400)
    """How long a required agent may be away: the host waits for it as long, and then ends the match."""

    @property
    def waits(self) -> bool:
        """Whether the game stands still until the agents that were asked have answered."""
        return self.rule != "realtime"


class MemoryRule(Frozen):
    """What an agent knows of the steps before. Also in one line: `2`, or `steps=4,summary=20,notes=8`."""

    steps: int = Field(default=0, ge=0, le=100)
    """Number of past steps in the prompt, in short form: time, thought, orders and what became of them, messages."""
    whole: bool = False
    """Whether these steps stand there word for word instead, each with its observation."""
    summary: int = Field(default=0, ge=0)
    """After so many decisions each, the model sums up the game so far, in a request of its own; 0 for no summary."""
    notes: int = Field(default=0, ge=0, le=100)
    """Notes to itself that an agent may have; the oldest one makes room."""
    messages_s: float = Field(default=0.0, ge=0)
    """Seconds of the game for which a message is shown again, unless its reader writes to its sender; 0 for once."""

    @model_validator(mode="before")
    @classmethod
    def _in_short(cls, value: Any) -> Any:
        if isinstance(value, int) and not isinstance(value, bool):
            return {"steps": value}
        if not isinstance(value, str):
            return value
        pairs = [part.partition("=") for part in value.replace(" ", "").split(",") if part]
        return {name: number for name, _, number in pairs} if "=" in value else {"steps": value}


class Example(Frozen):
    """A made-up observation of an agent, and a reply that follows from it."""

    observation: str
    reply: str


class Briefing(Wire):
    """Host → agent: all that an agent must know, except observations, so that it can join late or restart."""

    kind: Literal["briefing"] = "briefing"
    agent: str
    side: str
    episode: Count
    episodes: int = Field(default=1, ge=1)
    """Of the run; after the result of the last one there is nothing to do."""
    role: str
    """The agent's role and task."""
    agent_kind: AgentKind = "combat_group"
    task: str = ""
    teams: tuple[TeamSpec, ...] = ()
    knowledge: tuple[str, ...] = ()
    """What is known of each type of its units, before any upgrade: its name and what it is, and a line for each of its
    body, weapons, use and abilities."""
    actions: tuple[ActionSpec, ...] = ()
    """Every action that any of its teams may ever use."""
    correspondents: tuple[Contact, ...] = ()
    channels: tuple[str, ...] = ()
    frames: Frames = Frames()
    clock: Clock = Clock()
    max_actions: int = Field(default=3, ge=1)
    """Actions that one team may have in one reply; more are rejected."""
    memory: MemoryRule = MemoryRule()
    standing_orders: int = Field(default=0, ge=0)
    """Standing orders that one team may have."""
    example: Example | None = None


class ImageRef(Frozen):
    """A picture that belongs to an observation; its bytes travel on their own topic."""

    name: str
    media_type: Literal["image/jpeg", "image/png", "image/webp"]
    sha256: str
    """Hash of the bytes, by which a receiver finds them among the pictures that arrived."""
    title: str = ""
    """One line that explains the picture to a model."""
    width: int = Field(ge=1)
    """In pixels."""
    height: int = Field(ge=1)
    bytes: int = Field(ge=1)
    """Number of bytes."""


class Rejection(Frozen):
    """A call, or text that looked like one, that was not executed. The agent gets it with the next observation."""

    reason: RejectionReason
    message: str
    """One sentence for the model: what was wrong, and what would be right."""
    text: str
    """The rejected words, as much of them as fits; empty if it stands for several."""
    start: int = Field(ge=0)
    """Offset of `text` in the reply."""
    team: str | None = None
    others: dict[RejectionReason, int] = {}
    """How many it stands for, by reason, if an observation has no room for them; else it stands for itself."""

    @property
    def hallucination(self) -> HallucinationKind | None:
        """The kind of hallucination that its reason is; None if it is none."""
        return HALLUCINATION_KINDS[self.reason].kind


def refusals_by_reason(reason: R, others: Mapping[R, int]) -> Mapping[R, int]:
    """Return how many refused calls a rejection with these fields stands for, by reason."""
    return others or {reason: 1}


def count_refusals(rejections: Iterable[Rejection]) -> Counter[RejectionReason]:
    """Return how many were refused, by reason."""
    found: Counter[RejectionReason] = Counter()
    for rejection in rejections:
        found.update(refusals_by_reason(rejection.reason, rejection.others))
    return found


class Received(Frozen):
    """A message as its recipient gets it."""

    sender: str
    recipient: str
    """The agent's own name, or the channel it listens to."""
    text: str
    age_s: float | None = None
    """Seconds of the game since it was written; None if messages are shown once (`MemoryRule.messages_s`)."""
    again: bool = False
    """Whether an earlier observation had it, too."""


class Verdict(Frozen):
    """The host's answer to a reply of which nothing is possible: the agent may reply once more (`Reply.rethink`)."""

    number: int = Field(ge=1, le=MAX_RETHINKS)
    """From 1, of the verdicts on the replies to this observation."""
    text: str
    """What was refused and why, in words; the game and the deadline are those of the observation."""


class CastView(Frozen):
    """What became of a cast that the agent ordered, in this step or before."""

    call: str
    """As in `Observation.accepted`, `Sentry-1 <Ability_ForceField_Screen([12, 9])>`."""
    end: Literal["cast", "under way", "not cast"]
    why: str = ""
    """Why it was not cast."""


class Observation(Wire):
    """Host → agent: what one agent sees at one step. A pure function of what was recorded before."""

    kind: Literal["observation"] = "observation"
    agent: str
    side: str
    episode: Count
    step: Count
    game_loop: Count
    answer_within_s: float | None
    """Seconds until the host goes on without this agent, counted from the arrival: clocks differ between machines."""
    text: str
    """The observation in words."""
    view: View
    """The data that the words were made from."""
    images: tuple[ImageRef, ...] = ()
    accepted: tuple[str, ...] = ()
    """The agent's calls of the last step that were carried out, as written."""
    casts: tuple[CastView, ...] = ()
    """What became of casts, also of those that were accepted earlier."""
    rejections: tuple[Rejection, ...] = ()
    """The agent's calls of the last step that were not carried out."""
    messages: tuple[Received, ...] = ()
    verdict: Verdict | None = Field(default=None, exclude_if=lambda verdict: verdict is None)
    """On the agent's reply to this very observation, which is sent again for it; absent when it is sent first."""
