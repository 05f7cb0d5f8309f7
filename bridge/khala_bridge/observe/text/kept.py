"""Sections about what stays from step to step: the agent's notes, and its standing orders."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.observe.text.page import section
from khala_bridge.observe.text.words import INDENT, minutes, one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import StandingView


@section("notes")
def notes(page: Page) -> Iterator[str]:
    """Show the agent's notes to itself, with their numbers and times."""
    if page.view.notes:
        yield "Your notes"
    yield from (f"{INDENT}{note.number}: ({minutes(note.time_s)}) {one_line(note.text)}" for note in page.view.notes)


@section("standing")
def standing(page: Page) -> Iterator[str]:
    """Show the standing orders in force, what they wait for, and those that have ended."""
    if page.view.standing:
        yield "Standing orders"
    yield from (f"{INDENT}{order.number}: {order.order}: {_state(order)}" for order in page.view.standing)


def _state(order: StandingView) -> str:
    done = f"carried out {order.times} time{'' if order.times == 1 else 's'}"
    if order.ended:
        return f"{done}; over: {one_line(order.ended)}"
    return f"{done}; waits: {one_line(order.waits_for)}" if order.waits_for else done
