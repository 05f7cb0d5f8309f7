"""The versions of the game that the simulator can be, and the data sets that a map can have.

Apart from the tables themselves, because the command line shows them without reading any.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

DEFAULT_VERSION: Final = "4.10"
"""The newest for Linux that both PySC2 and python-sc2 know."""

VERSION_OF_BUILD: Final = {75689: "4.10", 92440: "5.0.13"}
BUILD_OF_VERSION: Final = {version: build for build, version in VERSION_OF_BUILD.items()}

DataSet = Literal["liberty", "void", "multi"]
"""Whose numbers a map has: those of the last mod that it depends on; "multi" is VoidMulti, of ladder games."""
DATA_SETS: Final[tuple[DataSet, ...]] = get_args(DataSet)
DEFAULT_DATA: Final[DataSet] = "multi"
