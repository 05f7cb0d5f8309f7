"""Which units a player has selected, and how clicks, rectangles and hotkeys change that.

A selection is a list of tags: own units, or a single foreign one that is only looked at. It belongs to the player's
interface, not to the world. Actions that make no sense change nothing and say so by their result.

Above: `actions.py`, `ui.py`. Below: `sight.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.api.sight import Alliance, Display
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from khala_simulator.api.sight import Sight
    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Rows = NDArray[np.intp]

GROUPS = 10


class PlayerSelection:
    """The selected units and the ten control groups of one player, as tags in the order of the unit panel."""

    def __init__(self) -> None:
        self.tags: list[int] = []
        self.groups: list[list[int]] = [[] for _ in range(GROUPS)]

    def forget_dead(self, world: World) -> None:
        """Drop units that are gone."""
        for tags in (self.tags, *self.groups):
            if any(world.slot_of(tag) < 0 for tag in tags):
                tags[:] = [tag for tag in tags if world.slot_of(tag) >= 0]

    def slots(self, world: World) -> list[int]:
        """Return the slots of the selected units that live."""
        return [slot for slot in map(world.slot_of, self.tags) if slot >= 0]

    def rows(self, sight: Sight) -> Bools:
        """Return which rows of a sight are selected."""
        if not self.tags:
            return np.zeros(len(sight), np.bool_)
        tags = frozenset(self.tags)  # np.isin takes 45 us for ten units
        return np.array([tag in tags for tag in sight.tag.tolist()], np.bool_)

    def choose(self, tags: Iterable[int], *, add: bool = False) -> None:
        """Select units, or add them."""
        kept = self.tags if add else []
        self.tags = list(dict.fromkeys([*kept, *tags]))

    def remove(self, tags: Iterable[int]) -> None:
        """Deselect units."""
        gone = set(tags)
        self.tags = [tag for tag in self.tags if tag not in gone]


def panel_order(world: World, types: Types, tags: Iterable[int]) -> list[int]:
    """Return tags in the order of the unit panel: by the priority of their subgroup, then by type, then by arrival."""

    def key(tag: int) -> tuple[int, int]:
        row = int(world.type[world.slot_of(tag)])
        return -int(types.subgroup[row]), int(types.id[row])

    return sorted(tags, key=key)


def selectable(sight: Sight, types: Types) -> Bools:
    """Return the rows that a click can select."""
    rows: Bools = types.selectable[sight.row] & (sight.display != Display.HIDDEN)
    return rows


def at_point(sight: Sight, types: Types, point: tuple[float, float], reach: float) -> int | None:
    """Return the row of the topmost unit under a world point, within `reach` of its edge; None on bare ground."""
    gap = ((sight.pos - point) ** 2).sum(axis=1)
    under = selectable(sight, types) & (gap <= (sight.radius + reach) ** 2)
    rows = np.flatnonzero(under)
    return int(rows[-1]) if rows.size else None


def in_rectangle(sight: Sight, types: Types, corner: tuple[float, float], other: tuple[float, float]) -> Rows:
    """Return the rows of own units whose bodies touch a rectangle of the world; structures only if no unit does."""
    low = np.minimum(corner, other)
    high = np.maximum(corner, other)
    nearest = np.clip(sight.pos, low, high)
    touched = ((sight.pos - nearest) ** 2).sum(axis=1) <= sight.radius**2
    own = touched & (sight.alliance == Alliance.SELF) & selectable(sight, types)
    units = own & ~types.structure[sight.row]
    return np.flatnonzero(units if units.any() else own)


def army(sight: Sight, types: Types) -> Rows:
    """Return the rows of the player's army."""
    return _own(sight, types, types.army)


def warp_gates(sight: Sight, types: Types) -> Rows:
    """Return the rows of the player's warp gates."""
    return _own(sight, types, types.warp_gate)


def larvae(sight: Sight, types: Types) -> Rows:
    """Return the rows of the player's larvae."""
    return _own(sight, types, types.larva)


def idle_workers(world: World, sight: Sight, types: Types) -> Rows:
    """Return the rows of the player's idle workers."""
    rows = _own(sight, types, types.worker)
    idle: Rows = rows[world.order_kind[sight.slot[rows]] == OrderKind.IDLE.value]
    return idle


def _own(sight: Sight, types: Types, kind: Bools) -> Rows:
    return np.flatnonzero((sight.alliance == Alliance.SELF) & kind[sight.row] & selectable(sight, types))
