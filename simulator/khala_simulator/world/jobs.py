"""Jobs: the products in the queue of a structure or an egg, as values; ``production`` has the rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_simulator.tables.prices import Cost


@dataclass(slots=True)
class Job:
    """One thing in the making.

    ``makes`` is the name of a unit type or an upgrade, ``done`` the loops of work that went into it, ``paid`` the
    refund when it is called off, ``supply`` what it uses once it is ``begun``. A job of kind ``addon`` only waits for
    the structure with the tag ``site``.
    """

    ability: int
    kind: str
    makes: str
    owner: int
    loops: float
    paid: Cost = (0.0, 0.0)
    supply: float = 0.0
    count: int = 1
    done: float = 0.0
    begun: bool = False
    site: int = 0

    @property
    def progress(self) -> float:
        """How far it is, 0..1."""
        return min(1.0, self.done / self.loops) if self.loops else 1.0
