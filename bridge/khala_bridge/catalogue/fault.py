"""The check of a text action: its arguments, its function in PySC2, its unit types.

Pure and about one action alone; `khala_bridge.catalogue.catalogue`, above it, checks that names are unique.
"""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from khala_bridge.catalogue.functions import functions, raw_forms
from khala_bridge.knowledge import knowledge, upgrades

if TYPE_CHECKING:
    from khala_bridge.catalogue.action import Action, ArgKind

_TARGETS: dict[str, frozenset[ArgKind | None]] = {
    "quick": frozenset({None}),
    "autocast": frozenset({None}),
    "screen": frozenset({"tag", "screen"}),
    "minimap": frozenset({"minimap"}),
    "interface": frozenset({None}),
}
"""Possible targets of an action, by the kind of the function that it ends in."""
_LEFT_OPEN: dict[str, frozenset[ArgKind | None]] = {
    "quick": frozenset({None, "tag"}),
    "screen": frozenset({None, "tag", "screen", "minimap"}),
    "minimap": frozenset({None, "tag", "minimap"}),
}
"""The same for actions with a rule, which finds the target or takes the tag as a unit to work with."""


def fault(action: Action) -> str | None:
    """Return what is wrong with an action, in a sentence; None if nothing is."""
    return _of_subject(action) or _of_types(action) or _of_function(action)


def _of_subject(action: Action) -> str | None:
    if len(action.args) < action.actor_count or set(action.args[: action.actor_count]) - {"tag"}:
        return f"its first {action.actor_count} argument(s) name units, so they are tags, not {list(action.args)}"
    if len(action.args) > action.actor_count + 1:
        return f"it has more than one target: {list(action.args)}"
    if action.target and action.target_kind != "tag":
        return f"only a tag can be {action.target}, and it has none for its target"
    if action.subject == "side" and action.function and not action.rule:
        return "an action of the whole side needs a rule that says who carries it out"
    return None


def _of_types(action: Action) -> str | None:
    for name in action.units:
        if name not in knowledge():
            return f"there is no unit type {name}{_close(name, list(knowledge()))}"
    if action.produces and action.produces not in knowledge() and action.produces not in upgrades():
        return f"there is no unit type or upgrade {action.produces} to produce"
    return None


def _of_function(action: Action) -> str | None:
    if action.function is None:
        return f"it orders nothing, and has arguments: {list(action.args)}" if action.args else None
    function = functions().get(action.function)
    if function is None:
        return f"PySC2 has no function {action.function}{_close(action.function, list(functions()))}"
    given = action.target_kind
    allowed = (_LEFT_OPEN if action.rule else _TARGETS).get(function.kind, frozenset())
    if given not in allowed:
        return f"{function.name} takes no {given}" if given else f"{function.name} takes a target, and it has none"
    if action.rule or given is None or function.kind != "screen":
        return None
    form = "unit" if given == "tag" and action.aim == "unit" else "pt"
    if form not in raw_forms(function.ability_id):
        return f"PySC2's raw interface has no {function.stem}_{form}"
    return None


def _close(name: str, known: list[str]) -> str:
    found = difflib.get_close_matches(name, known, n=1)
    return f", did you mean {found[0]}?" if found else ""
