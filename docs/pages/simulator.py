"""The page of the simulator: what it models, estimates and refuses. Made from its own data and code."""

from __future__ import annotations

import ast
import inspect
import os
import sys
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import khala_simulator.api
from docs.pages.markdown import code, codes, head, join, prose, table
from khala_simulator.abilities.casting import is_modelled
from khala_simulator.api.data import rows as api_rows
from khala_simulator.maps.game_map import load_map, map_names
from khala_simulator.process.requests import HANDLERS
from khala_simulator.process.status import AFTER, LEGAL, Status
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.mechanics import entries
from khala_simulator.tables.versions import DEFAULT_VERSION, VERSION_OF_BUILD

if TYPE_CHECKING:
    from khala_simulator.tables.mechanics import Constant

SOURCES = "SOURCES.md"
REFUSAL = "not supported"
"""Words of a sentence with which the simulator refuses what the game can do."""
MOVES = {"join_lan": "`join_game` with ports"}
"""Names that the table of states distinguishes and the API does not."""
SOURCED = {"catalog": "the game's data", "replay": "recorded games"}


def page() -> str:
    """Return everything that a reader of results must know of the simulated game."""
    return join(
        head("The simulator", "`simulator/khala_simulator/data` and the simulator's own tables"),
        "How it is built: [design](../design/simulator.md). Where the data is from: "
        "[SOURCES.md](../../simulator/khala_simulator/data/SOURCES.md).",
        _tables(),
        "## One game loop",
        "The systems of the world, in the order in which they run.",
        table(
            ("system", "in words"),
            [(code(name), _system(name)) for name in _systems()],
        ),
        "## What a player can order",
        _abilities(),
        "## Requests",
        f"Of the SC2 API it takes {codes(HANDLERS)}.",
        "### Requests by state",
        "The state is in every response. A request without a dot is refused in that state with `Response.error`. That "
        "changes nothing, and neither does a legal request that fails, with an error of its own kind.",
        _states(),
        "## What is an estimate",
        _chapter("What is an estimate"),
        "### Constants of the rules",
        _constants(),
        "### Weapons",
        _weapons(),
        "### Maps",
        _maps(),
        "## Constants that have a source",
        _sourced(),
        "## What is not modelled",
        _chapter("Not modelled by the rules yet"),
        _refused(),
    )


def _tables() -> str:
    rows = []
    for build, version in VERSION_OF_BUILD.items():
        catalog = load_catalog(version)
        played = code("khala sc2 install" + (f" --version {version}" if version != DEFAULT_VERSION else ""))
        rows.append((version, build, len(catalog.units), len(catalog.weapons), len(catalog.upgrades), played))
    return table(("tables of version", "build", "unit types", "weapons", "upgrades", "installed by"), rows)


def _systems() -> list[str]:
    """Return the modules of the systems, in the order in which a loop calls them."""
    tree = ast.parse((resources.files("khala_simulator") / "tick.py").read_text(encoding="utf-8"))
    loop = next(part for part in tree.body if isinstance(part, ast.FunctionDef) and part.name == "play_loop")
    calls = sorted((part for part in ast.walk(loop) if isinstance(part, ast.Call)), key=lambda call: call.lineno)
    return [ast.unparse(call.func).partition(".")[0] for call in calls]


def _system(name: str) -> str:
    return (inspect.getdoc(sys.modules[f"khala_simulator.systems.{name}"]) or "").split("\n\n", maxsplit=1)[0]


def _abilities() -> str:
    listed = {int(row["ability_id"]): row for row in api_rows("abilities")}
    known = [ability for ability in load_catalog().abilities if is_modelled(ability)]
    rows = [(code(ability.id), ability.name) for ability in known]
    return join(
        f"The game's API lists {len(listed)} abilities. These are carried out, by their specific or their general id; "
        "every other one is answered with `NotSupported`.",
        table(("ability", "name"), rows),
    )


def _states() -> str:
    """Return the simulator's own table of states."""
    states = [status for status in Status if status is not Status.quit]
    moves = sorted(set().union(*LEGAL.values()), key=lambda move: ([move not in LEGAL[s] for s in states], move))
    rows = [
        (MOVES.get(move, code(move)), *("●" if move in LEGAL[state] else "" for state in states), _state_after(move))
        for move in moves
    ]
    return join(
        table(("request", *map(_state_name, states), "then"), rows),
        f"A game that is decided, and a replay at its end, turn {_state_name(Status.in_game)} and "
        f"{_state_name(Status.in_replay)} into {_state_name(Status.ended)}.",
    )


def _state_after(move: str) -> str:
    return _state_name(AFTER[move]) if move in AFTER else ""


def _state_name(status: Status) -> str:
    return code(status.name)


def _constants() -> str:
    rows = [(code(e.name), _value(e), e.unit, e.note, code(e.probe)) for e in entries() if e.source not in SOURCED]
    return table(("constant", "value", "unit", "meaning", "[probe](probes.md) that would settle it"), rows)


def _sourced() -> str:
    rows = [(code(e.name), _value(e), e.unit, e.note, SOURCED[e.source]) for e in entries() if e.source in SOURCED]
    return table(("constant", "value", "unit", "meaning", "source"), rows)


def _value(entry: Constant) -> object:
    return {True: "yes", False: "no"}[entry.value] if isinstance(entry.value, bool) else entry.value


def _weapons() -> str:
    rows = [(code(weapon.id), ", ".join(weapon.estimates)) for weapon in load_catalog().weapons if weapon.estimates]
    return table(("weapon", "estimated"), rows)


def _maps() -> str:
    found: dict[str, list[str]] = {}
    for name in map_names():
        for text in load_map(name).scenario.estimates:
            found.setdefault(text, []).append(name)
    rows = [(text, codes(_short(names))) for text, names in found.items()]
    return table(("what a map's file does not say", "maps"), rows)


def _short(names: list[str]) -> list[str]:
    """Return names of maps, with one entry for all that begin the same."""
    families: dict[str, list[str]] = {}
    for name in names:
        families.setdefault(name.partition("/")[0], []).append(name)
    listed: list[str] = []
    for some in families.values():
        prefix = os.path.commonprefix(some)  # noqa: RUF071  # of names, not of paths: letter by letter is meant
        whole = len(some) > 1 and some == [name for name in map_names() if name.startswith(prefix)]
        listed += [f"{prefix}*"] if whole else some
    return listed


def _chapter(title: str) -> str:
    """Return a chapter of the data's own account of its sources."""
    text = (resources.files("khala_simulator.data") / SOURCES).read_text(encoding="utf-8")
    chapter = text.partition(f"## {title}\n")[2].partition("\n## ")[0].strip()
    return prose(chapter.replace("](../../../docs/reference/", "]("))


def _refused() -> str:
    texts = _refusals()
    return join("Refused with a sentence that says so:", "\n".join(f"* {text}" for text in texts)) if texts else ""


def _refusals() -> list[str]:
    """Return the sentences that refuse a request where the game would carry it out."""
    directory = Path(next(iter(khala_simulator.api.__path__)))
    constants = (
        node.value
        for path in sorted(directory.glob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    return list(dict.fromkeys(text for text in constants if REFUSAL in text and "\n" not in text))
