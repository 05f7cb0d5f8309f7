"""A page within a budget: what is left out first, and what never is."""

from __future__ import annotations

import functools
import re
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from khala_bridge.observe.text import SECTIONS, SECTIONS_OF, find_sections, tokens

AGENTS = {"Commander": "commander", "Developer": "developer", "Builder": "builder", "CombatGroup1": "combat_group"}
NOTICE = "Left out to keep this short\n"
ROUNDING = 30
"""Tokens by which sections counted apart may be more than the page: one a section, and what stands between them."""
SMALLEST = 100
"""The least that a configuration may ask for; no page is as short."""


@pytest.fixture
def full(pages: Any) -> dict[str, str]:
    """Return the pages without a limit."""
    found: dict[str, str] = pages()
    return found


@pytest.fixture
def shortest(pages: Any) -> dict[str, str]:
    """Return the declared minimum of each page."""
    found: dict[str, str] = pages(**dict.fromkeys(AGENTS, SMALLEST))
    return found


@pytest.fixture
def within(pages: Any) -> Any:
    """Return an agent's page within a budget; pages are remembered, since a property asks for many."""
    return functools.cache(lambda agent, budget: pages(**{agent: budget})[agent])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(agent=st.sampled_from(sorted(AGENTS)), budget=st.integers(SMALLEST, 2500))
def test_a_page_is_within_its_budget_or_the_declared_minimum(
    agent: str, budget: int, within: Any, full: dict[str, str], shortest: dict[str, str]
) -> None:
    text = within(agent, budget)
    assert tokens(text) <= budget or text == shortest[agent]
    assert (text == full[agent]) == (NOTICE not in text)
    assert text == full[agent] or tokens(full[agent]) + ROUNDING > budget


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(agent=st.sampled_from(sorted(AGENTS)), budget=st.integers(SMALLEST, 2500))
def test_no_line_is_cut_and_none_is_made_up(agent: str, budget: int, within: Any, full: dict[str, str]) -> None:
    known = {*full[agent].splitlines()}
    forms = re.compile(r"\d+ \w+ around screen|: \d+$|by type:$|What they cost:|Costs |\S+:$|CombatGroup1: |Builder: ")
    new = [line for line in within(agent, budget).partition(NOTICE)[0].splitlines() if line not in known]
    assert [line for line in new if not forms.search(line)] == []


def test_a_page_that_fits_says_nothing_of_a_budget(within: Any, full: dict[str, str]) -> None:
    assert within("CombatGroup1", 5000) == full["CombatGroup1"]
    assert NOTICE not in full["CombatGroup1"]


def test_what_is_left_out_grows_in_the_declared_order(within: Any, full: dict[str, str]) -> None:
    notices: list[str] = []
    for budget in range(tokens(full["CombatGroup1"]) + ROUNDING, SMALLEST, -25):
        notice = within("CombatGroup1", budget).partition(NOTICE)[2].partition("\n\nAnswer")[0]
        if not notices or notice != notices[-1]:
            notices.append(notice)
    assert notices[:3] == [
        "",
        "    weapons and abilities of the types in sight",
        "    what is known of the types in sight",
    ]


@pytest.mark.parametrize("agent", sorted(AGENTS))
def test_the_minimum_still_says_who_can_be_told_what(agent: str, shortest: dict[str, str]) -> None:
    text = shortest[agent]
    for heading in ("Game", "Valid actions", "Task", "Communication", "Answer"):
        assert re.search(f"^{heading}$", text, re.MULTILINE)
    assert text.index("Left out to keep this short") < text.index("\nAnswer\n")


def test_own_units_keep_their_lines_at_any_budget(shortest: dict[str, str], full: dict[str, str]) -> None:
    own = re.findall(r"    Your units:\n((?:        .*\n)+)", full["CombatGroup1"])
    assert own == re.findall(r"    Your units:\n((?:        .*\n)+)", shortest["CombatGroup1"])


def test_shorter_forms_are_registered_in_the_order_in_which_they_are_taken() -> None:
    forms = [form.rank for section in SECTIONS.values() for form in section.shorter]
    assert len(forms) == len(set(forms))
    for names in SECTIONS_OF.values():
        for section in find_sections(names):
            ranks = [form.rank for form in section.shorter]
            assert ranks == sorted(ranks)


# --- the count ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "least", "most"),
    [
        ("", 0, 0),
        ("Zealot", 1, 2),
        ("The whole army attacks known enemies near it.", 8, 12),
        ("tag 0x100140001 | screen [17.5, 12] | health 100/100", 20, 32),
        ("1234567890", 4, 6),
        ("向敌人进攻", 5, 5),
    ],
)
def test_tokens_are_about_as_many_as_tokenizers_make(text: str, least: int, most: int) -> None:
    assert least <= tokens(text) <= most


@given(st.text(max_size=200), st.text(max_size=200))
def test_a_longer_text_has_no_fewer_tokens(first: str, second: str) -> None:
    assert max(tokens(first), tokens(second)) <= tokens(first + second) <= tokens(first) + tokens(second)


def test_lines_count_apart_as_much_as_together(full: dict[str, str]) -> None:
    for text in full.values():
        assert tokens(text) <= sum(tokens(line + "\n") for line in text.splitlines())
