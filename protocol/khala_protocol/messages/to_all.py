"""What the host publishes for all: the run, what was written, what happened, and how it ended."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from khala_protocol.messages.base import Count, Frozen, Variant, Wire
from khala_protocol.messages.hallucinations import HallucinationKind
from khala_protocol.messages.to_agents import Clock, Received, Rejection
from khala_protocol.messages.usage import Usage

Outcome = Literal["win", "draw", "loss"]
Ending = Literal["win", "draw", "loss", "cut", "aborted"]
"""How an episode ended for one side: `cut` if the host ended it after the number of steps that it may take, so that it
says nothing of who would have won; `aborted` if the host could not play it as it should be."""
STEP_LIMIT = "step limit"
"""Cause of an episode that was cut. Versions before 0.2 called its outcome a draw."""

AgentStatus = Literal[
    "ok",  # the agent decided, in time
    "empty",  # its model answered without a word
    "cut",  # its model reached the limit of tokens before it said anything
    "refused",  # its model declined to answer
    "filtered",  # a filter of the endpoint took the answer away
    "malformed",  # its endpoint answered with no completion, or the agent sent no valid reply
    "failed",  # its endpoint or its policy failed
    "late",  # nothing arrived before the deadline
    "fallback",  # another policy decided in its place
    "gone",  # its liveliness token went away while the host was waiting
]

Fate = Literal[
    "fresh",  # carried out at the game loop that the agent had seen
    "stale",  # carried out later than that, as it was meant
    "adapted",  # carried out later, as far as the state of the game still allowed it
    "refused",  # it held orders, and none of them was carried out
    "dropped",  # the episode ended before it could take effect
]

Trigger = Literal["attacked", "idle", "message"]
Unasked = Literal["no_units", "not_due"]


class AgentCard(Frozen):
    """One agent on the run card."""

    name: str
    side: str
    teams: tuple[str, ...]
    required: bool = True
    pictures: tuple[str, ...] = ()
    """Kinds of its pictures. They show what its text does not: all that its side sees on a minimap, the ground, and
    what reaches into a screen from outside."""
    human: bool = Field(default=False, exclude_if=lambda human: not human)
    """Whether a person plays it (`khala run --person`); absent if not. `Result.humans` also has persons who joined from
    elsewhere."""


class Forked(Frozen):
    """Where a match was forked: what was decided before this step are the recorded decisions of another match."""

    run: str
    """Name of the other match."""
    sha256: str
    """Of its recording."""
    episode: Count
    """Its episode; the fork has no other one, and calls it 0."""
    step: Count
    """The first step whose decisions are the fork's own."""


class Run(Wire):
    """Host → all but agents: the run card, with everything needed to repeat a run or to trust its numbers."""

    kind: Literal["run"] = "run"
    task: str
    variant: Variant = "files"
    """As its published files play it, or as its paper says; see [tasks](tasks.md)."""
    map_name: str
    map_sha256: str
    seed: int
    episodes: int
    game: str
    """The game and its version, `StarCraft II 4.10.0.75689` or `Khala simulator 0.1.0, as 4.10.0.75689`."""
    opponent: str = ""
    """Who the agents play against: `computer (zerg, easy)`, `guest bot Rush, zerg`, `nobody`; "" with two sides."""
    executor: Literal["raw", "screen"]
    clock: Clock
    agents: tuple[AgentCard, ...]
    rethink: dict[str, int] = {}
    """By agent that may be asked again in a step because nothing of its reply is possible: how often. Only of agents
    that the host itself starts; `Result.rethinks` has the others, too."""
    advisers: tuple[str, ...] = ()
    """Who may write to agents from outside the match; `Result.advisers` says who did."""
    catalogue_sha256: str
    versions: dict[str, str]
    """Of Khala, Python, PySC2, zenoh."""
    code_sha256: str = ""
    """Of the Python code of Khala, because a version says little of a checkout."""
    hardware: dict[str, str | int] = {}
    """Of the host: its processor, number of cores, memory."""
    labels: dict[str, str] = {}
    """What an experiment calls this match: its name, its hash, and its place in the grid."""
    config: dict[str, object] = {}
    """The task file with all its defaults."""
    forked: Forked | None = None
    """None: it was played from its beginning; see `khala fork`."""

    @property
    def played_task(self) -> str:
        """The task and, unless it is that of the published files, its variant: `pvz_task3_level1 (variant paper)`."""
        return self.task if self.variant == "files" else f"{self.task} (variant {self.variant})"


