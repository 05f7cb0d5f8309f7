"""The messages, as frozen pydantic models with a literal `kind` each.

They stand alone: no game, no bus, no model provider is imported here. Positions are in one of two frames,
x right and y down in both: *screen*, `[0, 24)` cells of one world unit around the centre of a team's
(virtual) camera, and *minimap*, `[0, 64)`. The world frame never leaves the host.

Lengths are counted in game loops (22.4 per second at the speed called "faster") where a name ends in
`_loops` or is `game_loop`, in seconds where it ends in `_s`, in world units otherwise.
"""

from __future__ import annotations

from enum import IntFlag
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from khala_protocol.clock_rule import ClockRule  # pydantic evaluates it
from khala_protocol.field_words import field_words

if TYPE_CHECKING:
    from pydantic import GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core import CoreSchema

SCHEMA_VERSION: Literal[1] = 1
"""Major version of the schema. A peer with another one is refused."""

LOOPS_PER_S = 22.4
"""Game loops per second at the speed called "faster", which ladders and the API use."""

MOST = 2**53
"""Largest number that every reader of JSON takes as it is. An agent reports its usage itself: no sum must fail."""

MAX_DETAIL_CHARACTERS = 200
"""Longest reason for a fallback."""

MAX_REPLY_CHARACTERS = 65_536
"""The part of a reply that is read. Ordinary ones have at most some 10 000; a model that repeats itself goes on."""

MAX_ADVICE_CHARACTERS = 500
"""Longest message of an adviser."""

Count = Annotated[int, Field(ge=0, le=MOST)]
Point = tuple[float, float]
Alliance = Literal["own", "ally", "enemy", "neutral"]
Outcome = Literal["win", "draw", "loss"]
Ending = Literal["win", "draw", "loss", "aborted"]
"""How an episode ended for one side; `aborted` if the host ended it, because it could not be played as it should be."""

RejectionReason = Literal[
    "malformed",  # looks like a call, but is not one
    "unknown_action",  # no action of this name in the agent's catalogue
    "wrong_arguments",  # number or form of the arguments
    "unknown_team",  # a team that this agent does not have
    "unknown_target",  # a tag that names no unit in sight
    "dead_target",  # a tag of a unit that has died
    "not_yours",  # a tag of a unit that does not obey this team
    "invalid_target",  # a unit or a point that this action cannot be used on
    "wrong_frame",  # a point that only makes sense in the other frame
    "out_of_bounds",  # a point outside of its frame or of the map
    "not_available",  # known, but not now: cost, cooldown, requirement
    "too_many_actions",  # over the number of actions a team may have in one reply
    "unknown_recipient",  # a message to nobody
    "too_late",  # the reply took effect too long after its observation
    "too_many_messages",  # over the number of messages an agent may send in one reply
    "refused_by_game",  # PySC2 or the game answered with an error
]

AgentStatus = Literal[
    "ok",  # a reply of the policy, in time
    "fallback",  # the policy failed (see `Reply.detail`) and said nothing: the task's default reply counts
    "late",  # nothing arrived before the deadline
    "gone",  # its liveliness token went away while the host was waiting
    "malformed",  # something arrived that is not a valid reply
]

Fate = Literal[
    "fresh",  # carried out at the game loop that the agent had seen
    "stale",  # carried out later than that, as it was meant
    "adapted",  # carried out later, as far as the state of the game still allowed it
    "refused",  # it held orders, and none of them was carried out
    "dropped",  # the episode ended before it could take effect
]

Trigger = Literal["attacked", "idle", "message"]
AgentKind = Literal["combat_group", "commander", "developer", "builder"]
Unasked = Literal["no_units", "not_due"]
Purpose = Literal["decision", "summary"]
"""What a model is asked for: a reply to an observation, or a summary of the steps so far (`MemoryRule.summary`)."""


