from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.maps.game_map import MapError, find_map, load_map, map_from, map_names
from khala_simulator.maps.nodes import ScenarioError
from khala_simulator.maps.scenario_file import parse_scenario, read_scenario
from khala_simulator.tick import advance, new_game

if TYPE_CHECKING:
    from pathlib import Path

DUEL = """\
name: duel
family: mine
title: A Zealot waits for two Zerglings
terrain: agria_open
players:
  1: {race: protoss, control: agent}
  2: {race: zerg, control: computer}
points:
  middle: [16, 16]
triggers:
  - name: begin
    when: [start]
    do:
      - create: {player: 1, unit: Zealot, at: middle}
      - create: {player: 2, unit: Zergling, count: 2, at: [26, 16]}
      - order: {player: 2, move: middle}
  - name: late
    when: [{at_loop: 30}]
    do:
      - create: {player: 2, unit: Zergling, at: [6, 16]}
  - name: time limit
    when: [{every_loops: 48}]
    do:
      - result: {1: victory, 2: defeat}
"""

MISTAKES = [
    (
        "{every_loops: 48}",
        "{every_loop: 48}",
        (
            "duel.yaml:22: triggers[2].when[0]: give start, unit_died, {every_loops: n}, {at_loop: n}, {died: who}, "
            "{made: who}, {enters: ...} or {touches: ...}"
        ),
    ),
    (
        "{every_loops: 48}",
        "{every_loops: 0}",
        "duel.yaml:22: triggers[2].when[0].every_loops: Input should be greater than 0",
    ),
    ("count: 2", "count: two", "duel.yaml:15: triggers[0].do[1].create.count: Input should be a valid integer"),
    ("move: middle", "walk: middle", "duel.yaml:16: triggers[0].do[2].order.walk: Extra inputs are not permitted"),
    (
        ", move: middle",
        "",
        (
            "duel.yaml:16: triggers[0].do[2].order: give exactly one of attack_move, move, attack_units_of, "
            "attack_nearest_of, unload_at, gather_near"
        ),
    ),
    (
        "- order:",
        "- command:",
        (
            "duel.yaml:16: triggers[0].do[2]: give exactly one of create, spawn, regroup, remove, order, select, draw, "
            "score, give, result"
        ),
    ),
    ("unit: Zealot, ", "", "duel.yaml:14: triggers[0].do[0].create.unit: Field required"),
    (
        "at: middle",
        "at: center",
        "duel.yaml:14: triggers[0].do[0].create.at: there is no point center; there are middle",
    ),
    (
        "at: middle",
        "at: midle",
        "duel.yaml:14: triggers[0].do[0].create.at: there is no point midle; did you mean middle?",
    ),
    (
        "unit: Zealot",
        "unit: Zealott",
        "triggers[0].do[0].create.unit: there is no unit type Zealott; did you mean Zealot?",
    ),
    ("player: 2, unit", "player: 3, unit", "duel.yaml:15: triggers[0].do[1].create.player: there is no player 3"),
    (
        "race: zerg",
        "race: borg",
        "duel.yaml:7: players.2.race: Input should be 'protoss', 'terran', 'zerg' or 'random'",
    ),
    (
        "{1: victory",
        "{1: won",
        "duel.yaml:24: triggers[2].do[0].result.1: Input should be 'victory', 'defeat' or 'tie'",
    ),
    ("title:", "titel:", "title: Field required"),
    ("[16, 16]", "[16, 16", "duel.yaml:10: not YAML:"),
]


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES)
def test_a_mistake_is_named_with_file_line_and_field(right: str, wrong: str, message: str) -> None:
    assert right in DUEL
    with pytest.raises(ScenarioError) as error:
        parse_scenario(DUEL.replace(right, wrong, 1), "duel.yaml")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nothing.yaml: can't be read: No such file or directory"):
        read_scenario(tmp_path / "nothing.yaml")


def test_a_scenario_of_a_user_plays(tmp_path: Path) -> None:
    path = tmp_path / "duel.yaml"
    path.write_text(DUEL, encoding="utf-8")
    world = new_game(map_from(read_scenario(path), DUEL))
    assert [len(world.units_of(p)) for p in (1, 2)] == [1, 2]
    advance(world, 30)
    assert [len(world.units_of(p)) for p in (1, 2)] == [1, 3]
    assert advance(world, 100) == 18
    assert [p.result.name for p in world.players[1:]] == ["VICTORY", "DEFEAT"]


def test_all_nine_llm_smac_maps_are_shipped() -> None:
    names = [n.removeprefix("llm_smac/") for n in map_names() if n.startswith("llm_smac/")]
    assert names == [
        "1c3s5z", "2c_vs_64zg", "2s3z", "2s_vs_1sc", "3s5z", "3s5z_vs_3s6z", "3s_vs_3z", "3s_vs_4z", "3s_vs_5z",
    ]  # fmt: skip


def test_a_shipped_map_hangs_together(subtests: pytest.Subtests) -> None:
    for name in map_names():
        with subtests.test(name):
            game_map = load_map(name)
            terrain = game_map.terrain
            width, height = terrain.size
            assert f"{game_map.family}/{game_map.name}" == name
            assert game_map.path == f"{name}.SC2Map"
            assert width * height % 8 == 0  # clients unpack one bit per cell
            for grid in (terrain.walk, terrain.glide, terrain.build, terrain.creep, terrain.cliff, terrain.height):
                assert grid.shape == (height, width)
                assert not grid.flags.writeable or grid is terrain.creep
            assert terrain.vertices.shape == (height + 1, width + 1)
            assert (terrain.walk <= terrain.glide).all()
            assert (terrain.build <= terrain.walk).all()
            x0, y0, x1, y1 = terrain.playable
            outside = terrain.walk.copy()
            outside[y0:y1, x0:x1] = False
            assert not outside.any()
            # -16 + 32 v / 255 is the height of the cell's lower-left corner
            z = terrain.height / 255 * 32 - 16
            assert abs(z - terrain.vertices[:-1, :-1])[terrain.walk].max() < 0.2


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("2s3z", "llm_smac/2s3z"),
        ("llm_smac/2s3z", "llm_smac/2s3z"),
        ("llm_smac/2s3z.SC2Map", "llm_smac/2s3z"),
        ("/somewhere/Maps/llm_smac/3s_vs_3z.SC2Map", "llm_smac/3s_vs_3z"),
        ("C:\\Maps\\llm_smac\\3s_vs_3z.SC2Map", "llm_smac/3s_vs_3z"),
    ],
)
def test_a_map_is_found_by_name_and_by_path(given: str, found: str) -> None:
    assert find_map(given) == found


@pytest.mark.parametrize("given", ["", "2s4z", "smac/2s3z/x", "../../etc/passwd"])
def test_an_unknown_map_is_told_with_those_there_are(given: str) -> None:
    with pytest.raises(MapError, match=r"no map .*; shipped are Melee/Empty128, .*, mini_games/MoveToBeacon"):
        find_map(given)
