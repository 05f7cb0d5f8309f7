"""How scripted players write: calls, points, and a reply in the form of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_agents.scripted.reading import Point, TextTeam

MARGIN = 0.5
"""Distance that a point keeps from the edge of a screen, in its cells."""


def call(name: str, *values: str | Point) -> str:
    """Return an action with its arguments, `<Attack_Unit(0x1)>`."""
    return f"<{name}({', '.join(value if isinstance(value, str) else point(value) for value in values)})>"


def point(at: Point) -> str:
    """Return a point, `[12.0, 9.5]`."""
    return f"[{at[0]:.1f}, {at[1]:.1f}]"


def inside(at: Point, team: TextTeam) -> Point:
    """Return the point of a team's screen that is nearest to another one, and on the map."""
    x0, x1, y0, y1 = team.bounds
    return min(max(at[0], x0 + MARGIN), x1 - MARGIN), min(max(at[1], y0 + MARGIN), y1 - MARGIN)


def reply(analysis: str, orders: Mapping[str, Iterable[str]], messages: Iterable[tuple[str, str]] = ()) -> str:
    """Return a whole reply.

    Args:
        analysis: one line.
        orders: calls by team.
        messages: recipient and text.
    """
    lines = [f"Analysis: {analysis}", "Actions:"]
    for team, calls in orders.items():
        lines.append(f"    Team {team}:")
        lines += [f"        {each}" for each in calls]
    said = [f"    <MessageTo({name}, '''{text}''')>" for name, text in messages]
    return "\n".join(lines + (["Communications:", *said] if said else [])) + "\n"
