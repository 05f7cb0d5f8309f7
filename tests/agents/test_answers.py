"""Forms of answers: what they allow is what the host offers, and each form of an order is read as the same order."""

from __future__ import annotations

import json
import random
import re
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.answers.choices import Choices, argument_names, choices_in, choices_of
from khala_agents.answers.form import AnswerRule
from khala_agents.answers.grammar import answer_grammar
from khala_agents.answers.render import shape_for
from khala_agents.answers.schema import TEXT_CHARACTERS, answer_schema
from khala_agents.answers.tools import tools_for
from khala_agents.answers.wording import in_json
from khala_agents.build import client_for
from khala_agents.config import ModelConfig
from khala_agents.llm.verdict import tool_words
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Context
from khala_agents.scripted.canned import Canned, completion
from khala_bridge.catalogue.catalogue import catalogue
from khala_protocol.codec import decode_as, encode
from khala_protocol.messages import (
    ActionSpec,
    Briefing,
    Call,
    Contact,
    MemoryRule,
    NoteView,
    Point,
    TeamSpec,
    TeamView,
    UnitView,
    ValidArguments,
    View,
)
from khala_protocol.speech import parse, written

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_protocol.messages import Observation

ATTACK = ActionSpec(name="Attack_Unit", args=("tag",), target="enemy")
MOVE = ActionSpec(name="Move_Screen", args=("screen",))
LOAD = ActionSpec(name="Select_Unit_Load", args=("tag", "tag"), actors=1, target="own")
BUILD = ActionSpec(name="Build_Pylon_Screen", args=("screen",))


def unit(tag: str, alliance: Any = "own") -> UnitView:
    return UnitView(tag=tag, type="Zealot", alliance=alliance, health=1, health_max=1, shield=0, shield_max=0, energy=0,
                    energy_max=0, screen=(1, 1), minimap=(1, 1))  # fmt: skip


def team(name: str, **changes: Any) -> TeamView:
    return TeamView(name=name, minimap=(1, 1), bounds=(0, 0, 24, 20), **changes)


VIEW = View(
    time_s=1.0,
    teams=(
        team(
            "Zealot-1",
            units=(unit("0x11"), unit("0x12")),
            enemies=(unit("0x21", "enemy"), unit("0x22", "enemy")),
            actions=(ATTACK, MOVE, LOAD, BUILD),
            arguments=(
                ValidArguments(action="Attack_Unit", tags=("0x21",)),
                ValidArguments(action="Build_Pylon_Screen", points=((3.0, 4.5), (5.0, 6.0))),
            ),
        ),
        team("Zealot-2", units=(unit("0x13"),), actions=(ATTACK, MOVE)),
    ),
    notes=(NoteView(number=3, time_s=0, text="x"),),
)
TOLD = Briefing(
    run="test",
    agent="Zealots",
    side="blue",
    episode=0,
    role="You command.",
    teams=(TeamSpec(name="Zealot-1", unit_types=("Zealot",)), TeamSpec(name="Zealot-2", unit_types=("Zealot",))),
    actions=(ATTACK, MOVE, LOAD, BUILD),
    correspondents=(Contact(name="Commander"),),
    channels=("Channel-1",),
    memory=MemoryRule(notes=2),
    standing_orders=2,
)


def samples(schema: dict[str, Any], chance: random.Random, definitions: dict[str, Any]) -> Any:
    """Return a value that a schema of ours allows."""
    if "$ref" in schema:
        return samples(definitions[schema["$ref"].rpartition("/")[2]], chance, definitions)
    if "anyOf" in schema:
        return samples(chance.choice(schema["anyOf"]), chance, definitions)
    if "enum" in schema:
        return chance.choice(schema["enum"])
    kind = schema["type"]
    if kind == "object":
        return {name: samples(inner, chance, definitions) for name, inner in schema["properties"].items()}
    if kind == "array":
        count = schema.get("minItems", chance.randint(0, 3))
        return [samples(schema["items"], chance, definitions) for _ in range(count)]
    number = chance.randint(int(schema.get("minimum", 1)), int(schema.get("maximum", 9)))
    return (
        number
        if kind in ("integer", "number")
        else chance.choice([None, "22 Probe"])
        if kind == ["string", "null"]
        else "words <Stop()> 'and' \"quotes\""
    )


def calls(text: str) -> list[tuple[Any, ...]]:
    return [(call.team, call.name, call.args) for call in parse(text).calls]