class Message(Wire):
    """Host → all: a `MessageTo` of an agent's reply, or advice; recipients find it in their next observation."""

    kind: Literal["message"] = "message"
    agent: str
    """The sender."""
    side: str
    episode: Count
    step: Count
    recipient: str
    """An agent or a channel."""
    text: str
    human: bool = False
    """Whether it came from an adviser, and not from an agent of the match."""


class AgentReport(Frozen):
    """The result of one agent's decision, in the step in which it took effect."""

    agent: str
    side: str
    status: AgentStatus
    detail: str = ""
    """Why the agent did not decide, in a few words by which decisions are counted; "" if it did."""
    reason: str = ""
    """The same in the words of its endpoint or its policy."""
    latency_s: float | None = None
    """From the publication of the observation to the arrival of the reply, on the host's clock."""
    accepted: tuple[str, ...] = ()
    rejections: tuple[Rejection, ...] = ()
    ignored: int = 0
    """Replies that arrived and were not executed: duplicates, late or foreign ones."""
    rethinks: int = 0
    """How many replies it gave before this one, of which nothing was possible (`Reply.rethink`)."""
    human: bool = Field(default=False, exclude_if=lambda human: not human)
    """Whether a person plays it; absent if not."""
    usage: Usage = Usage()
    asked_step: int | None = Field(default=None, ge=0)
    """Step of the observation that it answers; None for the step of the report."""
    age_loops: int = Field(default=0, ge=0)
    """Game loops from the observation to the effect."""
    fate: Fate | None = None
    """What became of the decision; None if there was none."""


class Timings(Frozen):
    """Where the wall time of a step went, in seconds."""

    observe_s: float = 0.0
    publish_s: float = 0.0
    wait_s: float = 0.0
    held_s: float = 0.0
    """Of `wait_s`: until the last required agent that was away was back, and had its whole time again; the rest is
    within the deadline."""
    act_s: float = 0.0
    game_s: float = 0.0
    lag_s: float = 0.0
    """With the clock `realtime`: how much the game is behind the wall clock since the episode began."""


class Report(Wire):
    """Host → all: what happened in one step."""

    kind: Literal["report"] = "report"
    side: str = "blue"
    """Whose agents these are; in a match of two sides each has a report of each step."""
    episode: Count
    step: Count
    game_loop: Count
    agents: tuple[AgentReport, ...]
    messages: tuple[Received, ...] = ()
    """What the mailbox took in this step, in the order of the agents; the next observations have what it could
    deliver."""
    advisers: tuple[str, ...] = ()
    """Those of `messages` that came from outside the match: their senders, in the same order."""
    functions: tuple[str, ...] = ()
    """PySC2 functions or raw commands that were executed."""
    env_steps: int = 0
    """Number of `SC2Env.step` calls of the joint action."""
    score: float = 0.0
    killed_value: float | None = None
    """Minerals + vespene of what the side destroyed in this step; over an episode they sum up to that of its result.
    None in recordings of versions that did not say."""
    lost_value: float | None = None
    """Minerals + vespene of what the side lost in this step."""
    unasked: dict[str, Unasked] = {}
    """By agent that could have been asked in this step, why it was not: it has no units to command, or its
    `every_loops` and `when` put it off. Those who still think are not among them."""
    incidents: tuple[str, ...] = ()
    """What failed in this step and was overcome, or not: an agent that was away, a match that was resumed."""
    timings: Timings = Timings()


