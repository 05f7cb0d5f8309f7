"""Compiled systems: what is hot in a game loop, as machine code with the same results to the last bit.

``systems`` has the rules, in numpy; a module here with the same name has the same functions in Cython, and a test
plays both side by side. The environment variable ``KHALA_ENGINE`` chooses: ``auto`` (compiled where it was built, the
default), ``compiled`` (or nothing at all), ``python``.

Above: ``tick``, and the API for its kernels. Below: the systems themselves, for whatever is rare.
"""

from __future__ import annotations

import functools
import importlib
import os
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_simulator.world.world import World

    System = Callable[[World], None]

ENGINES: Final = ("auto", "compiled", "python")
VARIABLE: Final = "KHALA_ENGINE"
SYSTEMS: Final = (
    "acquire",
    "autocast",
    "avoidance",
    "buffs",
    "casts",
    "collision",
    "construction",
    "death",
    "engagement",
    "harvest",
    "hits",
    "missiles",
    "movement",
    "navigation",
    "orders",
    "regeneration",
    "sweeps",
    "triggers",
    "vision",
    "weapons",
)
"""The systems that have a module here."""


def wanted() -> str:
    """Return which engine the environment asks for; raise ``ValueError`` if that is none."""
    engine = os.environ.get(VARIABLE) or "auto"
    if engine not in ENGINES:
        raise ValueError(f"{VARIABLE}={engine} is no engine: say {', '.join(ENGINES[:-1])} or {ENGINES[-1]}")
    return engine


@functools.cache
def part(name: str) -> Any | None:
    """Return the compiled module of a name; None where numpy is to be used.

    Raises:
        ImportError: ``KHALA_ENGINE=compiled`` was asked for, and the module was not built.
    """
    engine = wanted()
    if engine == "python":
        return None
    try:
        return importlib.import_module(f"{__name__}.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"{__name__}.{name}":
            raise
        if engine == "compiled":
            raise ImportError(
                f"{VARIABLE}=compiled, but {error.name} was not built: install with a C compiler"
            ) from error
        return None


def engine() -> str:
    """Return which engine plays: ``compiled`` or ``python``."""
    return "python" if part("columns") is None else "compiled"


def chosen(rules: Iterable[System]) -> tuple[System, ...]:
    """Return the rules, compiled where that is possible."""
    names = ((rule, rule.__module__.rpartition(".")[2]) for rule in rules)
    return tuple(getattr(part(name) if name in SYSTEMS else None, rule.__name__, rule) for rule, name in names)
