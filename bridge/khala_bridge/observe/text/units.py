"""Sections about the agent's teams: the units on their screens and the events there.

Unit lines are fields between bars, so that programs can read them as well (the scripted players do):

    Zealot | tag 0x100140001 | screen [17.5, 12] | distance 5.4 | health 100/100 | shield 12/50

A unit is told one by one if an order may name it or its state matters: own units and enemies, the `MOST` that matter
first of many, and friends at whom an action can aim. All others are told by type and place. What a page has said of an
enemy or of an event, it does not say again under another team.
"""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING

from khala_bridge.knowledge import is_structure
from khala_bridge.observe.landmarks import at_work
from khala_bridge.observe.text.page import section, shorter
from khala_bridge.observe.text.words import INDENT, INDENT2, n, percent, point, tenth, whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import ActionSpec, EffectView, Event, OrderView, Point, TeamView, UnitDetails, UnitView

MOST = 12
"""Units of a list that are told one by one: of the team's own the weakest, of enemies the nearest. Pages with more than
two teams have as many of all their teams as of two."""
MOST_PLACES = 8
"""Units of a type whose places are told; the middle is told of more."""
NEAR = 9.0
"""World units from the middle of a team within which a shorter page lists enemies one by one; beyond the range of all
weapons but siege weapons."""
FEW, FEWEST = 6, 3
"""Number of enemies that still shorter pages list one by one, the nearest ones."""


@section("teams", parts=("resources",))
def teams(page: Page) -> list[str]:
    """Show one block per team: its place, the units there, and events."""
    return _blocks(page, lambda team: _nearest(team, _most(page)), _tagged_events)


@shorter("teams", rank=10, says="enemies far from a team are grouped by type")
def near_units(page: Page) -> list[str]:
    """Show the blocks with far enemies only by type."""
    return _blocks(page, lambda team: _within(_nearest(team, _most(page)), NEAR), _tagged_events)


@shorter("teams", rank=60, says="only the nearest enemies are told one by one, events and other units by type")
def few_units(page: Page) -> list[str]:
    """Show the blocks with a few enemies, and events without tags."""
    return _blocks(page, lambda team: _nearest(team, FEW), _counted_events)


@shorter("teams", rank=110, says="only the nearest enemies are told one by one, other units by type, no events")
def fewest_units(page: Page) -> list[str]:
    """Show the blocks with a handful of enemies, and no events."""
    return _blocks(page, lambda team: _nearest(team, FEWEST), _no_events)


def _blocks(
    page: Page,
    enemies: Callable[[TeamView], list[UnitView]],
    events: Callable[[Page, Sequence[Event]], list[str]],
) -> list[str]:
    size = page.task.frames.screen
    lines: list[str] = []  # lists, since a dozen agents have some thousand lines in each step
    told: set[str] = set()
    news = _news(page)
    for team in page.teams:
        if team.minimap is None:
            continue
        lines += ["", f"Team {team.name}"] if lines else [f"Team {team.name}"]
        lines.append(f"{INDENT}Minimap position: {point(team.minimap)}")
        if team.bounds != (0.0, 0.0, size, size):
            x0, y0, x1, y1 = map(n, team.bounds)
            lines.append(f"{INDENT}Screen on the map: x {x0} to {x1}, y {y0} to {y1}")
        near = enemies(team)
        lines += _under_heading("Your units:", _own_lines(page, team))
        lines += _allies(page, team)
        lines += _under_heading("Enemy units:", _lines(page, [unit for unit in near if unit.tag not in told]))
        lines += _under_heading(_AGAIN, _places_again([unit for unit in near if unit.tag in told]))
        lines += _under_heading("Other enemy units by type:", _group_lines(_without(team.enemies, near)))
        lines += _under_heading("Effects on the ground:", _effect_lines(team.effects))
        lines += _under_heading("Resources on the screen:", _resource_lines(team.resources))
        lines += _under_heading("Since the last observation:", events(page, news[team.name]))
        told |= {unit.tag for unit in near}
    return lines