class Frozen(BaseModel):
    """Base of all parts of messages: immutable; unknown fields, infinity and NaN (which JSON lacks) are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema, with the sentence under each field as its description."""
        schema = handler(core)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        words = field_words(cls)
        for name in properties.keys() & words.keys():
            properties[name].setdefault("description", words[name])
        return schema

    def but(self, **changes: object) -> Self:
        """Return a copy with some fields replaced, unchecked.

        For inner loops only: it takes 1 µs where `model_copy` takes 6, and a joint step of 128 agents makes 3500.
        """
        return self.having({**self.__dict__, **changes})

    def having(self, fields: dict[str, object]) -> Self:
        """Return a model of the same class with all of these fields, unchecked and not copied."""
        made = object.__new__(type(self))
        _set_fields(made, fields)
        _set_fields_set(made, self.__pydantic_fields_set__)
        _set_extra(made, None)
        _set_private(made, None)
        return made


_set_fields, _set_fields_set, _set_extra, _set_private = (
    vars(BaseModel)[slot].__set__
    for slot in ("__dict__", "__pydantic_fields_set__", "__pydantic_extra__", "__pydantic_private__")
)
"""The slots of a model: setting a frozen model's fields through them takes half the time of `object.__setattr__`."""


class Wire(Frozen):
    """Base of all messages: the fields that every message has."""

    v: Literal[1] = SCHEMA_VERSION
    """Major version of the schema."""
    run: str
    """Name of the run; the same as in the key."""


# --- what an agent may say --------------------------------------------------------------------------


class Call(Frozen):
    """One `<Name(args)>` found in a reply, with its place in the text."""

    name: str
    args: tuple[str | Point, ...] = ()
    """Tags as `0x…`, points as `(x, y)` in the frame that the action's catalogue entry says, the rest as text."""
    team: str | None = None
    """The team of the heading above it, as written there; None if there was no heading."""
    start: int = Field(ge=0)
    """Offset of `<` in the reply's text, in characters."""
    end: int = Field(ge=0)
    """Offset after `>`."""


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


class ActionSpec(Frozen):
    """One text action of the catalogue, as an agent sees it."""

    name: str
    args: tuple[Literal["tag", "screen", "minimap"], ...] = ()
    description: str = ""


# --- what an agent sees -----------------------------------------------------------------------------


class OrderView(Frozen):
    """One order of a unit of the own side."""

    name: str
    """General name of what it does, `Attack`."""
    target: str | None = None
    """Tag of the unit that it targets."""
    minimap: Point | None = None
    """The point that it targets."""
    progress: float | None = None
    """Progress, 0 to 1, of training, research or morphing; None for orders without progress."""


class UnitDetails(Frozen):
    """Details that only some units have."""

    passengers: tuple[str, ...] = ()
    """Types of the units inside; own units only."""
    cargo_max: int = 0
    """Room for passengers; 0 for units without room, and for others' units."""
    burrowed: bool = False
    unpowered: bool = False
    """Whether an own structure is idle because it lacks a power field."""
    contents: int | None = None
    """Minerals or vespene left in a resource."""
    harvesters: tuple[int, int] | None = None
    """Workers of an own base or gas structure, and how many it has work for."""
    ready: tuple[str, ...] = ()
    """Of the skills that the agent may use, those that a unit of its team could use now."""
    unready: tuple[str, ...] = ()
    """Of these, the ones that only other units of its team could use now."""


class UnitView(Frozen):
    """One unit in sight of a team, in the team's screen frame."""

    tag: str
    """Hexadecimal, `0x1002c0001`; the name under which actions speak of the unit."""
    type: str
    """Name as in `pysc2.lib.units`, without the race."""
    alliance: Alliance
    screen: Point
    minimap: Point
    distance: float | None = None
    """From the mean position of the team's units, in world units; enemies only."""
    health: float
    health_max: float
    shield: float = 0.0
    shield_max: float = 0.0
    energy: float = 0.0
    energy_max: float = 0.0
    weapon_cooldown_s: float | None = None
    """Seconds until the weapon is ready; None for units without one, or of others."""
    build_progress: float = 1.0
    """0 to 1; 1 is finished."""
    flying: bool = False
    cloaked: bool = False
    hallucination: bool = False
    buffs: tuple[str, ...] = ()
    order: str | None = None
    """Name of its current order; own units only."""
    orders: tuple[OrderView, ...] = ()
    """Its current order, and the orders queued after it."""
    details: UnitDetails | None = None
    """Details that only some units have; None for all others."""


