"""Archives of StarCraft II itself: made here, byte by byte, and read as maps."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, Any

import mpyq
import numpy as np
import pytest
from typer.testing import CliRunner

from khala_simulator.cli import app
from khala_simulator.maps import terrain_file, walkability
from khala_simulator.maps.archive import ArchiveError, read_archive
from khala_simulator.maps.game_map import load_map
from khala_simulator.maps.map_file import MapDataError, is_placeholder, read_map
from khala_simulator.maps.terrain_file import TerrainError
from khala_simulator.process.install import InstallError, install, link_maps
from khala_simulator.tick import advance, new_game

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

WIDTH, HEIGHT = 40, 32
PLAYABLE = (2, 3, 38, 30)
OBJECTS = """<?xml version="1.0" encoding="utf-8"?>
<PlacedObjects Version="27">
    <ObjectPoint Id="1" Position="10.5,10.5,0" Type="StartLoc" Name="Start Location 001"/>
    <ObjectPoint Id="2" Position="29.5,22.5,0" Type="StartLoc" Name="Start Location 002"/>
    <ObjectPoint Id="3" Position="20,20,0" Type="Normal" Name="Point 001"/>
    <ObjectUnit Id="4" Position="4,10.5,8" UnitType="MineralField" Resources="1800"/>
    <ObjectUnit Id="5" Position="4,12.5,8" UnitType="MineralField750"/>
    <ObjectUnit Id="6" Position="20.25,16,8" Rotation="3.1416" Player="2" UnitType="Zealot"/>
    <ObjectUnit Id="7" Position="20,18,8" UnitType="SomethingOfACampaign"/>
    <ObjectDoodad Id="8" Position="20,12,8" Type="Tree"/>
</PlacedObjects>
"""


# writing --------------------------------------------------------------------------------------------------------------


def encrypted(data: bytes, key: int) -> bytes:
    """Return the bytes that the reader's own decryption turns back into ``data``."""
    table: dict[int, int] = mpyq.MPQArchive.encryption_table
    seed, out = 0xEEEEEEEE, []
    for (value,) in struct.iter_unpack("<I", data):
        seed = (seed + table[0x400 + (key & 0xFF)]) & 0xFFFFFFFF
        out.append(value ^ ((key + seed) & 0xFFFFFFFF))
        key = (((~key << 0x15) + 0x11111111) | (key >> 0x0B)) & 0xFFFFFFFF
        seed = (value + seed + (seed << 5) + 3) & 0xFFFFFFFF
    return struct.pack(f"<{len(out)}I", *out)


def archive(files: dict[str, bytes]) -> bytes:
    """Return an MPQ archive of format 0: header, files of one unit each, hash table, block table."""
    hashed = mpyq.MPQArchive.__new__(mpyq.MPQArchive)._hash
    body, blocks, hashes = b"", b"", b""
    for index, (name, content) in enumerate(files.items()):
        packed = b"\x02" + zlib.compress(content)
        small = len(packed) < len(content)
        stored = packed if small else content
        flags = 0x81000000 | (0x200 if small else 0)
        blocks += struct.pack("<4I", 32 + len(body), len(stored), len(content), flags)
        hashes += struct.pack("<2I2HI", hashed(name, "HASH_A"), hashed(name, "HASH_B"), 0, 0, index)
        body += stored
    at = 32 + len(body)
    header = struct.pack(
        "<4s2I2H4I", b"MPQ\x1a", 32, at + len(hashes) + len(blocks), 0, 3, at, at + len(hashes), len(files), len(files)
    )
    return (
        header
        + body
        + encrypted(hashes, hashed("(hash table)", "TABLE"))
        + encrypted(blocks, hashed("(block table)", "TABLE"))
    )  # one piece after the other


