"""Set up a directory like a StarCraft II install whose game is this simulator.

Clients find it through `SC2PATH` and start `Versions/Base75689/SC2_x64`, a shell script that becomes the process of
`__main__.py`; the number is the build of the game that it is. On macOS and Windows they look for another name, see
`platforms.py`. It never replaces parts of a real StarCraft II, and keeps maps that a user adds. A user's own maps are
linked, not copied: they stay where they are.

Above: `cli.py`. Below: the list of scenarios.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from khala_simulator.process import platforms
from khala_simulator.tables.versions import BUILD_OF_VERSION, DEFAULT_VERSION

OWN_FOLDER = "user"
"""Folder below `Maps` for maps without a folder that clients look into."""

_MARK = "The simulator of Khala stands in for the game here."
_EXECUTABLES = ("SC2*", "SC2.app/Contents/MacOS/SC2")
_REAL = (".build.info", "SC2Data", "StarCraft II.exe", "StarCraft II.app", "Support64")


class InstallError(Exception):
    """The directory cannot become an install; the message says why and what to do."""


def install(directory: Path | str, version: str = DEFAULT_VERSION) -> Path:
    """Make a directory that clients take for an install of one version of StarCraft II; return its absolute path.

    Calling it again repairs and updates the launcher and the maps, and leaves everything else alone; with another
    version the install becomes one of that version, because clients start the newest that they find.

    Raises:
        InstallError: there are no tables of this version, a real StarCraft II is there, or something cannot be written.
    """
    if version not in BUILD_OF_VERSION:
        raise InstallError(f"there are no tables of version {version}, only of {' and '.join(BUILD_OF_VERSION)}")
    root = Path(directory).expanduser().absolute()
    _refuse_real_game(root)
    try:
        for other in BUILD_OF_VERSION:
            if other != version and (root / _launcher(other)).exists():
                shutil.rmtree(root / _base(other))
        _write_launcher(root / _launcher(version))
        _write_maps(root / "Maps")
        for name in ("Replays", *platforms.directories_of_game()):
            (root / name).mkdir(exist_ok=True)
    except OSError as error:
        raise InstallError(_explain(error, root)) from error
    return root


@dataclass(frozen=True, slots=True)
class OwnMap:
    """A map of the user: where it is, its path below `Maps`, and why it can't be played, if so."""

    source: Path
    path: str
    trouble: str = ""


def link_maps(root: Path, directory: Path | str) -> list[OwnMap]:
    """Link every .SC2Map file below a directory into an install, and return which ones can be played.

    The directory may be one of maps, of folders of maps, or a StarCraft II with its folder `Maps`. It may also be a
    folder that clients look into, such as `SMAC_Maps`, whose maps then go into that of the install. A map of the user
    replaces a shipped one of the same path; none replaces a file that the user put there.

    Raises:
        InstallError: there is no such directory, no map in it, or something cannot be written.
    """
    source = Path(directory).expanduser().absolute()
    if not source.is_dir():
        raise InstallError(f"{source} is no directory with maps")
    top = source / "Maps" if (source / "Maps").is_dir() else source
    files = sorted(path for path in top.rglob("*") if path.suffix.lower() == ".sc2map" and path.is_file())
    if not files:
        raise InstallError(f"{source} holds no .SC2Map file")
    try:
        return [_link(root / "Maps", top, file) for file in files]
    except OSError as error:
        raise InstallError(_explain(error, root)) from error


def is_installed(directory: Path | str) -> bool:
    """Return whether a directory holds an install of the simulator."""
    return installed_version(directory) is not None


def installed_version(directory: Path | str) -> str | None:
    """Return the version of the game that an install of the simulator is, or None where there is no install."""
    root = Path(os.path.expanduser(directory))  # noqa: PTH111  # Path's raises for a user that is not there
    return next((version for version in BUILD_OF_VERSION if _is_ours(root / _launcher(version))), None)


