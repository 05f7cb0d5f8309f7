"""The versions of the game that the simulator can be.

Apart from the tables themselves, because the command line shows them without reading any.
"""

from __future__ import annotations

from typing import Final

DEFAULT_VERSION: Final = "4.10"
"""The newest for Linux that both PySC2 and python-sc2 know."""

VERSION_OF_BUILD: Final = {75689: "4.10", 92440: "5.0.13"}
BUILD_OF_VERSION: Final = {version: build for build, version in VERSION_OF_BUILD.items()}
