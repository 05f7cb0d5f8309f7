"""What the server of `khala view` tells its page, as frozen models; the page's TypeScript types are made from them.

| path below `/api` | answer |
|---|---|
| `library` | `Library`: the recordings and experiments that can be opened |
| `runs/{run}` | `RunView`: the run card, sides, agents, episodes |
| `runs/{run}/episodes/{e}/timeline` | `Timeline`: every step with its curves and marks |
| `runs/{run}/episodes/{e}/terrain` | `Terrain` of the protocol |
| `runs/{run}/episodes/{e}/scenes?from=a&to=b` | `Scenes`: from step a to step b, both included, `MOST_SCENES` at most |
| `runs/{run}/episodes/{e}/steps/{s}` | `Moment`: what each agent last decided, and what the step did |
| `runs/{run}/episodes/{e}/steps/{s}/agents/{side}/{agent}` | `Asked`: what it saw then, and the requests to its model |
| `runs/{run}/images/{sha256}` | a picture as it was sent |
| `experiments/{experiment}` | `ExperimentView`: its table with intervals, and its matches |
| `runs/{run}/live` | a websocket: `Progress` down, `AdviceNote` up |

A static export holds the same answers by the same paths. Times are in seconds of the game unless a name says otherwise,
positions are in the minimap frame, in which agents think.
"""

from __future__ import annotations

from typing import Any, Literal

from khala_protocol.messages import (
    AgentKind,
    AgentStatus,
    Ending,
    Fate,
    Frozen,
    ImageRef,
    ModelCall,
    Point,
    RejectionReason,
    Scene,
    Timings,
    Unasked,
    Usage,
)

MOST_SCENES = 64
"""Scenes in one answer."""
SCENES_AT_ONCE = 16
"""Scenes that the page asks for: always `from` a multiple of it `to` the last step before the next multiple, also
beyond the end of the episode, so that an export can hold the same paths."""

CurveName = Literal[
    "army_value", "workers", "supply_used", "supply_cap", "minerals", "vespene", "income_minerals", "income_vespene",
    "killed_value", "lost_value", "latency_s", "tokens", "cost_usd", "refused", "score",
]  # fmt: skip
MarkKind = Literal[
    "fight", "death", "building", "upgrade", "message", "advice", "late", "fallback", "refused", "incident", "end"
]


# --- the library ------------------------------------------------------------------------------------


class RunLine(Frozen):
    """One recording, as a list shows it."""

    id: str
    """Its name in paths."""
    path: str
    """Of the recording, below the directory that was opened."""
    run: str
    task: str
    map: str
    seed: int
    opponent: str
    """Who played against the agents; "" with two sides."""
    clock: str
    models: tuple[str, ...]
    """Different models, by name, as far as they are known."""
    recorded_at_s: float
    """Seconds since 1970."""
    outcomes: dict[str, tuple[Ending, ...]]
    """By side, of each episode that ended."""
    valid: bool
    complete: bool
    """False for a recording that is torn, or still grows."""
    live: bool
    episodes: int
    steps: int
    game_s: float
    cost_usd: float | None
    size_bytes: int
    labels: dict[str, str]
    """Its place in an experiment's grid."""


class ExperimentLine(Frozen):
    """One experiment, as a list shows it."""

    id: str
    name: str
    description: str
    played: int
    matches: int


class Library(Frozen):
    """What can be opened."""

    title: str
    """What `khala view` was asked for: a directory, a file, a run."""
    runs: tuple[RunLine, ...]
    experiments: tuple[ExperimentLine, ...] = ()
    opened: tuple[str, ...] = ()
    """Ids of the one or two runs that were asked for; the page begins with them."""


# --- a run ------------------------------------------------------------------------------------------


class AgentLine(Frozen):
    """One agent of a match."""

    side: str
    name: str
    kind: AgentKind
    model: str
    """Of a scripted agent the name of its policy; "" if it is unknown."""
    teams: tuple[str, ...]
    role: str = ""


class EpisodeLine(Frozen):
    """One episode of a match."""

    episode: int
    steps: int
    """So far."""
    game_s: float
    wall_s: float | None
    outcomes: dict[str, Ending]
    """By side; empty while it is played."""
    causes: dict[str, str]
    kd: dict[str, float | None]
    invalid_because: str = ""


class RunView(Frozen):
    """A run, as its page begins."""

    line: RunLine
    sides: tuple[str, ...]
    agents: tuple[AgentLine, ...]
    episodes: tuple[EpisodeLine, ...]
    indexed: float
    """The part of the recording that is indexed, 0 to 1; more follows on the websocket."""
    scenes: Literal["whole", "seen", "views"]
    """What the map is drawn from: scenes without fog, scenes of what the sides saw, or the agents' observations of a
    recording that has no scenes."""
    can_advise: bool
    """Whether advice can be sent to its agents."""
    card: dict[str, Any]
    """The run card as recorded."""


# --- time -------------------------------------------------------------------------------------------


class Curve(Frozen):
    """A number over the steps of an episode."""

    name: CurveName
    side: str
    """An opponent that Khala does not play is `opponent`; "" for what belongs to neither side."""
    values: tuple[float | None, ...]
    """One for each step of the time line; sums (killed, lost, tokens, money, refused) are since the beginning."""