def test_an_order_means_the_same_as_text_json_and_tool() -> None:
    chance = random.Random(5)
    values: dict[str, str | Point] = {"tag": "0x1002c0001", "screen": (3.5, 12.0), "minimap": (31.0, 22.0)}
    for action in catalogue().values():
        spec = action.spec
        team_name = chance.choice(["Zealot-1", "Main base", "Gruppe 3"])
        args = tuple(values[kind] for kind in spec.args)
        text = f"Actions:\n    Team {team_name}:\n        {written(spec.name, args)}"
        names = [name for name, _ in argument_names(spec)]
        given = {"team": team_name, **dict(zip(names, args, strict=True))}
        shuffled = dict(chance.sample(list(given.items()), len(given)))
        assert calls(text) == [(team_name, spec.name, args)]
        assert calls(in_json(text, [spec])) == calls(text), spec.name
        assert calls(tool_words(spec.name, json.dumps(shuffled))) == calls(text), spec.name


def test_the_choices_are_what_an_observation_offers() -> None:
    choices = choices_in(TOLD, VIEW)
    allowed = {
        (name, option.action.name): [
            argument.tags or argument.points or argument.bounds for argument in option.arguments
        ]
        for option in choices.options
        for name in option.teams
    }
    assert allowed == {
        ("Zealot-1", "Attack_Unit"): [("0x21",)],
        ("Zealot-1", "Move_Screen"): [(0, 0, 24, 20)],
        ("Zealot-1", "Select_Unit_Load"): [("0x11", "0x12"), ("0x11", "0x12")],
        ("Zealot-1", "Build_Pylon_Screen"): [((3.0, 4.5), (5.0, 6.0))],
        ("Zealot-2", "Move_Screen"): [(0, 0, 24, 20)],  # it has nothing to attack
    }
    assert choices.notes == (3,)


@pytest.mark.parametrize("choices", [choices_in(TOLD, VIEW), choices_of(TOLD)], ids=["exact", "same in all steps"])
def test_all_that_a_schema_allows_is_read_as_it_is_meant(choices: Choices) -> None:
    schema = answer_schema(choices)
    chance = random.Random(1)
    orders = 0
    for _ in range(200):
        answer = samples(schema, chance, schema.get("$defs", {}))
        speech = parse(json.dumps(answer))
        assert not speech.faults
        once = [order for order in answer["orders"] if order["until"] is None]
        assert [(call.team, call.name) for call in speech.calls] == [(each["team"], each["action"]) for each in once]
        assert len(speech.standing) == len(answer["orders"]) - len(once) + len(answer["revoke"])
        orders += len(once)
    assert orders > 50


def derive(grammar: str, chance: random.Random) -> str:  # noqa: C901
    """Return a text that a grammar of ours allows."""
    rules = dict(line.split(" ::= ", 1) for line in grammar.splitlines())
    token = re.compile(r'"(?:\\.|[^"\\])*"|\[(?:\\.|[^\]\\])+\]|\{\d+,\d+\}|[()|?]|[a-z][a-z0-9-]*')

    def alternatives(tokens: Iterator[str]) -> list[list[tuple[Any, str]]]:
        found: list[list[tuple[Any, str]]] = [[]]
        for word in tokens:
            if word == ")":
                break
            if word == "|":
                found.append([])
            elif word == "?" or word[0] == "{":
                found[-1][-1] = (found[-1][-1][0], word)
            else:
                found[-1].append((alternatives(tokens) if word == "(" else word, ""))
        return found

    def make(node: Any) -> str:
        if isinstance(node, list):
            return "".join(repeat(*part) for part in chance.choice(node))
        if node[0] == '"':
            return str(json.loads(node))
        if node[0] == "[":
            return "w" if "^" in node else "4"
        return make(alternatives(iter(token.findall(rules[node]))))

    def repeat(node: Any, times: str) -> str:
        low, high = (0, 1) if times == "?" else map(int, times[1:-1].split(",")) if times else (1, 1)
        return "".join(make(node) for _ in range(chance.randint(low, min(high, low + 3))))

    return make("root")


