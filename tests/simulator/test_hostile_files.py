"""Files that are made to do harm: scenarios, archives and replays end in a sentence, soon, whatever is in them."""

from __future__ import annotations

import copy
import json
import os
import random
import time
import zlib
from importlib import resources
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.maps.game_map import map_from
from khala_simulator.maps.map_file import MapDataError, read_file, read_map
from khala_simulator.maps.nodes import ScenarioError
from khala_simulator.maps.scenario_file import parse_scenario, read_scenario, sheets
from khala_simulator.process import mpq
from khala_simulator.process.client import Client, ResponseError, interface
from khala_simulator.tick import new_game
from khala_simulator.world import world as worlds

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

MARK = b"# A map of Khala's simulator\n"
HEAD = """\
name: try_out
family: test
title: To try things
terrain: {flat: [48, 48]}
players: {1: {race: terran, control: agent}, 2: {race: zerg, control: computer}}
"""
UNIT = HEAD + "units: [{player: 1, unit: Marine, at: [4, 4]}]\n"
BOMB = "\n".join(["a0: &a0 [x]", *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12))])
MERGED = "\n".join(
    ["m0: &m0 {x: 1}", *(f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 9)}]}}" for i in range(1, 12))]
)

SENTENCES = [
    (HEAD + f"triggers: {'[' * 200_000}", "h.yaml:6: the file: nested too deep"),
    (HEAD + "? " * 2000, "h.yaml:6: the file: nested too deep"),
    (BOMB, "there are more than 10000 values, those of aliases included"),
    (MERGED, "there are more than 10000 values, those of aliases included"),
    ("r: &r [*r, *r]", "nested too deep"),
    (HEAD + "points: {[1, 2]: [3, 4]}\n", "h.yaml:6: points: write the name of a field here, not a list or fields"),
    (HEAD + "title: twice\n", "h.yaml:6: title: is given a second time"),
    (HEAD + 'melee: !!int ""\n', "h.yaml:6: melee:  is no int; put it in quotes if it is a text"),
    (HEAD + "melee: 2026-02-31\n", "h.yaml:6: melee: 2026-02-31 is no timestamp"),
    (HEAD + f"melee: {'9' * 5000}\n", "is longer than 2000 characters"),
    (HEAD + "melee: \x07\n", "h.yaml:6: the file: it has characters that no text has"),
    (HEAD + f"extends: {'x' * 2000}\n", f"there is no shipped scenario {'x' * 60}…"),
    (HEAD + "triggers: [{name: a, when: [7], do: [{score: {1: 1}}]}]\n", "triggers[0].when[0]: give start, unit_died"),
    (HEAD + "triggers: [{name: a, when: [start], do: [7]}]\n", "triggers[0].do[0]: give exactly one of create"),
    (HEAD + "triggers: [{name: a, when: [start], do: [{draw: 7}]}]\n", "triggers[0].do[0]"),
    (UNIT.replace("[4, 4]", "7"), "units[0].at: give a point's name"),
    (UNIT.replace("[4, 4]", "[.nan, 4]"), "units[0].at[0]: Input should be a finite number"),
    (UNIT.replace("[4, 4]", "{x: {from: 0, to: 1.0e+9}, y: 4}"), "at most 400 numbers"),
    (UNIT.replace("[4, 4]", "{x: {from: 9, to: 0}, y: 4}"), "an end that is not before the start"),
    (UNIT.replace("[4, 4]", "{x: {from: 0, to: 40}, y: {from: 0, to: 40}}"), "give at most 400 places"),
    (UNIT.replace("Marine", "Marinee" + "x" * 1000), f"there is no unit type Marinee{'x' * 53}…"),
    (HEAD.replace("[48, 48]", "[100000, 100000]"), "terrain.flat[0]: Input should be less than or equal to 512"),
]


@pytest.mark.parametrize(("text", "sentence"), SENTENCES, ids=[sentence[-40:] for _, sentence in SENTENCES])
def test_a_hostile_scenario_is_refused_with_file_line_and_field(text: str, sentence: str) -> None:
    with pytest.raises(ScenarioError) as error:
        parse_scenario(text, "h.yaml")
    assert sentence in str(error.value)
    assert str(error.value).startswith("h.yaml:")
    assert len(str(error.value)) < 500


def test_a_scenario_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "h.yaml"
    path.write_bytes(HEAD.encode() + b"# \xff\n")
    with pytest.raises(ScenarioError, match=r"h\.yaml:6: the file: it is no UTF-8 text"):
        read_scenario(path)


