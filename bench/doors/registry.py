"""Which module has the rows of which doors, so that a row is loaded without the imports of all others.

`python -m bench doors --check` reads this table alone; a test holds it to the rows.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from bench.doors.rows import Row

DOORS: Final[dict[str, tuple[str, ...]]] = {
    "trust": (
        "khala run",
        "khala host",
        "khala agent",
        "khala submit",
        "khala replay",
        "khala fork",
        "khala mcp",
        "khala openenv",
        "khala view",
        "khala dataset export",
        "khala experiment run",
        "khala experiment resume",
        "khala experiment show",
        "khala experiment status",
        "khala experiment index",
        "khala experiment report",
        "khala experiment export",
        "khala experiment compare",
        "khala serve",
    ),
    "money": ("endpoint",),
    "validity": ("khala run", "khala experiment run"),
    "endpoints": (
        "endpoint",
        "model file",
    ),
    "http_doors": (
        "khala openenv",
        "khala mcp",
        "khala view",
        "khala serve --metrics",
        "khala llm",
    ),
    "files": (
        "khala experiment export",
        "khala experiment index",
        "khala run --resume",
        "khala view",
        "khala experiment report",
        "khala experiment",
        "khala dataset export",
        "files",
        "khala replay",
        "recording",
        "khala agent",
        "khala experiment show",
        "khala experiment status",
        "khala arena show",
        "khala experiment compare",
        "khala matches",
        "khala stop",
        "khala watch",
        "khala replay (a name of a file)",
        "khala serve",
    ),
    "worlds": (
        "game: requests",
        "khala sc2 serve",
        "game: maps",
        "khala sc2 install",
        "khala sc2 info",
    ),
    "rest": (
        "khala advise",
        "khala calibrate",
        "khala doctor",
        "khala keys show",
        "khala knowledge write",
        "khala llm",
        "khala router",
        "khala try",
    ),
}
"""By module, in the order in which they are played."""


def load_rows(door: str = "") -> list[Row]:
    """Return the rows whose door begins so; import the modules that have such rows."""
    modules = [name for name, doors in DOORS.items() if any(known.startswith(door) for known in doors)]
    rows = [row for name in modules for row in importlib.import_module(f"bench.doors.{name}").ROWS]
    return [row for row in rows if row.door.startswith(door)]
