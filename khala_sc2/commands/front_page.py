"""The page of `khala --help`, drawn by rich alone.

typer's own pages import rich's Markdown and tracebacks, with their parser, lexers and validators: a quarter of the time
of `khala --help`. This page needs none of them, and is the one that typer would print: `tests/khala/test_help.py`
compares the two. The pages of commands are typer's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.columns import Columns
from rich.console import Console
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typer.core import TyperGroup

MARKS = ((r"(?<!\w)-\w+", "bold green"), (r"(?<!\w)--[\w-]+", "bold cyan"), (r"Usage: ", "yellow"))
"""Short options, long options and the first word, with their styles; a later style covers an earlier one."""


def print_page(group: TyperGroup, ctx: Any) -> None:
    """Print the usage, the options and the commands of a group."""
    console = Console()
    console.print(Padding(_mark(group.get_usage(ctx)), 1), style="bold")
    console.print(Padding(_mark(group.help), (0, 1, 1, 1)))
    console.print(_panel("Options", _options(group, ctx)))
    console.print(_panel("Commands", _commands(group)))
    console.print(Padding(_mark(group.epilog), 1))


def _options(group: TyperGroup, ctx: Any) -> Table:
    table = _table()
    option: Any  # typer does not export its type
    for option in group.get_params(ctx):
        kind = Text(option.display_type_rich(ctx=ctx), style="bold yellow")
        kind.highlight_regex(r"^<|>$", "dim")
        summary = Columns([_mark(option.help)])  # takes all the room that is left
        table.add_row(*_names(option.opts), *_names(option.secondary_opts), kind, summary)
    return table


def _commands(group: TyperGroup) -> Table:
    table = _table()
    table.add_column(style="bold cyan", no_wrap=True, width=max(map(len, group.commands)))
    table.add_column(ratio=1)
    for name, command in group.commands.items():
        table.add_row(name, _mark((command.help or "").partition("\n\n")[0]))
    return table


def _names(names: Sequence[str]) -> tuple[Text, Text]:
    """Return the long names of an option, and the short ones."""
    long = [name for name in names if name.startswith("--")]
    short = [name for name in names if name not in long]
    return _mark(",".join(long)), _mark(",".join(short))


def _mark(words: str | None) -> Text:
    text = Text.from_markup(words or "")
    for pattern, style in MARKS:
        text.highlight_regex(pattern, style)
    return text


def _table() -> Table:
    return Table(box=None, show_header=False, expand=True, pad_edge=False)


def _panel(title: str, table: Table) -> Panel:
    return Panel(table, title=title, title_align="left", border_style="dim")