OFF = [
    (UNIT.replace("[4, 4]", "[400, 4]"), "units[0].at: [400, 4] is not on the map, which has 48 x 48 cells"),
    (HEAD + "points: {a: [4, -1]}\n", "points.a: [4, -1] is not on the map, which has 48 x 48 cells"),
    (HEAD + "camera: [1.0e+300, 4]\n", "camera: [1e+300, 4] is not on the map, which has 48 x 48 cells"),
    (
        HEAD + "triggers: [{name: a, when: [start], do: [{create: {player: 1, unit: Marine, at: [[4, 99]]}}]}]\n",
        "triggers[0].do[0].create.at: [4, 99] is not on the map, which has 48 x 48 cells",
    ),
    (HEAD.replace("{flat: [48, 48]}", "../x"), "terrain: no terrain '../x' is shipped"),
    (HEAD.replace("{flat: [48, 48]}", "x" * 300), f"terrain: no terrain '{'x' * 60}…' is shipped"),
]


@pytest.mark.parametrize(("text", "sentence"), OFF, ids=[sentence[:20] for _, sentence in OFF])
def test_what_is_not_on_the_terrain_is_refused_with_its_field(text: str, sentence: str) -> None:
    with pytest.raises(MapDataError) as error:
        read_map(MARK + text.encode(), "own.SC2Map")
    assert str(error.value) == f"own.SC2Map: {sentence}"


def test_a_grid_a_column_and_a_region_that_reach_beyond_the_map_end_at_its_edge() -> None:
    text = HEAD + (
        "points: {a: [4, 4]}\nregions: {r: {rect: [900, 900, 990, 990]}}\nunits:\n"
        "  - {player: 1, unit: Medivac, at: {x: 1.0e+9, y: -7}}\n"
        "  - {player: 1, unit: Medivac, at: {around: a, x: 0, y: -900}}\n"
        "  - {player: 1, unit: Medivac, count: 3, at: {column: a, step: 1.0e+300}}\n"
        "  - {player: 1, unit: Medivac, at: {random_in: r}}\n"
    )
    client = Client()
    players = [sc.PlayerSetup(type=kind) for kind in (sc.Participant, sc.Computer)]
    game_map = sc.LocalMap(map_data=MARK + text.encode())
    client.ask(create_game=sc.RequestCreateGame(local_map=game_map, player_setup=players))
    client.ask(join_game=sc.RequestJoinGame(race=1, options=interface(screen=0)))  # type: ignore[arg-type]  # Terran
    units = client.step(20).observation.raw_data.units
    assert len(units) == 6
    assert all(0 <= axis <= 48 for unit in units for axis in (unit.pos.x, unit.pos.y))


def test_a_script_that_makes_units_without_end_stops_before_the_tags_are_used_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = HEAD + (
        "triggers: [{name: a, when: [start], do: ["
        + ", ".join(["{create: {player: 1, unit: Medivac, at: {x: {from: 1, to: 20}, y: {from: 1, to: 5}}}}"] * 3)
        + "]}]\n"
    )
    monkeypatch.setattr(worlds, "MOST_UNITS", 150)
    world = new_game(map_from(parse_scenario(text, "h.yaml"), text), seed=1)
    assert len(world.units_of(1)) == 150


# mutations ------------------------------------------------------------------------------------------------------------

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 99, 2**31, 2**70, 0.5, -0.5, 1e300, float("inf"), float("nan"), "", "x", "Zealot", "touched",
    "start", "random", "../x", "a" * 300, "\0", [], {}, [[]], [1], [0, 0], [-5, -5], [1e9, 1e9], [0, 0, 32, 32],
    [[1, 1], [2, 2]], {"x": 1, "y": 1}, {"random_in": "r"}, {"column": [4, 4]}, {"flat": [1, 1]}, {"flat": [0, 9]},
    {1: "x"}, {"x": {"from": 0, "to": 1e9}, "y": 3},
)  # fmt: skip


def shipped_scenarios() -> list[Any]:
    """Return the data of the scenarios of all shipped maps."""
    maps = resources.files("khala_simulator.data") / "maps"
    files = [
        maps / family / file.name
        for family in ("llm_smac", "SMAC_Maps", "duels", "mini_games", "llm_pysc2")
        for file in (maps / family).iterdir()
        if file.name.endswith(".yaml")
    ]
    return [sheet.data() for file in files for _, sheet in sheets(file.read_text(encoding="utf-8"), str(file))]


def mutated(data: Any, dice: random.Random) -> Any:
    """Return a scenario's data with some values replaced, dropped, moved or scaled; most are still YAML."""
    data = yaml.safe_load(yaml.safe_dump(data))
    for _ in range(dice.choice((1, 1, 1, 2, 3))):
        holder, key = dice.choice(_places(data))
        kind = dice.random()
        if kind < 0.5:
            holder[key] = copy.deepcopy(dice.choice(VALUES))  # a later change must not reach the next scenario
        elif kind < 0.65:
            del holder[key]
        elif kind < 0.8:
            other, its_key = dice.choice(_places(data))
            holder[key] = yaml.safe_load(yaml.safe_dump(other[its_key]))
        elif isinstance(holder[key], (int, float)):
            holder[key] *= dice.choice((-1, 10, 1000, 0.1))
        if not _places(data):
            return {}
    return data


