"""An observation in words, as a model reads it: one function per section.

A section is a heading at the left margin and indented lines below it; an empty section is left out. A page contains
the view, knowledge about the types in it, and the result of the last reply. It decides nothing and reads no game: a
page is a pure function of an observation, its task and the agent's feedback.

    page       registers, writes and shortens sections                    tokens, words    counting, small words
    general, units, known, actions, reply, kept, whole_side, leading            the sections, by topic

`SECTIONS_OF` lists the sections of a page by the agent's kind. A task may name others (`AgentConfig.sections`), and a
program may register sections of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.observe.text import actions, general, kept, known, leading, reply, units, whole_side
from khala_bridge.observe.text.page import SECTIONS, Page, Section, find_sections, render, section, shorter
from khala_bridge.observe.text.tokens import tokens

if TYPE_CHECKING:
    from khala_bridge.knowledge import DataSet
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import AgentKind

__all__ = [
    "SECTIONS",
    "SECTIONS_OF",
    "Page",
    "Section",
    "actions",
    "find_sections",
    "general",
    "kept",
    "knowledge_of",
    "known",
    "leading",
    "render",
    "reply",
    "section",
    "sections_of",
    "shorter",
    "tokens",
    "units",
    "whole_side",
]

_STEADY = ("unit_knowledge", "arguments", "valid_actions")
"""What rarely changes stands first: a provider's cache keeps what begins as the prompt before it."""
_ACTING = ("impossible", "standing", "last_actions", "rejections")
_ENDING = ("task", "notes", "messages", "communication", "answer")

SECTIONS_OF: dict[AgentKind, tuple[str, ...]] = {
    "combat_group": (*_STEADY, "game", "teams", *_ACTING, *_ENDING),
    "commander": (
        *_STEADY,
        *("game", "map", "army", "counts", "alerts", "events", "others", "teams"),
        *_ACTING,
        *_ENDING,
    ),
    "developer": (
        "arguments",
        *("game", "economy", "counts", "alerts", "events", "structures", "warp", "teams"),
        "valid_actions",
        *_ACTING,
        *_ENDING,
    ),
    "builder": ("arguments", "game", "teams", "counts", "events", "places", "valid_actions", *_ACTING, *_ENDING),
}
"""Names of the sections of a page by the kind of the agent, in their order."""


def knowledge_of(agent: AgentConfig, data_set: DataSet) -> tuple[str, ...]:
    """Return what is known of each type of an agent's units; () if its pages have nothing of the kind.

    Args:
        agent: whose units they are.
        data_set: the data that the map depends on, `TaskConfig.map_data`.
    """
    if known.unit_knowledge not in (found.write for found in sections_of(agent)):
        return ()
    return known.own_types((name for team in agent.teams for name in team.unit_types), data_set)


def sections_of(agent: AgentConfig) -> tuple[Section, ...]:
    """Return the sections of an agent's page.

    Raises:
        ConfigError: its configuration names one that does not exist.
    """
    return find_sections(agent.sections or SECTIONS_OF[agent.kind])
