"""What agents can say, chosen and printed: the work of `khala actions`, whose options are in `khala_sc2.commands.actions`.

It loads no PySC2. A mistake of the user is raised as a `ConfigError` of one sentence, as in the other
commands; `khala_sc2.cli` prints it.
"""

from __future__ import annotations

import difflib
import itertools
import json
import textwrap
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table
from rich.text import Text

from khala_bridge.catalogue.catalogue import GROUPS, Action, catalogue, example
from khala_bridge.catalogue.coverage import coverage
from khala_bridge.catalogue.functions import functions
from khala_bridge.knowledge import knowledge
from khala_orchestrator.console import stdout_console
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

INDENT = " " * 4
FEW = 20
"""Number of names up to which an error lists all of them."""
MANY = 9
"""Number of unit types that are listed; of more, the first ones."""


def print_actions(
    *,
    race: str | None,
    unit: str | None,
    group: str | None,
    name: str | None,
    function: str | None,
    everything: bool,
    as_json: bool,
) -> None:
    """Print the actions that all of these are true of; without any, the groups."""
    known = sorted(catalogue().values(), key=_place)
    _check(unit, knowledge(), "unit type")
    _check(group, GROUPS, "group")
    wanted = _function(function)
    found = [
        action
        for action in known
        if (race is None or action.race in (None, race))
        and (unit is None or _is_for(action, unit))
        and (group is None or action.group == group)
        and (name is None or any(name.casefold() in each.casefold() for each in (action.name, *action.aliases)))
        and (wanted is None or action.function == wanted)
    ]
    console = stdout_console()
    if as_json:
        typer.echo(json.dumps({"actions": [dict(_fields(action)) for action in found]}))
    elif not (everything or race or unit or group or name or function):
        console.print(_groups(known))
        console.print(f"\n{len(found)} actions; `khala actions --help` tells how to choose among them")
    else:
        for line in _lines(found, console.width) if found else [_why_none(wanted)]:
            console.print(line, soft_wrap=True)


def _place(action: Action) -> tuple[int, str]:
    """Return its place in the list: by group, and within a group what every race has first."""
    return list(GROUPS).index(action.group), action.race or ""


def _check(given: str | None, known: Iterable[str], what: str) -> None:
    names = sorted(known)
    if given is None or given in names:
        return
    close = difflib.get_close_matches(given, names, n=1)
    all_of_them = f", there are {', '.join(names)}" if len(names) <= FEW else ""
    raise ConfigError(f"there is no {what} '{given}'" + (f", did you mean '{close[0]}'?" if close else all_of_them))


def _function(given: str | None) -> str | None:
    """Return the name of a function that is given by name or number."""
    if given is not None and given.isdecimal():
        given = next((each.name for each in functions().values() if each.id == int(given)), given)
    _check(given, functions(), "function of PySC2")
    return given


def _why_none(function: str | None) -> str:
    reasons = {each.function.name: each.reason for each in coverage()}
    return f"no action ends in {function}: {reasons[function]}" if function and reasons[function] else "no action fits"


def _groups(known: Iterable[Action]) -> Table:
    table = Table(box=None, pad_edge=False)
    for column in ("group", "race", "actions", "such as"):
        table.add_column(column, justify="right" if column == "actions" else "left", no_wrap=True)
    counted: dict[tuple[str, str], list[Action]] = {}
    for action in known:
        counted.setdefault((action.group, action.race or "every race"), []).append(action)
    for (group, race), members in counted.items():
        table.add_row(group, race, str(len(members)), example(members[0]))
    return table


def _is_for(action: Action, unit: str) -> bool:
    """Return whether units of a type carry it out; false for orders to the whole side that name no unit."""
    return action.fits(unit) and (action.subject != "side" or bool(action.units))


def _lines(found: list[Action], width: int) -> Iterator[Text]:
    """Yield lines for each action, under headings of group and race; names and calls are never broken."""
    for (group, race), members in itertools.groupby(found, key=lambda action: (action.group, action.race)):
        yield Text(f"\n{group}, {race or 'every race'}", style="bold underline")
        for action in members:
            yield from _block(action, width)


def _block(action: Action, width: int) -> Iterator[Text]:
    function = f"{action.pysc2.id} {action.pysc2.name}" if action.pysc2 else ""
    beside = len(action.form) + len(function) + 2 <= width
    yield Text.assemble((action.form, "bold"), (f"  {function}" if beside else "", "cyan"))
    if not beside:
        yield Text(INDENT + function, style="cyan")
    if action.args:
        yield Text(INDENT + example(action))
    yield from map(Text, _wrap(action.about, width))
    aliases = f"; also {', '.join(action.aliases)}" if action.aliases else ""
    yield from (Text(line, style="dim") for line in _wrap(_users(action) + aliases, width))


def _wrap(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, initial_indent=INDENT, subsequent_indent=INDENT, break_long_words=False)


def _users(action: Action) -> str:
    shown = ", ".join(action.units[:MANY]) + (f" and {more} more" if (more := len(action.units) - MANY) > 0 else "")
    subject = {
        "team": "a whole team",
        "unit": "one unit",
        "two_units": "two units",
        "side": "the side, by",
    }
    return f"{subject[action.subject]}: {shown}" if shown else subject[action.subject]


def _fields(action: Action) -> Iterator[tuple[str, Any]]:
    yield from action.model_dump(mode="json", exclude={"needs"}).items()
    yield "function_id", None if action.pysc2 is None else action.pysc2.id
    yield "example", example(action)
