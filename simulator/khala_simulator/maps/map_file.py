"""The content of the `.SC2Map` files of an install, and which map a client means.

A map of the simulator is a text file: a first line that marks it, then the name of a shipped map, or a whole scenario
in the language of `scenario.py`, which is how a user adds one. Clients read the file and send its bytes, or only its
path. An archive of StarCraft II itself is read by `archive.py`.

Above: `process/install.py`, `process/lobby.py`. Below: `game_map.py`, `archive.py`.
"""

from __future__ import annotations

import contextlib
import errno
import stat
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from khala_simulator.maps.game_map import GameMap, MapError, find_map, load_map, map_from, map_names
from khala_simulator.maps.nodes import ScenarioError, text_of
from khala_simulator.maps.scenario_file import parse_scenario

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

FOLDERS = ("Melee", "mini_games", "llm_pysc2", "llm_smac", "SMAC_Maps", "duels")
"""Folders below `Maps`: those that PySC2, SMAC and LLM-PySC2 look into, and that of Khala's own maps."""

SUFFIX = ".SC2Map"
LARGEST_FILE = 256 * 2**20
"""Bytes of a map or a replay; the largest of the game have some 20 MB."""
_MARK = b"# A map of Khala's simulator\n"
_ARCHIVE = b"MPQ"


class MapDataError(ValueError):
    """The bytes are no map that can be played here."""


def placeholders() -> Iterator[tuple[str, bytes]]:
    """Yield the path below `Maps` and the content of the file of every shipped map."""
    for name in map_names():
        yield name + SUFFIX, _placeholder(name)


def _placeholder(name: str) -> bytes:
    return _MARK + name.encode() + b"\n"


def is_placeholder(data: bytes) -> bool:
    """Return whether this is the file of a shipped map, which an update may replace, and not a user's own."""
    return data.startswith(_MARK) and b"\n" not in data[len(_MARK) :].strip()


def is_archive(data: bytes) -> bool:
    """Return whether this is an archive of StarCraft II itself."""
    return data.startswith(_ARCHIVE)


def read_map(data: bytes, path: str) -> GameMap:
    """Return the map in the bytes of a file; its path names the map in an archive of StarCraft II.

    Raises:
        MapDataError: with a sentence for the client.
    """
    if is_archive(data):
        from khala_simulator.maps.archive import ArchiveError, read_archive  # noqa: PLC0415  # its libraries, for few games

        try:
            return read_archive(data, path)
        except ArchiveError as error:
            raise MapDataError(f"{path or 'the map'} is an archive that the simulator cannot read: {error}") from error
    if not data.startswith(_MARK):
        raise MapDataError(f"{path or 'the map'} holds neither a map of the simulator nor a StarCraft II archive")
    try:
        return _read_text(data, path or "the map")
    except (MapError, ScenarioError) as error:
        raise MapDataError(str(error)) from error


def _read_text(data: bytes, source: str) -> GameMap:
    text = text_of(data, source)
    if is_placeholder(data):
        return load_map(text[len(_MARK) :].strip())
    scenario = parse_scenario(text, source)  # the mark is a comment of YAML
    try:
        return map_from(scenario, text)
    except MapError as error:
        raise MapError(f"{source}: {error}") from error


def find_data(path: str, saved: Mapping[str, bytes], data_dir: Path) -> bytes | None:
    """Return the bytes of the map that a path means, or None.

    It may be one that the client saved, a file of the install, any file, or the name of a shipped map.
    """
    if path in saved:
        return saved[path]
    for file in _files(path, data_dir):
        with contextlib.suppress(OSError, ValueError):  # not there, no file, or no possible name at all
            return read_file(file)
    try:
        return _placeholder(find_map(path))
    except MapError:
        return None


def read_file(path: Path) -> bytes:
    """Return the bytes of a regular file: a pipe would stop the process, and a device fill its memory.

    Raises:
        OSError: it can't be read, is no regular file, or is too large.
    """
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "it is no regular file", str(path))
    if found.st_size > LARGEST_FILE:
        raise OSError(errno.EFBIG, f"it is larger than {LARGEST_FILE} bytes", str(path))
    return path.read_bytes()


def _files(path: str, data_dir: Path) -> Iterator[Path]:
    maps = data_dir / "Maps"
    yield maps / path
    yield Path(path)
    yield from (folder / PurePosixPath(path).name for folder in sorted(maps.glob("*/")))