def map_info(playable: tuple[int, ...] = PLAYABLE, size: tuple[int, int] = (WIDTH, HEIGHT)) -> bytes:
    head = b"IpaM" + struct.pack("<5I", 39, 0, 0, *size) + struct.pack("<2I", 1, 0) + b"\0\0" + struct.pack("<I", 7)
    return head + b"Dark\0BraxisAlpha\0" + struct.pack("<4I", *playable) + struct.pack("<I", 8 * 4096)


def plateau() -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """Return a level 128 in the west and 64 in the east, with a cliff at x = 20 and a ramp in rows 12 to 17."""
    cliff = np.full((HEIGHT, WIDTH), 64, dtype=np.uint16)
    cliff[:, :20] = 128
    cliff[12:18, 18:22] = (112, 96, 88, 72)
    cliff[0, :] = 0
    flags = np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    flags[:, 18:22] = 1
    return cliff, flags


def map_files() -> dict[str, bytes]:
    cliff, flags = plateau()
    pairs = np.zeros((HEIGHT + 1, WIDTH + 1, 2), dtype="<u2")
    pairs[:, :, 0] = 8 * 256
    pairs[:, :20, 0] = 10 * 256
    pairs[0, :, 0] = 250 * 256
    paint = np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    paint[5, 30] = 0b0100
    return {
        "MapInfo": map_info(),
        "t3SyncHeightMap": b"SMAP" + bytes(60) + pairs.tobytes(),
        "t3SyncCliffLevel": b"CLIF" + bytes(28) + cliff.astype("<u2").tobytes(),
        "t3CellFlags": b"LFCT" + bytes(28) + flags.tobytes(),
        "CellAttribute_Pnp": struct.pack("<I", WIDTH * HEIGHT * 8) + paint.tobytes(),
        "Objects": OBJECTS.encode(),
    }


@pytest.fixture(scope="module")
def whole() -> bytes:
    return archive(map_files())


# reading --------------------------------------------------------------------------------------------------------------


def test_an_archive_is_a_map_with_the_terrain_of_its_files(whole: bytes) -> None:
    game_map = read_archive(whole, "Melee/Hill.SC2Map")
    terrain = game_map.terrain
    cliff, _ = plateau()
    assert (game_map.name, terrain.size, terrain.playable) == ("Hill", (WIDTH, HEIGHT), PLAYABLE)
    assert (terrain.cliff == cliff).all()
    assert terrain.vertices[3, 3] == 10
    assert terrain.vertices[3, 30] == 8
    assert terrain.vertices[0, 5] == -6
    assert terrain.height[10, 10] == round(26 / 32 * 255)
    assert terrain.height[2, 10] == 0  # not in the playable area
    assert not terrain.walk[5, 30]  # painted
    assert not terrain.glide[5, 30]
    assert terrain.walk[14, 4:36].all()  # over the ramp
    assert not terrain.build[14, 18:22].any()
    assert not terrain.walk[8, 18:22].all()  # the cliff
    assert terrain.glide[8, 18:22].all()
    inside = np.zeros_like(terrain.walk)
    inside[3:30, 2:38] = True
    assert not terrain.walk[~inside].any()


def test_its_start_locations_and_units_make_a_melee_game(whole: bytes) -> None:
    game_map = read_archive(whole, "Melee/Hill.SC2Map")
    world = new_game(game_map, seed=1)
    starts = {player.start for player in world.players[1:]}
    assert starts == {(10.5, 10.5), (29.5, 22.5)}
    names = [world.unit_type(slot).name for slot in world.units_of(0).tolist()]
    assert names == ["MineralField", "MineralField750"]
    (zealot,) = [s for s in world.units_of(2).tolist() if world.unit_type(s).name == "Zealot"]
    assert world.pos[zealot].tolist() == [20.25, 16]
    assert world.facing()[zealot] == pytest.approx(np.pi / 2, abs=1e-3)
    advance(world, 50)
    assert not world.ended


