"""Which code may run because a file or a message names it: none, unless the user says so.

A task names modules for sections of its text and the command of a guest, an agents file and an experiment name
policies, and a recording has the task that was played. To import a module is to run it, and any of these files may be
anyone's. So all of Khala imports what is named by a file here, and nowhere else:

* `import_trusted` refuses a module that is not trusted, with a sentence that says what to do;
* what the user names on the command line is trusted (`trust_named`), and `--trust` trusts what files name;
* processes that are started inherit it, by the environment variable `KHALA_TRUST`.

Modules are also looked for in the current directory, which no process of Khala has on its path otherwise.
"""

from __future__ import annotations

import importlib
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import ModuleType

VARIABLE: Final = "KHALA_TRUST"
"""Names of modules, with commas between; `*` for whatever files name."""
ALL: Final = "*"


class Untrusted(ConfigError):
    """A file names code that the user has not trusted."""

    def __init__(self, code: str, *, source: str | None = None) -> None:
        super().__init__(
            f"this names the code {code!r}, which would run on this machine: if you trust it, say --trust, or set "
            f"{VARIABLE}={shlex.quote(_token(code))}",
            source=source,
        )


def module_of(reference: str) -> str:
    """Return the module of `module:name`; "" for a name without one."""
    return reference.rpartition(":")[0]


def trust(*names: str) -> None:
    """Trust modules, or commands."""
    os.environ[VARIABLE] = ",".join(sorted({*_trusted_hashes(), *map(_token, names)}))


def trust_named(*references: str | None) -> None:
    """Trust the modules of what the user has named, `module:name`."""
    trust(*filter(None, (module_of(reference) for reference in references if reference)))


def trust_files(trusted: bool) -> bool:
    """Trust all that files name, if the user says so; a callback of an option."""
    if trusted:
        os.environ[VARIABLE] = ALL
    return trusted


def is_trusted(name: str) -> bool:
    """Return whether a module, or a command, is trusted."""
    return not _trusted_hashes().isdisjoint({ALL, _token(name)})


def check_trusted(names: Iterable[str], *, source: str | None = None) -> None:
    """Check that code is trusted before anything of it runs.

    Raises:
        Untrusted: the first one is not.
    """
    for name in names:
        if not is_trusted(name):
            raise Untrusted(name, source=source)


def check_keys(sent: Iterable[str]) -> None:
    """Check that keys go only where the user wants them.

    Args:
        sent: `OPENAI_API_KEY to llm.example.org`, of what a file names.

    Raises:
        ConfigError: the first one is not trusted.
    """
    for what in sent:
        if not is_trusted(what):
            raise ConfigError(f"this sends the key in {what}: if you trust that address, give --trust")


def import_trusted(module: str, *, source: str) -> ModuleType:
    """Import a module of the user.

    Raises:
        Untrusted: the user has not trusted it.
        ConfigError: there is no such module, or importing it failed.
    """
    check_trusted([module], source=source)
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # behind all others, so that no file there stands in for a library
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ConfigError(f"there is no module '{error.name}'", source=source) from None
    except Exception as error:  # an import runs the user's code, which may raise anything
        raise ConfigError(f"importing it failed: {type(error).__name__}: {error}", source=source) from error


def _trusted_hashes() -> set[str]:
    return set(filter(None, os.environ.get(VARIABLE, "").split(",")))


def _token(name: str) -> str:
    return name.replace(",", "%2C")
