"""Every benchmark is in the registry, backs a claim, and is called by its name."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from bench.paths import ROOT
from bench.registry import BENCH, BENCHMARKS, having

if TYPE_CHECKING:
    from bench.registry import Benchmark

SCRIPTS = {"__main__", "environments.env_worker", "simulator.at_once"}
"""The command itself, and what benchmarks start as processes of their own."""
MEASUREMENTS = (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")
CALL = re.compile(r"python -m\s+bench(?:[ \n](?P<name>[a-z]\w*)|\.\w+)")


def claim_of(benchmark: Benchmark) -> str:
    """Return the text that rests on a benchmark: a section of the measurements, or a file."""
    if (ROOT / benchmark.claim).is_file():
        return (ROOT / benchmark.claim).read_text(encoding="utf-8")
    head = f"# {benchmark.claim}\n"
    assert head in MEASUREMENTS, f"docs/measurements.md has no heading {benchmark.claim!r}"
    return MEASUREMENTS.partition(head)[2].partition("\n## ")[0]


def test_no_module_with_a_main_is_unregistered() -> None:
    modules = {".".join(file.relative_to(BENCH).with_suffix("").parts): file for file in BENCH.rglob("*.py")}
    sources = {module: file.read_text(encoding="utf-8") for module, file in modules.items()}
    mains = {module for module, source in sources.items() if re.search(r"^(async )?def main\(", source, re.MULTILINE)}
    scripts = {module for module, source in sources.items() if '__name__ == "__main__"' in source}
    assert mains - {"__main__"} == {benchmark.module for benchmark in BENCHMARKS.values()}
    assert scripts == SCRIPTS


@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_says_what_it_measures_and_backs_a_claim(name: str) -> None:
    benchmark = BENCHMARKS[name]
    assert benchmark.measures.endswith(".")
    assert re.search(rf"\bbench[\w.]*(\.|\s|\simport\s){name}\b", claim_of(benchmark)), (
        f"{benchmark.claim} does not name it"
    )
    assert benchmark.limited is None or benchmark.part == "figures"


def test_benchmarks_whose_figures_are_kept_have_measures() -> None:
    assert all(callable(BENCHMARKS[name].load().measures) for name in having("figures"))


def test_docs_and_targets_call_benchmarks_by_their_names() -> None:
    listed = subprocess.run(["git", "ls-files", "*.md", "*.py", "Makefile"], cwd=ROOT, capture_output=True, text=True)  # noqa: PLW1510  # outside of git there is nothing to list
    calls = {
        (file, call["name"])
        for file in listed.stdout.splitlines()
        for call in CALL.finditer((ROOT / file).read_text(encoding="utf-8"))
    }
    assert {(file, name) for file, name in calls if name not in BENCHMARKS} == set()


@pytest.mark.parametrize("words", [("--help",), ("--list",), ("house", "--help")], ids=" ".join)
def test_a_help_imports_no_benchmark_that_is_not_asked(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-X", "importtime", "-m", "bench", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    heavy = re.findall(r"\| +(numpy|pydantic|rich|scipy|khala\w*)$", done.stderr, re.MULTILINE)
    assert done.stdout
    assert heavy == []
