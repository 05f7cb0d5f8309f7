"""Ratios that must not get worse."""

from __future__ import annotations

import json
import subprocess
from typing import TYPE_CHECKING, Any

import pytest

from bench import limits
from bench.figures import Figure
from bench.limits import judge, main
from bench.simulator import engines

if TYPE_CHECKING:
    from bench.figures import Better


def ratio(*values: float, better: Better = "less", skipped: str = "") -> Figure:
    return Figure("ours / theirs", "times", values, better, limit=1.5, skipped=skipped)


@pytest.mark.parametrize(
    ("figure", "verdict"),
    [
        (ratio(1.1, 1.2, 1.3), "kept"),
        (ratio(1.4, 1.6, 1.7), "at the limit"),
        (ratio(1.9, 2.0, 2.1), "broken"),
        (ratio(2.0), "at the limit"),
        (ratio(1.9, 2.0, 2.1, better="more"), "kept"),
        (ratio(1.3, 1.4, 1.7, better="more"), "at the limit"),
        (ratio(1.1, 1.2, 1.3, better="more"), "broken"),
        (ratio(skipped="no compiler"), "skipped"),
    ],
)
def test_a_limit_is_broken_only_beyond_chance(figure: Figure, verdict: str) -> None:
    assert [one.verdict for one in judge("bus", [figure])] == [verdict]


def test_a_figure_without_a_limit_is_not_judged() -> None:
    assert list(judge("bus", [Figure("a round", "ms", (1.0,))])) == []


@pytest.mark.parametrize(("values", "code"), [((1.1, 1.2), 0), ((1.9, 2.0, 2.1), 1)])
def test_only_a_broken_limit_fails_the_command(
    values: tuple[float, ...], code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, Any]] = []

    def measured(name: str, options: Any) -> list[Figure]:
        asked.append((name, options))
        return [ratio(*values)]

    monkeypatch.setattr(limits, "figures_of", measured)
    assert main(["bus"]) == code
    assert asked == [("bus", limits.LIMITED["bus"])]
    assert ("bus: ours / theirs is beyond its limit of 1.5" in capsys.readouterr().err) == bool(code)
    assert main(["bus", "--json"]) == code
    (row,) = json.loads(capsys.readouterr().out)
    assert row["verdict"] == ("broken" if code else "kept")


def test_without_a_compiled_engine_the_comparison_is_left_out_and_says_why(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = "ImportError: KHALA_ENGINE=compiled, but the rules were not compiled: install with a C compiler"
    failed = subprocess.CompletedProcess([], 1, "", f"Traceback:\n{words}\n")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    figures = list(engines.measures(engines.measure(3, 1.0)))
    monkeypatch.setattr(limits, "figures_of", lambda *_: figures)
    assert main(["engines"]) == 0
    assert f"* skipped: there is no compiled engine here, so it is compared with nothing ({words})" in (
        capsys.readouterr().out
    )


def test_a_compiled_engine_that_cannot_be_loaded_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = subprocess.CompletedProcess([], 1, "", "ImportError: undefined symbol: round\n")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(SystemExit, match="cannot be loaded: ImportError: undefined symbol: round"):
        engines.why_not()
