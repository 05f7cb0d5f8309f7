"""Section about what is known of the types of units in sight; the words are those of `bridge.knowledge`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bridge.knowledge import advice, knowledge, short
from bridge.observe.chronicle import is_structure
from bridge.observe.text.page import section, shorter
from bridge.observe.text.words import INDENT, INDENT2

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bridge.observe.text.page import Page


@section("unit_knowledge")
def unit_knowledge(page: Page) -> Iterator[str]:
    """What is known of every type in sight; uses and abilities only of those under control."""
    mine, others = _types(page)
    among = frozenset(mine | others)
    if among:
        yield "Unit knowledge"
    for name in mine | others:
        heading, *lines = short(name, among)
        yield f"{INDENT}{heading}"
        yield from (f"{INDENT2}{line}" for line in lines)
        if name in mine:
            yield from (f"{INDENT2}{line}" for line in advice(name))


@shorter("unit_knowledge", rank=20, says="weapons and abilities of the types in sight")
def unit_knowledge_in_short(page: Page) -> Iterator[str]:
    """One line a type."""
    mine, others = _types(page)
    among = frozenset(mine | others)
    if among:
        yield "Unit knowledge"
    yield from (f"{INDENT}{short(name, among)[0]}" for name in mine | others)


@shorter("unit_knowledge", rank=30, says="what is known of the types in sight")
def no_unit_knowledge(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Nothing."""
    yield from ()


def _types(page: Page) -> tuple[dict[str, None], dict[str, None]]:
    """Types under control, and the others that are in sight or heard of, in the order of the page.

    Of allied structures nothing needs to be known.
    """
    mine = dict.fromkeys(unit.type for team in page.teams for unit in team.units)
    allies = dict.fromkeys(unit.type for team in page.teams for unit in team.allies)
    others = dict.fromkeys(name for name in allies if not is_structure(name))
    others |= dict.fromkeys(unit.type for team in page.teams for unit in team.enemies)
    others |= dict.fromkeys(name for team in page.view.others for name in team.units)
    if page.view.others and page.view.counts:
        others |= dict.fromkeys(enemy.type for enemy in page.view.counts.enemies)
    return {name: None for name in mine if name in knowledge()}, {n: None for n in others if n in knowledge()}
