"""The messages: what every one of them promises, whatever its content."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from khala_protocol import messages
from khala_protocol.keys import AGENT_TOPICS, NUMBERED_TOPICS, RUN_TOPICS, Topic
from khala_protocol.manual import list_actions
from khala_protocol.messages import (
    MESSAGE_TYPES,
    SCHEMA_VERSION,
    ActionSpec,
    Briefing,
    Call,
    Frozen,
    Message,
    Observation,
    Reply,
    UnitView,
    Usage,
    Wire,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

PARTS = [
    part for _, part in inspect.getmembers(messages, inspect.isclass) if issubclass(part, Frozen) and part is not Frozen
]
TOKENS = st.integers(0, 10**6)
USAGES = st.builds(
    Usage,
    requests=TOKENS,
    prompt_tokens=TOKENS,
    completion_tokens=TOKENS,
    cached_tokens=TOKENS,
    reasoning_tokens=TOKENS,
    cost_usd=st.none() | TOKENS.map(float),
    unknown_requests=TOKENS,
)


def a_reply(**changes: object) -> Reply:
    return Reply.model_validate(
        {"run": "r", "agent": "A", "side": "p1", "episode": 0, "step": 0, "text": "<Stop()>"} | changes
    )


def test_every_kind_of_message_has_a_topic_of_its_name() -> None:
    kinds = [model.model_fields["kind"].default for model in MESSAGE_TYPES]
    assert sorted(kinds) == sorted(str(topic) for topic in set(Topic) - NUMBERED_TOPICS)
    assert {issubclass(model, Wire) for model in MESSAGE_TYPES} == {True}


def test_a_message_of_an_agents_topic_says_whose_it_is() -> None:
    by_topic = {Topic(model.model_fields["kind"].default): model for model in MESSAGE_TYPES}
    assert all({"agent", "side"} <= set(by_topic[topic].model_fields) for topic in AGENT_TOPICS - NUMBERED_TOPICS)
    assert not any("agent" in by_topic[topic].model_fields for topic in RUN_TOPICS)


def test_every_message_carries_version_and_run() -> None:
    assert a_reply().v == SCHEMA_VERSION
    assert all({"v", "run", "kind"} <= set(model.model_fields) for model in MESSAGE_TYPES)


def test_a_schema_has_the_sentences_under_the_fields_also_inherited_and_nested_ones() -> None:
    schema = Reply.model_json_schema()
    assert schema["properties"]["run"]["description"] == "Name of the run; the same as in the key."
    assert schema["$defs"]["Usage"]["properties"]["cost_usd"]["description"].startswith("None")


def test_no_part_can_be_changed_or_widened(subtests: pytest.Subtests) -> None:
    for part in PARTS:
        with subtests.test(part.__name__):
            assert part.model_config["frozen"] is True
            assert part.model_config["extra"] == "forbid"
            assert part.__doc__


def test_a_field_cannot_be_assigned() -> None:
    with pytest.raises(ValidationError, match="Instance is frozen"):
        a_reply().text = "other"  # type: ignore[misc]  # that it is read-only is what is tested


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"colour": "red"}, "Extra inputs are not permitted"),
        ({"v": 2}, "Input should be 1"),
        ({"kind": "message"}, "Input should be 'reply'"),
        ({"step": -1}, "Input should be greater than or equal to 0"),
        ({"status": "gone"}, "Input should be 'ok', 'empty', 'cut'"),
        ({"latency_s": float("nan")}, "Input should be a finite number"),
        ({"latency_s": float("inf")}, "Input should be a finite number"),
        ({"text": b"\xff"}, "Input should be a valid string"),
        ({"usage": {"requests": "many"}}, "Input should be a valid integer"),
    ],
)
def test_what_the_schema_does_not_allow_cannot_be_built(changes: Mapping[str, object], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        a_reply(**changes)


@pytest.mark.parametrize("model", [Briefing, Message, Observation, Reply])
def test_a_field_that_must_be_given_has_no_default_that_guesses(model: type[Wire]) -> None:
    required = {name for name, field in model.model_fields.items() if field.is_required()}
    assert {"run", "agent", "side", "episode"} <= required


@pytest.mark.parametrize(
    ("given_argument", "kept"),
    [("0x1f", "0x1f"), ((3, 4), (3.0, 4.0)), ([3, 4.5], (3.0, 4.5)), ("[3, 4]", "[3, 4]"), ("", "")],
)
def test_an_argument_is_a_text_or_a_point_and_never_mistaken(given_argument: object, kept: object) -> None:
    call = Call.model_validate({"name": "Act", "args": [given_argument], "start": 0, "end": 5})
    assert call.args == (kept,)
    assert Call.model_validate_json(call.model_dump_json()) == call


def test_a_point_has_two_coordinates() -> None:
    with pytest.raises(ValidationError):
        Call.model_validate({"name": "Act", "args": [(1, 2, 3)], "start": 0, "end": 5})


def test_units_in_fields_are_said_in_their_names() -> None:
    assert {"weapon_cooldown_s"} <= set(UnitView.model_fields)
    assert {"answer_within_s", "game_loop"} <= set(Observation.model_fields)


@given(USAGES, USAGES, USAGES)
def test_usage_adds_up_in_any_order(one: Usage, two: Usage, three: Usage) -> None:
    assert one + two == two + one
    assert (one + two) + three == one + (two + three)
    assert one + Usage() == one
    assert (one + two).prompt_tokens == one.prompt_tokens + two.prompt_tokens


@pytest.mark.parametrize(
    ("one", "two", "total"), [(None, None, None), (0.5, None, 0.5), (None, 0.25, 0.25), (0.5, 0.25, 0.75)]
)
def test_a_price_that_is_not_known_is_not_counted_as_zero(
    one: float | None, two: float | None, total: float | None
) -> None:
    assert (Usage(cost_usd=one) + Usage(cost_usd=two)).cost_usd == total


def test_actions_that_do_the_same_share_a_line_and_those_of_one_way_a_heading() -> None:
    said = {
        "Train_A": "Train in a free Gateway: fast.",
        "Train_B": "Train in a free Gateway: strong.",
        "Warp_A": "Warp one in.",
        "Warp_B": "Warp one in.",
        "Build_A": "Build in an own base: supply.",
        "Stop": "",
        "Hold": "",
    }
    actions = [ActionSpec(name=name, description=description) for name, description in said.items()]
    assert list_actions(actions).splitlines() == [
        "Train in a free Gateway:",
        "- <Train_A()>: fast.",
        "- <Train_B()>: strong.",
        "- <Warp_A()>, <Warp_B()>: Warp one in.",
        "- <Build_A()>: Build in an own base: supply.",
        "- <Stop()>",
        "- <Hold()>",
    ]
