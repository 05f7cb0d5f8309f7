"""Sections are found by name, replaced and added; an agent's configuration decides on its page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.observe import Observer
from khala_bridge.observe.text import Page, find_sections, section, shorter
from khala_protocol.errors import ConfigError
from khala_protocol.trust import Untrusted, trust

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_bridge.task.config import TaskConfig


@pytest.fixture
def told(base: Any, look: Any, base_task: TaskConfig) -> Any:
    """Return the text of the agent at the front, with sections of these names."""

    def write(*names: str, text_tokens: int | None = None) -> str:
        changed = {"sections": names, "text_tokens": text_tokens}
        agents = tuple(a.model_copy(update=changed if a.name == "CombatGroup1" else {}) for a in base_task.agents)
        observation = Observer(base_task.model_copy(update={"agents": agents})).observe(look(base()))
        return str(observation.agents["CombatGroup1"].text)

    return write


def headings(text: str) -> list[str]:
    return [line for line in text.splitlines() if line and not line.startswith(" ")]


def test_a_configuration_says_which_sections_and_in_which_order(told: Any) -> None:
    assert headings(told("task", "game", "alerts", "counts", "answer")) == ["Task", "Game", "Unit counts", "Answer"]


def test_a_view_has_the_parts_that_the_page_shows(base: Any, look: Any, base_task: TaskConfig) -> None:
    agents = Observer(base_task).observe(look(base())).agents
    shown = {
        name: [part for part in ("counts", "others", "landmarks", "warp_gates") if getattr(agent.view, part)]
        for name, agent in agents.items()
    }
    assert shown == {
        "Commander": ["counts", "others"],
        "Developer": ["counts", "landmarks", "warp_gates"],
        "Builder": ["counts", "landmarks", "warp_gates"],
        "CombatGroup1": [],
    }


@pytest.mark.usefixtures("own_sections")
def test_a_section_of_ones_own_stands_where_its_name_stands(told: Any) -> None:
    @section("motto")
    def motto(page: Page) -> Iterator[str]:
        yield "Motto"
        yield f"    {len(page.teams)} teams, one spirit"

    assert told("motto", "answer").startswith("Motto\n    2 teams, one spirit\n\nAnswer\n")


@pytest.mark.usefixtures("own_sections")
def test_a_section_can_take_the_place_of_another(told: Any) -> None:
    @section("unit_knowledge", replace=True)
    def briefly(page: Page) -> Iterator[str]:
        yield "Unit knowledge"
        yield from (f"    {unit.type} bites" for team in page.teams[:1] for unit in team.enemies)

    assert "Unit knowledge\n    Roach bites\n    Zergling bites\n" in told("unit_knowledge", "answer")


@pytest.mark.usefixtures("own_sections")
def test_a_section_of_ones_own_can_be_shortened(told: Any) -> None:
    @section("epos")
    def epos(page: Page) -> Iterator[str]:
        yield "Epos"
        yield "    " + f"Sing of {page.observation.agent.name}. " * 100

    @shorter("epos", rank=5, says="most of the epos")
    def verse(page: Page) -> Iterator[str]:
        yield "Epos"
        yield f"    Sing of {page.observation.agent.name}."

    assert told("epos", "answer", text_tokens=100) == (
        "Epos\n    Sing of CombatGroup1.\n\nLeft out to keep this short\n    most of the epos\n\n"
        + told("answer", text_tokens=100)
    )


def test_a_name_cannot_be_taken_twice_unawares() -> None:
    with pytest.raises(ValueError, match="there is a section 'game' already; give replace=True"):
        section("game")


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("unit_knowlege", "there is no section 'unit_knowlege' of an observation: did you mean 'unit_knowledge'?"),
        ("xyz", "there is no section 'xyz' of an observation: there are "),
    ],
)
def test_a_section_that_does_not_exist_is_named_when_an_observer_is_made(name: str, complaint: str, told: Any) -> None:
    with pytest.raises(ConfigError) as raised:
        told("game", name)
    assert str(raised.value).startswith(complaint)


@pytest.mark.usefixtures("own_sections")
def test_a_section_can_come_with_a_module_of_ones_own(
    told: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = (
        "from khala_bridge.observe.text import section",
        "@section('creed')",
        "def creed(page):",
        "    yield 'Creed'",
    )
    (tmp_path / "khala_test_creed.py").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(Untrusted, match="names the code 'khala_test_creed'"):
        told("khala_test_creed:creed", "answer")
    trust("khala_test_creed")
    assert told("khala_test_creed:creed", "answer").startswith("Creed\n\nAnswer\n")


def test_a_module_that_is_not_there_is_named(told: Any) -> None:
    trust("nowhere")
    with pytest.raises(ConfigError, match="section 'nowhere:creed': there is no module 'nowhere'"):
        told("nowhere:creed")


def test_sections_are_found_in_the_order_of_their_names() -> None:
    assert [found.name for found in find_sections(["task", "game"])] == ["task", "game"]
