"""What has changed since an agent's last observation: events of units and of the side, the fallen, the game's alerts.

Agents look at their own pace: one that is asked at every fifth step gets everything that happened in between, once.
Those who looked last at the same moment share one value. Below are the events of units and the log of the chronicle;
`khala_bridge.observe.observer`, above, knows who looked when.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_bridge.observe.body import body
from khala_bridge.observe.events import Events

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_bridge.observe.body import Body
    from khala_bridge.observe.chronicle import Entry
    from khala_bridge.observe.scene import SideScene
    from khala_protocol.messages import Event


class Changes:
    """The changes from one moment to the present scene."""

    def __init__(self, before: Mapping[str, float], scene: SideScene, log: Sequence[Entry]) -> None:
        """Take health and shield by tag at that moment, the present scene, and the log since then."""
        self._world = scene.world
        self._log = log
        dead = frozenset(hex(tag) for entry in log for tag in entry.dead)
        self.events = Events(before, scene.views, dead)
        """Of the units in sight."""
        self.of_side: tuple[Event, ...] = tuple(event for entry in log for event in entry.events)
        """Events of the whole side, the earliest first."""
        self.alerts = tuple(alert for entry in log for alert in entry.alerts)
        """The game's alerts, the earliest first."""
        self.conditions: dict[str, str] = {}
        """By tag, what pages have written of a unit's condition and of its changes."""

    @functools.cached_property
    def fallen(self) -> Mapping[int, Body]:
        """Own units that died, as they were last seen, in ascending order of tags."""
        fallen = {unit.tag: unit for entry in self._log for unit in entry.fallen}
        return {tag: body(fallen[tag], self._world) for tag in sorted(fallen)}
