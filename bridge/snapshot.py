"""What one player knows of the game at one moment, as the game itself says it.

A value, not a connection: everything above `bridge.game` is a function of snapshots.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from s2clientprotocol import raw_pb2

if TYPE_CHECKING:
    from collections.abc import Mapping

    from s2clientprotocol import sc2api_pb2 as sc_pb

    from protocol.messages import Outcome


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One observation of the SC2 API, with what PySC2 and the steps before it have to add."""

    response: sc_pb.ResponseObservation
    info: sc_pb.ResponseGameInfo
    """About the game and its map; the same object for a whole episode."""
    abilities: Mapping[int, frozenset[int]] | None = None
    """By tag of an own unit, the abilities that the game would take from it now, each as itself and in its general
    form; None if the game was not asked."""
    functions: frozenset[int] = frozenset()
    """Ids of the PySC2 functions that the current selection allows."""
    dead: frozenset[int] = frozenset()
    """Tags of the units that died since the snapshot that agents saw before this one."""
    errors: tuple[sc_pb.ActionError, ...] = ()
    """What the game refused since then."""
    ended: bool = False
    """Whether the episode is over: by a result, or because its steps are used up."""
    outcome: Outcome | None = None
    """The player's result; None while it plays, and after an end without one."""
    units: dict[int, raw_pb2.Unit] = field(init=False, repr=False, compare=False)
    """Every visible unit by its tag, in ascending order of tags."""

    def __post_init__(self) -> None:
        found = sorted(self.response.observation.raw_data.units, key=lambda unit: unit.tag)
        object.__setattr__(self, "units", {unit.tag: unit for unit in found if is_shown(unit)})

    @property
    def game_loop(self) -> int:
        """Game loops since the start of the episode."""
        return self.response.observation.game_loop

    @property
    def own(self) -> list[raw_pb2.Unit]:
        """The player's own units, in ascending order of tags."""
        return [unit for unit in self.units.values() if unit.alliance == raw_pb2.Self]


def is_shown(unit: raw_pb2.Unit) -> bool:
    """Whether a unit is there now: neither a memory under the fog of war nor a plan not yet begun."""
    return unit.display_type in _SHOWN


_SHOWN = (raw_pb2.Visible, raw_pb2.Hidden)  # hidden: cloaked and not detected, its place is known all the same
