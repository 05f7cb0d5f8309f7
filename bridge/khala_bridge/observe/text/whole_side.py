"""Sections about the whole side, for agents that lead or build it: counts, alerts, events, other agents, places."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.observe.text.page import section, shorter
from khala_bridge.observe.text.words import INDENT, INDENT2, ago, count_words, percent, point, under_heading, whole

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import EnemyCount, Landmark, Production, TypeCount


@section("counts", parts=("counts",))
def counts(page: Page) -> Iterator[str]:
    """Show the side's units and production, and the known enemies."""
    found = page.view.counts
    if found is None:
        return
    yield "Unit counts"
    yield from _line("Your units", [_ready(count) for count in found.units if count.ready])
    yield from _line("Your structures", [_ready(count) for count in found.structures if count.ready])
    yield from _line("Under construction", [_under_way(count) for count in found.structures if count.under_way])
    yield from _line("Going to be built by workers on their way", [count_words(found.planned)] if found.planned else [])
    yield from _line("Coming in", [_under_way(count) for count in found.units if count.under_way])
    yield from _line("In production", [_production(made) for made in found.production])
    if found.enemies:
        yield from under_heading("Enemies spotted so far:", map(_enemy, found.enemies))
    else:
        yield f"{INDENT}Enemies spotted so far: none"


def _line(what: str, entries: Sequence[str]) -> Iterator[str]:
    if entries:
        yield f"{INDENT}{what}: {', '.join(entries)}"


def _ready(count: TypeCount) -> str:
    if count.idle is None:
        return f"{count.ready} {count.type}"
    busy = count.ready - count.idle
    state = f"{busy} working, {count.idle} idle" if busy and count.idle else "idle" if count.idle else "working"
    return f"{count.ready} {count.type} ({state})"


def _under_way(count: TypeCount) -> str:
    return f"{len(count.under_way)} {count.type} ({', '.join(map(percent, count.under_way))})"


def _production(made: Production) -> str:
    parts = [f"{len(made.progress)} at {', '.join(map(percent, made.progress))}"] if made.progress else []
    parts += [f"{made.queued} more queued"] if made.queued else []
    return f"{made.order} ({'; '.join(parts)})"


def _enemy(enemy: EnemyCount) -> str:
    alive = enemy.seen - enemy.dead
    where = f"{', one' if alive > 1 else ''} at minimap {point(enemy.minimap)}" if enemy.minimap else ""
    if not alive:
        return f"{enemy.seen} {enemy.type}, dead"
    if enemy.in_sight == alive:
        line = f"{alive} {enemy.type} in sight{where}"
    elif enemy.in_sight:
        line = f"{alive} {enemy.type}, {enemy.in_sight} of them in sight{where}"
    else:
        line = f"{alive} {enemy.type} out of sight, last seen {ago(enemy.unseen_s)}{where}"
    return line + (f"; {enemy.dead} more dead" if enemy.dead else "")


@section("alerts", parts=("alerts",))
def alerts(page: Page) -> Iterator[str]:
    """Show the places where the side loses health or units, and the game's warnings."""
    view = page.view
    if view.alerts or view.warnings:
        yield "Alerts"
    for alert in view.alerts:
        died = f", {alert.died} died" if alert.died else ""
        lost = f", lost {whole(alert.lost)} health and shield" if alert.lost else ""
        yield f"{INDENT}Under attack at minimap {point(alert.minimap)}: {count_words(alert.units)}{lost}{died}"
    yield from (f"{INDENT}{warning}" for warning in view.warnings)


_HAPPENED = {
    ("finished", "own"): "Finished",
    ("researched", "own"): "Researched",
    ("died", "own"): "Lost",
    ("died", "enemy"): "Killed",
    ("appeared", "enemy"): "Seen for the first time",
}


@section("events", parts=("events",))
def events(page: Page) -> Iterator[str]:
    """Show the side's events since the last observation."""
    by_kind: dict[str, dict[str, int]] = {}
    for event in page.view.events:
        of_kind = by_kind.setdefault(_HAPPENED[event.what, event.alliance], {})
        of_kind[event.type] = of_kind.get(event.type, 0) + 1
    if by_kind:
        yield "Since the last observation"
    for what in _HAPPENED.values():
        if what in by_kind:
            names = ", ".join(by_kind[what]) if what == "Researched" else count_words(by_kind[what])
            yield f"{INDENT}{what}: {names}"


@section("others", parts=("others",))
def others(page: Page) -> Iterator[str]:
    """Show the teams of the other agents: their units, places and condition."""
    if page.view.others:
        yield "Teams of other agents"
    agent = ""
    for team in page.view.others:
        if team.agent != agent:
            agent = team.agent
            yield f"{INDENT}{agent}"
        where = f"minimap {point(team.minimap)}"
        yield f"{INDENT2}{team.name}: {count_words(team.units)} at {where}, {percent(team.health)} of health and shield"


@shorter("others", rank=100, says="the single teams of other agents")
def others_in_short(page: Page) -> Iterator[str]:
    """Show one line for each agent."""
    by_agent: dict[str, dict[str, int]] = {}
    for team in page.view.others:
        units = by_agent.setdefault(team.agent, {})
        for name, count in team.units.items():
            units[name] = units.get(name, 0) + count
    yield from ["Teams of other agents"] if by_agent else []
    yield from (f"{INDENT}{agent}: {count_words(units)}" for agent, units in by_agent.items())


# --- landmarks ------------------------------------------------------------------------------------------------


@section("structures", parts=("structures",))
def structures(page: Page) -> Iterator[str]:
    """Show the own structures with their tags and orders, a line for each type."""
    by_type: dict[str, list[str]] = {}
    for mark in _marks(page, "structure"):
        by_type.setdefault(mark.type, []).append(mark.tag + (f" {mark.about}" if mark.about else ""))
    yield from ["Your structures"] if by_type else []
    yield from (f"{INDENT}{name}: {'; '.join(tags)}" for name, tags in by_type.items())


@shorter("structures", rank=70, says="tags of your structures")
def no_structures(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Show nothing."""
    yield from ()


@section("warp", parts=("power",))
def warp(page: Page) -> Iterator[str]:
    """Show the WarpGates, and the places for warping in."""
    gates = page.view.warp_gates
    fields = _marks(page, "power field")
    if gates is None and not fields:
        return
    yield "Warping in"
    if gates is not None:
        ready = "" if gates.ready is None else f", {gates.ready} ready now"
        yield f"{INDENT}WarpGates: {gates.count}{ready}"
    yield from under_heading("Power fields:", map(_place, fields))


@section("places", parts=("places", "power"))
def places(page: Page) -> Iterator[str]:
    """Show free places for a base and free geysers, by the tags that name them, and the power fields."""
    bases, geysers, fields = (_marks(page, what) for what in ("base place", "geyser", "power field"))
    if bases or geysers or fields:
        yield "Places to build at"
    yield from under_heading("Free places for a base, each named by a resource beside it:", map(_place, bases))
    yield from under_heading("Free geysers:", map(_place, geysers))
    yield from under_heading("Power fields, which most structures need:", map(_place, fields))


def _place(mark: Landmark) -> str:
    screen = f", screen {point(mark.screen)}" if mark.screen else ""
    about = f", {mark.about}" if mark.about else ""
    return f"{mark.type} {mark.tag} at minimap {point(mark.minimap)}{screen}{about}"


def _marks(page: Page, what: str) -> list[Landmark]:
    return [mark for mark in page.view.landmarks if mark.what == what]
