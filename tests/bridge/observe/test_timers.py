"""How long until an ability is ready, or an effect ends: what no single snapshot has."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import facts_of
from khala_bridge.observe import Observer
from khala_bridge.observe.timers import Timers
from khala_bridge.state import Alliance, Effect, Snapshot
from khala_bridge.task.config import TaskConfig

FACTS = facts_of("multi")
BLINK = functions()["Effect_Blink_screen"].ability_id
PSI_STORM = 1
LIBERATOR_ZONE = 9

BLINKERS = TaskConfig.model_validate(
    {
        "name": "blinkers",
        "map": "2s3z",
        "task": "",
        "agents": [
            {
                "name": "A",
                "role": "",
                "teams": [{"name": "Stalker-1", "unit_types": ["Stalker"]}],
                "actions": {"Stalker": ["Ability_Blink_Screen", "Move_Screen"]},
            }
        ],
    }
)


@pytest.fixture
def stalkers(unit: Any, snapshot: Any) -> Any:
    def at(loop: int, *ready: int, more: Any = (), **fields: Any) -> Snapshot:
        units = [*(unit(tag, "Stalker", 15 + tag, 16, **fields) for tag in (1, 2)), *more]
        able = {tag: frozenset((BLINK,) if tag in ready else ()) for tag in (1, 2)}
        made: Snapshot = snapshot(units, loop=loop, abilities=able, upgrades=(87,))
        return made

    return at


def test_a_cooldown_runs_from_when_the_ability_was_last_ready(stalkers: Any) -> None:
    timers = Timers()
    for now in (stalkers(0, 1), stalkers(112)):
        timers.note(now)
    assert timers.ready_in_s(now.facts, now.units[1], BLINK) == 2.1  # 7.14 s of the ability less 5
    assert timers.ready_in_s(now.facts, now.units[2], BLINK) is None
    timers.note(stalkers(224))
    assert timers.ready_in_s(now.facts, now.units[1], BLINK) is None


def test_no_time_is_told_while_something_else_holds_the_unit(stalkers: Any) -> None:
    timers = Timers()
    for now in (stalkers(0, 1), stalkers(11, buff_ids=(17,))):
        timers.note(now)
    assert now.units[1].buffs == ("FungalGrowth",)
    assert timers.ready_in_s(now.facts, now.units[1], BLINK) is None


def test_an_effect_that_stays_in_its_place_ends_in_time(snapshot: Any) -> None:
    def at(loop: int) -> Snapshot:
        there = (Effect(PSI_STORM, Alliance.ENEMY, 1.5, (WorldPoint(3, 3),)),)
        made: Snapshot = dataclasses.replace(snapshot([], loop=loop), effects=there)
        return made

    timers = Timers()
    timers.note(at(0))
    effect = PSI_STORM, (WorldPoint(3, 3),)
    assert timers.effect_left_s(FACTS, effect, "PsiStorm") == 2.9
    timers.note(at(45))
    assert timers.effect_left_s(FACTS, effect, "PsiStorm") == 0.9
    assert timers.effect_left_s(FACTS, (LIBERATOR_ZONE, ()), "LiberatorDefenderZone") is None


def test_pages_tell_how_long_skills_buffs_and_barriers_last(stalkers: Any, unit: Any) -> None:
    observer = Observer(BLINKERS)
    observer.observe(stalkers(0, 1, 2))
    wall = unit(9, "ForceField", 18, 16, alliance="neutral", radius=1.7)
    now = stalkers(22, more=[wall], buff_ids=(18,), buff_duration_remain=56)
    text = observer.observe(now).agents["A"].text
    assert "| effects GuardianShield | 2.5 s left" in text
    assert "| not ready Blink (6.2 s)" in text
    assert "neutral ForceField at [14, 12] (10.7 s left), radius 1.7" in text
