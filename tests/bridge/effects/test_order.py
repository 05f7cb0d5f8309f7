"""A cast and a move in one reply: the cast happens at once, and the move waits for no order from before the reply."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import pytest

from khala_bridge.act import Actor, Executor
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_protocol.speech import parse

from .cases import AGENT
from .stage import Stage

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Unit

LOOPS = 12
"""Loops of a reply: the screen executor moves the camera, selects and gives two orders meanwhile."""


class Cast(NamedTuple):
    """A cast of a type of unit, and whether its effect is there when the reply is played."""

    caster: str
    call: str
    happened: Callable[[Unit, WorldPoint], bool]


CASTS = [
    pytest.param(
        Cast("Sentry", "Ability_GuardianShield()", lambda now, _: "GuardianShield" in now.buffs), id="instant"
    ),
    pytest.param(
        Cast("Stalker", "Ability_Blink_Screen([17, 12])", lambda now, before: now.pos.x > before.x), id="an order"
    ),
]


class Play:
    """A caster on a stage, told one reply after another."""

    def __init__(self, cast: Cast, executor: Executor) -> None:
        teams = (TeamConfig(name="Team", unit_types=(cast.caster,), kind="select"),)
        name = cast.call.partition("(")[0]
        actions = {cast.caster: (name, "Move_Screen", "Move_Minimap")}
        agent = AgentConfig(name=AGENT, role="", admits="any", teams=teams, actions=actions)
        self._task = TaskConfig(name="order", map="Simple64", task="", agents=(agent,))
        self._executor = executor
        self._stage = Stage(cast.caster, layers=True)

    @property
    def now(self) -> Unit:
        """The caster."""
        return self._stage.look().snapshot.units[self._stage.caster]

    def say(self, *calls: str) -> Unit:
        """Play a reply; return the caster after it."""
        snapshot = self._stage.look().snapshot
        observation = Observer(self._task).observe(snapshot)
        teams = observation.agents[AGENT].teams
        team = next(team.name for team in teams if self._stage.caster in team.tags)
        reply = "\n".join(["Actions:", f"Team {team}:", *(f"<{call}>" for call in calls)])
        joint = Actor(self._task).joint(observation, {AGENT: parse(reply)})
        assert joint.rejections[AGENT] == ()
        played, _ = self._stage.play(self._executor.plan(joint.commands, snapshot, LOOPS))
        assert played.refusals == ()
        return self.now


@pytest.mark.parametrize("executor", [RawExecutor(), ScreenExecutor()], ids=["raw", "screen"])
@pytest.mark.parametrize("cast", CASTS)
def test_a_move_follows_the_cast_before_it_and_not_the_order_of_before(cast: Cast, executor: Executor) -> None:
    play = Play(cast, executor)
    far = play.say("Move_Minimap([60, 60])")
    (old,) = far.orders
    after = play.say(cast.call, "Move_Screen([8, 12])")
    assert cast.happened(after, far.pos)
    (move,) = after.orders
    assert move.ability_id == old.ability_id
    assert move.target_world_space_pos is not None and old.target_world_space_pos is not None
    assert move.target_world_space_pos.x < far.pos.x < old.target_world_space_pos.x
