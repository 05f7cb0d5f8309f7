"""The directory that clients take for StarCraft II."""

import ast
import errno
import re
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from pysc2.run_configs import platforms as run_platforms

from khala_bridge.game.processes import settle_flags
from khala_simulator.maps.game_map import map_names
from khala_simulator.maps.map_file import FOLDERS, read_map
from khala_simulator.process import platforms
from khala_simulator.process.install import InstallError, install, is_installed

LAUNCHER = "Versions/Base75689/SC2_x64"


def test_an_install_has_what_clients_look_for(tmp_path: Path) -> None:
    root = install(tmp_path / "game")
    launcher = root / LAUNCHER
    assert launcher.is_file()
    assert launcher.stat().st_mode & stat.S_IXUSR
    assert sorted(p.name for p in (root / "Versions").iterdir()) == ["Base75689"]
    assert sorted(p.name for p in (root / "Maps").iterdir()) == sorted(FOLDERS)
    assert (root / "Replays").is_dir()
    assert is_installed(root)
    assert not is_installed(tmp_path)


def test_the_launcher_becomes_the_game_and_ignores_the_clients_python(tmp_path: Path) -> None:
    last = (install(tmp_path) / LAUNCHER).read_text().splitlines()[-1]
    assert re.match(r"exec '?/[^ ]+'? -I ", last)
    assert last.endswith('"$@"')


def test_the_launcher_starts_without_an_environment(tmp_path: Path) -> None:
    root = install(tmp_path)
    trap = tmp_path / "trap"
    trap.mkdir()
    (trap / "sitecustomize.py").write_text("raise SystemExit(77)")
    command = [str(root / LAUNCHER), "-listen", "127.0.0.1", "-port", "99999999"]
    done = subprocess.run(command, env={"PYTHONPATH": str(trap)}, cwd=trap, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("StarCraft II simulator: cannot listen on 127.0.0.1:99999999")


def test_every_shipped_map_is_a_file_that_is_read_back(tmp_path: Path, subtests: pytest.Subtests) -> None:
    root = install(tmp_path)
    for name in map_names():
        with subtests.test(name):
            path = root / "Maps" / f"{name}.SC2Map"
            game_map = read_map(path.read_bytes(), str(path))
            assert f"{game_map.family}/{game_map.name}" == name


def test_installing_twice_repairs_and_keeps_what_a_user_added(tmp_path: Path) -> None:
    root = install(tmp_path)
    shipped = root / "Maps" / f"{map_names()[0]}.SC2Map"
    shipped.unlink()
    own = root / "Maps/Melee/Mine.SC2Map"
    own.write_bytes(b"MPQ\x1b mine")
    (root / LAUNCHER).unlink()
    install(tmp_path)
    assert shipped.exists()
    assert own.read_bytes() == b"MPQ\x1b mine"
    assert is_installed(root)


def test_matches_that_start_at_once_install_at_once(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as threads:
        assert set(threads.map(install, [tmp_path] * 40)) == {tmp_path}
    assert not list(tmp_path.rglob("*.new"))


def test_a_launcher_that_is_half_written_is_none_of_a_real_game(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def half_way(path: Path, data: bytes) -> int:
        monkeypatch.undo()
        path.touch()
        install(tmp_path)
        return path.write_bytes(data)

    monkeypatch.setattr(Path, "write_bytes", half_way)
    install(tmp_path)


def test_what_is_there_already_is_not_written_again(tmp_path: Path) -> None:
    files = [path for path in install(tmp_path).rglob("*") if path.is_file()]
    numbers = [path.stat().st_ino for path in files]
    install(tmp_path)
    assert [path.stat().st_ino for path in files] == numbers


def test_a_map_file_that_a_user_replaced_is_kept(tmp_path: Path) -> None:
    root = install(tmp_path)
    replaced = root / "Maps" / f"{map_names()[0]}.SC2Map"
    replaced.write_bytes(b"MPQ\x1b the real one")
    install(tmp_path)
    assert replaced.read_bytes() == b"MPQ\x1b the real one"


@pytest.mark.parametrize(
    "evidence", [".build.info", "SC2Data/x", "Support64/x", "Versions/Base75689/SC2_x64", "Versions/Base88500/SC2_x64"]
)
def test_a_real_starcraft_is_never_touched(tmp_path: Path, evidence: str) -> None:
    file = tmp_path / evidence
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"\x7fELF")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InstallError, match=r"holds a real StarCraft II \(.*\); choose another directory"):
        install(tmp_path)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "game").write_text("")
    with pytest.raises(InstallError, match=r"game.* is a file, not a directory; choose another place"):
        install(tmp_path / "game")


@pytest.mark.parametrize(
    ("number", "sentence"),
    [
        (errno.EACCES, "cannot be written; choose a directory of yours or change its permissions"),
        (errno.EROFS, "cannot be written; choose a directory of yours or change its permissions"),
        (errno.ENOSPC, "No space left on device"),
    ],
)
def test_a_directory_that_cannot_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, sentence: str
) -> None:
    def fail(path: Path, **_: object) -> None:
        raise OSError(number, "", str(path))

    monkeypatch.setattr(Path, "mkdir", fail)  # a real directory without permission would not stop root
    with pytest.raises(InstallError, match=sentence) as caught:
        install(tmp_path / "game")
    assert str(caught.value).startswith(str(tmp_path / "game"))


@pytest.mark.parametrize(
    ("platform", "launcher"),
    [("darwin", "Versions/Base75689/SC2.app/Contents/MacOS/SC2"), ("win32", "Versions/Base75689/SC2_x64.exe")],
)
def test_pysc2_finds_the_launcher_on_other_platforms(
    platform: str, launcher: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for function in (platforms.launcher_name, platforms.launcher, platforms.directories_of_game):
        monkeypatch.setattr(platforms, function.__name__, partial(function, platform=platform))
    settle_flags()
    install(tmp_path)
    before = (tmp_path / launcher).stat().st_ino
    install(tmp_path)
    assert (tmp_path / launcher).stat().st_ino == before
    assert is_installed(tmp_path)
    config = {"darwin": run_platforms.MacOS, "win32": run_platforms.Windows}[platform]
    monkeypatch.setenv("SC2PATH", str(tmp_path))
    found = config()
    assert (Path(found.data_dir) / "Versions" / f"Base{found.version.build_version}" / found._exec_name).is_file()
    assert found.cwd is None or Path(found.cwd).is_dir()


def test_the_launcher_for_windows_holds_a_program_that_python_runs(tmp_path: Path) -> None:
    """Its first part, which starts this Python with it, is that of pip, and runs on Windows alone."""
    exe = tmp_path / "SC2_x64.exe"
    exe.write_bytes(platforms.launcher("import sys; print(sys.argv[1:])", "the mark", "win32"))
    assert f'#!"{sys.executable}" -I\r\n'.encode() in exe.read_bytes()
    done = subprocess.run([sys.executable, "-I", exe, "-port", "7"], capture_output=True, text=True, check=True)
    assert ast.literal_eval(done.stdout) == ["-executable", str(exe), "-port", "7"]
