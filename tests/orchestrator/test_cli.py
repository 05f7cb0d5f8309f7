"""What the lists of the command line say."""

from __future__ import annotations

import pytest

from khala_orchestrator.cli import people, tasks


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        ([], ""),
        (["Zealots", "Stalkers"], "Zealots, Stalkers"),
        (["Commander", "CombatGroup0", "CombatGroup1", "CombatGroup12"], "Commander, CombatGroup0 1 12"),
        (["CombatGroup", "CombatGroup2"], "CombatGroup 2"),
        (["2"], "2"),
    ],
)
def test_agents_that_differ_by_a_number_are_named_together(names: list[str], shown: str) -> None:
    assert people(names) == shown


def test_a_task_is_listed_with_its_agents_and_what_it_is_about(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    tasks()
    lines = capsys.readouterr().out.splitlines()
    first = lines.index("pvz_task5_level1  Commander, CombatGroup1 2 5 6")
    assert lines[first + 1].startswith("    LLM-PySC2 task 5, ")
    assert all(len(line) <= 80 for line in lines)