def test_a_battle_that_is_known_by_name_has_its_own_script() -> None:
    shipped = load_map("llm_smac/2s3z")
    files = map_files() | {"MapInfo": map_info((2, 3, 38, 30))}
    other_size = read_archive(archive(files), "llm_smac/2s3z.SC2Map")
    assert other_size.scenario.family == "user"  # of that name, but not that map
    width, height = shipped.terrain.size
    grown = resized(width, height)
    same_size = read_archive(archive(grown), "llm_smac/2s3z.SC2Map")
    assert same_size.scenario is shipped.scenario
    assert same_size.terrain.playable == (0, 0, width, height)
    assert same_size.digest != shipped.digest


LIBERTY = "bnet:Liberty (Mod)/0.0/999,file:Mods/Liberty.SC2Mod"
SWARM = "bnet:Swarm (Mod)/0.0/999,file:Mods/Swarm.SC2Mod"
VOID = "bnet:Void (Mod)/0.0/999,file:Mods/Void.SC2Mod"
MULTI = "bnet:Void Multi (Mod)/0.0/999,file:Mods/VoidMulti.SC2Mod"


@pytest.mark.parametrize(
    ("mods", "data"),
    [
        ([LIBERTY], "liberty"),
        ([VOID], "void"),
        ([VOID, SWARM, LIBERTY], "void"),
        ([LIBERTY, SWARM, VOID, MULTI], "multi"),
        (["file:Mods/Own.SC2Mod", LIBERTY], "multi"),
        ([], "multi"),
    ],
)
@pytest.mark.parametrize("name", ["DocumentInfo", "DocumentHeader"])
def test_the_mods_of_an_archive_say_whose_numbers_units_have(name: str, mods: list[str], data: str) -> None:
    named = "".join(f"<Value>{mod}</Value>" for mod in mods).encode()
    game_map = read_archive(with_file(name, named), "Melee/Hill.SC2Map")
    assert game_map.scenario.data == data
    assert new_game(game_map).catalog.data == data


def test_a_battle_that_is_known_by_name_has_the_numbers_of_its_own_mods() -> None:
    files = resized(*load_map("llm_smac/2s3z").terrain.size)
    own = read_archive(archive(files | {"DocumentInfo": MULTI.encode()}), "llm_smac/2s3z.SC2Map")
    assert (load_map("llm_smac/2s3z").scenario.data, own.scenario.data) == ("liberty", "multi")


def test_two_can_play_a_map_without_start_locations_and_have_what_they_make() -> None:
    objects = OBJECTS.replace('Type="StartLoc"', 'Type="Normal"').encode()
    scenario = read_archive(archive(map_files() | {"Objects": objects}), "SMAC_Maps/Field.SC2Map").scenario
    assert (sorted(scenario.players), scenario.melee) == ([1, 2], False)
    assert {player.ai for player in scenario.players.values()} == {None}


@pytest.mark.parametrize("name", ["Simple64", "Flat32"])
def test_a_melee_map_of_a_known_name_begins_where_its_file_says(name: str) -> None:
    shipped = load_map(name)
    own = read_archive(archive(resized(*shipped.terrain.size)), f"Melee/{name}.SC2Map")
    assert own.scenario.start_locations == ((10.5, 10.5), (29.5, 22.5)) != shipped.scenario.start_locations


def resized(width: int, height: int) -> dict[str, bytes]:
    return {
        "MapInfo": map_info((0, 0, width, height), (width, height)),
        "t3SyncHeightMap": b"SMAP" + bytes(60 + 4 * (width + 1) * (height + 1)),
        "t3SyncCliffLevel": b"CLIF" + bytes(28) + np.full(width * height, 64, "<u2").tobytes(),
        "t3CellFlags": b"LFCT" + bytes(28 + width * height),
        "Objects": OBJECTS.encode(),
    }


def without(name: str) -> bytes:
    return archive({key: value for key, value in map_files().items() if key != name})


def with_file(name: str, content: bytes) -> bytes:
    return archive(map_files() | {name: content})


