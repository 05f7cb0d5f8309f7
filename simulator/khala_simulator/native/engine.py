"""Which engine plays: the rules as machine code where they were compiled, else the same files in the interpreter.

The environment variable ``KHALA_ENGINE`` chooses: ``auto`` (compiled where that was done, the default), ``compiled``
(or nothing at all), ``python`` (the interpreter: for debuggers and for coverage, a hundred times slower).
"""

from __future__ import annotations

import importlib.util
import os
import sys
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, FileFinder, SourceFileLoader
from pathlib import Path
from typing import TYPE_CHECKING, Final

from khala_simulator.native import flags

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

ENGINES: Final = ("auto", "compiled", "python")
VARIABLE: Final = "KHALA_ENGINE"
PACKAGE: Final = __name__.partition(".")[0]
ROOT: Final = Path(__file__).parent.parent


def request() -> str:
    """Return which engine the environment asks for; raise ``ValueError`` if that is none."""
    engine = os.environ.get(VARIABLE) or "auto"
    if engine not in ENGINES:
        raise ValueError(f"{VARIABLE}={engine} is no engine: say {', '.join(ENGINES[:-1])} or {ENGINES[-1]}")
    return engine


def engine() -> str:
    """Return which engine plays in this process: ``compiled`` or ``python``."""
    found = importlib.util.find_spec(f"{PACKAGE}.native.columns")
    return "compiled" if found and str(found.origin).endswith(tuple(EXTENSION_SUFFIXES)) else "python"


def describe() -> str:
    """Return the engine that plays in this process, for the run card: with the flags that decide the last bits."""
    return "interpreted" if engine() == "python" else f"compiled {' '.join(flags.DECISIVE)}"


def choose() -> None:
    """Have this process interpret the rules, if the environment asks for that."""
    if os.environ.get(VARIABLE) == "python":
        sys.meta_path.insert(0, _Interpreted())


def check() -> None:
    """Make sure that a game can be played as the environment asks.

    Raises:
        ValueError: the environment asks for an engine that does not exist.
        ImportError: it asks for the compiled one, which was not built; or a rule was changed since it was compiled.
    """
    if request() == "python":
        return
    if request() == "compiled" and engine() == "python":
        raise ImportError(f"{VARIABLE}=compiled, but the rules were not compiled: install with a C compiler")
    if (rule := changed_rule()) is not None:
        raise ImportError(f"{rule} was changed since it was compiled: say make install, or {VARIABLE}=python")


def changed_rule() -> Path | None:
    """Return a file of a rule that is newer than what was compiled from it; only a checkout has any."""
    if not (ROOT.parent / "setup.py").exists():
        return None
    for source in _sources():
        compiled = source.with_name(source.stem + EXTENSION_SUFFIXES[0])
        if compiled.exists() and compiled.stat().st_mtime < source.stat().st_mtime:
            return source
    return None


def compiled_rules() -> tuple[str, ...]:
    """Return the names of the modules that are compiled where there is a compiler."""
    names = (file.relative_to(ROOT.parent).with_suffix("") for file in _sources() if file.suffix == ".py")
    return tuple(sorted(".".join(name.parts) for name in names))


def _sources() -> Iterator[Path]:
    """Yield what is compiled: each rule that has a ``.pxd`` or, where there is one, the ``.pyx``, and the ``.pxd``."""
    for types in ROOT.rglob("*.pxd"):
        kernel = types.with_suffix(".pyx")
        source = kernel if kernel.exists() else types.with_suffix(".py")
        if source.exists():
            yield types
            yield source


class _Interpreted:
    """Finds the source of a module of this package, where Python would take what was compiled from it."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        if path is None or not name.startswith(f"{PACKAGE}."):
            return None
        finders = (FileFinder(place, (SourceFileLoader, SOURCE_SUFFIXES)) for place in path)
        return next((spec for finder in finders if (spec := finder.find_spec(name, target))), None)
