"""What a probe is: an id, what it measures and settles, and a function that plays it.

Above: `probes`, which makes them, and `run`, which plays them. Below: `lab`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

from khala_bridge.calibrate.setting import Setting

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab

Samples: TypeAlias = Iterator[tuple[str, float]]
"""What a probe yields: the name of what is measured and one value; of the same name as often as it is measured."""
Play: TypeAlias = "Callable[[Lab], Samples]"

LEVEL_GROUND: Final = Setting()
MELEE: Final = Setting(map="Melee/Simple64.SC2Map")
FOG: Final = Setting(map="Melee/Simple64.SC2Map", fog=True)


@dataclass(frozen=True, slots=True)
class Probe:
    """One experiment."""

    id: str
    """Such as `move.speed`; files of measurements and estimates of the simulator name it."""
    measures: str
    """One sentence."""
    settles: str
    """Which question about the game it answers."""
    unit: str
    play: Play
    exact: bool = True
    """Whether the game repeats it to the last digit; if not, each name has several values, and means are compared."""
    resolution: float = 0.0
    """Of an exact one: values that differ by no more are equal, because of how the API rounds."""
    setting: Setting = LEVEL_GROUND


def probe(
    name: str,
    *,
    measures: str,
    settles: str,
    unit: str,
    exact: bool = True,
    resolution: float = 0.0,
    setting: Setting = LEVEL_GROUND,
) -> Callable[[Play], Probe]:
    """Make a probe of the function below."""

    def make(play: Play) -> Probe:
        return Probe(name, measures, settles, unit, play, exact, resolution, setting)

    return make
