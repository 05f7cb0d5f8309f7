"""Sections for those who lead a whole side: the map by the names of its places, both armies, the economy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.knowledge import facts_of
from khala_bridge.observe.text.page import section, shorter
from khala_bridge.observe.text.words import INDENT, ago, count_words, minutes, n, point, under_heading

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import Army, ArmyPart, Economy, Place

MOST_COUNTERS = 4
"""Types that are named as good against one of the enemy's."""

# --- the map --------------------------------------------------------------------------------------------------


@section("map", parts=("map",))
def map_(page: Page) -> Iterator[str]:
    """Show the enemy's race, the playable area, and the places by name."""
    view = page.view
    if not view.places:
        return
    yield "Map"
    if view.enemy_race:
        yield f"{INDENT}The enemy's race: {view.enemy_race}"
    x0, y0, x1, y1 = map(n, view.bounds)
    yield f"{INDENT}On the minimap, the playable map is x {x0} to {x1}, y {y0} to {y1}"
    yield from under_heading(_PLACES, map(_place, view.places))


@shorter("map", rank=45, says="ramps and passages of the map")
def bases_alone(page: Page) -> Iterator[str]:
    """Show the bases only."""
    if page.view.places:
        yield "Map"
        yield from under_heading(_PLACES, (_place(place) for place in page.view.places if place.what == "base"))


_PLACES = "Places, numbered by the way from where you began:"


def _place(place: Place) -> str:
    parts = [f"{place.name} at {point(place.minimap)}"]
    if place.what == "base":
        parts.append({"own": "yours", "enemy": "the enemy's", "": "no town hall known"}[place.holder])
    if place.about:
        parts.append(place.about)
    if place.what == "base" and place.holder != "own":
        parts.append(_last_look(place))
    return ", ".join(parts)


def _last_look(place: Place) -> str:
    if place.unseen_s is None:
        return "never seen"
    return "in sight" if not place.unseen_s else f"last seen {ago(place.unseen_s)}"


# --- the armies -----------------------------------------------------------------------------------------------


@section("army", parts=("army",))
def army(page: Page) -> Iterator[str]:
    """Show the own army by place, its scouts, what its last order cost, and the enemy's army as it was last seen."""
    found = page.view.army
    if found is None:
        return
    yield "Armies"
    if found.parts:
        yield from under_heading(f"Yours, worth {found.value} minerals and vespene:", map(_own_part, found.parts))
    else:
        yield f"{INDENT}Yours: none"
    yield from under_heading("Scouts on their way:", map(_own_part, found.scouts))
    yield from _enemies(found)
    yield from _toll(page)


def _own_part(part: ArmyPart) -> str:
    doing = f": {part.doing}" if part.doing else ""
    return f"{_where(part)}: {count_words(part.units)}{doing}"


def _where(part: ArmyPart) -> str:
    return f"at {part.place}, {point(part.minimap)}" if part.place else f"at {point(part.minimap)}"


def _enemies(found: Army) -> Iterator[str]:
    if not found.enemies:
        yield f"{INDENT}The enemy's, seen in the last three minutes: none"
        return
    worth = sum(part.value for part in found.enemies)
    heading = f"The enemy's, seen in the last three minutes, worth {worth}, the nearest to your bases first:"
    yield from under_heading(heading, map(_enemy_part, found.enemies))


def _enemy_part(part: ArmyPart) -> str:
    away = "" if part.away is None else f", the nearest {part.away:.0f} from your nearest base"
    when = f"seen {ago(part.unseen_s)}" if part.unseen_s else "in sight"
    if 0 < part.in_sight < sum(part.units.values()):
        when = f"{part.in_sight} of them in sight"
    return f"{_where(part)}{away}: {count_words(part.units)}, {when}"


def _toll(page: Page) -> Iterator[str]:
    toll = page.view.toll
    if toll is None:
        return
    lost, killed = count_words(toll.lost) or "nothing", count_words(toll.killed) or "nothing"
    yield f"{INDENT}Since your last order, {ago(toll.since_s)}: lost {lost}; killed {killed}"


# --- the economy ----------------------------------------------------------------------------------------------


@section("economy", parts=("economy",))
def economy(page: Page) -> Iterator[str]:
    """Show income and spending, workers, supply to come, energy, and what is good against the enemy's units."""
    found = page.view.economy
    if found is None:
        return
    yield "Economy"
    (minerals, vespene), (spent, gas) = found.income, found.spending
    yield f"{INDENT}Income per minute: {minerals} minerals, {vespene} vespene; spent in the last minute: {spent}, {gas}"
    yield f"{INDENT}{_workers(found)}"
    yield f"{INDENT}{_supply(page, found)}"
    energies = [f"{name} {', '.join(map(str, energy))}" for name, energy in found.casters.items()]
    if energies:
        yield f"{INDENT}Energy: {'; '.join(energies)}"
    yield from under_heading("Against what the enemy was seen to have:", _answers(page))


def _workers(found: Economy) -> str:
    on_minerals, on_vespene, idle = found.gatherers
    room, gas_room = found.room
    parts = [f"{on_minerals} of {room} on minerals", f"{on_vespene} of {gas_room} on vespene"]
    return f"Workers: {', '.join(parts)}" + (f", {idle} idle" if idle else "")


def _supply(page: Page, found: Economy) -> str:
    used = page.view.resources
    coming = f", {n(found.supply_coming)} more under construction" if found.supply_coming else ""
    left = f"Supply left: {n(max(0.0, used.supply_cap - used.supply_used))}{coming}"
    return left + (f"; full in about {minutes(found.full_in_s)} at this pace" if found.full_in_s is not None else "")


def _answers(page: Page) -> Iterator[str]:
    """Yield, for each armed type of the enemy, the own race's types that beat it."""
    counts = page.view.counts
    mine = _trainable(page)
    types = facts_of(page.task.map_data).units
    for enemy in counts.enemies if counts else ():
        known = types.get(enemy.type)
        if known is None or not known.weapons or known.worker or known.structure:
            continue
        good = [name for name in known.countered_by if name in mine][:MOST_COUNTERS]
        if good:
            yield f"{enemy.type}: {', '.join(good)}"


def _trainable(page: Page) -> frozenset[str]:
    """Return the types that the agent's orders train or warp in, now or later."""
    names: Iterable[str] = (name for team in page.observation.teams for name in team.config.actions)
    return frozenset(name.partition("_")[2] for name in names if name.startswith(("Train_", "Warp_", "Morph_")))
