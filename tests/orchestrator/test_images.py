"""Pictures for all agents by a word on the command line."""

from __future__ import annotations

import pytest

from khala_bridge.task.images import PAPER
from khala_orchestrator.config import change, load_task
from khala_protocol.errors import ConfigError


def shown(words: str | None) -> dict[str, tuple[str, ...]]:
    """What each kind of agent of a full game is shown."""
    task = change(load_task("simple64_ecsb"), images=words)
    return {agent.kind: tuple(image.what for image in agent.images) for agent in task.agents}


def test_without_a_word_a_task_is_as_its_file_says() -> None:
    assert set(shown(None).values()) == {()}


def test_paper_shows_each_kind_what_the_paper_shows_it() -> None:
    assert shown("paper") == {kind: PAPER[kind] for kind in ("commander", "developer", "builder")}


@pytest.mark.parametrize(
    ("words", "pictures"),
    [("screen", ("screen",)), ("screen, layer:creep", ("screen", "layer:creep")), ("none", ())],
)
def test_a_list_is_for_all(words: str, pictures: tuple[str, ...]) -> None:
    assert set(shown(words).values()) == {pictures}


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("minmap", "command line: what: there is no picture 'minmap', did you mean 'minimap'?"),
        ("screen,", "command line: what: there is no picture '', there are screen, minimap, features, layer:<name>, "),
    ],
)
def test_a_wrong_word_is_said(words: str, fault: str) -> None:
    with pytest.raises(ConfigError) as raised:
        shown(words)
    assert str(raised.value).startswith(fault)
