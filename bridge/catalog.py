"""The catalogue of text actions: those that were written by hand, and those that follow from PySC2's functions.

The files of `bridge/data/actions/` hold the actions of the paper and others that deserve words of their own;
`bridge.generated` makes one of every function that none of them stands for, and the forms for a single unit. The
whole is checked while it is loaded. It does not import PySC2: that PySC2 has every function that is named here is
checked where a game starts.
"""

from __future__ import annotations

import functools
import hashlib
from typing import TYPE_CHECKING

from pydantic import ValidationError

from bridge import data
from bridge.action import GROUP_SELECTOR, Action, ArgKind
from bridge.errors import CatalogueError
from bridge.functions import functions
from bridge.generated import generated

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["Action", "ArgKind", "alias_of", "catalogue", "catalogue_sha256", "chosen", "curated"]

DIRECTORY = "actions"
_TARGETS: dict[str, frozenset[ArgKind | None]] = {
    "quick": frozenset({None}),
    "autocast": frozenset({None}),
    "screen": frozenset({"tag", "screen", "minimap"}),
    "minimap": frozenset({"minimap"}),
    "interface": frozenset({None}),
}
"""What the target of an action may be, by the kind of the function that it ends in."""


@functools.cache
def catalogue() -> dict[str, Action]:
    """Every text action by name: the files in the order of their names, then what follows from them.

    Raises:
        CatalogueError: an entry contradicts another one or PySC2's functions.
    """
    written = curated()
    found = dict(written)
    for action in generated(written):
        _check(action, found, "made by rule")
        found[action.name] = action
    return found


@functools.cache
def curated() -> dict[str, Action]:
    """The actions of the files, by name.

    Raises:
        CatalogueError: an entry contradicts another one or PySC2's functions.
    """
    found: dict[str, Action] = {}
    for file in _files():
        for action in _read(file):
            _check(action, found, file)
            found[action.name] = action
    return found


def _read(file: str) -> Iterable[Action]:
    """The actions of a file: each has the fields that stand under `common`, and its own."""
    page = data.document(file)
    for name, fields in page["actions"].items():
        try:
            yield Action.model_validate({**page["common"], **fields, "name": name})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            place = ".".join(map(str, first["loc"]))
            raise CatalogueError(f"text action {name} ({file}): {place}: {first['msg']}") from None


@functools.cache
def _by_any_name() -> dict[str, Action]:
    names = {action.name.casefold(): action for action in catalogue().values()}
    aliases = {alias.casefold(): action for action in catalogue().values() for alias in action.aliases}
    return aliases | names


def alias_of(name: str) -> Action | None:
    """The action of this name or alias, in any case of letters; None if there is none."""
    return _by_any_name().get(name.casefold())


def chosen(names: Iterable[str], unit_type: str | None = None) -> tuple[str, ...]:
    """Names of actions, with each `group:<name>` replaced by the actions of that group, each once.

    Args:
        names: names of actions and groups.
        unit_type: of a group only what units of this type have, and no more than they are told one by one; None for
            the actions of a side.

    Raises:
        ValueError: there is no such group.
    """
    found: dict[str, None] = {}
    for name in names:
        if name.startswith(GROUP_SELECTOR):
            found |= dict.fromkeys(_of_group(name.removeprefix(GROUP_SELECTOR), unit_type))
        else:
            found[name] = None
    return tuple(found)


def _of_group(group: str, unit_type: str | None) -> list[str]:
    members = [action for action in catalogue().values() if action.group == group]
    if not members:
        groups = ", ".join(dict.fromkeys(action.group for action in catalogue().values()))
        raise ValueError(f"there is no group of actions '{group}', there are {groups}")
    if unit_type is None:
        return [action.name for action in members if action.subject == "side"]
    return [action.name for action in members if action.subject != "side" and action.fits(unit_type)]


def catalogue_sha256() -> str:
    """Hash of the whole catalogue, for the run card."""
    digest = hashlib.sha256()
    for action in catalogue().values():
        digest.update(action.model_dump_json().encode())
    return digest.hexdigest()


def _files() -> list[str]:
    return [f"{DIRECTORY}/{file.name}" for file in sorted(data.path(DIRECTORY).glob("*.yaml"))]


def _check(action: Action, others: dict[str, Action], source: str) -> None:
    """Raises `CatalogueError` if an action cannot be what it says."""
    if fault := _fault(action, others):
        raise CatalogueError(f"text action {action.name} ({source}): {fault}")


def _fault(action: Action, others: dict[str, Action]) -> str | None:
    function = action.function and functions().get(action.function)
    named = action.args[: action.named]
    faults = {
        "there are two of this name": action.name in others,
        f"one of its aliases is the name of another one: {action.aliases}": any(a in others for a in action.aliases),
        f"it names {action.named} unit(s) first, which are tags": named != ("tag",) * action.named,
        f"it has more than one target: {action.args}": len(action.args) > action.named + 1,
        f"PySC2 has no function {action.function}": action.function is not None and not function,
        f"{action.function} takes no {action.target_kind or 'order without a target'}": (
            action.rule is None and function and action.target_kind not in _TARGETS[function.kind]
        ),
    }
    return next((fault for fault, is_so in faults.items() if is_so), None)