def test_all_that_a_grammar_allows_is_read_without_a_fault() -> None:
    grammar, chance = answer_grammar(choices_in(TOLD, VIEW)), random.Random(2)
    seen: set[tuple[str | None, str]] = set()
    spoken = 0
    for _ in range(300):
        text = derive(grammar, chance)
        speech = parse(text)
        assert not speech.faults, text
        assert not speech.mentions, text
        given = [*speech.calls, *(each.call for each in speech.standing if hasattr(each, "call"))]
        for call in given:
            assert isinstance(call, Call)
            assert call.name != "Attack_Unit" or call.args == ("0x21",)
        assert len(speech.calls) <= TOLD.max_actions * len(VIEW.teams)
        seen |= {(call.team, call.name) for call in given}
        spoken += len(speech.messages) + len(speech.listens) + len(speech.notes)
    assert seen == {("Zealot-1", "Attack_Unit"), ("Zealot-1", "Move_Screen"), ("Zealot-1", "Select_Unit_Load"),
                    ("Zealot-1", "Build_Pylon_Screen"), ("Zealot-2", "Move_Screen")}  # fmt: skip
    assert spoken > 50


def test_a_tool_is_for_all_teams_that_have_its_action() -> None:
    tools = {tool.name: tool.parameters["properties"] for tool in tools_for(choices_in(TOLD, VIEW))}
    assert tools["Move_Screen"]["team"]["enum"] == ["Zealot-1", "Zealot-2"]
    assert tools["Select_Unit_Load"]["unit"]["enum"] == ["0x11", "0x12"]
    assert set(tools) == {
        "Attack_Unit", "Move_Screen", "Select_Unit_Load", "Build_Pylon_Screen",
        "MessageTo", "ListenTo", "Note", "Forget", "Revoke",
    }  # fmt: skip
    assert parse(tool_words("MessageTo", {"to": "Commander", "text": "go, (now)"})).messages[0].text == "go, (now)"
    assert parse(tool_words("Note", {"text": "a, (b)"})).notes[0].text == "a, (b)"  # type: ignore[union-attr]
    assert parse(tool_words("ListenTo", {"channel": "Channel-1"})).listens[0].channel == "Channel-1"
    assert parse(tool_words("Forget", {"number": 3})).notes[0].number == 3  # type: ignore[union-attr]


def test_a_form_that_is_the_same_in_all_steps_has_no_tags() -> None:
    shape = shape_for(AnswerRule(form="json", exact=False), TOLD, VIEW)
    assert shape is not None
    assert "0x21" not in json.dumps(shape.schema)
    assert shape_for(AnswerRule(), TOLD, VIEW) is None
    told_again = decode_as(Briefing, encode(TOLD))
    assert shape_for(AnswerRule(form="json", exact=False), told_again, VIEW) is shape, "it is made once"


@pytest.mark.parametrize(("exact", "forms"), [(True, 2), (False, 1)])
@pytest.mark.parametrize("form", ["json", "tools", "grammar"])
async def test_an_endpoint_is_sent_the_same_form_in_all_steps_or_one_for_each(
    form: Any, exact: bool, forms: int, observation: Callable[..., Observation]
) -> None:
    there, gone = VIEW, VIEW.model_copy(update={"teams": VIEW.teams[1:]})
    async with Canned(completion("Analysis: go.")) as server:
        config = {"profile": "llamacpp", "model": "m", "base_url": server.base_url}
        policy = LLMPolicy(client_for(ModelConfig.model_validate(config)), answer=AnswerRule(form=form, exact=exact))
        for view in (there, gone):
            await policy.decide(Context(TOLD, observation(view=view)))
        await policy.close()
    sent = [{name: asked.body.get(name) for name in ("response_format", "tools", "grammar")} for asked in server.asked]
    assert len({json.dumps(fields) for fields in sent}) == forms
    assert ("0x21" in json.dumps(sent[0])) == exact


def bounds(schema: dict[str, Any]) -> Iterator[bool]:
    """Yield for each list and text of a schema whether it has a bound."""
    if schema.get("type") == "array":
        yield "maxItems" in schema
    if schema.get("type") in ("string", ["string", "null"]):
        yield bool(schema.keys() & {"maxLength", "enum", "pattern"})
    inner = [*schema.get("properties", {}).values(), *schema.get("anyOf", ()), *schema.get("$defs", {}).values()]
    for each in (*inner, *([schema["items"]] if "items" in schema else [])):
        yield from bounds(each)


def test_no_answer_in_json_goes_on_for_ever_and_no_analysis_in_a_grammar() -> None:
    choices = choices_in(TOLD, VIEW)
    found = list(bounds(answer_schema(choices)))
    assert len(found) > 10
    assert all(found)
    assert f"{{1,{TEXT_CHARACTERS}}}" in answer_grammar(choices)