def _places(data: Any) -> list[tuple[Any, Any]]:
    pairs = list(data.items()) if isinstance(data, dict) else list(enumerate(data)) if isinstance(data, list) else []
    return [place for key, value in pairs for place in ((data, key), *_places(value))]


def play(data: bytes, players: int) -> str:
    """Create and play the start of a game on a map; return how it was refused, "" if it was played."""
    client = Client()
    setups = [sc.PlayerSetup(type=sc.Participant), sc.PlayerSetup(type=sc.Computer)][:players]
    request = sc.RequestCreateGame(local_map=sc.LocalMap(map_data=data, map_path="x.SC2Map"), player_setup=setups)
    created = client.ask(create_game=request).create_game
    if created.HasField("error"):
        return created.error_details
    joined = client.ask(join_game=sc.RequestJoinGame(race=1, options=sc.InterfaceOptions(raw=True))).join_game  # type: ignore[arg-type]  # Terran
    if not joined.HasField("error"):
        client.step(30)
        client.step(30)
    return joined.error_details


def play_mutations(count: int, seed: int) -> int:
    """Play so many mutated scenarios; return how many were played at all."""
    shipped = [data for data in shipped_scenarios() if not data.get("melee")]
    played = 0
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        data = mutated(dice.choice(shipped), dice)
        text = yaml.safe_dump(data, sort_keys=False).encode("utf-8", "replace")
        began = time.process_time()
        try:
            said = play(MARK + text, len(data.get("players") or ()) if isinstance(data.get("players"), dict) else 1)
        except ResponseError as error:
            raise AssertionError(f"mutation {seed} {number}: {error}") from error
        assert time.process_time() - began < 10, f"mutation {seed} {number} took long"
        assert not said or "x.SC2Map" in said or "has" in said, f"mutation {seed} {number}: {said}"
        played += not said
    return played


def test_mutated_scenarios_are_played_or_refused() -> None:
    assert 0 < play_mutations(14, seed=1) < 14


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_many_mutated_scenarios_are_played_or_refused() -> None:
    played = play_mutations(600, seed=2)
    assert 30 < played < 570


# replays --------------------------------------------------------------------------------------------------------------

FIELDS = ("path", "map", "players", "interfaces", "seed", "disable_fog", "loops", "observers", "results", "races")
JUNK: tuple[Any, ...] = (None, -1, 1.5, "x", [7], {"9": "0801"})


@pytest.fixture(scope="module")
def head_and_log() -> tuple[dict[str, Any], bytes]:
    client = Client()
    client.play("SMAC_Maps/3m", interface(screen=0))
    client.step(8)
    data = mpq.member(client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data, "khala.replay")
    assert data is not None
    head, _, log = zlib.decompress(data.partition(b"\n")[2]).partition(b"\n")
    return json.loads(head), log


@pytest.mark.parametrize("field", FIELDS)
def test_a_replay_whose_head_is_wrong_is_refused_or_watched(
    field: str, head_and_log: tuple[dict[str, Any], bytes]
) -> None:
    head, log = head_and_log
    for value in JUNK:
        text = json.dumps({**head, field: value}).encode() + b"\n" + log
        client, data = Client(), b"Khala replay 3\n" + zlib.compress(text)
        info = client.ask(replay_info=sc.RequestReplayInfo(replay_data=data)).replay_info
        if info.HasField("error"):
            assert info.error_details.startswith("The replay is damaged: ")
            continue
        assert (field, value) == ("path", "x")  # any name will do


# files that are none --------------------------------------------------------------------------------------------------


def directory(path: Path) -> None:
    path.mkdir()


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("make", [directory, pytest.param(pipe, marks=pytest.mark.posix), endless])
def test_a_map_that_is_no_regular_file_is_not_opened(tmp_path: Path, make: Callable[[Path], None]) -> None:
    path = tmp_path / "x.SC2Map"
    make(path)
    with pytest.raises(OSError, match="it is no regular file"):
        read_file(path)
    request = sc.RequestCreateGame(local_map=sc.LocalMap(map_path=str(path)), player_setup=[sc.PlayerSetup(type=1)])  # type: ignore[arg-type]  # Participant
    created = Client().ask(create_game=request).create_game
    assert created.error == sc.ResponseCreateGame.InvalidMapPath
    info = Client().ask(replay_info=sc.RequestReplayInfo(replay_path=str(path))).replay_info
    assert info.error == sc.ResponseReplayInfo.InvalidReplayPath


def test_a_map_that_is_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.SC2Map"
    path.write_bytes(bytes(100))
    monkeypatch.setattr("khala_simulator.maps.map_file.LARGEST_FILE", 99)
    with pytest.raises(OSError, match="it is larger than 99 bytes"):
        read_file(path)
