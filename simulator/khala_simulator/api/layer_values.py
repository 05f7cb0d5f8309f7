"""What the feature layers show of each unit, as whole numbers: a row of values for each layer.

Above: `layers.py`. Below: `sight.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.api.sight import Cloak, Display
from khala_simulator.native import memory

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.sight import Sight

VALUES = (
    "player_id", "player_relative", "unit_type", "selected", "unit_hit_points", "unit_hit_points_ratio",
    "unit_shields", "unit_shields_ratio", "unit_energy", "unit_energy_ratio", "hallucinations", "cloaked", "active",
    "build_progress", "placeholder", "buffs", "buff_duration",
)  # fmt: skip
"""Layers that show a value of the topmost unit at each pixel, in the order of the rows."""

OWNER: Final = VALUES.index("player_id")
ALLIANCE: Final = VALUES.index("player_relative")
TYPE: Final = VALUES.index("unit_type")
SELECTED: Final = VALUES.index("selected")
LIFE: Final = VALUES.index("unit_hit_points")
LIFE_RATIO: Final = VALUES.index("unit_hit_points_ratio")
SHIELDS: Final = VALUES.index("unit_shields")
SHIELDS_RATIO: Final = VALUES.index("unit_shields_ratio")
ENERGY: Final = VALUES.index("unit_energy")
ENERGY_RATIO: Final = VALUES.index("unit_energy_ratio")
HALLUCINATION: Final = VALUES.index("hallucinations")
CLOAKED: Final = VALUES.index("cloaked")
ACTIVE: Final = VALUES.index("active")
PROGRESS: Final = VALUES.index("build_progress")
IS_PLACEHOLDER: Final = VALUES.index("placeholder")

UNKNOWN: Final = Cloak.UNKNOWN.value
NOT_CLOAKED: Final = Cloak.NOT_CLOAKED.value
PLACEHOLDER: Final = Display.PLACEHOLDER.value


def write_values(sight: Sight, selected: NDArray[np.bool_], values: NDArray[np.int32]) -> None:
    """Write the rows that every unit has: all but those of its buffs.

    Hit points, shields and energy are whole points, their ratios 0 to 255; the progress of a structure is 0 to 255
    while it is being built and 0 afterwards.
    """
    n = len(sight)
    to = memory.int32s(values)
    owner = memory.ints(sight.owner)
    alliance = memory.ints(sight.alliance)
    type_id = memory.ints(sight.type_id)
    cloak = memory.ints(sight.cloak)
    display = memory.ints(sight.display)
    chosen = memory.bools(selected)
    fake = memory.bools(sight.hallucination)
    active = memory.bools(sight.active)
    progress = memory.floats(sight.build_progress)
    _write_points(to, memory.floats(sight.life), memory.floats(sight.life_max), LIFE * n, LIFE_RATIO * n, n)
    _write_points(to, memory.floats(sight.shields), memory.floats(sight.shields_max), SHIELDS * n, SHIELDS_RATIO * n, n)
    _write_points(to, memory.floats(sight.energy), memory.floats(sight.energy_max), ENERGY * n, ENERGY_RATIO * n, n)
    for i in range(n):
        built = int(progress[i] * 255)
        to[OWNER * n + i] = owner[i]
        to[ALLIANCE * n + i] = alliance[i]
        to[TYPE * n + i] = type_id[i]
        to[SELECTED * n + i] = chosen[i]
        to[HALLUCINATION * n + i] = fake[i]
        to[CLOAKED * n + i] = cloak[i] != NOT_CLOAKED and cloak[i] != UNKNOWN
        to[ACTIVE * n + i] = active[i]
        to[PROGRESS * n + i] = built if progress[i] < 1.0 else 0
        to[IS_PLACEHOLDER * n + i] = display[i] == PLACEHOLDER


def _write_points(to: memory.Cells, points: memory.Cells, most: memory.Cells, row: int, ratios: int, n: int) -> None:
    """Write points of life, shields or energy, and what part they are of the most that a unit can have."""
    for i in range(n):
        whole = int(points[i])
        part = int(min(points[i] / max(most[i], 1e-9), 1.0) * 255)
        to[row + i] = whole
        to[ratios + i] = part
