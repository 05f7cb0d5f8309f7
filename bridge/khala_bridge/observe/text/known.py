"""Section with knowledge about the types of units in sight, in the words of `khala_bridge.knowledge`."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.knowledge import advice, facts_of, is_structure, is_worker, race_of, short
from khala_bridge.observe.text.page import section, shorter
from khala_bridge.observe.text.words import INDENT, INDENT2

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_bridge.knowledge import DataSet
    from khala_bridge.observe.text.page import Page


@section("unit_knowledge")
def unit_knowledge(page: Page) -> Iterable[str]:
    """Show what is known of every type in sight, and of the army that it leads: most of own types, least of allies."""
    return _written(_types(page), frozenset(page.view.upgrades), facts_of(page.task.map_data).version)


def own_types(names: Iterable[str], data_set: DataSet) -> tuple[str, ...]:
    """Return what is known of each of an agent's own types before any upgrade, for its briefing.

    Pages have the same lines, and those about counters; prompts do not repeat them. `data_set` are the data of the map.
    """
    version = facts_of(data_set).version
    told = ((*short(name, frozenset(), version=version), *advice(name, version=version)) for name in _known(names))
    return tuple(map("\n".join, told))


@functools.lru_cache(1024)
def _written(types: _Types, researched: frozenset[str], version: str) -> tuple[str, ...]:
    """Return the lines about some types; the own side has its upgrades.

    Cached, since types rarely change between steps.
    """
    friends, foes = frozenset((*types.mine, *types.allies)), frozenset(types.enemies)
    lines = ["Unit knowledge"] if any(types) else []
    for name in _all(types):
        own = researched if name in friends else frozenset[str]()
        heading, *more = short(name, _opponents(name, friends, foes), own, version)
        lines.append(f"{INDENT}{heading}")
        if name in types.mine or name in foes:
            lines += [f"{INDENT2}{line}" for line in more]
        if name in types.mine:
            lines += [f"{INDENT2}{line}" for line in advice(name, researched, version)]
    return tuple(lines)


@shorter("unit_knowledge", rank=20, says="weapons and abilities of the types in sight")
def unit_knowledge_in_short(page: Page) -> Iterator[str]:
    """Show one line for each type."""
    types = _types(page)
    version = facts_of(page.task.map_data).version
    if any(types):
        yield "Unit knowledge"
    yield from (f"{INDENT}{short(name, frozenset(), version=version)[0]}" for name in _all(types))


@shorter("unit_knowledge", rank=30, says="what is known of the types in sight")
def no_unit_knowledge(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Show nothing."""
    yield from ()


class _Types(NamedTuple):
    """Names of known types, without duplicates, in the order of the page."""

    mine: tuple[str, ...]
    """Under control."""
    allies: tuple[str, ...]
    """Others of the own side, without its structures."""
    enemies: tuple[str, ...]


def _types(page: Page) -> _Types:
    """Return the types that are in sight or known to the side."""
    view = page.view
    mine = [unit.type for team in page.teams for unit in team.units]
    if view.counts and any(team.minimap is None for team in page.teams):  # it leads the army of the whole side
        is_armed = facts_of(page.task.map_data).is_armed
        mine += [count.type for count in view.counts.units if is_armed(count.type) and not is_worker(count.type)]
    allies = [unit.type for team in page.teams for unit in team.allies]
    enemies = [unit.type for team in page.teams for unit in team.enemies]
    allies += [name for team in view.others for name in team.units]
    if view.others and view.counts:
        enemies += [enemy.type for enemy in view.counts.enemies]
    return _Types(_known(mine), _known(name for name in allies if not is_structure(name)), _known(enemies))


def _known(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for name in dict.fromkeys(names) if race_of(name))


def _all(types: _Types) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*types.mine, *types.allies, *types.enemies)))


def _opponents(name: str, friends: frozenset[str], foes: frozenset[str]) -> frozenset[str]:
    """Return the types to compare a type with: those of the other side; of both sides if both have the type."""
    return (foes if name in friends else frozenset()) | (friends if name in foes else frozenset())
