"""PySC2's functions as a table: every entry of its `FUNCTIONS`, and the forms that `RAW_FUNCTIONS` has of an ability.

PySC2 takes seconds to import. Lists of tasks and actions need only names and numbers, and read them from
`bridge/khala_bridge/data/functions.tsv`, which `python -m khala_bridge.catalogue.functions` writes from the installed
PySC2. `check_against_pysc2` checks, where PySC2 is loaded anyway, that both still agree.
Nothing here knows text actions: these are in `khala_bridge.catalogue.catalogue`.
"""

from __future__ import annotations

import csv
import functools
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias, get_args

from khala_bridge import data
from khala_bridge.errors import CatalogueError

if TYPE_CHECKING:
    from collections.abc import Iterable

FILE = "functions.tsv"
Kind: TypeAlias = Literal["quick", "screen", "minimap", "autocast", "interface"]
RawForm: TypeAlias = Literal["quick", "pt", "unit", "autocast"]
_RAW = "raw"
"""Mark in the column of ids for the raw forms of an ability."""


class Function(NamedTuple):
    """One entry of PySC2's `FUNCTIONS`."""

    id: int
    name: str
    args: tuple[str, ...]
    """Names of its arguments, `("queued", "screen")`."""
    ability_id: int
    """Ability that it stands for; 0 for those of the interface."""
    general_id: int
    """General ability of which this one is a special case, as `Effect_Stim` is of `Effect_Stim_Marine`; 0 for none."""
    kind: Kind
    """Kind of its target; `interface` for camera, selection and the like."""

    @property
    def stem(self) -> str:
        """Its name without the ending for its arguments: `Effect_Blink`."""
        return self.name if self.kind == "interface" else self.name.removesuffix(f"_{self.kind}")


@functools.cache
def functions() -> dict[str, Function]:
    """Return every function by its name, in the order of their ids."""
    return {row.name: row for row in _rows() if isinstance(row, Function)}


@functools.cache
def functions_of(ability: int) -> tuple[Function, ...]:
    """Return the functions that stand for an ability, in the order of their ids."""
    return tuple(function for function in functions().values() if ability and function.ability_id == ability)


def general(ability: int) -> int:
    """Return the general ability that a special one belongs to; itself if there is none."""
    return _generals().get(ability, ability)


def raw_forms(ability: int) -> frozenset[RawForm]:
    """Return the kinds of target that PySC2's raw interface has for an ability; empty if it lacks the ability."""
    return _raw_forms().get(ability, frozenset())


def check_against_pysc2() -> None:
    """Compare the table with the installed PySC2.

    Raises:
        CatalogueError: they differ; the text names the first difference.
    """
    here, there = [_written(row) for row in _rows()], [_written(row) for row in _from_pysc2()]
    for mine, its in zip(here, there, strict=False):
        if mine != its:
            raise CatalogueError(
                f"{FILE} says {' '.join(mine)!r} where PySC2 has {' '.join(its)!r}: "
                "another PySC2 than 4.0.0? `python -m khala_bridge.catalogue.functions` writes the table again"
            )
    if len(here) != len(there):
        raise CatalogueError(
            f"{FILE} has {len(here)} rows, PySC2 {len(there)}: `python -m khala_bridge.catalogue.functions` writes it"
        )


def write() -> None:
    """Write the table from the installed PySC2."""
    with data.path(FILE).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter="\t", lineterminator="\n").writerows(map(_written, _from_pysc2()))


class _Raw(NamedTuple):
    ability_id: int
    forms: frozenset[RawForm]


@functools.cache
def _rows() -> tuple[Function | _Raw, ...]:
    with data.path(FILE).open(encoding="utf-8", newline="") as file:
        return tuple(_read(row) for row in csv.reader(file, delimiter="\t"))


def _read(row: list[str]) -> Function | _Raw:
    match row:
        case [id_, ability, forms] if id_ == _RAW:
            return _Raw(int(ability), frozenset(form for form in get_args(RawForm) if form in forms.split()))
        case [id_, name, kind, ability, general_id, args]:
            known: Kind = next(known for known in get_args(Kind) if known == kind)
            return Function(int(id_), name, tuple(args.split()), int(ability), int(general_id), known)
        case _:
            raise CatalogueError(f"{FILE} has an invalid row: {row}")


def _written(row: Function | _Raw) -> list[str]:
    if isinstance(row, _Raw):
        return [_RAW, str(row.ability_id), " ".join(sorted(row.forms))]
    return [str(row.id), row.name, row.kind, str(row.ability_id), str(row.general_id), " ".join(row.args)]


@functools.cache
def _generals() -> dict[int, int]:
    return {f.ability_id: f.general_id for f in functions().values() if f.general_id}


@functools.cache
def _raw_forms() -> dict[int, frozenset[RawForm]]:
    return {row.ability_id: row.forms for row in _rows() if isinstance(row, _Raw)}


def _from_pysc2() -> Iterable[Function | _Raw]:
    from khala_bridge.compat import actions  # noqa: PLC0415  # takes seconds, and only these two functions need it

    for function in actions.FUNCTIONS:
        kind = function.function_type.__name__.removeprefix("cmd_")
        yield Function(
            int(function.id),
            function.name,
            tuple(argument.name for argument in function.args),
            int(function.ability_id),
            int(function.general_id),
            kind if kind in get_args(Kind) else "interface",
        )
    forms: dict[int, set[RawForm]] = {}
    for function in actions.RAW_FUNCTIONS:
        if function.ability_id:
            form = function.function_type.__name__.removeprefix("raw_").removeprefix("cmd_").replace("cmd", "quick")
            forms.setdefault(int(function.ability_id), set()).add(form)
    yield from (_Raw(ability, frozenset(found)) for ability, found in sorted(forms.items()))


if __name__ == "__main__":
    write()