def _under_heading(heading: str, lines: list[str]) -> list[str]:
    """Return a heading with indented lines below it; nothing without lines."""
    return [f"{INDENT}{heading}", *lines] if lines else lines


# --- units ----------------------------------------------------------------------------------------------------


def _allies(page: Page, team: TeamView) -> list[str]:
    """Return friends at whom the team can aim one by one, and the others by type; builders get all structures."""
    if page.observation.agent.kind == "builder":
        named = [unit for unit in team.allies if is_structure(unit.type)]
    else:
        named = list(team.allies[:MOST]) if any(map(_aims_at_friends, team.actions)) else []
    return [
        *_under_heading("Allied units:", _lines(page, named)),
        *_under_heading("Allied units by type:", _group_lines(_without(team.allies, named))),
    ]


def _aims_at_friends(action: ActionSpec) -> bool:
    return action.args.count("tag") > action.actors and action.target != "enemy"


def _without(units: Sequence[UnitView], told: Sequence[UnitView]) -> list[UnitView]:
    tags = {unit.tag for unit in told}
    return [unit for unit in units if unit.tag not in tags]


def _most(page: Page) -> int:
    return max(FEWEST, min(MOST, 2 * MOST // max(1, len(page.teams))))


def _within(units: Sequence[UnitView], distance: float) -> list[UnitView]:
    return [unit for unit in units if unit.distance is not None and unit.distance <= distance]


def _nearest(team: TeamView, count: int) -> list[UnitView]:
    """Return the nearest enemies, in the order of the full list."""
    nearest = sorted(team.enemies, key=lambda unit: (unit.distance or 0.0, unit.tag))[:count]
    return _among(team.enemies, nearest)


def _weakest(team: TeamView, count: int) -> list[UnitView]:
    """Return the own units with the smallest share of their health and shield, in the order of the full list."""
    return _among(team.units, sorted(team.units, key=lambda unit: (_share([unit]), unit.tag))[:count])


def _among(units: Sequence[UnitView], chosen: Sequence[UnitView]) -> list[UnitView]:
    tags = {unit.tag for unit in chosen}
    return [unit for unit in units if unit.tag in tags]


def _share(units: Sequence[UnitView]) -> float:
    """Return how much of their health and shield units have together, 0 to 1."""
    full = sum(unit.health_max + unit.shield_max for unit in units)
    return sum(unit.health + unit.shield for unit in units) / full if full else 1.0


_CARRYING = "Carry"
"""Beginning of the names of the effects by which workers look loaded."""


def _group_lines(units: Sequence[UnitView]) -> list[str]:
    """Return the number of units of each type, where they are, and how much is left of them."""
    by_type: dict[str, list[UnitView]] = {}
    for unit in units:
        by_type.setdefault(unit.type, []).append(unit)
    return [_group_line(name, group) for name, group in by_type.items()]


def _group_line(name: str, group: Sequence[UnitView]) -> str:
    if len(group) <= MOST_PLACES:
        where = f"at {', '.join(point(unit.screen) for unit in group)}"
    else:
        x, y = (round(sum(unit.screen[axis] for unit in group) / len(group), 1) for axis in (0, 1))
        where = f"around {point((x, y))}"
    distances = [unit.distance for unit in group if unit.distance is not None]
    away = f" | the nearest {tenth(min(distances))} away" if distances else ""
    share = _share(group)
    left = f" | {percent(share)} of health and shield" if share < 1 else ""
    unfinished = sum(unit.build_progress < 1 for unit in group)
    left += f" | {unfinished} unfinished" if unfinished else ""
    buffs = Counter(buff for unit in group for buff in unit.buffs if not buff.startswith(_CARRYING))
    under = f" | effects {', '.join(f'{buff} on {count}' for buff, count in buffs.items())}" if buffs else ""
    return f"{INDENT2}{len(group)} {name} {where}{away}{left}{under}"


def _own_lines(page: Page, team: TeamView) -> list[str]:
    """Return the team's units, with the skills that they can use now, and their places where no screen shows them."""
    size = page.task.frames.screen
    most = _most(page)
    units = _weakest(team, most) if len(team.units) > most else team.units
    lines = _lines(page, units)
    for index, unit in enumerate(units):
        if unit.details is not None:
            lines[index] += _skills(unit.details)
        if not (0 <= unit.screen[0] < size and 0 <= unit.screen[1] < size):
            place = point(unit.screen)
            lines[index] = lines[index].replace(place, f"{place} (off screen)", 1)
    return lines + _group_lines(_without(team.units, units))


_AGAIN = "Enemy units told above, by place on this screen and distance:"


def _places_again(units: Sequence[UnitView]) -> list[str]:
    """Return a line for each type of enemies whose condition another team's block has."""
    by_type: dict[str, list[str]] = {}
    for unit in units:
        by_type.setdefault(unit.type, []).append(f"{unit.tag} {point(unit.screen)} {tenth(unit.distance or 0.0)}")
    return [f"{INDENT2}{name}: {', '.join(told)}" for name, told in by_type.items()]


def _lines(page: Page, units: Sequence[UnitView]) -> list[str]:
    conditions = page.conditions
    lines = []
    for unit in units:
        tag = unit.tag
        condition = conditions.get(tag)
        if condition is None:
            condition = conditions[tag] = _condition(unit)
        x, y = unit.screen
        distance = unit.distance
        far = "" if distance is None else f" | distance {tenth(distance)}"
        lines.append(f"{INDENT2}{unit.type} | tag {tag} | screen [{n(x)}, {n(y)}]{far}{condition}")
    return lines


def _condition(unit: UnitView) -> str:
    """Return the condition of a unit; the same for every team that sees it."""
    fields = [f"health {whole(unit.health)}/{whole(unit.health_max)}"]
    if unit.shield_max:
        fields.append(f"shield {whole(unit.shield)}/{whole(unit.shield_max)}")
    if unit.energy_max:
        fields.append(f"energy {int(unit.energy)}/{whole(unit.energy_max)}")
    if unit.build_progress < 1:
        fields.append(f"built {percent(unit.build_progress)}")
    if unit.weapon_cooldown_s:
        fields.append(f"weapon in {n(unit.weapon_cooldown_s)} s")
    if unit.orders:
        fields.append(f"order {orders(unit.orders)}")
    fields += [word for word, is_so in (("cloaked", unit.cloaked), ("hallucination", unit.hallucination)) if is_so]
    if unit.details is not None:
        fields += _details(unit.details)
    if unit.buffs:
        fields.append(f"effects {', '.join(unit.buffs)}")
    if unit.details is not None and unit.details.left_s is not None:
        fields.append(f"{tenth(unit.details.left_s)} s left")
    return "".join(f" | {field}" for field in fields)


def _details(details: UnitDetails) -> Iterator[str]:
    if details.cargo_max:
        yield f"carries {', '.join(details.passengers) or 'nobody'}, room for {details.cargo_max} in all"
    if details.harvesters is not None:
        yield f"workers {details.harvesters[0]} of {details.harvesters[1]}"
    if details.burrowed:
        yield "burrowed"
    if details.unpowered:
        yield "without power"


def _skills(details: UnitDetails) -> str:
    """Return the skills that a unit can use now; not part of its condition, since they differ between agents."""
    ready = f" | ready {', '.join(details.ready)}" if details.ready else ""
    waits = [f"{name} ({tenth(left_s)} s)" if left_s else name for name, left_s in details.unready.items()]
    return ready + (f" | not ready {', '.join(waits)}" if waits else "")


def orders(queue: Sequence[OrderView]) -> str:
    """Return the orders of a unit: `Train_Marine 83%, then 4 Train_Marine`; a Reactor has two at work."""
    if not queue:
        return ""
    working, waiting = at_work(queue)
    later = [(words, len(list(same))) for words, same in groupby(map(_order, waiting))]
    begun = " and ".join(map(_order, working))
    return ", then ".join([begun, *(f"{count} {words}" if count > 1 else words for words, count in later)])


def _order(order: OrderView) -> str:
    target = f" {order.target}" if order.target else ""
    place = f" minimap {point(order.minimap)}" if order.minimap else ""
    return f"{order.name}{target}{place}" + (f" {percent(order.progress)}" if order.progress is not None else "")


def _effect_lines(effects: Sequence[EffectView]) -> list[str]:
    """Return a line for all effects of a kind."""
    lines = []
    for (alliance, name, radius), alike in groupby(effects, lambda e: (e.alliance, e.name, e.radius)):
        places = ", ".join(_place_of(effect, place) for effect in alike for place in effect.screen)
        wide = f", radius {n(radius)}" if radius else ""
        lines.append(f"{INDENT2}{alliance} {name} at {places}{wide}{_MEANING.get(name, '')}")
    return lines


def _place_of(effect: EffectView, place: Point) -> str:
    return point(place) if effect.left_s is None else f"{point(place)} ({tenth(effect.left_s)} s left)"


_MEANING = {"ForceField": ": of ground units, only massive ones pass"}
"""What no other part of a page says of an effect."""


def _resource_lines(resources: Sequence[UnitView]) -> list[str]:
    by_type: dict[str, list[str]] = {}
    for unit in resources:
        left = f" with {unit.details.contents}" if unit.details and unit.details.contents else ""
        by_type.setdefault(unit.type, []).append(f"{unit.tag} {point(unit.screen)}{left}")
    return [f"{INDENT2}{name}: {', '.join(found)}" for name, found in by_type.items()]


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


def _by_kind(events: Sequence[Event]) -> list[tuple[str, list[Event]]]:
    """Return events by verb and type, in the order of the verbs."""
    groups: dict[tuple[str, str, str], list[Event]] = {}
    for event in events:
        key = event.what, event.alliance, event.type
        if key in groups:
            groups[key].append(event)
        else:
            groups[key] = [event]
    order = sorted(groups, key=lambda key: (_PLACES[key[0]], key[1:]))
    return [(f"{key[1]} {key[2]} {_VERBS[key[0]]}", groups[key]) for key in order]


def _news(page: Page) -> dict[str, list[Event]]:
    """Return what is to be told under each team: of its own units all, of others what no team before it has told."""
    own = {unit.tag for team in page.teams for unit in team.units}
    told: set[tuple[str, str]] = set()
    news: dict[str, list[Event]] = {}
    for team in page.teams:
        events = [
            event
            for event in team.events
            if event.alliance == "own" or (event.tag not in own and (event.what, event.tag) not in told)
        ]
        told |= {(event.what, event.tag) for event in events}
        news[team.name] = events
    return news


def _tagged_events(page: Page, events: Sequence[Event]) -> list[str]:
    """Return one line for all units of a type with the same event; own units by their tags, others counted."""
    words = page.conditions
    lines = []
    for what, members in _by_kind(events):
        sign = _SIGNS.get(members[0].what)
        if members[0].alliance != "own":
            amount = sum(event.amount or 0.0 for event in members)
            lines.append(f"{INDENT2}{what}: {len(members)}" + (f",{sign}{whole(amount)} in all" if sign else ""))
            continue
        if sign is None:
            said = [event.tag for event in members]
        else:
            said = [words.get(sign + event.tag) or _amount(words, sign, event) for event in members]
        lines.append(f"{INDENT2}{what}: {', '.join(said)}")
    return lines


def _amount(words: dict[str, str], sign: str, event: Event) -> str:
    """Return a tag and what it lost or regained; cached, since several teams report it."""
    said = words[sign + event.tag] = f"{event.tag}{sign}{whole(event.amount or 0.0)}"
    return said


def _counted_events(page: Page, events: Sequence[Event]) -> list[str]:  # noqa: ARG001  # a form of telling events
    """Return the line without tags."""
    return [f"{INDENT2}{what}: {len(members)}" for what, members in _by_kind(events)]


def _no_events(page: Page, events: Sequence[Event]) -> list[str]:  # noqa: ARG001  # a form of telling events
    return []
