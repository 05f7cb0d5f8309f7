"""Sections that every agent has: the game, the task, and how to answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.observe.text.page import section
from khala_bridge.observe.text.words import INDENT, minutes, n, one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import Resources


@section("game")
def game(page: Page) -> Iterator[str]:
    """Show the time, and the resources if the agent spends them."""
    view, used = page.view, page.view.resources
    yield "Game"
    yield f"{INDENT}Time: {minutes(view.time_s)}.{int(10 * view.time_s) % 10}"
    if used.minerals or used.vespene or page.observation.agent.kind != "combat_group":
        yield f"{INDENT}Minerals: {used.minerals}, vespene: {used.vespene}{_promise(used)}"
        yield f"{INDENT}Supply: {n(used.supply_used)} of {n(used.supply_cap)} used"
    if view.upgrades:
        yield f"{INDENT}Upgrades: {', '.join(view.upgrades)}"
    if page.observation.idle_teams:
        yield f"{INDENT}Teams without units: {', '.join(page.observation.idle_teams)}"


def _promise(resources: Resources) -> str:
    amounts = zip(resources.promised, ("minerals", "vespene"), strict=True)
    parts = [f"{amount} {what}" for amount, what in amounts if amount]
    return f" ({' and '.join(parts)} of it for what workers are on their way to build)" if parts else ""


@section("task")
def task(page: Page) -> Iterator[str]:
    """Show the tasks of all, of this agent, and of its teams at this time."""
    yield "Task"
    yield f"{INDENT}{one_line(page.task.task)}"
    if page.observation.agent.task:
        yield f"{INDENT}{one_line(page.observation.agent.task)}"
    always = {team.config.name: team.config.task for team in page.observation.teams}
    yield from (f"{INDENT}Team {name}: {one_line(words)}" for name, words in always.items() if words)
    yield from (f"{INDENT}Team {team.name}: {one_line(team.task)}" for team in page.teams if team.task)


@section("answer")
def answer(page: Page) -> Iterator[str]:
    """Show the limit of actions, one piece of advice, and the signal to begin."""
    parts = ['"Analysis:"']
    yield "Answer"
    if page.teams:
        limit = page.task.max_actions_of(page.observation.agent)
        yield f"{INDENT}At most {limit} action{'s' if limit > 1 else ''} per team."
        parts.append('"Actions:"')
    else:
        yield f"{INDENT}You have no team to order now" + (
            ": write messages to those who have." if _talks(page) else "."
        )
    if _talks(page):
        parts.append('"Communications:"')
    words = " and ".join(part for part in (", ".join(parts[:-1]), parts[-1]) if part)
    yield f"{INDENT}Now answer in the part{'s' if len(parts) > 1 else ''} {words}."


def _talks(page: Page) -> bool:
    return bool(page.correspondents or page.channels)
