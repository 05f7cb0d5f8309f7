"""Whatever a command prints passes one place, in which no character of foreign words does anything to the terminal."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
PACKAGES = ("agents/khala_agents", "bridge/khala_bridge", "orchestrator/khala_orchestrator",
            "protocol/khala_protocol", "simulator/khala_simulator", "khala_sc2", "envs")  # fmt: skip
WRITERS = {"typer.echo", "typer.secho", "click.echo", "print", "sys.stdout.write", "sys.stderr.write", "rich.print"}
HINT = re.compile(r"echo\(|\bprint\(|std(out|err)\.write|Console\(|from_markup|TextColumn|rich\.markup")
PLACES = {
    "khala_sc2/commands/front_page.py": "draws `khala --help`, whose texts are our own",
    "simulator/khala_simulator/cli.py": "stands alone, and has a `_say` of its own",
    "simulator/khala_simulator/process/lan.py": "stands alone, and prints one sentence in ASCII",
}


def faults(source: str) -> Iterator[str]:
    """Yield what a module prints past the one place, and what makes markup of words."""
    if not HINT.search(source):  # most modules print nothing, and to parse them all takes seconds
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module == "rich.markup":
            yield f"{node.lineno}: rich.markup"
        if not isinstance(node, ast.Call):
            continue
        name = ast.unparse(node.func)
        if name in WRITERS and not _is_clean(node.args):
            yield f"{node.lineno}: {name}"
        if name == "Console" or name.endswith((".Console", ".from_markup")):
            yield f"{node.lineno}: {name}"
        if name == "TextColumn" and "markup=False" not in map(ast.unparse, node.keywords):
            yield f"{node.lineno}: TextColumn with markup"


def _is_clean(arguments: list[ast.expr]) -> bool:
    """Return whether it is a text of ours, or JSON, which escapes the rest."""
    return all(
        isinstance(one, ast.Constant) or (isinstance(one, ast.Call) and ast.unparse(one.func) == "json.dumps")
        for one in arguments
    )


@cache
def modules() -> dict[str, str]:
    found = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {str(path.relative_to(ROOT)): path.read_text() for path in found}


def test_nothing_is_printed_past_the_one_place() -> None:
    outside = {name: text for name, text in modules().items() if name not in PLACES}
    assert len(outside) > 400
    wrong = [f"{name}:{fault}" for name, text in outside.items() for fault in faults(text)]
    assert not wrong, "print with `khala_protocol.commandline.say` or a console of `khala_orchestrator.console`"


def test_every_place_that_may_print_does() -> None:
    assert not [name for name in PLACES if not list(faults(modules()[name]))]


@pytest.mark.parametrize(
    "line",
    [
        "typer.echo(text)", "typer.echo(f'{a}')", "print(text, file=sys.stderr)", "sys.stderr.write(text)",
        "Console().print(table)", "rich.console.Console()", "Text.from_markup(text)",
        "TextColumn('{task.description}')", "from rich.markup import escape",
    ],
)  # fmt: skip
def test_a_way_past_it_is_found(line: str) -> None:
    assert list(faults(line))


@pytest.mark.parametrize(
    "line", ["typer.echo(json.dumps(data))", "typer.echo('ready')", "sys.stdout.write('ready\\n')"]
)
def test_what_cannot_hold_foreign_words_is_let_through(line: str) -> None:
    assert not list(faults(line))
