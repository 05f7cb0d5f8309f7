"""What an agent sees, as data: the view of an observation."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from khala_protocol.messages.base import Frozen, Point

Alliance = Literal["own", "ally", "enemy", "neutral"]


class ActionSpec(Frozen):
    """One text action of the catalogue, as an agent sees it."""

    name: str
    args: tuple[Literal["tag", "screen", "minimap"], ...] = ()
    description: str = ""
    actors: int = 0
    """How many of its first arguments name the units that carry it out."""
    target: Literal["enemy", "own"] | None = None
    """Whose unit its last tag names; None for anybody's."""

    @property
    def form(self) -> str:
        """The action as it is listed: `<Attack_Unit(tag)>`."""
        return f"<{self.name}({', '.join(self.args)})>"


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
    unready: dict[str, float | None] = Field(default_factory=dict)
    """Of these, the ones that only other units of its team could use now, or that will be ready again: the
    seconds until then at most, None if they are not known."""
    left_s: float | None = None
    """Seconds until its buff ends, or a unit that lives for a time only; own units only."""


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


class EffectView(Frozen):
    """An effect on the ground that a team's screen shows: a storm, a bile on its way, a force field."""

    name: str
    """As in PySC2's `features.Effects`; `ForceField`."""
    alliance: Alliance
    radius: float
    """In world units; 0 if the game gives none."""
    screen: tuple[Point, ...]
    left_s: float | None = None
    """Seconds until it ends, at most; None if that is not known."""


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
    """Tags of targets that will do; () for every enemy, or every other unit, on the screen."""
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
    effects: tuple[EffectView, ...] = ()
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
    in_sight: int = 0
    """How many of the enemies are; of the others it tells where they were seen."""
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
    """Why it cannot be carried out at this moment; "" if it can."""
    ended: str = ""
    """Why it is no longer in force; "" if it is. The next observation no longer has it."""


class View(Frozen):
    """The structured form of an observation's text."""

    time_s: float
    """Seconds on the game's clock: game loop / 22.4."""
    resources: Resources = Resources()
    upgrades: tuple[str, ...] = ()
    cell: float = 1.0
    """World units that a cell of the minimap is wide."""
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
