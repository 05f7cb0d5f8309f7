"""Sections about actions: valid ones with their costs, those that are not possible now, and their arguments."""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.observe.text.page import section, shorter
from khala_bridge.observe.text.words import INDENT, INDENT2, n, point, under_heading

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import ActionCost, TeamView, UnavailableAction


MOST_TAGS = 12
"""Tags that are listed for an action at most; the first ones."""


@section("valid_actions")
def valid_actions(page: Page) -> Iterator[str]:
    """Show the valid actions of each team, and their costs; the briefing says what each does."""
    yield from _calls(page)
    yield from under_heading("What they cost:", (f"{offer.action}: {_price(offer)}" for offer in _offers(page)))


def _calls(page: Page) -> Iterator[str]:
    if page.teams:
        yield "Valid actions"
    for team in page.teams:
        calls = ", ".join([action.form for action in team.actions])
        yield f"{INDENT}Team {team.name}: {calls or 'none'}"
    for team in page.teams:
        if team.arguments:
            yield f"{INDENT}What will do for team {team.name}:"
        yield from (f"{INDENT2}{', '.join(names)}: {words}" for words, names in _will_do(team).items())


def _will_do(team: TeamView) -> dict[str, list[str]]:
    """Return actions by the arguments that will do."""
    found: dict[str, list[str]] = {}
    for argument in team.arguments:
        parts = [f"unit {' or '.join(argument.units)}"] if argument.units else []
        parts += [f"tag {_first(argument.tags)}"] if argument.tags else []
        parts += [f"a place such as {' or '.join(map(point, argument.points))}"] if argument.points else []
        found.setdefault("; ".join(parts), []).append(argument.action)
    return found


def _first(tags: Sequence[str]) -> str:
    """Return the first of many tags, and how many there are beside them."""
    more = len(tags) - MOST_TAGS
    return " or ".join(tags[:MOST_TAGS]) + (f" or {more} other{'s' if more > 1 else ''}" if more > 0 else "")


def _offers(page: Page) -> Iterable[ActionCost]:
    return {offer.action: offer for team in page.teams for offer in team.offers}.values()


def _price(offer: ActionCost) -> str:
    parts = [f"{offer.minerals} minerals"] if offer.minerals else []
    parts += [f"{offer.vespene} vespene"] if offer.vespene else []
    parts += [f"{n(offer.supply)} supply"] if offer.supply else []
    parts += [f"{n(offer.time_s)} s"] if offer.time_s else []
    more = [f"enough for {offer.times}"] if offer.times > 1 else []
    more += [f"takes {offer.footprint[0]} x {offer.footprint[1]} cells of ground"] if offer.footprint else []
    more += ["you have none yet"] if offer.first else []
    return "; ".join((", ".join(parts), *more))


@section("impossible")
def impossible(page: Page) -> Iterator[str]:
    """Show the actions of each team that are not possible now, by the reason."""
    teams = [team for team in page.teams if team.barred]
    if teams:
        yield "Not possible now"
    for team in teams:
        yield f"{INDENT}Team {team.name}"
        makers = [barred.reason.removeprefix("no ") for barred in team.barred if _lacks_maker(barred)]
        if makers:
            yield f"{INDENT2}no {', '.join(dict.fromkeys(makers))}: all that is made there"
        yield from (f"{INDENT2}{reason}: {_together(names)}" for reason, names in _reasons(team).items())


@shorter("impossible", rank=80, says="what is not possible now, and why")
def nothing_impossible(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Show nothing."""
    yield from ()


def _lacks_maker(barred: UnavailableAction) -> bool:
    """Return whether an action is barred only because nothing stands where its description has it made."""
    way, colon, _ = catalogue()[barred.action].about.partition(": ")
    maker = way.partition(" a free ")[2].replace(" ", "")
    return bool(colon and maker) and barred.reason == f"no {maker}"


def _together(names: Sequence[str]) -> str:
    """Return names with a common beginning together: `Train_(Zealot, Stalker, Adept), Build_Forge`."""
    words: list[str] = []
    for verb, likes in groupby(names, lambda name: name.partition("_")[0]):  # All_Units_Attack is no verb
        alike = list(likes)
        ends = ", ".join(name.removeprefix(f"{verb}_") for name in alike)
        words += [f"{verb}_({ends})"] if len(alike) > 2 and verb not in ("All", "Select") else alike
    return ", ".join(words)


_TOO_FEW = re.compile(r"(\d+) more (\w+) needed")


def _reasons(team: TeamView) -> dict[str, list[str]]:
    """Return actions by the reason against them; those that are only too dear stand together, with the shortage."""
    reasons: dict[str, list[str]] = {}
    for barred in team.barred:
        if _lacks_maker(barred):
            continue
        if too_few := _TOO_FEW.fullmatch(barred.reason):
            reasons.setdefault(f"{too_few[2]} missing", []).append(f"{barred.action} {too_few[1]}")
        else:
            reasons.setdefault(barred.reason, []).append(barred.action)
    return reasons


@section("arguments")
def arguments(page: Page) -> Iterator[str]:
    """Show the scale of the minimap, and where the playable map ends for agents with actions that take its points."""
    yield "Arguments"
    yield f"{INDENT}{_scale(page)}"
    takes_points = any("minimap" in action.args for action in page.observation.agent.specs())
    if takes_points and not page.view.places and (words := _playable(page)):
        yield f"{INDENT}minimap: {words}"


@shorter("arguments", rank=50, says="where the playable map ends")
def no_arguments(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Show nothing."""
    yield from ()


def _scale(page: Page) -> str:
    """Return how the cells of both frames compare, and in which of them lengths are told."""
    screen = CAMERA_WIDTH / page.task.frames.screen
    cell = n(round(page.view.cell / screen, 2))
    unit = "cells of the screen" if screen == 1 else f"units, of which a cell of the screen has {n(screen)}"
    return f"a cell of the minimap is as wide as {cell} of the screen; distances, ranges and speeds are in {unit}"


def _playable(page: Page) -> str:
    """Return the part of the minimap that orders may name, if it is not all of it."""
    x0, y0, x1, y1 = page.view.bounds
    size = page.task.frames.minimap
    if (x0, y0, x1, y1) == (0.0, 0.0, size, size):
        return ""
    return f"the playable map is x {n(x0)} to {n(x1)}, y {n(y0)} to {n(y1)}"
