"""Whole battles: that they end, that skill pays, and that no side has an advantage by its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.maps.game_map import load_map, map_names
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import GameResult
from khala_simulator.world.world import World

Policy = Callable[[World], None]
STEP_LOOPS = 8


def idle(world: World) -> None:
    """Give no orders for player 1."""


def attack(world: World) -> None:
    """Attack-move to where the enemies are, again when it is done: the last of both sides may pass by each other."""
    foes = world.units_of(2)
    idle = [slot for slot in world.units_of(1).tolist() if not world.orders_of(slot)]
    if idle and len(foes):
        x, y = world.pos[foes].mean(axis=0)
        commands.attack_move(world, idle, (float(x), float(y)))


def run_away(world: World) -> None:
    corner = (1.0, 8.0) if world.loop // 200 % 2 == 0 else (31.0, 23.0)
    commands.move(world, world.units_of(1).tolist(), corner)


def focus_fire(world: World) -> None:
    """Make all units shoot at the weakest enemy that is near."""
    mine, foes = world.units_of(1), world.units_of(2)
    if not len(mine) or not len(foes):
        return
    centre = world.pos[mine].mean(axis=0)
    distance = ((world.pos[foes] - centre) ** 2).sum(axis=1)
    near = foes[distance <= max(distance.min(), 64.0)]
    weakest = near[(world.life[near] + world.shields[near]).argmin()]
    tag = world.tag_of(int(weakest))
    for slot in mine.tolist():
        if world.target[slot] != weakest:
            commands.attack_unit(world, [slot], tag)


def kite(world: World) -> None:
    """Step back while the weapon cools down, shoot when it is ready."""
    mine, foes = world.units_of(1), world.units_of(2)
    if not len(mine) or not len(foes):
        return
    for slot in mine.tolist():
        offset = world.pos[foes] - world.pos[slot]
        nearest = int(foes[(offset**2).sum(axis=1).argmin()])
        x, y = world.pos[slot] - world.pos[nearest]
        close = x * x + y * y < 16
        if world.cooldown[slot] > 4 and close:
            away = (x * x + y * y) ** 0.5
            commands.move(
                world, [slot], (float(world.pos[slot, 0] + 3 * x / away), float(world.pos[slot, 1] + 3 * y / away))
            )
        elif world.target[slot] == -1 or world.cooldown[slot] <= 4:
            commands.attack_unit(world, [slot], world.tag_of(nearest))


def play(name: str, policy: Policy, seed: int) -> World:
    world = new_game(load_map(name), seed=seed)
    while not world.ended:
        policy(world)
        advance(world, STEP_LOOPS)
    return world


def margin(world: World) -> float:
    """Return the damage dealt less the damage taken by player 1."""
    score = world.players[1].score
    return (score.damage_dealt.life + score.damage_dealt.shields) - (
        score.damage_taken.life + score.damage_taken.shields
    )


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=[] if n in ("llm_smac/2s3z", "llm_smac/2c_vs_64zg") else pytest.mark.slow)
        for n in map_names()
        if n.startswith("llm_smac/") and n != "llm_smac/2s_vs_1sc"  # the last two die together, and it begins again
    ],
)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_a_battle_that_both_sides_want_ends_before_the_time_limit(name: str, seed: int) -> None:
    world = play(name, attack, seed)
    assert world.loop < 1440
    assert {p.result for p in world.players[1:]} == {GameResult.VICTORY, GameResult.DEFEAT}


def test_an_idle_army_defends_itself() -> None:
    for seed in range(3):
        world = play("3s5z", idle, seed)
        assert world.loop < 1440
        assert world.players[1].score.killed_units >= 1


def test_a_mirrored_battle_is_won_by_either_side(make_field: Any) -> None:
    """The same places, mirrored, and orders at the same moment: being first in the arrays is no advantage."""
    wins = {1: 0, 2: 0}
    for seed in range(20):
        field = make_field(seed=seed)
        world = field.world
        places = np.random.default_rng(seed).uniform((7.5, 13.5), (10.5, 18.5), (5, 2)).tolist()
        for player in (1, 2):
            for name, (x, y) in zip(["Stalker"] * 2 + ["Zealot"] * 3, places, strict=True):
                field.put(name, player, x if player == 1 else 32 - x, y)
        for player, x in ((1, 23.0), (2, 9.0)):
            commands.attack_move(world, world.units_of(player).tolist(), (x, 16.0))
        while len(world.units_of(1)) and len(world.units_of(2)):
            field.play(STEP_LOOPS)
        wins[1 if len(world.units_of(1)) else 2] += 1
    assert min(wins.values()) >= 4


def test_focus_fire_beats_doing_nothing() -> None:
    focused = sum(margin(play("2s3z", focus_fire, seed)) for seed in range(3))
    idled = sum(margin(play("2s3z", idle, seed)) for seed in range(3))
    assert focused > idled


def test_running_away_loses_to_attacking() -> None:
    assert margin(play("2s3z", run_away, 0)) < margin(play("2s3z", attack, 0))


def test_kiting_stalkers_do_better_against_zealots_than_standing_ones() -> None:
    kited = sum(margin(play("3s_vs_3z", kite, seed)) for seed in range(3))
    stood = sum(margin(play("3s_vs_3z", attack, seed)) for seed in range(3))
    assert kited > stood + 300
    assert play("3s_vs_3z", kite, 0).players[1].result is GameResult.VICTORY


def test_more_zealots_beat_fewer() -> None:
    results = [play("3s5z_vs_3s6z", idle, seed).players[1].result for seed in range(4)]
    assert results.count(GameResult.VICTORY) <= 2
