"""The measures of an experiment as a table for other programs: a row for each episode and side."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import ConfigError
from khala_protocol.files import replacing, write_private
from khala_sc2.experiment.measures import Measures
from khala_sc2.experiment.plan import FACTOR
from khala_sc2.experiment.selection import factors_of

if TYPE_CHECKING:
    from pathlib import Path

    from khala_sc2.experiment.store import Store

Columns = dict[str, type]


def write_csv(store: Store, path: Path) -> int:
    """Write the rows as CSV, an empty cell for nothing, and return their number."""
    columns, rows = table(store)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(columns))
    writer.writeheader()
    writer.writerows(rows)
    write_private(path, text.getvalue())
    return len(rows)


def write_parquet(store: Store, path: Path) -> int:
    """Write the rows as Parquet, each column with its type, and return their number.

    Raises:
        ConfigError: pyarrow is not installed.
    """
    try:
        import pyarrow as pa  # type: ignore[import-untyped]  # noqa: PLC0415  # of the extra `data`
        from pyarrow import parquet  # noqa: PLC0415
    except ImportError:
        raise ConfigError("Parquet needs pyarrow: pip install 'khala-sc2[data]', or give --csv") from None
    columns, rows = table(store)
    kinds = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    schema = pa.schema([(name, kinds[kind]) for name, kind in columns.items()])
    with replacing(path) as file:
        parquet.write_table(pa.Table.from_pylist(rows, schema=schema), file)
    return len(rows)


def table(store: Store) -> tuple[Columns, list[dict[str, Any]]]:
    """Return the columns with their types, and the rows."""
    played = store.matches()
    columns = _columns(factors_of(played.values()))
    rows = [row | {"recording": played[row["match"]].recording} for row in store.results()]
    return columns, [{name: _convert(row.get(name), kind) for name, kind in columns.items()} for row in rows]


def _columns(factors: tuple[str, ...]) -> Columns:
    about: Columns = {"match": str, "state": str, "cause_of_state": str, "repetition": int}
    kinds = {kind.__name__: kind for kind in (str, int, float, bool)}
    measures = {name: kinds[str(field.type).split(" | ")[0]] for name, field in Measures.__dataclass_fields__.items()}
    return {**about, **{f"{FACTOR}{name}": str for name in factors}, **measures, "recording": str}


def _convert(value: Any, kind: type) -> Any:
    """Return a value of SQLite, which has no booleans, in the type of its column."""
    return None if value is None else kind(value)
