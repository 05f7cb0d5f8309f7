"""The commands of `khala` as typer's group, with a page of their own; `khala_sc2.commands.front_page` draws it."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup


class Commands(TyperGroup):
    """The commands of `khala`."""

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002  # rich prints, and typer's formatter does not
        """Print the page of `khala --help`."""
        from khala_sc2.commands.front_page import print_page  # noqa: PLC0415  # rich, for which a command need not wait

        print_page(self, ctx)