class Casualties(Frozen):
    """Units and their value in minerals + vespene, lost by one side."""

    units: int = 0
    value: float = 0.0


class EndState(Frozen):
    """What a side has at the end of a game with bases."""

    workers: int
    bases: int
    """Town halls, finished or not."""
    army: int
    """Units that the game counts as army."""
    supply_used: int
    supply_cap: int


class Result(Wire):
    """Host → all: the result of an episode."""

    kind: Literal["result"] = "result"
    side: str = "blue"
    episode: Count
    variant: Variant = "files"
    """As in the run card."""
    outcome: Ending
    cause: str
    """Why it ended: `enemy defeated`, `defeated`, `both sides dead`, `time limit`, `step limit`, `agents gone`; against
    a guest also `guest left` (it gave up), `guest gone` (its connection or its process ended), `guest hung`."""
    opponent: str = ""
    """As in the run card, but a guest may be another one in each episode; the other side, if there are two."""
    valid: bool = True
    """False if the episode says nothing about its agents; `invalid_because` has the reason."""
    invalid_because: str = ""
    steps: int
    """Number of decisions of the agents."""
    env_steps: int = 0
    """Number of `SC2Env.step` calls for them: one each with the raw executor, many with the screen executor."""
    game_loop: Count
    game_s: float
    wall_s: float
    killed: Casualties
    lost: Casualties
    kd: float | None
    """Value killed / value lost; None if nothing was lost."""
    score: float = 0.0
    holdings: EndState | None = None
    """None if the side began without a base, and in recordings of versions that did not say."""
    usage: dict[str, Usage] = {}
    """By agent."""
    statuses: dict[str, dict[str, int]] = {}
    """By agent: how many of its steps ended `ok`, `late`, …"""
    unasked: dict[str, dict[str, int]] = {}
    """By agent: in how many steps it was not asked, by reason."""
    rejections: dict[str, int] = {}
    """Rejected calls by reason."""
    hallucinations: dict[HallucinationKind, int] = {}
    """Rejected calls of the agents themselves, by kind of hallucination; see [measures](measures.md#hallucinations)."""
    fates: dict[str, dict[str, int]] = {}
    """By agent: how many of its decisions were `fresh`, `stale`, …"""
    accepted_of: dict[str, int] = {}
    """By agent: how many of its orders were carried out."""
    fallbacks: dict[str, dict[str, int]] = {}
    """By agent: how often it did not decide itself, by reason."""
    rethinks: dict[str, int] = {}
    """By agent that was asked to rethink: how often, over all steps."""
    humans: dict[str, int] = Field(default={}, exclude_if=lambda humans: not humans)
    """By agent that a person plays: how many decisions the person made in time; absent if persons play none."""
    incidents: tuple[str, ...] = ()
    """The first incidents of its reports, each with its step."""
    advisers: dict[str, int] = {}
    """By adviser: how many messages from outside the match its agents got."""
    age_p50_loops: float | None = None
    """Game loops from an observation to the effect of the decision."""
    age_p95_loops: float | None = None
    lag_s: float = 0.0
    """With the clock `realtime`: how much the game was behind the wall clock at the end."""
    accepted: int = 0
    latency_p50_s: float | None = None
    latency_p95_s: float | None = None

    @model_validator(mode="before")
    @classmethod
    def _cut(cls, fields: Any) -> Any:
        """Read an episode of an older recording that was cut as what it was."""
        if isinstance(fields, dict) and (fields.get("outcome"), fields.get("cause")) == ("draw", STEP_LIMIT):
            return fields | {"outcome": "cut"}
        return fields

    @property
    def ending(self) -> str:
        """How and why it ended, in words: `win, enemy defeated`, `cut at 120 steps`."""
        if self.outcome != "cut":
            return f"{self.outcome}, {self.cause}"
        return f"cut at {self.steps} step{'' if self.steps == 1 else 's'}"