class Event(Frozen):
    """A change of a unit between the last observation and this one."""

    what: Literal["hurt", "healed", "died", "joined", "appeared", "disappeared", "finished", "researched"]
    tag: str
    """Empty for `researched`, which concerns no unit."""
    type: str
    """Type of the unit; the upgrade's name for `researched`."""
    alliance: Alliance
    amount: float | None = None
    """Health and shield lost (`hurt`) or regained (`healed`)."""


class ActionCost(Frozen):
    """The cost of a valid action."""

    action: str
    minerals: int = 0
    vespene: int = 0
    supply: float = 0.0
    times: int = Field(ge=0)
    """How often it could be paid for now; at most 1 for research."""
    time_s: float = 0.0
    """Seconds until its product is finished, without a boost."""
    footprint: tuple[int, int] | None = None
    """Width and height of the ground that it takes, in world units; None for actions without a point."""
    first: bool = False
    """Whether it makes the first structure of its type."""


class UnavailableAction(Frozen):
    """An action that is not valid now."""

    action: str
    reason: str
    """As the end of a sentence: `no Stargate`."""


class ValidArguments(Frozen):
    """Arguments with which a valid action is accepted, if not all do that its kind suggests."""

    action: str
    units: tuple[str, ...] = ()
    """Tags of the units that can carry it out; () for every unit of the team."""
    tags: tuple[str, ...] = ()
    """Tags of targets that will do, the first ones of many; () for every enemy, or every other unit, on the screen."""
    points: tuple[Point, ...] = ()
    """Some points of the screen that will do; () if every place on the map does."""


class TeamView(Frozen):
    """One team of an agent: its units, and what they see on their screen."""

    name: str
    minimap: Point | None = None
    """Centre of the team's camera; None for a team without units, which gives orders to the whole side."""
    task: str = ""
    """Its current task."""
    units: tuple[UnitView, ...] = ()
    allies: tuple[UnitView, ...] = ()
    enemies: tuple[UnitView, ...] = ()
    events: tuple[Event, ...] = ()
    actions: tuple[ActionSpec, ...] = ()
    """Actions that are valid for this team now."""
    offers: tuple[ActionCost, ...] = ()
    """Valid actions that have a cost."""
    arguments: tuple[ValidArguments, ...] = ()
    """Valid actions for which only some arguments will do."""
    barred: tuple[UnavailableAction, ...] = ()
    """Actions of this team that are not valid now."""
    resources: tuple[UnitView, ...] = ()
    """Minerals and geysers on its screen; for builders only."""
    bounds: tuple[float, float, float, float] = (0.0, 0.0, 24.0, 24.0)
    """The part of the screen frame that lies on the playable map: x0, y0, x1, y1."""


class Resources(Frozen):
    """The numbers at the top of a player's screen."""

    minerals: int = 0
    vespene: int = 0
    supply_used: float = 0.0
    supply_cap: float = 0.0
    promised: tuple[int, int] = (0, 0)
    """Resources reserved for structures that workers are on their way to build, as minerals and vespene."""


class TypeCount(Frozen):
    """How many units of a type the own side has."""

    type: str
    ready: int
    """Number of finished ones."""
    idle: int | None = None
    """Number of finished ones without an order; None for types that neither produce nor gather."""
    under_way: tuple[float, ...] = ()
    """Progress of each one that is being built or warped in, 0 to 1, the farthest first."""


