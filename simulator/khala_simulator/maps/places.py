"""Places of a scenario: points, regions and the ways in which a file places units.

Models and plane geometry. The models hold names; whether a point, a region, a player or a unit type exists is checked
against ``Names``, which the reader of the file passes as the context of the validation. Above: ``script``,
``scenario``. ``systems`` chooses random places and free ones.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    model_validator,
)

from khala_simulator.maps.nodes import shown
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import DEFAULT_VERSION, VERSION_OF_BUILD

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from khala_simulator.numeric.arrays import Bools
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.tables.catalog import Catalog

MOST_UNITS: Final = 400
"""Units that one entry of a file makes."""
_LONGEST_GUESSED: Final = 100
"""Characters of a wrong name for which the nearest one is looked for."""
_MOST_LISTED: Final = 40
"""Names that a message lists."""


class Model(BaseModel):
    """A part of a scenario: immutable, with no unknown fields, and finite numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Names:
    """What the parts of one file may refer to."""

    players: frozenset[int]
    points: frozenset[str]
    regions: frozenset[str]
    groups: frozenset[str]


class UnknownNameError(ValueError):
    """A name is none of the known ones.

    The nearest one takes milliseconds to find, so it is looked for when the error is shown: one of them is, and a file
    may hold thousands.
    """

    def __init__(self, what: str, name: Any, known: Collection[Any]) -> None:
        super().__init__(f"there is no {what} {shown(name)}")
        self._name = str(name)[:_LONGEST_GUESSED]
        self._known = known

    def hint(self) -> str:
        """Return what follows the sentence: the nearest name, or all if they are few."""
        names = sorted(map(str, self._known))  # a region may be called 7 and another "seven"
        if close := difflib.get_close_matches(self._name, names, n=1):
            return f"; did you mean {shown(close[0])}?"
        if len(names) > _MOST_LISTED:
            return ""
        return f"; there are {', '.join(map(shown, names)) or 'none'}"


def _reference(what: str, *fields: str) -> AfterValidator:
    """Return a check that the file has what a value names; without a context every name is accepted."""

    def check(value: Any, info: ValidationInfo) -> Any:
        names = info.context
        if names is None or isinstance(value, tuple):
            return value
        known = frozenset[Any]().union(*(getattr(names, field) for field in fields))
        if value not in known:
            raise UnknownNameError(what, value, known)
        return value

    return AfterValidator(check)


def _in_tables(names: Callable[[Catalog], Collection[str]], what: str) -> AfterValidator:
    """Return a check that any version of the game's tables has what a value names."""

    def check(value: str) -> str:
        if any(value in names(load_catalog(version)) for version in (DEFAULT_VERSION, *VERSION_OF_BUILD.values())):
            return value
        raise UnknownNameError(what, value, names(load_catalog()))

    return AfterValidator(check)


PlayerId = Annotated[int, Field(ge=1, le=15)]
Owner = Annotated[int, _reference("player", "players")]
"""A player of the file, or 0 for the neutral one."""
PointName = Annotated[str, _reference("point", "points")]
RegionName = Annotated[str, _reference("region", "regions")]
GroupName = Annotated[str, _reference("group", "groups")]
UnitName = Annotated[str, _in_tables(lambda catalog: catalog.row_of_name, "unit type")]
UpgradeName = Annotated[str, _in_tables(lambda catalog: {upgrade.name for upgrade in catalog.upgrades}, "upgrade")]


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Point = Annotated[tuple[float, float], BeforeValidator(_as_tuple)]
Posed = Annotated[tuple[float, float] | tuple[float, float, float], BeforeValidator(_as_tuple)]
"""A point, or a point and the facing of the unit that stands there."""


def kind_of_place(value: Any) -> str | None:
    """Return the form of place that a value has."""
    if isinstance(value, str):
        return "name"
    if isinstance(value, list | tuple):
        return "point" if not value or not isinstance(value[0], list | tuple) else "points"
    return next((kind for kind in ("x", "random_in", "column") if kind in fields_of(value)), None)


def fields_of(value: Any) -> Collection[Any]:
    """Return the names of the fields of a mapping or of a model; a plain value has none."""
    if isinstance(value, Model):
        return type(value).model_fields
    return value if isinstance(value, dict) else ()


Place = Annotated[
    Annotated[PointName, Tag("name")] | Annotated[Point, Tag("point")],
    Discriminator(kind_of_place, custom_error_type="place", custom_error_message="give a point's name or [x, y]"),
]


Source = Annotated[str | Point, _reference("point or region", "points", "regions")]
"""What a point is drawn from: another one, or any point of a region."""


