"""Files of results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.figures import Figure
from bench.results import begin, every, find, join, read, this_machine, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bench.results import Results, Series

    Made = Callable[..., Results]
    Step = Callable[..., Series]


def test_results_are_read_as_they_were_written(made: Made, step: Step, tmp_path: Path) -> None:
    results = made(step(1.5, 2.5), step(3.0, name="another", better="more", limit=1.5), load=0.25)
    assert read(write(results, into=tmp_path)) == results


def test_a_file_is_named_after_date_and_commit_and_none_is_written_over(made: Made, tmp_path: Path) -> None:
    names = [write(one, into=tmp_path).name for one in (made(), made(), made(changed=True), made(commit=""))]
    assert names == [
        "2026-11-01-aaaaaaaa.json", "2026-11-01-aaaaaaaa-2.json", "2026-11-01-aaaaaaaa-changed.json",
        "2026-11-01-unknown.json",
    ]  # fmt: skip


def test_results_are_found_by_path_commit_and_date(made: Made, tmp_path: Path) -> None:
    old, new = (write(made(commit=letter * 40, day=day), into=tmp_path) for letter, day in (("a", 3), ("b", 12)))
    assert find(str(old)) == old
    assert [find(name, among=tmp_path) for name in ("aaaa", "b" * 40, "2026-11-03", "2026-11")] == [old, new, old, new]
    with pytest.raises(SystemExit, match=r"no results 'c0ffee': .* of 2026-11-03-aaaaaaaa, 2026-11-12-bbbbbbbb$"):
        find("c0ffee", among=tmp_path)
    assert [path for path, _ in every(tmp_path)] == [old, new]


@pytest.mark.parametrize(
    ("text", "words"), [("{", "the file: Invalid JSON"), ("{}", "date: Field required; `python -m bench` writes them")]
)
def test_a_file_that_holds_no_results_is_named_with_what_is_wrong(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(SystemExit, match=words):
        read(tmp_path / "a.json")


def test_figures_of_several_runs_become_one_with_the_values_of_each() -> None:
    runs = [[Figure("x", "ms", (1.0, 2.0), limit=3.0)], [Figure("x", "ms", (1.23456789,), limit=3.0)]]
    (series,) = join("turn", runs)
    assert (series.runs, series.per_run, series.limit) == (((1.0, 2.0), (1.23457,)), [1.5, 1.23457], 3.0)


def test_a_figure_that_could_not_be_measured_says_why() -> None:
    (series,) = join("engines", [[Figure("x", "times", (), skipped="no compiler")]])
    assert (series.runs, series.per_run, series.skipped) == ((), [], "no compiler")


def test_this_machine_is_described_without_its_name() -> None:
    results, machine = begin(), this_machine()
    assert results.machine == machine
    assert machine.cores >= 1
    assert machine.python.startswith("3.")
    assert not {"hostname", "node", "user"} & set(machine.model_dump())
