"""What an agent can answer: its actions with the arguments that will do, and who hears its messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_protocol.messages import ActionSpec, Briefing, Point, TeamView, UnitView, ValidArguments, View

ACTORS: Final = ("unit", "second_unit")
"""Names of the arguments that name the units that carry an action out."""


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of an action, and its possible values.

    Attributes:
        name: `unit` and `second_unit` for units that carry the action out; else its kind.
        tags: that will do; () for any tag.
        points: that will do, () for all within the bounds.
        bounds: of a point, x0, y0, x1, y1; None for a tag.
    """

    name: str
    tags: tuple[str, ...] = ()
    points: tuple[Point, ...] = ()
    bounds: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Option:
    """An action, the teams that can do it with the same arguments, and these."""

    action: ActionSpec
    teams: tuple[str, ...]
    arguments: tuple[Argument, ...] = ()


@dataclass(frozen=True, slots=True)
class Choices:
    """What an agent can answer.

    Attributes:
        options: its possible orders.
        most: orders that a team may have in an answer.
        recipients: agents and channels that it can write to.
        channels: that it can listen to.
        keeps_notes: whether it can write notes to itself.
        notes: numbers of the notes that it has.
        stands: whether it can give standing orders.
        standing: numbers of the standing orders that it has given.
    """

    options: tuple[Option, ...] = ()
    most: int = 1
    recipients: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    keeps_notes: bool = False
    notes: tuple[int, ...] = ()
    stands: bool = False
    standing: tuple[int, ...] = ()

    @property
    def teams(self) -> tuple[str, ...]:
        """The teams that can do anything."""
        return tuple(dict.fromkeys(team for option in self.options for team in option.teams))

    def of_team(self, team: str) -> Iterator[Option]:
        """Yield what one team can do."""
        return (option for option in self.options if team in option.teams)


def choices_of(briefing: Briefing) -> Choices:
    """Return all that an agent may ever answer: the same in each step."""
    teams = tuple(team.name for team in briefing.teams)
    bounds = {kind: (0.0, 0.0, size, size) for kind, size in briefing.frames}
    options = [
        Option(action, teams, tuple(Argument(name, bounds=bounds.get(kind)) for name, kind in argument_names(action)))
        for action in briefing.actions
        if teams
    ]
    return _choices(briefing, options)


def choices_in(briefing: Briefing, view: View) -> Choices:
    """Return what an agent can answer to an observation with this view."""
    alike: dict[tuple[str, tuple[Argument, ...]], tuple[ActionSpec, list[str]]] = {}
    for team in view.teams:
        valid = {known.action: known for known in team.arguments}
        for action in team.actions:
            arguments = tuple(_possible(action, team, view, valid.get(action.name)))
            if all(found.bounds or found.tags or team.minimap is None for found in arguments):
                alike.setdefault((action.name, arguments), (action, []))[1].append(team.name)
    options = [Option(action, tuple(teams), arguments) for (_, arguments), (action, teams) in alike.items()]
    notes = tuple(note.number for note in view.notes)
    standing = tuple(order.number for order in view.standing)
    return replace(_choices(briefing, options), notes=notes, standing=standing)


def _choices(briefing: Briefing, options: Sequence[Option]) -> Choices:
    return Choices(
        options=tuple(options),
        most=briefing.max_actions,
        recipients=(*(who.name for who in briefing.correspondents), *briefing.channels),
        channels=briefing.channels,
        keeps_notes=briefing.memory.notes > 0,
        stands=briefing.standing_orders > 0,
    )


def argument_names(action: ActionSpec) -> list[tuple[str, str]]:
    """Return the names and kinds of the arguments of an action."""
    return [(ACTORS[place] if place < action.actors else kind, kind) for place, kind in enumerate(action.args)]


def _possible(action: ActionSpec, team: TeamView, view: View, valid: ValidArguments | None) -> Iterator[Argument]:
    """Yield the arguments that an action of a team can have."""
    for name, kind in argument_names(action):
        match kind:
            case "tag" if name in ACTORS:
                yield Argument(name, (valid and valid.units) or _tags(team.units))
            case "tag":
                yield Argument(name, (valid and valid.tags) or _tags(_targets(action, team)))
            case _:
                points = valid.points if valid and kind == "screen" else ()
                yield Argument(name, points=points, bounds=team.bounds if kind == "screen" else view.bounds)


def _targets(action: ActionSpec, team: TeamView) -> Iterable[UnitView]:
    if action.target == "enemy":
        return team.enemies
    friends = (*team.units, *(unit for unit in team.allies if action.target is None or unit.alliance == "own"))
    return friends if action.target == "own" else (*friends, *team.enemies)


def _tags(units: Iterable[UnitView]) -> tuple[str, ...]:
    return tuple(unit.tag for unit in units)
