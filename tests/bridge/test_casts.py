"""What became of casts: an accepted order is followed until it is done, or given up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from khala_bridge.act import Actor, Casts, GameRefusal, JointAction
from khala_bridge.act.rejected import CallRejected, reject
from khala_bridge.catalogue.functions import functions
from khala_bridge.observe import Observer
from khala_bridge.task.config import TaskConfig
from khala_protocol.messages import CastView
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from khala_bridge.state import Snapshot

TASK = TaskConfig.model_validate(
    {
        "name": "casters",
        "map": "2s3z",
        "task": "",
        "agents": [
            {
                "name": "A",
                "role": "",
                "teams": [{"name": kind, "unit_types": [kind]} for kind in ("HighTemplar", "Stalker")],
                "actions": {
                    "HighTemplar": ["Ability_PsiStorm_Screen", "Move_Screen"],
                    "Stalker": ["Ability_Blink_Screen", "Move_Screen"],
                },
            }
        ],
    }
)
STORM = functions()["Effect_PsiStorm_screen"].ability_id
BLINK = functions()["Effect_Blink_screen"].ability_id
MOVE = functions()["Move_screen"].ability_id
TEMPLAR, STALKER = 1, 2
CAST = "HighTemplar <Ability_PsiStorm_Screen([12, 9])>"


class Said(NamedTuple):
    """A reply that took effect, and the state in which it did."""

    joint: JointAction
    before: Snapshot


@pytest.fixture
def now(unit: Any, snapshot: Any) -> Any:
    """Return a state with the two casters, of which either may differ or be gone."""

    def make(*, templar: dict[str, Any] | None, stalker: bool = True, loop: int = 0, dead: Any = frozenset()) -> Any:
        units = [unit(STALKER, "Stalker", 20, 16)]
        if templar is not None:
            units.append(unit(TEMPLAR, "HighTemplar", 16, 16, **{"energy": 100.0, "energy_max": 200.0} | templar))
        able = {TEMPLAR: frozenset((MOVE, STORM)), STALKER: frozenset((MOVE, BLINK) if stalker else (MOVE,))}
        return snapshot(units, abilities=able, upgrades=(52, 87), loop=loop, dead=dead)

    return make


def say(before: Snapshot, *calls: str) -> Said:
    observation = Observer(TASK).observe(before)
    words = "Actions:\n" + "\n".join(f"    Team {call.split()[0]}:\n        {call.split(' ', 1)[1]}" for call in calls)
    joint = Actor(TASK).joint(observation, {"A": parse(words)})
    assert joint.accepted["A"] == calls
    return Said(joint, before)


@pytest.mark.parametrize(
    ("templar", "end"),
    [
        ({"energy": 25.6}, CastView(call=CAST, end="cast")),
        ({"orders": (STORM,)}, CastView(call=CAST, end="under way")),
        ({}, CastView(call=CAST, end="not cast", why="the order ended without it")),
        (None, CastView(call=CAST, end="not cast", why="its caster died")),
    ],
)
def test_a_cast_is_told_by_what_its_caster_has_done(templar: Any, end: CastView, now: Any) -> None:
    joint, before = say(now(templar={}), CAST)
    after = now(templar=templar, loop=11, dead=frozenset() if templar is not None else frozenset({TEMPLAR}))
    assert Casts().follow(joint.commands, before, after) == {"A": [end]}


def test_a_cast_on_its_way_is_told_again_when_it_ends(now: Any) -> None:
    casts = Casts()
    joint, before = say(now(templar={}), CAST)
    walks = now(templar={"orders": (STORM,)}, loop=11)
    assert casts.follow(joint.commands, before, walks) == {"A": [CastView(call=CAST, end="under way")]}
    assert casts.follow((), walks, walks) == {}
    assert casts.follow((), walks, now(templar={"energy": 25.0}, loop=22)) == {"A": [CastView(call=CAST, end="cast")]}
    assert casts.follow((), walks, walks) == {}


def test_an_order_in_its_place_ends_a_cast(now: Any) -> None:
    casts = Casts()
    joint, before = say(now(templar={}), CAST)
    walks = now(templar={"orders": (STORM,)}, loop=11)
    casts.follow(joint.commands, before, walks)
    joint, before = say(walks, "HighTemplar <Move_Screen([3, 3])>")
    told = casts.follow(joint.commands, before, now(templar={}, loop=22))
    assert told == {"A": [CastView(call=CAST, end="not cast", why="another order took its place")]}


def test_what_costs_no_energy_is_told_by_its_cooldown(now: Any) -> None:
    call = "Stalker <Ability_Blink_Screen([12, 9])>"
    joint, before = say(now(templar={}), call)
    assert Casts().follow(joint.commands, before, now(templar={}, stalker=False, loop=11)) == {
        "A": [CastView(call=call, end="cast")]
    }


def test_a_cast_that_the_game_refuses_and_other_orders_are_not_told_again(now: Any) -> None:
    joint, before = say(now(templar={}), CAST, "Stalker <Move_Screen([3, 3])>")
    said = joint.commands[0].said
    assert said is not None
    refusal = GameRefusal("A", reject(said.call, CallRejected("refused_by_game", "No."), said.team.name))
    assert Casts().follow(joint.commands, before, now(templar={}, loop=11), [refusal]) == {}
