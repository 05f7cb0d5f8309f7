"""Effects on the ground as a player perceives them: storms, scans, biles on their way.

The one place that decides which are told; the raw list, the feature layer and the rendered image show the same.
Below: `sight.py`, the world's fields.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator.api.sight import sees

if TYPE_CHECKING:
    from simulator.fields import Field
    from simulator.world import World


def seen_fields(world: World, player: int, *, through_fog: bool = False) -> list[Field]:
    """Fields that the API has an effect id for and that the player perceives: his own, and those in his sight."""
    told = [field for field in world.fields if field.effect]
    if through_fog or not told:
        return told
    return [f for f in told if f.owner == player or sees(world, player, np.array(f.points, float)).any()]