class Mark(Frozen):
    """Something that happened at a step."""

    step: int
    kind: MarkKind
    side: str = ""
    agent: str = ""
    text: str = ""
    """In a few words: `2 Stalkers died`."""
    weight: float = 1.0
    """How much: of a fight the value that was lost, of others their number."""
    at: Point | None = None


class Timeline(Frozen):
    """Every step of an episode, in columns of one length."""

    episode: int
    steps: tuple[int, ...]
    time_s: tuple[float, ...]
    loops: tuple[int, ...]
    asked: dict[str, tuple[int, ...]]
    """By `side/agent`, the steps in which it was asked."""
    curves: tuple[Curve, ...]
    marks: tuple[Mark, ...]


class Scenes(Frozen):
    """Scenes in the order of their steps."""

    scenes: tuple[Scene, ...]


# --- a moment ---------------------------------------------------------------------------------------


class Letter(Frozen):
    """A message as it was sent or read."""

    sender: str
    recipient: str
    text: str
    step: int
    """In which it was sent, or shown."""
    human: bool = False
    again: bool = False


class Deed(Frozen):
    """One call of a reply, and what became of it."""

    text: str
    start: int
    """Offset in the reply, in characters."""
    team: str
    accepted: bool | None
    """None while its step is not over, or if the host did not say."""
    reason: RejectionReason | None = None
    message: str = ""
    """Why it was refused, as the agent reads it."""
    tags: tuple[int, ...] = ()
    """Units that it names."""
    at: Point | None = None
    """The place that it names, in the minimap frame."""


class SeenTeam(Frozen):
    """A team as its agent saw it."""

    name: str
    tags: tuple[int, ...]
    minimap: Point | None
    """Centre of its screen."""
    screen: float
    """Size of its screen, in the minimap frame."""


class SeenDecision(Frozen):
    """What an agent last was asked, and what it answered."""

    side: str
    agent: str
    step: int
    """Of the observation."""
    game_loop: int
    effect_step: int | None = None
    """In which its answer took effect; None if that has not happened."""
    status: AgentStatus | None = None
    detail: str = ""
    fate: Fate | None = None
    age_loops: int = 0
    latency_s: float | None = None
    attempts: int = 0
    usage: Usage = Usage()
    model: str = ""
    teams: tuple[SeenTeam, ...] = ()
    thought: str = ""
    """The reply before its first heading: what the agent makes of its position."""
    reply: str = ""
    """Word for word."""
    deeds: tuple[Deed, ...] = ()
    sent: tuple[Letter, ...] = ()
    read: tuple[Letter, ...] = ()
    images: tuple[ImageRef, ...] = ()


class SideMoment(Frozen):
    """The state of one side at a step."""

    side: str
    score: float
    killed_value: float
    lost_value: float
    tokens: int
    cost_usd: float | None


class StepView(Frozen):
    """Everything about one step but the map."""

    episode: int
    step: int
    game_loop: int
    time_s: float
    sides: tuple[SideMoment, ...]
    decisions: tuple[SeenDecision, ...]
    """The last one of each agent up to this step, in the order of the agents."""
    unasked: dict[str, Unasked]
    """By `side/agent`."""
    incidents: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()
    """What the game executed, by side `blue: Attack_screen …`."""
    timings: Timings = Timings()


class DecisionTexts(Frozen):
    """The long texts of a decision."""

    side: str
    agent: str
    step: int
    """Of the observation: at the asked step, or the last one before it."""
    text: str
    """The observation in words."""
    before: str | None
    """The agent's observation before; None for its first one."""
    reply: str
    images: tuple[ImageRef, ...]
    calls: tuple[ModelCall, ...]
    """Requests to its model, in their order."""


# --- experiments ------------------------------------------------------------------------------------


class TableCell(Frozen):
    """A cell of a table: a number with its interval."""

    text: str
    """As the report prints it: `45 % (25 to 66)`."""
    value: float | None = None
    low: float | None = None
    high: float | None = None


class TableRow(Frozen):
    """One place of the grid."""

    names: tuple[str, ...]
    """The values of the factors."""
    games: int
    cells: tuple[TableCell, ...]
    runs: tuple[str, ...]
    """Ids of its recordings."""


class ExperimentView(Frozen):
    """An experiment's table."""

    line: ExperimentLine
    factors: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()
    """What the reader of the table must know."""
    runs: tuple[RunLine, ...] = ()


# --- live -------------------------------------------------------------------------------------------


class RecordingProgress(Frozen):
    """Server → page: there is more to see."""

    kind: Literal["progress"] = "progress"
    episode: int
    steps: int
    """Of this episode, so far."""
    indexed: float
    live: bool
    lag_s: float | None = None
    """Seconds from the host's report of the newest step until it could be asked for; None if nothing is live."""


class AdviceNote(Frozen):
    """Page → server: what a person writes to agents."""

    kind: Literal["advice"] = "advice"
    side: str
    recipient: str
    """An agent, a channel, or `everyone`."""
    text: str


class PageNote(Frozen):
    """Server → page: what became of an advice, or why something cannot be had."""

    kind: Literal["note"] = "note"
    ok: bool
    text: str
