"""Sections about the agent's teams: who is on their screens and what happened there.

Unit lines are fields between bars, so that programs can read them as well (the scripted players do):

    Zealot | tag 0x100140001 | screen [17.5, 12] | distance 5.4 | health 100/100 | shield 12/50 | total 75%
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bridge.observe.text.page import section, shorter
from bridge.observe.text.words import INDENT, listed, n, percent, point, whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from bridge.observe.text.page import Page
    from protocol.messages import Event, OrderView, TeamView, UnitView

NEAR = 9.0
"""World units from the middle of a team within which enemies are told one by one on a shorter page; beyond the range
of all weapons but those of siege."""
FEW, FEWEST = 8, 3
"""Enemies that are told one by one on still shorter pages, the nearest ones."""


@section("teams", parts=("resources",))
def teams(page: Page) -> Iterator[str]:
    """One block per team: where it is, who is there, what happened."""
    return _blocks(page, _all_units, _tagged_events)


@shorter("teams", rank=10, says="allied units, and enemies far from a team, are grouped by type")
def near_units(page: Page) -> Iterator[str]:
    """Allies and far enemies only by type."""
    return _blocks(page, lambda page, team: _grouped(page, team, _distance_within(team, NEAR)), _tagged_events)


@shorter("teams", rank=60, says="only the nearest enemies are told one by one, events and other units by type")
def few_units(page: Page) -> Iterator[str]:
    """A few enemies, and events without tags."""
    return _blocks(page, lambda page, team: _grouped(page, team, _nearest(team, FEW)), _counted_events)


@shorter("teams", rank=110, says="only the nearest enemies are told one by one, other units by type, no events")
def fewest_units(page: Page) -> Iterator[str]:
    """A handful of enemies, no events."""
    return _blocks(page, lambda page, team: _grouped(page, team, _nearest(team, FEWEST)), _no_events)


def _blocks(
    page: Page, units: Callable[[Page, TeamView], Iterator[str]], events: Callable[[Sequence[Event]], Iterable[str]]
) -> Iterator[str]:
    size = page.task.frames.screen
    for index, team in enumerate(page.teams):
        if index:
            yield ""
        yield f"Team {team.name}"
        if team.minimap is None:
            yield f"{INDENT}Has no units of its own: its actions are carried out by units of your whole side."
            continue
        yield f"{INDENT}Minimap position: {point(team.minimap)}"
        if team.bounds != (0.0, 0.0, size, size):
            x0, y0, x1, y1 = map(n, team.bounds)
            yield f"{INDENT}Screen on the map: x {x0} to {x1}, y {y0} to {y1}"
        yield from units(page, team)
        yield from listed("Resources on the screen:", _resource_lines(team.resources))
        yield from listed("Since the last observation:", events(team.events))


# --- units ----------------------------------------------------------------------------------------------------


def _all_units(page: Page, team: TeamView) -> Iterator[str]:
    yield from listed("Your units:", _own_lines(page, team))
    yield from listed("Allied units:", _lines(page, team.allies))
    yield from listed("Enemy units:", _lines(page, team.enemies))


def _grouped(page: Page, team: TeamView, told: Sequence[UnitView]) -> Iterator[str]:
    """Own units and the enemies that are told one by one; everybody else by type."""
    yield from listed("Your units:", _own_lines(page, team))
    yield from listed("Allied units by type:", _group_lines(team.allies))
    yield from listed("Enemy units:", _lines(page, told))
    tags = {unit.tag for unit in told}
    rest = [unit for unit in team.enemies if unit.tag not in tags]
    yield from listed("Other enemy units by type:", _group_lines(rest))


def _distance_within(team: TeamView, distance: float) -> list[UnitView]:
    return [unit for unit in team.enemies if unit.distance is not None and unit.distance <= distance]


def _nearest(team: TeamView, count: int) -> list[UnitView]:
    """The nearest enemies, in the order in which all are listed."""
    nearest = sorted(team.enemies, key=lambda unit: (unit.distance or 0.0, unit.tag))[:count]
    tags = {unit.tag for unit in nearest}
    return [unit for unit in team.enemies if unit.tag in tags]


def _group_lines(units: Sequence[UnitView]) -> Iterator[str]:
    """How many of each type there are, and about where."""
    by_type: dict[str, list[UnitView]] = {}
    for unit in units:
        by_type.setdefault(unit.type, []).append(unit)
    for name, group in by_type.items():
        x, y = (round(sum(unit.screen[axis] for unit in group) / len(group), 1) for axis in (0, 1))
        where = f"{len(group)} {name} around screen {point((x, y))}"
        distances = [unit.distance for unit in group if unit.distance is not None]
        yield where + (f", the nearest {n(min(distances))} away" if distances else "")


def _own_lines(page: Page, team: TeamView) -> Iterator[str]:
    size = page.task.frames.screen
    for unit, line in zip(team.units, _lines(page, team.units), strict=True):
        x, y = unit.screen
        if 0 <= x < size and 0 <= y < size:
            yield line
        else:
            place = point(unit.screen)
            yield line.replace(place, f"{place} (off screen)", 1)


def _lines(page: Page, units: Sequence[UnitView]) -> Iterator[str]:
    conditions = page.conditions
    for unit in units:
        tag = unit.tag
        condition = conditions.get(tag)
        if condition is None:
            condition = conditions[tag] = _condition(unit)
        x, y = unit.screen
        if unit.distance is None:
            yield f"{unit.type} | tag {tag} | screen [{n(x)}, {n(y)}]{condition}"
        else:
            yield f"{unit.type} | tag {tag} | screen [{n(x)}, {n(y)}] | distance {n(unit.distance)}{condition}"


def _condition(unit: UnitView) -> str:
    """How a unit is: the same for every team that sees it."""
    fields = [f"health {whole(unit.health)}/{whole(unit.health_max)}"]
    if unit.shield_max:
        fields.append(f"shield {whole(unit.shield)}/{whole(unit.shield_max)}")
    if full := unit.health_max + unit.shield_max:
        fields.append(f"total {whole(100 * (unit.health + unit.shield) / full)}%")
    if unit.energy_max:
        fields.append(f"energy {whole(unit.energy)}/{whole(unit.energy_max)}")
    if unit.build_progress < 1:
        fields.append(f"built {percent(unit.build_progress)}")
    if (cooldown_s := unit.weapon_cooldown_s) is not None:
        fields.append(f"weapon in {n(cooldown_s)} s" if cooldown_s else "weapon ready")
    if unit.orders:
        fields.append(f"order {', then '.join(map(_order, unit.orders))}")
    if unit.cargo_max:
        fields.append(f"carries {', '.join(unit.passengers) or 'nobody'}, room for {unit.cargo_max} in all")
    if unit.harvesters is not None:
        fields.append(f"workers {unit.harvesters[0]} of {unit.harvesters[1]}")
    states = (
        ("cloaked", unit.cloaked),
        ("burrowed", unit.burrowed),
        ("hallucination", unit.hallucination),
        ("without power", unit.unpowered),
    )
    fields += [word for word, is_so in states if is_so]
    if unit.buffs:
        fields.append(f"effects {', '.join(unit.buffs)}")
    return "".join(f" | {field}" for field in fields)


def _order(order: OrderView) -> str:
    target = f" {order.target}" if order.target else ""
    place = f" minimap {point(order.minimap)}" if order.minimap else ""
    return f"{order.name}{target}{place}" + (f" {percent(order.progress)}" if order.progress is not None else "")


def _resource_lines(resources: Sequence[UnitView]) -> Iterator[str]:
    by_type: dict[str, list[str]] = {}
    for unit in resources:
        left = f" with {unit.contents}" if unit.contents else ""
        by_type.setdefault(unit.type, []).append(f"{unit.tag} {point(unit.screen)}{left}")
    yield from (f"{name}: {', '.join(found)}" for name, found in by_type.items())


# --- events ---------------------------------------------------------------------------------------------------

_VERBS = {
    "hurt": "was hit",
    "healed": "recovered",
    "died": "died",
    "joined": "joined the team",
    "appeared": "came into sight",
    "disappeared": "went out of sight",
}
_PLACES = {what: place for place, what in enumerate(_VERBS)}
_SIGNS = {"hurt": " -", "healed": " +"}


def _by_kind(events: Sequence[Event]) -> Iterator[tuple[str, list[Event]]]:
    """What happened to which type, and the events, in the order of the verbs."""
    groups: dict[tuple[int, str, str], list[Event]] = {}
    for event in events:
        groups.setdefault((_PLACES[event.what], event.alliance, event.type), []).append(event)
    for (_, alliance, name), members in sorted(groups.items()):
        yield f"{alliance} {name} {_VERBS[members[0].what]}", members


def _tagged_events(events: Sequence[Event]) -> Iterator[str]:
    """One line for all units of a type to which the same happened."""
    for what, members in _by_kind(events):
        sign = _SIGNS.get(members[0].what, "")
        yield f"{what}: " + ", ".join([e.tag + (f"{sign}{whole(e.amount)}" if e.amount else "") for e in members])


def _no_events(events: Sequence[Event]) -> Iterable[str]:  # noqa: ARG001  # a form of telling events
    return ()


def _counted_events(events: Sequence[Event]) -> Iterator[str]:
    """The same without tags."""
    yield from (f"{what}: {len(members)}" for what, members in _by_kind(events))
