"""The pages of the text actions, and of every one of PySC2's functions with the actions for it."""

from __future__ import annotations

import re
from itertools import groupby, takewhile
from typing import TYPE_CHECKING

from docs.pages.markdown import code, codes, head, join, table
from khala_bridge.catalogue.catalogue import GROUPS, catalogue, example
from khala_bridge.catalogue.coverage import coverage
from khala_bridge.catalogue.generated import GROUP

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.catalogue.catalogue import Action
    from khala_bridge.catalogue.coverage import Coverage

RACES = {None: "Every race", "protoss": "Protoss", "terran": "Terran", "zerg": "Zerg"}
SHOWN = 6
"""Number of unit types that are listed one by one."""
SUBJECTS = {"team": "", "unit": "one unit", "two_units": "two units", "side": "the side's "}


def actions() -> str:
    """Return the catalogue of text actions."""
    written = [action for action in catalogue().values() if action.group != GROUP]
    made = [action for action in catalogue().values() if action.group == GROUP]
    return join(
        head("Actions", "`bridge/khala_bridge/data/actions` and `bridge/khala_bridge/catalogue/generated.py`"),
        f"What an agent may say between `<` and `>`: {len(written)} actions with words of their own, and {len(made)} "
        "that follow from PySC2's functions. A task lists the ones that each of its unit types has, one by one or in "
        "groups: `group:skill`, for the actions of a side `group:train/protoss`. `khala actions` shows the same on the "
        "terminal. How calls are read: [the text language](text-language.md). Which function of PySC2 is reached by "
        "what: [functions](functions.md).",
        _legend(),
        _overview(),
        *(_group(name, about, written) for name, about in GROUPS.items() if name != GROUP),
        _generated(made),
    )


def functions() -> str:
    """Return every function of PySC2 and how it is reached."""
    rows = coverage()
    reached = [row for row in rows if row.actions]
    interface = [row for row in rows if row.function.kind == "interface"]
    gone = [row for row in rows if not row.actions and row.function.kind != "interface"]
    kinds = sorted({row.function.kind for row in rows})
    counts = [_counts(kind, [row for row in rows if row.function.kind == kind]) for kind in kinds]
    return join(
        head("Functions", "`khala_bridge.catalogue.coverage`"),
        f"PySC2 has {len(rows)} functions. {len(reached)} can be reached in words. {len(interface)} are those of its "
        f"interface, {len(gone)} belong to what version 4.10 of the game does not have; both are listed first, each "
        "with the reason. `khala actions --function NAME` shows one.",
        table(("kind", "functions", "reached in words", "not"), [*counts, _counts("all", list(rows))]),
        "## Not reached",
        table(("id", "function", "why"), [(r.function.id, code(r.function.name), r.reason) for r in rows if r.reason]),
        "## Reached",
        "Actions for one unit alone, `Select_Unit_…`, are only counted. Of a *general* function, such as "
        "`Effect_Stim_quick`, the special ones, such as `Effect_Stim_Marine_quick`, are cases for one type of unit.",
        table(("id", "function", "a case of", "text actions", "for one unit"), map(_reached, reached)),
    )


def _legend() -> str:
    return (
        "* `tag` is a unit's tag as the observation gives it, `screen` a point `[x, y]` of the team's screen, "
        "`minimap` a point of the whole map.\n"
        "* *Who*: unit types of the team; *one unit*: the first tag says which; *the side's*: units of the whole side, "
        "which the host chooses.\n"
        "* *Function* is PySC2's, in which both executors end.\n"
        "* *At once* ones do not wait for the orders that the unit was given earlier in the same reply.\n"
        "* Every action of a team has a form for one of its units: `Select_Unit_<name>` with the unit's tag "
        "before the other arguments, "
        f"{code(example(catalogue()['Select_Unit_Attack_Minimap']))}. Training and research can be given to one "
        "structure in the same way. Only those with names or words of their own are listed."
    )


def _overview() -> str:
    rows = [
        (
            f"[{code(name)}](#{name})",
            *(sum(a.group == name and a.race == race for a in catalogue().values()) for race in RACES),
            sum(a.group == name for a in catalogue().values()),
        )
        for name in GROUPS
    ]
    return table(("group", *RACES.values(), "all"), rows)


def _group(name: str, about: str, written: list[Action]) -> str:
    members = [action for action in written if action.group == name]
    parts = [(race, [action for action in members if action.race == race]) for race in RACES]
    shown = [part for part in parts if part[1]]
    blocks = [block for race, part in shown for block in (f"### {RACES[race]}" if len(shown) > 1 else "", _table(part))]
    return join(f"## {name}", about, *blocks)


def _table(members: Iterable[Action]) -> str:
    header = ("action", "meaning", "who", "target", "function", "at once", "also known as")
    return table(header, [_row(action) for action in members])


def _row(action: Action) -> tuple[object, ...]:
    return (
        code(action.form),
        action.about,
        _who(action),
        {"enemy": "an enemy", "own": "an own unit", None: ""}[action.target],
        code(action.function) if action.function else "",
        "yes" if action.function and action.subject != "side" and not action.queue else "",
        codes(action.aliases),
    )


def _who(action: Action) -> str:
    more = len(action.units) - SHOWN
    units = ", ".join(action.units[:SHOWN]) + (f" and {more} more" if more > 0 else "")
    subject = SUBJECTS[action.subject]
    return f"{subject}: {units}" if action.actor_count and units else f"{subject}{units}"


def _generated(made: list[Action]) -> str:
    """Return a line for each function, since the actions of one function differ only in how the target is given."""
    whole = [action for action in made if action.subject != "unit"]
    rows = [
        (codes(f"{a.name}({', '.join(a.args)})" for a in group), _who(group[0]), _in_common(group))
        for _, members in groupby(whole, key=_stem)
        for group in [list(members)]
    ]
    single = len(made) - len(whole)
    return join(
        f"## {GROUP}",
        f"One for every function and target that none of the actions above stands for ({len(whole)}), and {single} "
        "forms for one unit, which are not listed here. The names are PySC2's, ended by what is given: a point of the "
        "screen or of the map, a unit, or nothing; `_Autocast` switches on and off what units do by themselves. "
        "Research is ordered for the side, all else for a team.",
        table(("actions", "who", "meaning"), rows),
    )


def _in_common(actions: list[Action]) -> str:
    """Return the sentences that the descriptions of several actions begin with."""
    sentences = [re.split(r"(?<=[.;]) ", action.about) for action in actions]
    shared = takewhile(lambda each: len(set(each)) == 1, zip(*sentences, strict=False))
    return " ".join(each[0] for each in shared) or actions[0].about


def _stem(action: Action) -> str:
    return action.pysc2.stem if action.pysc2 else action.name


def _counts(name: str, rows: list[Coverage]) -> tuple[object, ...]:
    reached = sum(bool(row.actions) for row in rows)
    return name, len(rows), reached, len(rows) - reached or ""


def _reached(row: Coverage) -> tuple[object, ...]:
    whole = [name for name in row.actions if catalogue()[name].actor_count == 0]
    general = [each.function.stem for each in coverage() if each.function.ability_id == row.function.general_id]
    return (
        row.function.id,
        code(row.function.name),
        code(general[0]) if row.function.general_id and general else "",
        codes(whole),
        len(row.actions) - len(whole) or "",
    )
