"""The army: it defends the bases, goes on with its attack, or waits at the front until it is large enough for one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_simulator.opponent import attack, defence, hands, stance
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide


def lead(side: OwnSide, enemy: Enemy) -> None:
    """Give the army its orders for this thought."""
    army = [slot for slot in side.army if side.world.can_act[slot] and side.world.carrier[slot] == NOBODY]
    threat = defence.watch(side, enemy)
    if threat is not None:
        army = defence.defend(side, army, threat)
    if side.mind.attacking:
        attack.go_on(side, enemy, army)
    elif threat is None:
        stance.gather_up(side, army)
        _garrison(side, army)
        attack.set_out(side, enemy)


def _garrison(side: OwnSide, army: list[int]) -> None:
    """Send Marines into Bunkers with room."""
    world = side.world
    marines = [s for s in army if world.unit_type(s).name == "Marine" and stance.idle(side, s)]
    for bunker in side.of_type("Bunker"):
        room = world.unit_type(bunker).cargo_space - len(world.passengers(bunker))
        marines.sort(key=lambda s: (math.dist(side.place(s), side.place(bunker)), s))
        if room > 0 and marines and hands.smart(side, marines[:room], world.tag_of(bunker)):
            del marines[:room]
