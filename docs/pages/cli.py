"""The page of the command line, from its own help."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from docs.pages.markdown import anchor, code, fence, head, join, prose, table
from khala_sc2.cli import app

if TYPE_CHECKING:
    from collections.abc import Iterator


def page() -> str:
    """Return every command with its arguments, options and examples."""
    root: Any = typer.main.get_command(app)
    found = list(_commands(root, "khala"))
    contents = table(
        ("command", "about"),
        [(f"[`{path}`]({anchor(path)})", _first_line(command)) for path, command in found if path != "khala"],
    )
    sections = (_section(path, command) for path, command in found)
    intro = "Every command says the same with `--help`. Exit codes: 0, 1 with one sentence on stderr, 2 for a wrong "
    intro += "command line, 130 after Ctrl-C, 143 after SIGTERM."
    return join(head("Command line", "the help of the commands"), intro, contents, *sections)


def _commands(command: Any, path: str) -> Iterator[tuple[str, Any]]:
    yield path, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from _commands(inner, f"{path} {name}")


def _section(path: str, command: Any) -> str:
    context = typer.Context(command, info_name=path)
    records = [record for parameter in command.get_params(context) if (record := parameter.get_help_record(context))]
    rows = [(code(name), *_split(text)) for name, text in records if name != "--help"]
    usage = command.get_usage(context).removeprefix("Usage: ")
    return join(
        f"## {path}",
        _paragraphs(command.help or ""),
        fence(usage),
        table(("argument or option", "meaning", ""), rows) if rows else "",
        _examples(command.epilog or ""),
    )


def _paragraphs(text: str) -> str:
    """Return help text, in which an indented paragraph is a command to type."""
    blocks = [block for block in text.split("\n\n") if block.strip()]
    return "\n\n".join(fence(block.strip(), "bash") if block.startswith("    ") else prose(block) for block in blocks)


def _examples(epilog: str) -> str:
    lines = [line.strip() for line in epilog.splitlines()]
    commands = [line for line in lines if line.startswith(("khala ", "curl "))]
    return fence("\n".join(commands), "bash") if commands else ""


def _split(text: str) -> tuple[str, str]:
    """Return help, and what click adds to it in brackets: default, range, environment variable."""
    meaning, bracket, extras = text.rpartition("  [")
    return (meaning, extras.removesuffix("]")) if bracket else (text, "")


def _first_line(command: Any) -> str:
    return str(command.help or "").splitlines()[0]
