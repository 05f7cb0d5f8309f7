"""Every probe, in the order in which they are played: those of one setting share a game."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.probes import (
    crowds,
    damage,
    economy,
    fights,
    making,
    movement,
    production,
    spells,
    targets,
    terrain,
    weapons,
)
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.calibrate.probe import Probe

_MODULES: Final = (movement, crowds, weapons, damage, targets, spells, production, making, terrain, economy, fights)
_ALL: Final = tuple(probe for module in _MODULES for probe in module.PROBES)

PROBES: Final = tuple(
    probe for setting in dict.fromkeys(probe.setting for probe in _ALL) for probe in _ALL if probe.setting == setting
)


def choose(patterns: Sequence[str]) -> list[Probe]:
    """Return the probes whose id fits one of the patterns, such as `move.*`; all if there is no pattern.

    Raises:
        ConfigError: a pattern fits none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(probe.id, pattern) for probe in PROBES):
            raise ConfigError(f"there is no probe {pattern!r}: `khala calibrate --list` shows all")
    return [probe for probe in PROBES if not patterns or any(fnmatchcase(probe.id, pattern) for pattern in patterns)]