class Production(Frozen):
    """Units and upgrades in training, research or morphing, by the name of the order."""

    order: str
    progress: tuple[float, ...]
    """Progress of each one that has begun, 0 to 1, the farthest first."""
    queued: int = 0
    """How many more are queued."""


class EnemyCount(Frozen):
    """How many of an enemy's type were seen in this episode."""

    type: str
    seen: int
    """Different units, alive or dead."""
    in_sight: int = 0
    dead: int = 0
    minimap: Point | None = None
    """Place where one of them was last seen."""
    unseen_s: float = 0.0
    """Seconds since one of them was last seen."""


class Counts(Frozen):
    """Everything that a side has, makes and knows of."""

    units: tuple[TypeCount, ...] = ()
    structures: tuple[TypeCount, ...] = ()
    production: tuple[Production, ...] = ()
    planned: dict[str, int] = {}
    """Structures that workers are on their way to build, by type."""
    enemies: tuple[EnemyCount, ...] = ()


class Alert(Frozen):
    """A place where units of the own side lost health or died since the last observation."""

    minimap: Point
    units: dict[str, int]
    """How many, by type."""
    lost: float
    """Health and shield that they lost, without the units that died."""
    died: int = 0


class TeamReport(Frozen):
    """A team of another agent, as a commander sees it."""

    agent: str
    name: str
    minimap: Point
    units: dict[str, int]
    """How many, by type."""
    health: float
    """Health and shield of all of them, 0 to 1 of their maximum."""


class Landmark(Frozen):
    """A thing on the map whose tag an action takes."""

    what: Literal["base place", "geyser", "power field", "structure"]
    tag: str
    type: str
    minimap: Point
    screen: Point | None = None
    """Its place, if it is on the screen of the agent's first team."""
    about: str = ""
    """Further information."""


class Place(Frozen):
    """A place of the map with a name, the same for all agents of a side and all of an episode."""

    name: str
    """`Base 2`, counted by the way from where the side began."""
    what: Literal["base", "ramp", "passage"]
    minimap: Point
    start: bool = False
    """Whether a player may begin there."""
    holder: Literal["", "own", "enemy"] = ""
    """Whose town hall stands there, as far as the side knows."""
    unseen_s: float | None = None
    """Seconds since the place was last in sight; None if it never was."""
    about: str = ""


class ArmyPart(Frozen):
    """Own units of the army that are together, or enemy units as they were last seen."""

    place: str = ""
    """The name of the place where they are; "" between places."""
    minimap: Point
    units: dict[str, int]
    doing: str = ""
    """What most of them do: `idle`, `attack at [40, 46]`; "" for enemies."""
    value: int = 0
    """Minerals and vespene that they cost."""
    unseen_s: float = 0.0
    """Seconds since any of these enemies was in sight."""
    away: float | None = None
    """Of enemies: world units to the nearest own town hall."""


class Army(Frozen):
    """The army of a side, and what it knows of the enemy's."""

    parts: tuple[ArmyPart, ...] = ()
    scouts: tuple[ArmyPart, ...] = ()
    """Workers and unarmed units that are on their way to a place far from home."""
    enemies: tuple[ArmyPart, ...] = ()
    """Armed enemy units, the nearest to home first."""
    value: int = 0
    """Minerals and vespene of the whole army."""


class Toll(Frozen):
    """The losses of both sides since an agent's last order."""

    since_s: float
    lost: dict[str, int] = {}
    killed: dict[str, int] = {}


class Economy(Frozen):
    """What comes in and what it is spent on."""

    income: tuple[int, int]
    """Minerals and vespene per minute at present."""
    spending: tuple[int, int]
    """Minerals and vespene spent in the last minute."""
    gatherers: tuple[int, int, int]
    """Workers on minerals, on vespene, and without an order."""
    room: tuple[int, int]
    """How many workers the finished bases and gas structures have work for, at minerals and at vespene."""
    supply_coming: float = 0.0
    """Supply that is under construction."""
    full_in_s: float | None = None
    """Seconds until no supply is left, at the pace of the last minute and with what is under construction; None if
    none was used."""
    casters: dict[str, tuple[int, ...]] = {}
    """Energy of each own unit or structure that has any, by type."""


