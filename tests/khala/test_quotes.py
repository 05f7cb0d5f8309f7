"""Quotes of prompts are nobody's orders: replies of small models, and quotes drawn from real prompts."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
import yaml

from khala_agents.prompt import system_text
from khala_bridge.catalogue.catalogue import catalogue
from khala_orchestrator.config import all_tasks
from khala_orchestrator.match.cards import briefing
from khala_protocol.manual import manual
from khala_protocol.messages import Briefing, Observation
from khala_protocol.recording.reader import Recording
from khala_protocol.speech import ShownText, parse, render
from khala_protocol.speech.echoes import is_form

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_protocol.speech import Speech

HERE = Path(__file__).parent
REPLIES: list[dict[str, Any]] = yaml.safe_load((HERE / "small_models.yaml").read_text(encoding="utf-8"))


def orders(speech: Speech) -> list[str]:
    return [f"{call.team}: {render(call)}" if call.team else render(call) for call in speech.calls]


@pytest.mark.parametrize("row", REPLIES, ids=[row["name"] for row in REPLIES])
def test_a_small_model_orders_no_more_than_it_means(row: dict[str, Any]) -> None:
    speech = parse(row["reply"], ShownText(manual(tuple(action.spec for action in catalogue().values()))))
    assert orders(speech) == row["orders"]
    assert [message.text for message in speech.messages] == row["messages"]


# --- quotes ---------------------------------------------------------------------------------------------


class _Prompt(NamedTuple):
    system: str
    observation: str
    shown: ShownText
    team: str


OWN = "Actions:\n    Team {team}:\n        <Move_Screen([7, 7])>\n        <Attack_Unit(0x1007c0001)>\n        <Stop()>"
OWN_ORDERS = ["{team}: <Move_Screen([7, 7])>", "{team}: <Attack_Unit(0x1007c0001)>", "{team}: <Stop()>"]
_ANSWER = re.compile(r"\s*(?:Team [\w-]+:\s*)?<\w+(?:\([^<>]*\)>?[\s:]*)?")
"""A line that is an answer as it stands: who quotes it, orders it."""


def prompts() -> list[_Prompt]:
    """Return what agents read in a recorded battle, and before the first step of every task."""
    golden = Recording.open(HERE / "golden.mcap")
    briefings = {said.agent: said for said in golden.of(Briefing)}
    found = [_prompt(briefings[seen.agent], seen.text) for seen in golden.of(Observation)]
    for task in all_tasks():
        side = task.per_side()[0]
        found += [_prompt(briefing(side, agent, "run", 0), "") for agent in side.agents]
    return found


def _prompt(said: Briefing, observation: str) -> _Prompt:
    team = said.teams[0].name if said.teams else said.agent
    return _Prompt(
        system_text(said), observation, ShownText(observation, earlier=ShownText(manual(said.actions))), team
    )


def quotes(drawn: random.Random, prompt: _Prompt) -> Iterator[str]:
    """Yield parts of a prompt: lines, blocks, sections and all of it, as models repeat them."""
    text = prompt.observation or prompt.system
    lines = text.splitlines()
    begin = drawn.randrange(len(lines))
    sections = text.split("\n\n")
    for quote in (
        lines[begin],
        "\n".join(lines[begin : begin + drawn.randint(2, 12)]),
        drawn.choice(sections),
        "\n\n".join(sections[drawn.randrange(len(sections)) :]),
        prompt.system,
    ):
        yield _changed(drawn, quote)


def _changed(drawn: random.Random, quote: str) -> str:
    """Return a quote as a model may write it."""
    match drawn.randrange(5):
        case 0:
            return "\n".join(f"> {line}" for line in quote.splitlines())
        case 1:
            return f"```\n{quote}\n```"
        case 2:
            return "\n".join(line.strip() for line in quote.splitlines())
        case 3:
            return "\n".join(f"- {line.strip()}" if line.strip() else "" for line in quote.splitlines())
        case _:
            return quote


@pytest.mark.parametrize("count", [1_000, pytest.param(12_000, marks=pytest.mark.slow)])
def test_no_quote_is_carried_out_and_no_order_is_lost(count: int) -> None:
    drawn = random.Random(7)  # not for secrets
    read = prompts()
    tried = 0
    while tried < count:
        prompt = drawn.choice(read)
        own, wanted = OWN.format(team=prompt.team), [order.format(team=prompt.team) for order in OWN_ORDERS]
        for quote in quotes(drawn, prompt):
            cut = quote[: drawn.randrange(len(quote) + 1)]  # by a limit of tokens, at the end of a reply
            replies: tuple[tuple[str, str, list[str]], ...] = (
                (quote, quote, []),
                (cut, cut, []),
                (quote, f"Analysis: I see this.\n{quote}\n\n{own}", wanted),
                (quote, f"{quote}\n\n{own}\n", wanted),
                (quote, f"{own}\n\n{quote}", wanted),
                (cut, f"{own}\n\n{cut}", wanted),
            )
            for quoted, reply, said in replies:
                if not any(_ANSWER.fullmatch(line.lstrip("->` ")) for line in quoted.splitlines()):
                    tried += 1
                    speech = parse(reply, prompt.shown)
                    assert [order for order in orders(speech) if not is_form(order[order.find("<") :])] == said, reply
                    assert not (speech.messages or speech.listens or speech.notes or speech.standing), reply
