"""Which engine plays: the rules as machine code where they were compiled, else the same files in the interpreter.

The environment variable ``KHALA_ENGINE`` chooses: ``auto`` (compiled where that was done, the default), ``compiled``
(or nothing at all), ``python`` (the interpreter: for debuggers and for coverage, a hundred times slower).
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, SourceFileLoader
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

ENGINES: Final = ("auto", "compiled", "python")
VARIABLE: Final = "KHALA_ENGINE"
PACKAGE: Final = __name__.partition(".")[0]


def wanted() -> str:
    """Return which engine the environment asks for; raise ``ValueError`` if that is none."""
    engine = os.environ.get(VARIABLE) or "auto"
    if engine not in ENGINES:
        raise ValueError(f"{VARIABLE}={engine} is no engine: say {', '.join(ENGINES[:-1])} or {ENGINES[-1]}")
    return engine


def engine() -> str:
    """Return which engine plays in this process: ``compiled`` or ``python``."""
    columns = importlib.import_module(f"{PACKAGE}.native.columns")
    return "python" if str(columns.__file__).endswith(tuple(SOURCE_SUFFIXES)) else "compiled"


def choose() -> None:
    """Have this process import the rules as the environment asks.

    Raises:
        ValueError: the environment asks for an engine that does not exist.
        ImportError: it asks for the compiled one, which was not built.
    """
    if wanted() == "python":
        sys.meta_path.insert(0, _Interpreted())
    elif wanted() == "compiled" and engine() == "python":
        raise ImportError(f"{VARIABLE}=compiled, but the rules were not compiled: install with a C compiler")


class _Interpreted:
    """Finds the source of a module of this package, where Python would take what was compiled from it."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if path is None or not name.startswith(f"{PACKAGE}."):
            return None
        finders = (FileFinder(place, (SourceFileLoader, SOURCE_SUFFIXES)) for place in path)
        return next((spec for finder in finders if (spec := finder.find_spec(name, target))), None)


def compiled_rules() -> tuple[str, ...]:
    """Return the names of the modules that have a ``.pxd``, and are compiled where there is a compiler."""
    root = Path(__file__).parent.parent
    found = (file.relative_to(root.parent).with_suffix("") for file in root.rglob("*.pxd"))
    return tuple(sorted(".".join(file.parts) for file in found if file.with_suffix(".py").exists()))