class WarpGates(Frozen):
    """How many units can be warped in."""

    count: int
    ready: int | None = None
    """None if the game was not asked."""


class NoteView(Frozen):
    """A note that an agent has written to itself."""

    number: int
    """From 1, in the order in which the agent wrote them; no other note of the episode has it."""
    time_s: float
    """Seconds on the game's clock when it was written."""
    text: str


class StandingView(Frozen):
    """An order that the host gives again and again until it is revoked or its end is reached."""

    number: int
    """From 1, in the order in which the agent gave them; no other one of the episode has it."""
    order: str
    """The order and its end, `Developer <Train_Probe()> until 22 Probe`."""
    times: int = 0
    """How often it was carried out."""
    waits_for: str = ""
    """Why it was not carried out in the last step; "" if it was."""
    ended: str = ""
    """Why it is no longer in force; "" if it is. The next observation no longer has it."""


class View(Frozen):
    """The structured form of an observation's text."""

    time_s: float
    """Seconds on the game's clock: game loop / 22.4."""
    resources: Resources = Resources()
    upgrades: tuple[str, ...] = ()
    bounds: tuple[float, float, float, float] = (0.0, 0.0, 64.0, 64.0)
    """The part of the minimap frame that is the playable map: x0, y0, x1, y1."""
    teams: tuple[TeamView, ...] = ()
    counts: Counts | None = None
    """For commanders, developers and builders, like all that follows."""
    events: tuple[Event, ...] = ()
    """Events of the whole side."""
    warnings: tuple[str, ...] = ()
    """Warnings of the game itself, `NuclearLaunchDetected`."""
    alerts: tuple[Alert, ...] = ()
    others: tuple[TeamReport, ...] = ()
    landmarks: tuple[Landmark, ...] = ()
    places: tuple[Place, ...] = ()
    enemy_race: str = ""
    """What the opponent chose, `random` too."""
    army: Army | None = None
    toll: Toll | None = None
    economy: Economy | None = None
    warp_gates: WarpGates | None = None
    notes: tuple[NoteView, ...] = ()
    standing: tuple[StandingView, ...] = ()


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


class Contact(Frozen):
    """An agent or channel that an agent may write to."""

    name: str
    role: str = ""


class TeamSpec(Frozen):
    """One team of an agent, as configured."""

    name: str
    unit_types: tuple[str, ...]
    task: str = ""


class Frames(Frozen):
    """Sizes of the two frames that positions are given in; x right, y down, from 0 to below the size."""

    screen: float = 24.0
    minimap: float = 64.0


class Usage(Frozen):
    """The usage of requests to a model. Sums with `+`, and no sum is more than `MOST`."""

    requests: Count = 0
    prompt_tokens: Count = 0
    completion_tokens: Count = 0
    cached_tokens: Count = 0
    """The part of `prompt_tokens` that the provider had in its cache."""
    cache_write_tokens: Count = 0
    """The part of `prompt_tokens` that the provider put into its cache."""
    reasoning_tokens: Count = 0
    """The part of `completion_tokens` that was reasoning."""
    cost_usd: float | None = Field(default=None, ge=0, le=MOST)
    """None if no price is known for the model."""
    unknown_requests: Count = 0
    """Requests that were cancelled or failed, whose tokens are unknown."""
    images: Count = 0
    """Number of pictures that were sent along."""
    image_tokens: Count = 0
    """The part of `prompt_tokens` for pictures, as the model file's rule estimates it."""

    def __add__(self, other: Usage) -> Usage:
        costs = [c for c in (self.cost_usd, other.cost_usd) if c is not None]
        return Usage(
            requests=min(self.requests + other.requests, MOST),
            prompt_tokens=min(self.prompt_tokens + other.prompt_tokens, MOST),
            completion_tokens=min(self.completion_tokens + other.completion_tokens, MOST),
            cached_tokens=min(self.cached_tokens + other.cached_tokens, MOST),
            cache_write_tokens=min(self.cache_write_tokens + other.cache_write_tokens, MOST),
            reasoning_tokens=min(self.reasoning_tokens + other.reasoning_tokens, MOST),
            cost_usd=min(sum(costs), MOST) if costs else None,
            unknown_requests=min(self.unknown_requests + other.unknown_requests, MOST),
            images=min(self.images + other.images, MOST),
            image_tokens=min(self.image_tokens + other.image_tokens, MOST),
        )


