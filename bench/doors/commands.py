"""The doors that must have rows: every command of `khala`, as its own help lists them.

A command that reads nothing that somebody else wrote stands in `WITHOUT_ROWS`, with the reason.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import typer.main

from khala_sc2.cli import app

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

WITHOUT_ROWS: Final[dict[str, str]] = {
    "khala actions": "prints the catalogue that is installed",
    "khala experiment join": "takes an address and a number; matches come over Ray's own connection",
    "khala arena run": "reads files as `khala experiment run` does, and prints as `khala arena show` does",
    "khala arena export": "reads results as `khala arena show` does, and writes pages as `khala view` does",
    "khala tasks": "lists the tasks that are installed",
    "khala experiment list": "lists the experiments that are installed",
    "khala knowledge show": "prints the tables that are installed",
    "khala person": "takes a seat as `khala agent` does, and shows a page as `khala view` does",
    "khala keys init": "writes new keys",
    "khala keys agent": "writes a new key",
    "khala keys adviser": "writes a new key",
    "khala keys observer": "writes a new key",
}


def commands() -> list[str]:
    """Return the commands, `khala experiment show` for one in a group."""
    return sorted(_leaves("khala", typer.main.get_command(app)))


def missing(doors: Iterable[str]) -> list[str]:
    """Return the commands that are none of these doors and have no reason for it, and reasons that no longer hold."""
    doors = set(doors)
    known = commands()
    without = [name for name in known if name not in doors and name not in WITHOUT_ROWS]
    return without + [name for name in WITHOUT_ROWS if name not in known or name in doors]


def _leaves(name: str, command: Any) -> Iterator[str]:
    """Yield the commands below one; typer has a class of click of its own for groups, so nothing names it here."""
    below = getattr(command, "commands", None)
    if below is None:
        yield name
    else:
        for child, of_child in below.items():
            yield from _leaves(f"{name} {child}", of_child)