BROKEN = [
    (b"MPQ\x1a nothing more", "the archive is damaged: "),
    (without("MapInfo"), "the archive has no MapInfo"),
    (without("t3CellFlags"), "the archive has no t3CellFlags"),
    (without("Objects"), "the archive has no Objects"),
    (with_file("MapInfo", b"what?" * 20), "MapInfo is not a map's info"),
    (with_file("MapInfo", map_info((9, 9, 3, 3))), "MapInfo tells no playable area"),
    (with_file("MapInfo", map_info(size=(9999, 1))), "MapInfo tells a size of 9999 x 1 cells"),
    (with_file("t3SyncCliffLevel", b"CLIF" + bytes(99)), "t3SyncCliffLevel ends after 103 bytes, 2592 are needed"),
    (with_file("t3CellFlags", b"FLAG" + bytes(5000)), "t3CellFlags does not begin with LFCT"),
    (with_file("Objects", b"<PlacedObjects"), "Objects in the archive can't be read: unclosed token"),
    (
        with_file("Objects", b"<!DOCTYPE x><PlacedObjects/>"),
        "Objects in the archive can't be read: it declares entities",
    ),
    (
        with_file("Objects", b'<P><ObjectPoint Type="StartLoc" Position="here"/></P>'),
        "Objects in the archive can't be read: could not convert string to float",
    ),
]


@pytest.mark.parametrize(("data", "sentence"), BROKEN)
def test_what_is_wrong_with_an_archive_is_said(data: bytes, sentence: str) -> None:
    with pytest.raises(ArchiveError) as error:
        read_archive(data, "Melee/Hill.SC2Map")
    assert str(error.value).startswith(sentence)
    with pytest.raises(MapDataError, match=r"Melee/Hill.SC2Map is an archive that the simulator cannot read: "):
        read_map(data, "Melee/Hill.SC2Map")


def test_a_broken_archive_of_a_known_name_is_the_shipped_map() -> None:
    assert read_map(b"MPQ\x1a nothing more", "llm_smac/2s3z.SC2Map") is load_map("llm_smac/2s3z")


@pytest.mark.parametrize("place", [0, 3, 17])
def test_the_playable_area_is_found_wherever_the_versions_put_it(place: int) -> None:
    data = map_info()
    at = data.index(b"Dark")
    moved = data[:at] + b"\x02\0\0\0preview.tga\0"[:place] + data[at:]
    assert terrain_file.read_map_info(moved) == terrain_file.MapInfo((WIDTH, HEIGHT), PLAYABLE)


def test_the_upper_cell_of_a_straight_cliff_is_free_and_the_lower_one_is_not() -> None:
    cliff = np.full((8, 8), 64, dtype=np.uint16)
    cliff[:, :4] = 128
    walk = walkability.walkable(cliff, np.ones_like(cliff, dtype=np.bool_))
    assert walk[4].tolist() == [True, True, True, False, False, True, True, True]
    shifted = np.roll(cliff, 1, axis=1)
    shifted[:, 0] = 128
    walk = walkability.walkable(shifted, np.ones_like(cliff, dtype=np.bool_))
    assert walk[4].tolist() == [True, True, True, True, True, False, True, True]


@pytest.mark.parametrize("name", ["snow_bridge", "simple64", "braxis_ledge", "braxis_corridor", "char_pit"])
def test_shipped_terrain_is_never_walkable_where_the_rule_closes_it_without_tiles(name: str) -> None:
    family = {"snow_bridge": "pvz_task1_level1", "simple64": "Simple64", "braxis_ledge": "llm_smac/2c_vs_64zg",
              "braxis_corridor": "corridor", "char_pit": "llm_smac/2s_vs_1sc"}  # fmt: skip
    terrain = load_map(family[name]).terrain
    assert not (terrain.walk & ~walkability.solid(terrain.cliff)).any()
    assert (terrain.build == (walkability.buildable(terrain.cliff, terrain.walk) & terrain.build)).all()