class Pace(Frozen):
    """How long a model takes, as a function of what it reads and writes, so that the same reply always costs the same.

    seconds = requests * latency_s + tokens read / read_tokens_per_s + tokens written / write_tokens_per_s
    """

    latency_s: float = Field(default=0.5, ge=0, le=3600)
    """Seconds of each request, whatever its length."""
    read_tokens_per_s: float = Field(default=5000.0, gt=0)
    write_tokens_per_s: float = Field(default=50.0, gt=0)

    def seconds(self, usage: Usage) -> float:
        """Return the seconds that this usage takes."""
        reading_s = usage.prompt_tokens / self.read_tokens_per_s
        writing_s = usage.completion_tokens / self.write_tokens_per_s
        return usage.requests * self.latency_s + reading_s + writing_s


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
    rejections: tuple[Rejection, ...] = ()
    """The agent's calls of the last step that were not carried out."""
    messages: tuple[Received, ...] = ()


# --- what an agent sends ----------------------------------------------------------------------------


class Reply(Wire):
    """Agent → host: the answer to one observation. The first valid one of a step counts."""

    kind: Literal["reply"] = "reply"
    agent: str
    side: str
    episode: Count
    step: Count
    text: str
    """The reply as the model gave it. The host reads from it the agent's orders, messages and subscriptions."""
    status: Literal["ok", "fallback"] = "ok"
    detail: str = Field(default="", max_length=MAX_DETAIL_CHARACTERS)
    """Reason for a fallback: `timeout`, `http 500`, `budget`, …"""
    latency_s: float = 0.0
    """From the arrival of the observation to this reply."""
    attempts: Count = 0
    usage: Usage = Usage()
    pace: Pace | None = None
    """The pace of its model, if the model file gives one; see `Clock.pace`."""

    @model_validator(mode="before")
    @classmethod
    def _without_calls(cls, data: Any) -> Any:
        """Remove the calls that recordings of early versions hold next to the text."""
        return {k: v for k, v in data.items() if k != "calls"} if isinstance(data, dict) and "calls" in data else data


class Advice(Wire):
    """Adviser → host: a message to agents from outside the match, by a person or another program."""

    kind: Literal["advice"] = "advice"
    agent: str
    """The adviser."""
    side: str
    recipient: str
    """An agent, a channel, or `everyone` for all agents of the side."""
    text: str = Field(min_length=1, max_length=MAX_ADVICE_CHARACTERS)


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


class ChatMessage(Frozen):
    """One message of a prompt."""

    role: Literal["system", "user", "assistant"]
    content: str
    images: tuple[ImageRef, ...] = ()
    """Pictures before the text, in their order."""


class ModelCall(Wire):
    """Agent → recorder: one request to a model and its answer. Never a key."""

    kind: Literal["exchange"] = "exchange"
    agent: str
    side: str
    episode: Count
    step: Count
    purpose: Purpose = "decision"
    attempt: int = Field(ge=1)
    """Number of the try, from 1, of this step and purpose."""
    model: str
    """As it was asked for."""
    answered_by: str = ""
    """As the endpoint called it in its answer, with its version; "" if it did not say."""
    endpoint: str
    """Base URL without credentials or query."""
    prompt: tuple[ChatMessage, ...]
    params: dict[str, str | int | float | bool | None] = {}
    completion: str | None
    """None if no answer came."""
    status: str
    """`ok`, `timeout`, `cancelled`, `http 429`, `connection`, `malformed`."""
    started_s: float
    """Since the observation's arrival."""
    latency_s: float
    waited_s: float = 0.0
    """Time spent before the request in the queue of the shared limits."""
    usage: Usage = Usage()


