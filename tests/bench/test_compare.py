"""Factors between two results, and how sure they are."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bench.compare import changes, main, remarks
from bench.ratios import mean_ratio, ratio_of_means
from bench.results import write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bench.results import Results, Series

    Made = Callable[..., Results]
    Step = Callable[..., Series]


def test_the_interval_of_three_runs_a_side_holds_the_true_factor_as_often_as_it_says() -> None:
    rng, true = np.random.default_rng(1), 1.3
    held = 0
    for _ in range(600):
        before, after = 10 * rng.lognormal(0, 0.1, 3), 13 * rng.lognormal(0, 0.1, 3)
        found = ratio_of_means(after.tolist(), before.tolist())
        held += found.low <= true <= found.high
    assert 0.93 <= held / 600 <= 0.985


def test_the_interval_of_ratios_of_one_run_holds_the_true_one_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    intervals = [mean_ratio((1.2 * rng.lognormal(0, 0.3, 5)).tolist()) for _ in range(600)]
    assert 0.92 <= sum(one.low <= 1.2 <= one.high for one in intervals) / 600 <= 0.98


@pytest.mark.parametrize(
    ("over", "under", "value", "low", "high"),
    [
        ([4.0], [2.0, 2.1], 1.95, 0.0, math.inf),  # one run says nothing of how runs scatter
        ([4.0, 4.0], [2.0, 2.0], 2.0, 2.0, 2.0),
        ([4.0, -1.0], [2.0, 2.0], None, 0.0, math.inf),
        ([], [2.0], None, 0.0, math.inf),
    ],
)
def test_a_ratio_without_scatter_or_sense_says_so(
    over: list[float], under: list[float], value: float | None, low: float, high: float
) -> None:
    found = ratio_of_means(over, under)
    assert found.value == (None if value is None else pytest.approx(value, rel=0.01))
    assert (found.low, found.high) == (low, high)


@pytest.mark.parametrize(
    ("better", "after", "verdict"),
    [
        ("less", (20.0, 20.1, 20.2), "worse"),
        ("less", (5.0, 5.1, 5.2), "better"),
        ("more", (20.0, 20.1, 20.2), "better"),
        ("more", (5.0, 5.1, 5.2), "worse"),
        ("less", (9.0, 10.0, 11.5), ""),
        ("less", (20.0,), ""),
    ],
)
def test_a_figure_is_better_or_worse_only_if_the_interval_says_so(
    made: Made, step: Step, better: str, after: tuple[float, ...], verdict: str
) -> None:
    a, b = made(step(10.0, 10.1, 10.2, better=better)), made(step(*after, better=better))
    assert [change.verdict for change in changes(a, b)] == [verdict]


def test_figures_of_one_side_alone_and_those_not_asked_for_are_left_out(made: Made, step: Step) -> None:
    a, b = made(step(1.0), step(2.0, name="old")), made(step(1.0), step(2.0, name="new"))
    assert [change.name for change in changes(a, b)] == ["a step"]
    assert list(changes(a, b, only=["bus"])) == []
    assert any(words.startswith("2 figures are in one of the two alone") for words in remarks(a, b, []))


def test_another_machine_and_a_busy_one_are_said(made: Made, step: Step) -> None:
    a, b = made(step(1.0, 1.1)), made(step(1.0, 1.1), cpu="a slow one", load=2.5)
    said = list(remarks(a, b, list(changes(a, b))))
    assert said[0].startswith("the machines differ")
    assert said[1].startswith("B began on a machine with a load of 2.5")
    assert said[2] == "of 1 figures that are the same, 0.1 would stand out by chance"


def test_the_command_prints_a_table_and_strict_json(
    made: Made, step: Step, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(write(made(step(*runs)), into=tmp_path)) for runs in ((10.0, 10.1), (20.0, 20.1))]
    main(files)
    assert "1.995" in capsys.readouterr().out
    main([files[0], str(write(made(step(20.0)), into=tmp_path)), "--json"])
    (change,) = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)["changes"]
    assert change["factor"]["high"] is None