def _base(version: str) -> Path:
    return Path("Versions") / f"Base{BUILD_OF_VERSION[version]}"


def _launcher(version: str) -> Path:
    return _base(version) / platforms.launcher_name()


def _refuse_real_game(root: Path) -> None:
    for name in _REAL:
        if (root / name).exists() and not _is_empty_directory(root / name):
            raise InstallError(f"{root} holds a real StarCraft II ({name}); choose another directory")
    bases = (root / "Versions").glob("Base*")
    found = sorted(path for base in bases for name in _EXECUTABLES for path in base.glob(name))
    for executable in found:
        if not executable.is_dir() and not _is_ours(executable):
            relative = executable.relative_to(root)
            raise InstallError(f"{root} holds a real StarCraft II ({relative}); choose another directory")


def _is_empty_directory(path: Path) -> bool:
    return path.is_dir() and not any(path.iterdir())


def _is_ours(executable: Path) -> bool:
    if not executable.is_file():  # to open a pipe would wait for its writer
        return False
    try:
        with executable.open("rb") as file:
            first = file.read(256)
            file.seek(max(0, executable.stat().st_size - 256))
            return _MARK.encode() in first + file.read(256)
    except OSError:
        return False


def _write_launcher(path: Path) -> None:
    package_root = Path(__file__).absolute().parent.parent
    code = f"import sys; sys.path.append({str(package_root)!r}); from khala_simulator.__main__ import main; main()"
    path.parent.mkdir(parents=True, exist_ok=True)
    _put(path, platforms.launcher(code, _MARK), mode=0o755)


def _put(path: Path, data: bytes, *, mode: int = 0o644) -> None:
    """Write a file, unless it is there already; in one step, as others may be installing, or starting the game."""
    has_mode = sys.platform == "win32" or (path.exists() and path.stat().st_mode & 0o777 == mode)
    if has_mode and path.exists() and path.read_bytes() == data:
        return
    fresh = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")  # with the dot, no executable of a real game
    try:
        fresh.write_bytes(data)
        fresh.chmod(mode)
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)


def _write_maps(maps: Path) -> None:
    from khala_simulator.maps.map_file import FOLDERS, is_placeholder, placeholders  # noqa: PLC0415  # numpy: 0.1 s of any --help

    for folder in FOLDERS:
        (maps / folder).mkdir(parents=True, exist_ok=True)
    for relative, data in placeholders():
        path = maps / relative
        if not path.exists() or not path.stat().st_size or is_placeholder(path.read_bytes()):
            _put(path, data)


def _link(maps: Path, top: Path, file: Path) -> OwnMap:
    """Link one map; clients look for maps exactly one folder below `Maps`."""
    from khala_simulator.maps.map_file import FOLDERS, MapDataError, is_placeholder, read_file, read_map  # noqa: PLC0415  # numpy: 0.1 s of any --help

    folder = file.parent.name if file.parent != top or top.name in FOLDERS else OWN_FOLDER
    path = f"{folder}/{file.stem}.SC2Map"
    target = maps / path
    try:
        read_map(read_file(file), path)
    except (MapDataError, OSError) as error:
        return OwnMap(file, path, str(error))
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.is_symlink() or (target.exists() and is_placeholder(target.read_bytes())):
        target.unlink()
    if not target.exists():
        try:
            target.symlink_to(file)
        except OSError:  # Windows does not allow links to every user
            shutil.copyfile(file, target)
    return OwnMap(file, path)


def _explain(error: OSError, root: Path) -> str:
    where = error.filename or root
    if error.errno in {errno.EACCES, errno.EPERM, errno.EROFS}:
        return f"{where} cannot be written; choose a directory of yours or change its permissions"
    if error.errno in {errno.ENOTDIR, errno.EEXIST}:
        return f"{where} is a file, not a directory; choose another place"
    return f"{where}: {os.strerror(error.errno) if error.errno else error}"