def test_a_terrain_file_of_the_wrong_kind_is_refused() -> None:
    with pytest.raises(TerrainError, match="t3SyncHeightMap does not begin with SMAP"):
        terrain_file.read_heights(b"nothing", (4, 4))


# installing -----------------------------------------------------------------------------------------------------------


def test_own_maps_are_linked_one_folder_deep(tmp_path: Path, whole: bytes) -> None:
    own = tmp_path / "StarCraftII" / "Maps"
    for place in ("Ladder2019Season1/Hill.SC2Map", "Loose.SC2Map", "a/b/Deep.sc2map", "Melee/Simple64.SC2Map"):
        (own / place).parent.mkdir(parents=True, exist_ok=True)
        (own / place).write_bytes(whole)
    (own / "Melee/Broken.SC2Map").write_bytes(b"MPQ\x1a")
    (own / "readme.txt").write_text("no map")
    root = install(tmp_path / "game")
    found = {entry.path: entry.trouble for entry in link_maps(root, own.parent)}
    assert sorted(path for path, trouble in found.items() if not trouble) == [
        "Ladder2019Season1/Hill.SC2Map", "Melee/Simple64.SC2Map", "b/Deep.SC2Map", "user/Loose.SC2Map",
    ]  # fmt: skip
    assert "cannot read" in found["Melee/Broken.SC2Map"]
    linked = root / "Maps/Ladder2019Season1/Hill.SC2Map"
    assert linked.is_symlink()
    assert read_map(linked.read_bytes(), str(linked)).scenario.melee
    assert not (root / "Maps/Melee/Broken.SC2Map").exists()
    assert not is_placeholder((root / "Maps/Melee/Simple64.SC2Map").read_bytes())
    install(root)
    assert link_maps(root, own)  # again, and nothing is in the way
    assert (root / "Maps/Melee/Simple64.SC2Map").is_symlink()
    assert (own / "Melee/Simple64.SC2Map").read_bytes() == whole


def test_maps_of_a_folder_that_clients_look_into_stay_in_it(tmp_path: Path) -> None:
    own = tmp_path / "SMAC_Maps"
    own.mkdir()
    (own / "32x32_flat.SC2Map").write_bytes(archive(resized(32, 32)))
    root = install(tmp_path / "game")
    assert [entry.path for entry in link_maps(root, own)] == ["SMAC_Maps/32x32_flat.SC2Map"]
    linked = root / "Maps/SMAC_Maps/32x32_flat.SC2Map"
    assert read_map(linked.read_bytes(), str(linked)).scenario is load_map("32x32_flat").scenario


@pytest.mark.parametrize(
    ("make", "sentence"),
    [(False, "is no directory with maps"), (True, "holds no .SC2Map file")],
)
def test_a_directory_without_maps_is_one_sentence(tmp_path: Path, make: bool, sentence: str) -> None:
    root, own = install(tmp_path / "game"), tmp_path / "own"
    if make:
        own.mkdir()
    with pytest.raises(InstallError, match=sentence):
        link_maps(root, own)


def test_the_command_says_what_was_linked_and_what_was_not(tmp_path: Path, whole: bytes) -> None:
    own = tmp_path / "own"
    own.mkdir()
    (own / "Hill.SC2Map").write_bytes(whole)
    (own / "Bad.SC2Map").write_bytes(b"no map at all")
    arguments: list[Any] = ["install", str(tmp_path / "game"), "--maps", str(own)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0
    assert " maps and 1 of yours. Now: export SC2PATH=" in result.stdout
    assert f"Left out {own / 'Bad.SC2Map'}: user/Bad.SC2Map holds neither a map of the simulator" in result.stderr
    assert '"linked": ["user/Hill.SC2Map"]' in CliRunner().invoke(app, [*arguments, "--json"]).stdout
