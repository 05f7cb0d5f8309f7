"""Compiled systems: what is hot in a game loop, as machine code with the same results to the last bit.

``systems`` has the rules, in numpy; a module here with the same name has the same functions in Cython, and a test
plays both side by side. The environment variable ``KHALA_ENGINE`` chooses: ``auto`` (compiled where it was built, the
default), ``compiled`` (or nothing at all), ``python``.

Above: ``tick``, and the API for its kernels. Below: the systems themselves, for whatever is rare.
"""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING, Any, Final

from khala_simulator.native.engine import VARIABLE, wanted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_simulator.world.world import World

    System = Callable[[World], None]

SYSTEMS: Final = (
    "avoidance",
    "collision",
    "avoidance",
    "collision",
)
"""The systems that have a module here."""


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


def chosen(rules: Iterable[System]) -> tuple[System, ...]:
    """Return the rules, compiled where that is possible."""
    names = ((rule, rule.__module__.rpartition(".")[2]) for rule in rules)
    return tuple(getattr(part(name) if name in SYSTEMS else None, rule.__name__, rule) for rule, name in names)