# --- what the host publishes to all -------------------------------------------------------------------


class AgentCard(Frozen):
    """One agent on the run card."""

    name: str
    side: str
    teams: tuple[str, ...]
    required: bool = True


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


class AgentReport(Frozen):
    """The result of one agent's decision, in the step in which it took effect."""

    agent: str
    side: str
    status: AgentStatus
    detail: str = ""
    latency_s: float | None = None
    """From the publication of the observation to the arrival of the reply, on the host's clock."""
    accepted: tuple[str, ...] = ()
    rejections: tuple[Rejection, ...] = ()
    ignored: int = 0
    """Replies that arrived and were not executed: duplicates, late or foreign ones."""
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


class Result(Wire):
    """Host → all: the result of an episode."""

    kind: Literal["result"] = "result"
    side: str = "blue"
    episode: Count
    outcome: Ending
    cause: str
    """Why it ended: `enemy defeated`, `defeated`, `time limit`, `step limit`, `agents gone`; against a guest also
    `guest left` (it gave up), `guest gone` (its connection or its process ended), `guest hung`."""
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
    usage: dict[str, Usage] = {}
    """By agent."""
    statuses: dict[str, dict[str, int]] = {}
    """By agent: how many of its steps ended `ok`, `late`, …"""
    unasked: dict[str, dict[str, int]] = {}
    """By agent: in how many steps it was not asked, by reason."""
    rejections: dict[str, int] = {}
    """Rejected calls by reason."""
    fates: dict[str, dict[str, int]] = {}
    """By agent: how many of its decisions were `fresh`, `stale`, …"""
    fallbacks: dict[str, dict[str, int]] = {}
    """By agent: how often it fell back, by reason."""
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


# --- the whole map, for those who watch ----------------------------------------------------------------


class GridView(Frozen):
    """A grid of cells over the whole map, seen from above."""

    width: int = Field(ge=0)
    """Cells from west to east."""
    height: int = Field(ge=0)
    """Cells from north to south."""
    data: str
    """A byte for each cell, row after row from the north-west, deflated (zlib), in base64."""


class ResourceMark(NamedTuple):
    """A mineral field, a geyser, a rock or a tower of the map, that belongs to nobody; a list in JSON."""

    tag: int
    """As the game names it to who sees it; it may have another one in somebody's memory."""
    type: str
    """Name of its type, `MineralField`."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame."""


class Terrain(Wire):
    """Host → all but agents: the ground of an episode, once at its beginning."""

    kind: Literal["terrain"] = "terrain"
    episode: Count
    size: tuple[int, int]
    """Width and height of the map, in world units."""
    bounds: tuple[float, float, float, float]
    """The playable part of the minimap frame: x0, y0, x1, y1."""
    minimap: float = 64.0
    """Size of the minimap frame, which holds the longer side of the map."""
    height: GridView
    """Height of the ground, 0 to 255 for -16 to 16 world units."""
    walkable: GridView
    """1 where ground units can walk."""
    resources: tuple[ResourceMark, ...] = ()
    starts: tuple[Point, ...] = ()
    """Places where a player may begin, as far as the game says."""


class UnitFlag(IntFlag):
    """Properties of a unit of a scene."""

    STRUCTURE = 1
    WORKER = 2
    ARMY = 4
    FLYING = 8
    BURROWED = 16
    CLOAKED = 32
    HALLUCINATION = 64
    UNPOWERED = 128
    REMEMBERED = 256
    """Nobody sees it now: its values are those of the last look."""
    FIRES = 512
    """It has fired since the scene before."""


