"""Data files of the bridge and the one way to read them.

`actions/` (text actions), `functions.tsv` (PySC2's functions), `maps.yaml`, `knowledge/` (unit types); SOURCES.md
names the sources of the facts. They are part of the program: a fault in them is a bug for the tests to find, not an
error to explain to a user.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from pydantic import BaseModel, TypeAdapter

if TYPE_CHECKING:
    from typing import TypeVar

    M = TypeVar("M", bound=BaseModel)

_LOADER: type = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml is 15 times faster, and not in every wheel
_HERE = Path(__file__).parent


def path(name: str | Path) -> Path:
    """Return the path of a data file; an absolute path stays as it is."""
    return _HERE / name


def document(name: str | Path) -> Any:
    """Return the content of a YAML file, here or somewhere else."""
    return yaml.load(path(name).read_bytes(), Loader=_LOADER)  # noqa: S506  # a safe loader in both cases


def table(name: str, model: type[M]) -> dict[str, M]:
    """Return the entries of a data file by name, in the order of the file."""
    return TypeAdapter(dict[str, model]).validate_python(document(name))  # type: ignore[valid-type]  # a type known at run time
