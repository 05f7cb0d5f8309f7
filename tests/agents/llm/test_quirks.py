"""What an endpoint refuses by name is left out, or called by its other name, from then on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from pydantic import SecretStr

from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import Completion, Request, RequestRefused
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.llm.quirks import Quirks, SentFields
from khala_agents.scripted.canned import Canned, CannedRequest, Given, completion, refusal
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from collections.abc import Callable

PROMPT = (
    ChatMessage(role="system", content="You play."),
    ChatMessage(role="user", content="Game"),
    ChatMessage(role="assistant", content="Actions:"),
    ChatMessage(role="user", content="now"),
)
GOOD = completion("go")


def client(server: Canned, **options: Any) -> OpenAICompatible:
    return OpenAICompatible(
        PROFILES["compatible"], **{"model": "m", "base_url": server.base_url, "prices": Prices(), **options}
    )


async def ask(model: OpenAICompatible | Anthropic) -> Completion:
    return await model.complete(Request(PROMPT, timeout_s=5.0, stable=3))


def refuses(field: str, answer: Given) -> Callable[[CannedRequest], Given]:
    """Return an endpoint that answers so whenever a request has this field."""
    return lambda asked: answer if field in asked.body else GOOD


UNSUPPORTED = "Unsupported parameter: '{}' is not supported with this model."
REFUSED = [
    ("temperature", refusal(400, UNSUPPORTED.format("temperature"), param="temperature")),
    ("temperature", refusal(400, "Unsupported value: 'temperature' does not support 0.2 with this model.")),
    ("temperature", refusal(400, "`temperature` is deprecated for this model.", type="invalid_request_error")),
    ("temperature", refusal(400, "`temperature` and `top_p` cannot both be specified for this model.")),
    ("top_p", refusal(400, "top_p: Extra inputs are not permitted")),
    ("seed", refusal(400, 'Invalid JSON payload received. Unknown name "seed": Cannot find field.')),
    ("seed", refusal(400, "Unrecognized request argument supplied: seed")),
    ("seed", Given({"detail": [{"type": "extra_forbidden", "loc": ["body", "seed"], "msg": "Extra inputs"}]}, 422)),
    ("stream_options", refusal(400, "stream_options is only allowed with stream; it is not supported here")),
    ("stop", refusal(400, "'stop' is not supported with this model")),
]


@pytest.mark.parametrize(("field", "answer"), REFUSED, ids=[f"{row[0]}-{place}" for place, row in enumerate(REFUSED)])
async def test_a_field_that_is_refused_by_name_is_left_out_from_then_on(
    field: str, answer: Given, caplog: pytest.LogCaptureFixture
) -> None:
    extra = {"top_p": 0.9, "stream_options": {}, "stop": ["x"]}
    async with Canned(refuses(field, answer)) as server:
        model = client(server, temperature=0.2, seed=3, max_tokens=50, extra=extra)
        for _ in range(2):
            assert (await ask(model)).text == "go"
        await model.close()
    sent = [field in asked.body for asked in server.asked]
    assert sent == [True, False, False], "one request more, once"
    everything = {"temperature", "seed", "max_tokens", *extra}
    assert everything - {field} <= server.asked[-1].body.keys(), "nothing else is left out"
    assert field not in model.params, "what is recorded is what was sent"
    assert caplog.messages == [f"m at {server.base_url}: from now on Khala leaves {field} out, which it refuses"]


@pytest.mark.parametrize(("profile", "refused", "taken"), [
    ("compatible", "max_tokens", "max_completion_tokens"),
    ("openai", "max_completion_tokens", "max_tokens"),
])  # fmt: skip
async def test_the_limit_of_tokens_is_called_by_its_other_name_and_never_dropped(
    profile: Any, refused: str, taken: str
) -> None:
    answer = refusal(400, UNSUPPORTED.format(refused), param=refused, code="unsupported_parameter")
    async with Canned(refuses(refused, answer)) as server:
        model = OpenAICompatible(
            PROFILES[profile], model="m", base_url=server.base_url, prices=Prices(), max_tokens=50, temperature=0.5
        )
        assert model.answer_tokens == 50
        await ask(model)
        await model.close()
    assert [asked.body.get(taken) for asked in server.asked] == [None, 50]
    assert refused not in server.asked[-1].body
    assert model.answer_tokens == 50
    assert model.params == {taken: 50, "temperature": 0.5}


async def test_an_endpoint_that_takes_no_limit_under_either_name_is_not_asked_without_one() -> None:
    def answer(asked: CannedRequest) -> Given:
        return refusal(400, UNSUPPORTED.format("max_tokens" if "max_tokens" in asked.body else "max_completion_tokens"))

    async with Canned(answer) as server:
        model = client(server, max_tokens=50)
        with pytest.raises(RequestRefused, match="'max_completion_tokens' is not supported"):
            await ask(model)
        await model.close()
    assert len(server.asked) == 2


KEPT = [
    refusal(400, "max_tokens is too large: 50. This model supports at most 20.", param="max_tokens"),
    refusal(400, "max_tokens is not supported above 20: at most 20", param="max_tokens"),
    refusal(400, "temperature must be between 0 and 2", param="temperature"),
    refusal(400, "This model's maximum context length is 2048 tokens; unsupported prompt"),
    refusal(400, "'model' is not supported"),
    refusal(404, UNSUPPORTED.format("temperature")),
]


@pytest.mark.parametrize("answer", KEPT)
async def test_what_is_refused_for_its_value_or_without_a_name_is_an_error(answer: Given) -> None:
    async with Canned(answer) as server:
        model = client(server, max_tokens=50, temperature=9.0)
        with pytest.raises(RequestRefused):
            await ask(model)
        await model.close()
    assert len(server.asked) == 1


async def test_several_refusals_are_learned_in_one_try() -> None:
    def answer(asked: CannedRequest) -> Given:
        for field in ("max_tokens", "temperature", "seed"):
            if field in asked.body:
                return refusal(400, UNSUPPORTED.format(field), param=field)
        return GOOD

    async with Canned(answer) as server:
        model = client(server, max_tokens=50, temperature=0.1, seed=1)
        assert (await ask(model)).text == "go"
        await model.close()
    assert len(server.asked) == 4


async def test_clients_of_one_model_share_what_was_found_and_others_do_not() -> None:
    answer = refusal(400, UNSUPPORTED.format("temperature"))
    async with Canned(refuses("temperature", answer)) as server:
        first, second = client(server, temperature=0.1), client(server, temperature=0.1)
        other = client(server, temperature=0.1, model="other")
        for model in (first, second, other):
            await ask(model)
            await model.close()
    assert ["temperature" in asked.body for asked in server.asked] == [True, False, False, True, False]


# --- the system message -------------------------------------------------------------------------------


def roles(asked: CannedRequest) -> list[str]:
    return [message["role"] for message in asked.body["messages"]]


def gemma(asked: CannedRequest) -> Given:
    """Answer as a template that knows two roles, which alternate."""
    if {"system", "developer"} & set(roles(asked)):
        return refusal(400, "System role not supported")
    if roles(asked) != ["user", "assistant", "user"]:
        return refusal(400, "Conversation roles must alternate user/assistant/user/assistant/...")
    return GOOD


def no_developer(asked: CannedRequest) -> Given:
    known = "Invalid value: 'developer'. Supported values are: 'system', 'assistant', 'user'."
    return refusal(400, known, param="messages[0].role") if "developer" in roles(asked) else GOOD


FOLDED = ["user", "assistant", "user"]
ROLES: list[tuple[Any, Any, list[list[str]]]] = [
    (gemma, None, [["system", *FOLDED], FOLDED, FOLDED]),
    (gemma, "user", [["user", *FOLDED], FOLDED, FOLDED]),
    (gemma, "developer", [["developer", *FOLDED], ["system", *FOLDED], FOLDED, FOLDED]),
    (gemma, "fold", [FOLDED, FOLDED]),
    (no_developer, "developer", [["developer", *FOLDED], ["system", *FOLDED], ["system", *FOLDED]]),
]


@pytest.mark.parametrize(("answer", "role", "sent"), ROLES)
async def test_a_system_message_that_is_refused_goes_in_front_of_the_first_of_the_user(
    answer: Any, role: Any, sent: list[list[str]]
) -> None:
    async with Canned(answer) as server:
        model = client(server, system_role=role)
        for _ in range(2):
            assert (await ask(model)).text == "go"
        await model.close()
    assert [roles(asked) for asked in server.asked] == sent
    contents = [message["content"] for message in server.asked[-1].body["messages"]]
    assert "".join(contents).startswith("You play."), "nothing of it is lost"


async def test_roles_that_are_refused_even_so_are_an_error_and_no_loop() -> None:
    async with Canned(refusal(400, "Conversation roles must alternate user/assistant")) as server:
        model = client(server)
        with pytest.raises(RequestRefused, match="must alternate"):
            await ask(model)
        await model.close()
    assert len(server.asked) == 2


# --- Anthropic ----------------------------------------------------------------------------------------


async def test_a_gateway_that_refuses_marks_for_a_cache_gets_none() -> None:
    def answer(asked: CannedRequest) -> Given:
        if "cache_control" in str(asked.body):
            return refusal(400, "messages.0.content.0.cache_control: Extra inputs are not permitted")
        return Given({"content": [{"type": "text", "text": "go"}], "stop_reason": "end_turn"})

    async with Canned(answer) as server:
        model = Anthropic(model="c", prices=Prices(), key=SecretStr("sk-ant-0123"), base_url=server.base_url)
        assert (await ask(model)).text == "go"
        await model.close()
    assert len(server.asked) == 2
    assert server.asked[1].body["system"] == "You play."


def test_a_name_that_is_a_usual_word_counts_only_where_it_is_named() -> None:
    sent = SentFields({}, {"stop": ["x"], "user": "me"})
    assert Quirks().learn(b"unsupported: a user may not stop here", sent, None) == ""
    assert Quirks().learn(b"unsupported: 'stop'", sent, None) == "leaves stop out, which it refuses"