class UnitMark(NamedTuple):
    """One unit of a scene, a list in JSON; positions and lengths in the minimap frame."""

    tag: int
    """The game's own number of the unit, constant for the whole episode."""
    type: str
    """Name of its type, `Stalker`."""
    player: int
    """Number of its player, from 1; 16 for nobody."""
    x: float
    """Of its middle."""
    y: float
    """Of its middle."""
    radius: float
    """0 if the game has none for it."""
    facing: float
    """Direction in radians from east, clockwise as seen on the screen."""
    health: float
    """0, as the following ones, where `health_max` is 0."""
    health_max: float
    """0 if nobody knows: of what is in the fog of all sides, the game tells places and types."""
    shield: float
    """Shield points."""
    shield_max: float
    """0 for a unit without shields."""
    energy: float
    """0 for a unit without energy."""
    progress: float
    """Of its construction, 0 to 1."""
    flags: int
    """Sum of `UnitFlag`."""
    seen_by: int
    """Bit i is set if side i of the scene's `sides` sees it now."""
    order: str
    """Name of its current order; "" if it has none, or if nobody may know."""
    target: int
    """Tag of the unit that its order or its weapon is aimed at; 0 for none."""
    to_x: float
    """Where its order leads; -1 for nowhere."""
    to_y: float
    """Where its order leads; -1 for nowhere."""


class EffectMark(NamedTuple):
    """An effect on the ground, a list in JSON: a storm, a bile, a cloud."""

    name: str
    """As PySC2 has it, `PsiStorm`."""
    player: int
    """Number of the player whose it is; 0 if unknown."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame; 0 if the game has none for it."""


class PowerMark(NamedTuple):
    """A power field, a list in JSON."""

    player: int
    """Number of the player whose it is."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame."""


class PlayerMark(Frozen):
    """One player of a scene."""

    player: int
    """Its number, from 1."""
    side: str = ""
    """The side that Khala plays; "" for an opponent."""
    race: str = ""
    units: int = 0
    """Units and structures that this scene has of it."""
    workers: int = 0
    army_value: int = 0
    """Minerals and vespene of its army."""
    minerals: int | None = None
    """None for a player whose resources Khala does not see."""
    vespene: int | None = None
    supply_used: float | None = None
    supply_cap: float | None = None
    income: tuple[float, float] | None = None
    """Minerals and vespene per minute."""
    upgrades: tuple[str, ...] = ()


class Scene(Wire):
    """Host → all but agents: the whole map at one step, before its decisions take effect. Never for agents."""

    kind: Literal["scene"] = "scene"
    episode: Count
    step: Count
    game_loop: Count
    sides: tuple[str, ...]
    """The sides that Khala plays, in the order of the bits of `UnitMark.seen_by`."""
    whole: bool
    """Whether it has all units: the game showed the map without fog, or all players are Khala's. Otherwise it is what
    the sides know together."""
    players: tuple[PlayerMark, ...]
    units: tuple[UnitMark, ...]
    """Units and structures, without the resources of the map."""
    effects: tuple[EffectMark, ...] = ()
    power: tuple[PowerMark, ...] = ()
    """Power fields of the sides."""
    gone: tuple[int, ...] = ()
    """Tags of the terrain's resources that are no longer there, as far as anybody knows."""
    creep: GridView | None = None
    """1 where creep is; None if there is none."""
    fog: dict[str, GridView] = {}
    """By side: 2 where it sees now, 1 where it once saw, 0 elsewhere."""


AnyMessage = Annotated[
    Run | Briefing | Observation | Reply | Advice | Message | ModelCall | Report | Result | Terrain | Scene,
    Field(discriminator="kind"),
]
MESSAGE_TYPES: tuple[type[Wire], ...] = (
    Run, Briefing, Observation, Reply, Advice, Message, ModelCall, Report, Result, Terrain, Scene,
)  # fmt: skip
