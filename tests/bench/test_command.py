"""`python -m bench`: what it runs, and what it keeps."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING, Any

import pytest

from bench import __main__ as command
from bench import results, run
from bench.figures import Figure
from bench.registry import having
from bench.run import figures_of

if TYPE_CHECKING:
    from pathlib import Path

SHORT = {
    "yardstick": (),
    "turn": ("--agents", "1", "--steps", "1", "--original-steps", "1"),
    "bus": ("--agents", "1", "--scale", "0.05"),
    "simulator_engine": ("--seconds", "0.05", "--maps", "llm_smac/2s3z", "--sizes", "10"),
    "engines": ("--rounds", "1", "--seconds", "0.05"),
    "simulator_env": ("layers:2s3z:8", "--steps", "20"),
    "floors": ("layers:2s3z:8", "--rounds", "1", "--steps", "20"),
    "start": ("--times", "1"),
    "observe": (),
    "act": (),
    "abilities": (),
    "games_per_hour": ("--tasks", "2s3z_pair", "--games", "2", "--jobs", "2"),
    "sessions": ("--clients", "2", "--seconds", "1"),
    "env": ("--maps", "2s3z", "--seconds", "0.1", "--rounds", "1", "--envs", "1"),
}
"""By measurement, the options of its shortest run."""


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, tuple[str, ...]]]:
    """Return what was run, which measures nothing."""
    found: list[tuple[str, tuple[str, ...]]] = []

    def note(name: str, options: Any = ()) -> list[Figure]:
        found.append((name, tuple(options)))
        return [Figure(f"figure of {name}", "ms", (float(len(found)),))]

    monkeypatch.setattr(run, "show", note)
    monkeypatch.setattr(run, "figures_of", note)
    monkeypatch.setattr(command, "run_here", lambda *words: note(*words) and 0)
    return found


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name == "yardstick" else [pytest.mark.slow, pytest.mark.game]) for name in SHORT],
)
@pytest.mark.timeout(300)
def test_a_measurement_gives_figures_of_names_of_their_own(name: str) -> None:
    figures = figures_of(name, SHORT[name])
    assert figures
    assert len({figure.name for figure in figures}) == len(figures)
    for figure in figures:
        assert figure.values or figure.skipped
        assert all(value > 0 for value in figure.values) or name == "turn"  # its endpoint may be early


def test_a_named_measurement_runs_as_it_always_did_with_its_own_options(ran: list[Any]) -> None:
    assert command.main(["turn", "--tls", "--times", "9"]) == 0
    assert command.main(["bus", "soak"]) == 0
    assert command.main(["floors", "layers:2s3z:8"]) == 0
    assert command.main(["limits", "bus", "--json"]) == 0
    assert ran == [
        ("turn", ("--tls", "--times", "9")), ("bus", ()), ("soak", ()), ("floors", ("layers:2s3z:8",)),
        ("limits", ("bus", "--json")),
    ]  # fmt: skip


def test_figures_of_several_runs_in_turns_go_into_a_file(ran: list[Any], tmp_path: Path) -> None:
    out = tmp_path / "a.json"
    assert command.main(["--times", "2", "--out", str(out), "turn", "bus"]) == 0
    assert [name for name, _ in ran] == ["turn", "bus", "turn", "bus"]
    assert {one.name: one.runs for one in results.read(out).figures} == {
        "figure of turn": ((1.0,), (3.0,)),
        "figure of bus": ((2.0,), (4.0,)),
    }


def test_figures_are_kept_when_a_measurement_fails_and_the_exit_code_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[str] = []

    def fail_once(name: str, _: Any) -> list[Figure]:
        asked.append(name)
        if asked == ["turn", "bus"]:
            raise subprocess.CalledProcessError(2, ["bench", "bus"])
        return [Figure(f"figure of {name}", "ms", (float(len(asked)),))]

    monkeypatch.setattr(run, "figures_of", fail_once)
    assert command.main(["--times", "2", "--out", str(tmp_path / "a.json"), "turn", "bus"]) == 1
    assert [one.runs for one in results.read(tmp_path / "a.json").figures] == [((1.0,), (3.0,)), ((4.0,),)]
    assert "failed, and without figures: bus (1 of 2): exit code 2" in capsys.readouterr().err


def test_without_names_all_is_measured_and_the_figures_are_kept(
    ran: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[Path | None] = []
    monkeypatch.setattr(results, "write", lambda _, out: written.append(out))
    assert command.main([]) == 0
    assert [name for name, _ in ran] == [*having("figures") * command.TIMES, *having("table")]
    assert written == [None]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing"], "there is no benchmark 'nothing'; there are yardstick, turn"),
        (["turn", "bus", "nothing"], "there is no benchmark 'nothing'; there are yardstick, turn"),
        (["turn", "bus", "duels"], "duels runs alone: name no other"),
        (["turn", "bus", "--tls"], "--tls is an option of one benchmark: name it before, such as `turn --tls`"),
        (["--times", "2", "duels"], "duels has no figures that can be kept: run it without --times and --out"),
        (["--times", "2", "soak"], "soak has no figures that can be kept: run it without --times and --out"),
        (["--times", "0", "turn"], "0 times is no measurement"),
    ],
)
def test_a_wrong_command_line_says_what_would_be_right(
    words: list[str], said: str, ran: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        command.main(words)
    assert said in capsys.readouterr().err
    assert ran == []