class Span(Model):
    """Numbers from one to another, both included."""

    start: float = Field(alias="from")
    to: float
    step: Annotated[float, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _few(self) -> Span:
        if not 0 <= (self.to - self.start) / self.step < MOST_UNITS:
            raise ValueError(f"give an end that is not before the start, and at most {MOST_UNITS} numbers")
        return self

    def values(self) -> tuple[float, ...]:
        """Return the numbers, ascending."""
        count = round((self.to - self.start) / self.step) + 1
        return tuple(round(self.start + i * self.step, 4) for i in range(count))


def _axis(value: Any) -> Any:
    """Return the numbers of one number, several, or a span."""
    if isinstance(value, dict):
        return Span.model_validate(value).values()
    return (value,) if isinstance(value, int | float) else _as_tuple(value)


Axis = Annotated[tuple[float, ...], BeforeValidator(_axis), Field(min_length=1, max_length=MOST_UNITS)]


class PlaceGrid(Model):
    """Every x with every y; offsets from a place, if they are ``around`` one."""

    x: Axis
    y: Axis
    around: Place | None = None

    @model_validator(mode="after")
    def _few(self) -> PlaceGrid:
        if len(self.x) * len(self.y) > MOST_UNITS:
            raise ValueError(f"give at most {MOST_UNITS} places, there are {len(self.x)} x {len(self.y)} here")
        return self


class RandomPlace(Model):
    """Anywhere in a region, with a minimum distance to every unit of a type, centre to centre."""

    random_in: RegionName
    away_from: dict[UnitName, float] = {}


class ZigZag(Model):
    """One above and one below the other in turn, around a place."""

    column: Place
    step: Annotated[float, Field(gt=0)] = 1.0


Spot = Annotated[
    Annotated[PointName, Tag("name")]
    | Annotated[Point, Tag("point")]
    | Annotated[tuple[Posed, ...], Tag("points"), Field(max_length=MOST_UNITS)]
    | Annotated[PlaceGrid, Tag("x")]
    | Annotated[RandomPlace, Tag("random_in")]
    | Annotated[ZigZag, Tag("column")],
    Discriminator(
        kind_of_place,
        custom_error_type="spot",
        custom_error_message="give a point's name, [x, y], a list of them, {x, y}, {random_in: region} or "
        "{column: point}",
    ),
]
"""Where units are put: all at one point, one at each of several, at random, or in a column."""


class Shape(Model):
    """A rectangle ``[x0, y0, x1, y1]`` or a circle ``[x, y, radius]``; ``minus`` takes it out of the region."""

    rect: Annotated[tuple[float, float, float, float], BeforeValidator(_as_tuple)] | None = None
    circle: Annotated[tuple[float, float, float], BeforeValidator(_as_tuple)] | None = None
    minus: bool = False

    @model_validator(mode="after")
    def _one_form(self) -> Shape:
        if (self.rect is None) == (self.circle is None):
            raise ValueError("give either rect: [x0, y0, x1, y1] or circle: [x, y, radius]")
        x0, y0, x1, y1 = self.box
        if not (x0 <= x1 and y0 <= y1):
            raise ValueError("a rect has its lower left corner first, and a radius is not negative")
        return self

    def covers(self, points: Floats) -> Bools:
        """Return (n,) whether each of the points (n, 2) is inside, edges included."""
        x, y = points[:, 0], points[:, 1]
        if self.rect is not None:
            x0, y0, x1, y1 = self.rect
            inside: Bools = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
            return inside
        cx, cy, radius = self.circle or (0.0, 0.0, 0.0)
        within: Bools = (x - cx) ** 2 + (y - cy) ** 2 <= radius**2
        return within

    @property
    def box(self) -> tuple[float, float, float, float]:
        """The rectangle around it."""
        if self.rect is not None:
            return self.rect
        cx, cy, radius = self.circle or (0.0, 0.0, 0.0)
        return cx - radius, cy - radius, cx + radius, cy + radius


class Region(Model):
    """A part of the map: the union of its shapes without those taken out."""

    shapes: Annotated[tuple[Shape, ...], Field(min_length=1)]

    @model_validator(mode="before")
    @classmethod
    def _shapes(cls, value: Any) -> Any:
        if isinstance(value, dict) and "shapes" not in value:
            value = [value]
        return {"shapes": value} if isinstance(value, list) else value

    @model_validator(mode="after")
    def _something(self) -> Region:
        if all(shape.minus for shape in self.shapes):
            raise ValueError("a region needs a shape that is not taken out of it")
        return self

    def covers(self, points: Floats) -> Bools:
        """Return (n,) whether each of the points (n, 2) lies in the region."""
        inside: Bools = np.zeros(len(points), dtype=np.bool_)
        for shape in self.shapes:
            inside = inside & ~shape.covers(points) if shape.minus else inside | shape.covers(points)
        return inside

    @property
    def box(self) -> tuple[float, float, float, float]:
        """The rectangle around all of it."""
        corners = np.array([shape.box for shape in self.shapes if not shape.minus])
        x0, y0 = corners[:, :2].min(axis=0).tolist()
        x1, y1 = corners[:, 2:].max(axis=0).tolist()
        return x0, y0, x1, y1
