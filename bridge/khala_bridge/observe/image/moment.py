"""Everything to be drawn at one moment: units, effects, power, creep and fog, read from a snapshot once.

Every picture of a step is drawn from the same `Moment`. Positions are in the world frame; a picture converts them to
its own. It draws nothing, and knows no team.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_bridge.knowledge import is_structure, race_of
from khala_bridge.names import effect_name, unit_name
from khala_bridge.observe.image.codes import code_of
from khala_bridge.observe.image.painting import Painting, Veil, upright
from khala_bridge.state import Alliance
from khala_bridge.state.ground import land_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.frames import WorldPoint
    from khala_bridge.observe.image.bodies import Shape
    from khala_bridge.observe.image.palette import Side
    from khala_bridge.state import Snapshot, Unit
    from khala_bridge.state.ground import Land

_SIDES: dict[Alliance, Side] = {
    Alliance.OWN: "own",
    Alliance.ALLY: "ally",
    Alliance.ENEMY: "enemy",
    Alliance.NEUTRAL: "neutral",
}
_STRUCTURE_RADIUS = 1.0
"""An unknown type counts as a structure if it is this large and does not fly."""
_LEVELS: dict[Shape, int] = {
    "field": 0, "stone": 1, "geyser": 1, "minerals": 1, "rich": 1, "structure": 2, "ground": 3, "air": 4
}  # fmt: skip
UNDRAWN = frozenset({"Larva", "KarakFemale", "CollapsiblePurifierTowerDiagonal"})
"""Types that are not drawn; larvae crawl under their hatchery in swarms."""


class Subject(NamedTuple):
    """One unit, as pictures draw it."""

    tag: int
    type_id: int
    owner: int
    x: float
    y: float
    radius: float
    facing: float
    name: str
    code: str
    side: Side
    shape: Shape
    ghost: bool
    """Cloaked, burrowed, a hallucination, or remembered under the fog of war."""
    built: float
    health: float
    """Health, shield and energy as shares of the full value, 0 to 1; negative if the unit has none."""
    shield: float
    energy: float
    order: str
    """Name of its order; own units only."""
    target: tuple[float, float] | None
    """Target of its order, in the world."""

    @property
    def level(self) -> int:
        """Its place in the order of drawing: flat things first, flyers last."""
        return _LEVELS[self.shape]


@dataclass(frozen=True, slots=True)
class Patch:
    """An effect on the ground, or a source of power."""

    name: str
    side: Side
    radius: float
    places: tuple[tuple[float, float], ...]


class Moment:
    """The visible contents of one snapshot."""

    def __init__(self, snapshot: Snapshot) -> None:
        """Take a snapshot; each part is made on first use."""
        self.snapshot = snapshot

    @cached_property
    def painting(self) -> Painting:
        """The map's ground."""
        return Painting.of(self.snapshot.info)

    @cached_property
    def land(self) -> Land:
        """The structures and resources on the ground."""
        return land_of(self.snapshot)

    @cached_property
    def veil(self) -> Veil:
        """Creep and fog."""
        creep, sight = self.snapshot.creep.cells(), self.snapshot.visibility.cells()
        return Veil(None if creep is None else upright(creep), None if sight is None else upright(sight))

    @cached_property
    def subjects(self) -> tuple[Subject, ...]:
        """Every unit that is shown or remembered, in the order of drawing."""
        units = self.snapshot.known
        found = (_subject(unit, units) for unit in units.values())
        drawn = [subject for subject in found if subject.name not in UNDRAWN]
        return tuple(sorted(drawn, key=lambda subject: (subject.level, -subject.radius, subject.tag)))

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """World positions and radii of the subjects, (n, 3)."""
        return np.array([(subject.x, subject.y, subject.radius) for subject in self.subjects]).reshape(-1, 3)

    def around(self, x: float, y: float, reach: float) -> list[Subject]:
        """Return the subjects whose bodies come within `reach` of a point on both axes, in the order of drawing."""
        off = np.abs(self.places[:, :2] - (x, y)).max(axis=1) - self.places[:, 2] if len(self.places) else np.empty(0)
        return [self.subjects[index] for index in np.flatnonzero(off < reach).tolist()]

    @cached_property
    def effects(self) -> tuple[Patch, ...]:
        """Effects on the ground: storms, biles, clouds."""
        return tuple(
            Patch(
                effect_name(effect.effect_id),
                _SIDES[effect.alliance],
                effect.radius or 0.5,
                effect.places,
            )
            for effect in self.snapshot.effects
        )

    @cached_property
    def power(self) -> tuple[Patch, ...]:
        """The player's sources of power."""
        return tuple(Patch("Power", "own", source.radius, (source.pos,)) for source in self.snapshot.power_sources)


def _subject(unit: Unit, units: dict[int, Unit]) -> Subject:
    side = _SIDES[unit.alliance]
    name, code, shape = _kind(unit.unit_type, side, unit.is_flying, unit.radius >= _STRUCTURE_RADIUS)
    order, target = _order(unit, units) if side == "own" else ("", None)
    is_remembered = unit.is_remembered
    return Subject(
        tag=unit.tag,
        type_id=unit.unit_type,
        owner=unit.owner,
        x=unit.pos.x,
        y=unit.pos.y,
        radius=unit.radius or 0.5,
        facing=unit.facing,
        name=name,
        code=code,
        side=side,
        shape=shape,
        ghost=is_remembered or unit.is_cloaked or unit.is_hallucination or unit.is_burrowed,
        built=1.0 if is_remembered else unit.build_progress,
        health=_share(unit.health, unit.health_max),
        shield=_share(unit.shield, unit.shield_max),
        energy=_share(unit.energy, unit.energy_max),
        order=order,
        target=target,
    )


@functools.lru_cache(4096)
def _kind(unit_type: int, side: Side, is_flying: bool, is_large: bool) -> tuple[str, str, Shape]:  # a key
    """Return the name, letters and shape of a type of unit."""
    name = unit_name(unit_type)
    shape: Shape = "ground"
    if name == "ForceField":
        shape = "field"
    elif side == "neutral":
        shape = _thing(name)
    elif is_flying:
        shape = "air"
    elif is_structure(name) if race_of(name) else is_large:
        shape = "structure"
    return name, code_of(name) if shape in {"ground", "air", "structure"} else "", shape


def _thing(name: str) -> Shape:
    """Return the shape of a neutral thing."""
    if "MineralField" in name:
        return "rich" if "Rich" in name else "minerals"
    return "geyser" if "Geyser" in name else "stone"


def _share(value: float, full: float) -> float:
    if not full:
        return -1.0
    return 1.0 if value >= full else value / full


def _order(unit: Unit, units: dict[int, Unit]) -> tuple[str, WorldPoint | None]:
    """Return the order of an own unit and its target; the unit that it fires at comes first."""
    enemy = units.get(unit.engaged_target_tag)
    if enemy is not None:
        return "Attack", enemy.pos
    if not unit.orders:
        return "", None
    order = unit.orders[0]
    target = units.get(order.target_unit_tag)
    return order.name, order.target_world_space_pos if target is None else target.pos
