"""The catalogue of text actions: those written by hand, and those generated from PySC2's functions.

The files of `bridge/khala_bridge/data/actions/` hold the actions of the paper and others that deserve words of their
own. `khala_bridge.catalogue.generated` adds an action for every other function, and the forms for a single unit.
Loading finds contradictions among actions and with PySC2's functions. It does not import PySC2: the start of a game
checks that PySC2 has every function that is named here.
"""

from __future__ import annotations

import difflib
import functools
import hashlib
import re
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from khala_bridge import data
from khala_bridge.catalogue.action import GROUP_SELECTOR, Action, ArgKind
from khala_bridge.catalogue.fault import fault
from khala_bridge.catalogue.generated import GROUP as GENERATED
from khala_bridge.catalogue.generated import generate
from khala_bridge.errors import CatalogueError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

__all__ = [
    "GROUPS",
    "Action",
    "ArgKind",
    "alias_of",
    "catalogue",
    "catalogue_sha256",
    "chosen",
    "example",
    "read",
    "read_curated",
]

DIRECTORY = "actions"
GROUPS = {
    "basic": "What every unit has.",
    "orders": "Orders of every race that the paper leaves out.",
    "skill": "What units can do apart from moving and fighting.",
    "build": "Standard build: a worker of the team builds at the named place.",
    "easy-build": "Easy build: the host finds the place, and for names without an argument the worker too. "
    "Structures that grow are here as well.",
    "train": "The host chooses a free producer.",
    "research": "The host chooses a free structure.",
    "warp": "Warping in near something; the host chooses the WarpGate and the place.",
    "easy-warp": "Warping in wherever there is room.",
    "chrono": "Chrono Boost.",
    "macro": "Economy: gathering, rally points, larvae, creep, MULEs, scans, supply.",
    "easy-control": "The whole army, and scouts.",
    GENERATED: "Made by rule: for functions of PySC2 that no other action stands for, and for one unit alone.",
}
"""The groups of actions that a task can ask for, in the order in which they are shown, with their contents."""
_KEY = re.compile(r"  (\w+):")
"""Begins an action in a file."""


@functools.cache
def catalogue() -> dict[str, Action]:
    """Return every text action by name: the files in the order of their names, then the generated ones.

    Raises:
        CatalogueError: an entry contradicts another one or PySC2's functions.
    """
    written = read_curated()
    found = dict(written)
    spellings = _Spellings()
    for action in written.values():
        spellings.add(action)
    for action in generate(written):
        if wrong := spellings.add(action) or fault(action):
            raise CatalogueError(f"text action {action.name}, made by rule: {wrong}")
        found[action.name] = action
    return found


@functools.cache
def read_curated() -> dict[str, Action]:
    """Return the actions of the files, by name.

    Raises:
        CatalogueError: an entry contradicts another one or PySC2's functions.
    """
    return read(*sorted(data.path(DIRECTORY).glob("*.yaml")))


def read(*files: Path) -> dict[str, Action]:
    """Return the actions of some files, by name, in their order.

    Raises:
        CatalogueError: an entry is wrong; the text names the file and the line in which the action begins.
    """
    found: dict[str, Action] = {}
    spellings = _Spellings()
    for file in files:
        page = data.document(file)
        lines = _lines(file)
        for name, fields in page["actions"].items():
            place = f"{file.name}:{lines[name][-1]}: text action {name}"
            action = _action(place, {**page.get("common", {}), **fields, "name": name})
            if wrong := _twice(lines[name]) or spellings.add(action) or fault(action):
                raise CatalogueError(f"{place}: {wrong}")
            found[name] = action
    return found


def _action(place: str, fields: dict[str, Any]) -> Action:
    try:
        return Action.model_validate(fields)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise CatalogueError(f"{place}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None


def _lines(file: Path) -> dict[str, list[int]]:
    """Return the numbers of the lines in which actions begin, by name."""
    found: dict[str, list[int]] = {}
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        if match := _KEY.match(line):
            found.setdefault(match[1], []).append(number)
    return found


def _twice(lines: list[int]) -> str | None:
    """Return what is wrong if a name stands in several lines; YAML silently takes the last of several equal keys."""
    return f"it stands in line {lines[0]} as well" if len(lines) > 1 else None


@functools.cache
def _by_any_name() -> dict[str, Action]:
    names = {action.name.casefold(): action for action in catalogue().values()}
    return names | {alias.casefold(): action for action in catalogue().values() for alias in action.aliases}


def alias_of(name: str) -> Action | None:
    """Return the action of this name or alias, in any case of letters; None if there is none."""
    return _by_any_name().get(name.casefold())


def chosen(names: Iterable[str], unit_type: str | None = None) -> tuple[str, ...]:
    """Return the names of actions, with each `group:<name>` replaced by the actions of that group, each once.

    Args:
        names: names of actions and groups; `group:<name>/<race>` takes only those of one race and of every race.
        unit_type: of a group, take only the actions of teams and single units that units of this type have; None to
            take only those of a side.

    Raises:
        ValueError: there is no such group, or a side has actions of several races.
    """
    found: dict[str, None] = {}
    for name in names:
        if name.startswith(GROUP_SELECTOR):
            found |= dict.fromkeys(_of_group(name.removeprefix(GROUP_SELECTOR), unit_type))
        else:
            found[name] = None
    return tuple(found)


def _of_group(selector: str, unit_type: str | None) -> Iterator[str]:
    group, _, race = selector.partition("/")
    members = [action for action in catalogue().values() if action.group == group and race in ("", action.race or race)]
    if not members:
        raise ValueError(
            f"there is no group of actions '{selector}'{_close(group, GROUPS)}, there are {', '.join(GROUPS)}"
        )
    if unit_type is not None:
        return (action.name for action in members if action.subject != "side" and action.fits(unit_type))
    ours = [action for action in members if action.subject == "side"]
    if len(races := sorted({action.race for action in ours if action.race})) > 1:
        raise ValueError(f"group '{group}' has actions of {', '.join(races)}: write group:{group}/{races[0]}")
    return (action.name for action in ours)


def _close(name: str, known: Iterable[str]) -> str:
    found = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean '{found[0]}'?)" if found else ""


def example(action: Action) -> str:
    """Return a call as an agent would write it, with made-up arguments."""
    tags = iter(("0x1002c0001", "0x100340002"))
    points = {"screen": "[15, 9]", "minimap": "[40, 25]"}
    return f"<{action.name}({', '.join(points.get(kind) or next(tags) for kind in action.args)})>"


@functools.cache
def catalogue_sha256() -> str:
    """Return the hash of the whole catalogue, for the run card."""
    digest = hashlib.sha256()
    for action in catalogue().values():
        digest.update(action.model_dump_json().encode())
    return digest.hexdigest()


class _Spellings:
    """Every name and alias so far, in any case of letters."""

    def __init__(self) -> None:
        self._owners: dict[str, str] = {}

    def add(self, action: Action) -> str | None:
        """Add an action's names; return what is wrong if another action has one of them."""
        for name in (action.name, *action.aliases):
            owner = self._owners.setdefault(name.casefold(), action.name)
            if owner != action.name or (name != action.name and name.casefold() == action.name.casefold()):
                return f"the name {name} is already that of {owner}"
        return None
