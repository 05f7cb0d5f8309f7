"""`khala sc2`: what it says, and its JSON."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from khala_simulator.cli import app
from khala_simulator.maps.game_map import map_names
from khala_simulator.process.install import install, is_installed

run = CliRunner().invoke


def test_install_makes_an_install_and_says_what_to_do_next(tmp_path: Path) -> None:
    result = run(app, ["install", str(tmp_path / "game")])
    assert result.exit_code == 0
    assert is_installed(tmp_path / "game")
    expected = f"Installed version 4.10 with {len(map_names())} maps. Now: export SC2PATH={tmp_path / 'game'}\n"
    assert result.stdout == expected


def test_install_has_json(tmp_path: Path) -> None:
    result = run(app, ["install", str(tmp_path), "--json"])
    expected = {"path": str(tmp_path), "version": "4.10", "maps": list(map_names()), "linked": [], "left_out": {}}
    assert json.loads(result.stdout) == expected


def test_an_install_that_fails_is_one_sentence_on_stderr(tmp_path: Path) -> None:
    (tmp_path / ".build.info").touch()
    result = run(app, ["install", str(tmp_path)])
    assert result.exit_code == 1
    assert result.stdout == ""
    expected = f"Not installed: {tmp_path} holds a real StarCraft II (.build.info); choose another directory.\n"
    assert result.stderr == expected


def test_an_install_is_of_the_version_that_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SC2PATH", str(tmp_path))
    for version, build in (("4.10", 75689), ("5.0.13", 92440), ("4.10", 75689)):
        assert run(app, ["install", str(tmp_path), "--version", version]).exit_code == 0
        assert [path.name for path in (tmp_path / "Versions").iterdir()] == [f"Base{build}"]
        facts = json.loads(run(app, ["info", "--json"]).stdout)
        assert (facts["version"], facts["build"], facts["sc2path_is"]) == (version, build, "this simulator")


def test_a_version_without_tables_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    result = run(app, ["install", str(tmp_path), "--version", "5.0.11"])
    assert result.exit_code == 1
    assert result.stderr == "Not installed: there are no tables of version 5.0.11, only of 4.10 and 5.0.13.\n"


@pytest.mark.parametrize(
    ("place", "kind"),
    [
        (None, "run khala sc2 install DIRECTORY first"),
        ("game", "this simulator"),
        ("", "not an install of this simulator"),
        ("nowhere", "no such directory"),
    ],
)
def test_info_tells_where_the_game_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str | None, kind: str
) -> None:
    install(tmp_path / "game")
    if place is None:
        monkeypatch.delenv("SC2PATH", raising=False)
    else:
        monkeypatch.setenv("SC2PATH", str(tmp_path / place))
    facts = json.loads(run(app, ["info", "--json"]).stdout)
    assert facts["sc2path_is"] == kind
    assert [entry["name"] for entry in facts["maps"]] == list(map_names())
    text = run(app, ["info"]).stdout
    assert kind in text
    assert all(name in text for name in map_names())


@pytest.mark.parametrize("command", [[], ["install"], ["info"], ["serve"]])
def test_help_says_what_for(command: list[str]) -> None:
    result = run(app, [*command, "--help"])
    assert result.exit_code == 0
    assert len(result.stdout.splitlines()) > 5


def test_a_port_in_use_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def taken(host: str, port: int) -> None:
        raise OSError(98, "Address already in use")

    monkeypatch.setattr("khala_simulator.__main__.listen", taken)
    monkeypatch.setattr("khala_simulator.__main__.signal.signal", lambda *_: None)
    result = run(app, ["serve", "--port", "5999"])
    assert result.exit_code == 1
    assert "cannot listen on 127.0.0.1:5999: [Errno 98] Address already in use" in result.output
