from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from khala_simulator.world.orders import OrderKind
from khala_simulator.world.players import GameResult

if TYPE_CHECKING:
    from khala_simulator.world.world import World

ARMIES = {
    "llm_smac/1c3s5z": ({"Colossus": 1, "Stalker": 3, "Zealot": 5}, {"Colossus": 1, "Stalker": 3, "Zealot": 5}),
    "llm_smac/2c_vs_64zg": ({"Colossus": 2}, {"Zergling": 64}),
    "llm_smac/2s3z": ({"Stalker": 2, "Zealot": 3}, {"Stalker": 2, "Zealot": 3}),
    "llm_smac/2s_vs_1sc": ({"Stalker": 2}, {"SpineCrawler": 1}),
    "llm_smac/3s5z": ({"Stalker": 3, "Zealot": 5}, {"Stalker": 3, "Zealot": 5}),
    "llm_smac/3s5z_vs_3s6z": ({"Stalker": 3, "Zealot": 5}, {"Stalker": 3, "Zealot": 6}),
    "llm_smac/3s_vs_3z": ({"Stalker": 3}, {"Zealot": 3}),
    "llm_smac/3s_vs_4z": ({"Stalker": 3}, {"Zealot": 4}),
    "llm_smac/3s_vs_5z": ({"Stalker": 3}, {"Zealot": 5}),
}


def army(world: World, player: int) -> dict[str, int]:
    names = [world.unit_type(int(s)).name for s in world.units_of(player)]
    return {name: names.count(name) for name in sorted(set(names))}


def kill_all(world: World, *players: int) -> None:
    for player in players:
        commands.debug_kill(world, world.tag[world.units_of(player)].tolist())


@pytest.mark.parametrize("name", sorted(ARMIES))
def test_a_map_starts_with_its_armies(name: str) -> None:
    world = new_game(load_map(name))
    assert (army(world, 1), army(world, 2)) == ARMIES[name]
    assert world.loop == 0
    assert not world.fog
    assert world.facing()[world.live] == pytest.approx(4.7124, abs=1e-4) or name.endswith("1sc")


def test_the_enemy_attack_moves_to_the_learners_place() -> None:
    world = new_game(load_map("2s3z"))
    orders = [world.orders_of(int(s)) for s in world.units_of(2)]
    assert {(o[0].kind, o[0].point, len(o)) for o in orders} == {(OrderKind.ATTACK_MOVE, (9.0, 16.0), 1)}
    assert all(world.orders_of(int(s)) == [] for s in world.units_of(1))


def test_every_zergling_attacks_both_colossi() -> None:
    world = new_game(load_map("2c_vs_64zg"))
    colossi = {int(t) for t in world.tag[world.units_of(1)]}
    for slot in world.units_of(2).tolist():
        assert {o.target for o in world.orders_of(slot)} == colossi


@pytest.mark.parametrize("name", sorted(ARMIES))
def test_units_made_at_one_point_do_not_overlap(name: str) -> None:
    world = new_game(load_map(name))
    slots = world.live
    offset = world.pos[slots][:, None] - world.pos[slots]
    distance = np.sqrt((offset**2).sum(axis=-1)) + np.eye(len(slots)) * 99
    apart = world.separation[slots][:, None] + world.separation[slots]
    share_a_layer = world.layer_bits[slots][:, None] & world.layer_bits[slots] != 0
    assert (distance >= apart)[share_a_layer].all()


@pytest.mark.parametrize(
    ("dead", "mine", "theirs"),
    [(2, GameResult.VICTORY, GameResult.DEFEAT), (1, GameResult.DEFEAT, GameResult.VICTORY)],
)
@pytest.mark.parametrize("died_at", [1, 79, 80, 300])
def test_the_result_is_given_at_the_next_multiple_of_80_loops(
    dead: int, mine: GameResult, theirs: GameResult, died_at: int
) -> None:
    world = new_game(load_map("2s3z"))
    for player in (1, 2):
        commands.stop(world, world.units_of(player).tolist())
    advance(world, died_at - 1)
    kill_all(world, dead)
    advance(world, 1)
    while not world.ended:
        advance(world, 1)
    assert world.loop == -(-died_at // 80) * 80
    assert [p.result for p in world.players[1:]] == [mine, theirs]


def test_the_time_limit_is_a_tie_at_loop_1440() -> None:
    world = new_game(load_map("2s_vs_1sc"))
    played = advance(world, 5000)
    assert played == world.loop == 1440
    assert [p.result for p in world.players[1:]] == [GameResult.TIE, GameResult.TIE]


def test_a_victory_at_the_time_limit_is_a_victory() -> None:
    world = new_game(load_map("2s_vs_1sc"))
    advance(world, 1439)
    kill_all(world, 2)
    advance(world, 1)
    assert world.ended
    assert world.players[1].result is GameResult.VICTORY


def test_both_sides_come_back_when_both_are_gone() -> None:
    world = new_game(load_map("2s3z"))
    advance(world, 10)
    tags = set(world.tag[world.live].tolist())
    kill_all(world, 1, 2)
    advance(world, 1)
    assert (army(world, 1), army(world, 2)) == ARMIES["llm_smac/2s3z"]
    assert not tags & set(world.tag[world.live].tolist())
    assert {world.orders_of(int(s))[0].kind for s in world.units_of(2)} == {OrderKind.ATTACK_MOVE}
    assert not world.ended


def test_the_spine_crawler_stands_on_whole_cells_and_blocks_them() -> None:
    world = new_game(load_map("2s_vs_1sc"))
    spine = int(world.units_of(2)[0])
    assert world.pos[spine].tolist() == [14, 20]
    blocked = world.map.terrain.walk & ~world.ground.walk
    assert sorted(zip(*[a.tolist() for a in blocked.nonzero()], strict=True)) == [
        (19, 13),
        (19, 14),
        (20, 13),
        (20, 14),
    ]
    kill_all(world, 2)
    advance(world, 1)
    assert (world.ground.walk == world.map.terrain.walk).all()


def test_kills_and_losses_are_counted_in_both_scores() -> None:
    world = new_game(load_map("3s_vs_3z"))
    for player in (1, 2):
        commands.attack_move(world, world.units_of(player).tolist(), (16, 16))
    while not world.ended:
        advance(world, 8)
    me, foe = world.players[1].score, world.players[2].score
    assert me.killed_units == foe.lost_units == sum(d.owner == 2 for d in world.deaths)
    assert foe.killed_units == me.lost_units == sum(d.owner == 1 for d in world.deaths)
    assert me.killed_value_units == 100 * me.killed_units  # Zealots
    assert foe.killed_value_units == 175 * foe.killed_units  # Stalkers
    assert me.killed.army == [100 * me.killed_units, 0]
    assert foe.killed.army == [125 * foe.killed_units, 50 * foe.killed_units]
    assert me.lost.army == foe.killed.army
    assert me.damage_dealt == foe.damage_taken
    assert foe.damage_dealt.life > 0
