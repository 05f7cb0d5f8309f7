"""The columns of a world, for interpreted rules; for compiled ones the build writes `columns.pxd` and `columns.pyx`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from khala_simulator.native import memory
from khala_simulator.world.columns import COLUMNS, UnitColumns

if TYPE_CHECKING:
    from khala_simulator.native.memory import Cells, Points
    from khala_simulator.world.world import World


class Columns(UnitColumns if TYPE_CHECKING else object):  # type: ignore[misc]  # for the names of the columns
    """The columns of one world, each by its name, as rows of numbers or points; they hold until it grows."""

    if TYPE_CHECKING:
        visible: Cells
        """(players * capacity,) player by player."""
        pos: Points
        heading: Points
        order_point: Points
        order_origin: Points
        guard: Points
        turret: Points
        zone: Points
        nav_point: Points
        nav_goal: Points
        aside: Points
        toward: Points
        intended: Points
        goal: Points
        walls: Points

    def __init__(self, world: World) -> None:
        self.capacity = world.capacity
        self.visible = memory.bools(world.visible)
        self._arrays = {name: getattr(world, name) for name in COLUMNS}
        for name, column in COLUMNS.items():
            rows: Any = memory.points if column.width else memoryview
            setattr(self, name, rows(self._arrays[name]))

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world binds its own arrays."""
        return type(None), ()

    def clear(self, slot: int) -> None:
        """Make a slot unused."""
        for name, column in COLUMNS.items():
            self._arrays[name][slot] = column.empty


def columns_of(world: World) -> Columns:
    """Return the columns of a world, bound now if its arrays are new."""
    if world.native is None:
        world.native = Columns(world)
    columns: Columns = world.native  # type: ignore[assignment]  # its protocol says less
    return columns
