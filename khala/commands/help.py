"""The help of the command line, without the two halves of rich that it never uses.

typer's help imports rich's Markdown and tracebacks, with their parser, lexers and validators: a quarter of the time of
`khala --help`. Our help is in rich's own markup, and our errors are sentences. Both classes stay usable: they are
imported when somebody makes one.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

from typer.core import TyperGroup


class _Late(type):
    """A class that is imported when it is used."""

    module: str

    def _real(cls) -> Any:
        return getattr(importlib.import_module(cls.module), cls.__name__)

    def __call__(cls, *args: Any, **options: Any) -> Any:
        return cls._real()(*args, **options)

    def __getattr__(cls, name: str) -> Any:
        return getattr(cls._real(), name)


def _import_rich_utils() -> None:
    """Import typer's module for help, with stand-ins for `rich.markdown` and `rich.traceback`."""
    put = {}
    for module, name in (("rich.markdown", "Markdown"), ("rich.traceback", "Traceback")):
        if module not in sys.modules:
            put[module] = ModuleType(module)
            setattr(put[module], name, _Late(name, (), {"module": module}))
    sys.modules |= put
    try:
        importlib.import_module("typer.rich_utils")
    finally:
        for module in put:
            del sys.modules[module]


class Group(TyperGroup):
    """The commands of `khala`."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        _import_rich_utils()
        super().format_help(ctx, formatter)
