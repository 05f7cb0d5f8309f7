"""What became of an answer that arrived with "200 OK": words to play, or the reason why there are none."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import SecretStr
from pydantic_core import to_json

from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import Completion, EndpointUnavailable, MalformedCompletion, Request
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.llm.verdict import AnswerParts, judge
from khala_agents.scripted.canned import Canned, Given, completion
from khala_protocol.messages import ChatMessage, Usage
from khala_protocol.reasoning import CHANNELS, MARKS
from khala_protocol.speech import parse, render

if TYPE_CHECKING:
    from khala_agents.llm.client import LLMClient

PROMPT = (ChatMessage(role="system", content="You play."), ChatMessage(role="user", content="Game"))
ORDERS = "Analysis: go.\nActions:\nTeam A:\n<Attack_Unit(0x1)>"


async def ask(model: LLMClient, prompt: tuple[ChatMessage, ...] = PROMPT) -> Completion:
    try:
        return await model.complete(Request(prompt, timeout_s=5.0))
    finally:
        await model.close()


async def asked(answer: Given, **options: Any) -> Completion:
    async with Canned(answer) as server:
        return await ask(
            OpenAICompatible(PROFILES["vllm"], model="m", base_url=server.base_url, prices=Prices(), **options)
        )


def anthropic(base_url: str) -> Anthropic:
    return Anthropic(model="claude", prices=Prices(), key=SecretStr("sk-ant-0123"), base_url=base_url, max_tokens=77)


RAISE = "the model used all 99 tokens on its reasoning: raise max_tokens in the model file, or have it think less"
VERDICTS: list[tuple[str, Given, str, str]] = [
    ("words", completion(ORDERS), "ok", ""),
    ("words that were cut", completion(ORDERS, "length"), "ok", ""),
    ("words and a refusal", completion(ORDERS, refusal="hm"), "ok", ""),
    ("reasoning ate all", completion(None, "length", reasoning_content="hm"), "cut", RAISE),
    ("reasoning ate all, empty words", completion("", "length", reasoning="hm"), "cut", RAISE),
    ("cut before anything", completion("", "MAX_TOKENS"), "cut", "all 99 tokens before it said anything"),
    ("cut without a message", Given({"choices": [{"finish_reason": "length"}]}), "cut", "all 99 tokens before"),
    ("an open thought", completion(f"<think>I say {ORDERS}", "length"), "cut", RAISE),
    ("an open thought, not cut", completion(f"<think>I say {ORDERS}"), "empty", "thought, and then said nothing"),
    ("a thought alone", completion("<think>hm</think>\n"), "empty", "thought, and then said nothing"),
    ("the end of a thought alone", completion(f"{ORDERS}</think>"), "empty", "thought, and then said nothing"),
    ("a thought in parts", completion([{"type": "thinking", "thinking": []}]), "empty", "thought, and then said"),
    ("a thought and words", completion(f"<think>hm</think>{ORDERS}"), "ok", ""),
    ("nothing", completion(None), "empty", "the model said nothing (it ended with 'stop')"),
    ("blanks", completion(" \n"), "empty", "the model said nothing"),
    ("no content", Given({"choices": [{"message": {}}]}), "empty", "the model said nothing"),
    ("a refusal", completion(None, refusal="I will not."), "refused", "the model declined: I will not."),
    ("a refusal in parts", completion([{"type": "refusal", "refusal": "No."}]), "refused", "the model declined: No."),
    ("a refusal in prose", completion("I'm sorry, but I can't assist with that."), "refused", "I'm sorry"),
    ("a refusal, curly", completion("I\u2019m sorry, I can\u2019t help with this request."), "refused", "sorry"),
    ("a filter", completion(None, "content_filter"), "filtered", "a filter of the endpoint took the answer away"),
    ("a filter after some words", completion("Analysis", "content_filter"), "filtered", "(content_filter)"),
    ("a filter of Gemini", completion("", "SAFETY"), "filtered", "(SAFETY)"),
    ("Gemini without a message", Given({"choices": [{"finish_reason": "PROHIBITED_CONTENT"}]}), "filtered", "PROHIB"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("answer", "verdict", "reason"), [row[1:] for row in VERDICTS], ids=[row[0] for row in VERDICTS]
)
async def test_an_answer_without_words_says_what_became_of_it(answer: Given, verdict: str, reason: str) -> None:
    found = await asked(answer, max_tokens=99)
    assert found.verdict == verdict
    assert reason in found.reason
    assert bool(found.reason) == (verdict != "ok")


async def test_a_cut_answer_without_a_limit_of_ours_says_where_to_set_one() -> None:
    found = await asked(completion("", "length"))
    assert found.reason.endswith(
        "all tokens that its endpoint allows before it said anything: set max_tokens in the model file"
    )


TOOL: Any = {
    "id": "1",
    "type": "function",
    "function": {"name": "Attack_Unit", "arguments": '{"team": "A-1", "tag": "0x1"}'},
}


@pytest.mark.parametrize(
    ("answer", "orders"),
    [
        (completion(None, "tool_calls", tool_calls=[TOOL, TOOL]), ["A-1 <Attack_Unit(0x1)>"] * 2),
        (completion("Analysis: it is weak.", "tool_calls", tool_calls=[TOOL]), ["A-1 <Attack_Unit(0x1)>"]),
        (completion(None, function_call={"name": "Stop"}), ["None <Stop()>"]),
    ],
)
async def test_tools_that_a_model_calls_unasked_are_its_orders(answer: Given, orders: list[str]) -> None:
    found = await asked(answer)
    assert (found.verdict, found.reason.endswith("they are read as its orders")) == ("ok", True)
    assert [f"{call.team} {render(call)}" for call in parse(found.text).calls] == orders


async def test_tools_that_anthropics_models_call_are_its_orders() -> None:
    used = {"type": "tool_use", "id": "1", "name": "Move_Screen", "input": {"team": "A-1", "screen": [3, 4]}}
    async with Canned(Given({"content": [used], "stop_reason": "tool_use"})) as server:
        found = await ask(anthropic(server.base_url))
    assert [f"{call.team} {render(call)}" for call in parse(found.text).calls] == ["A-1 <Move_Screen([3, 4])>"]


NO_REFUSALS = [
    "I cannot help the Stalkers in time, so hold.",
    "We can't assist with that flank.\n<MessageTo(Zealots, 'hold')>",
    "I will not help this time: attack.\n<Attack_Unit(0x1)>",
    "Analysis: I can't help with that. " + "The enemy is near. " * 40,
]


@pytest.mark.parametrize(("begin", "end"), [*MARKS, CHANNELS])
def test_reasoning_between_any_marks_is_no_answer(begin: str, end: str) -> None:
    assert judge(AnswerParts(f"{begin}{ORDERS}{end}", "stop")).verdict == "empty"
    assert judge(AnswerParts(f"{begin}{ORDERS}", "stop")).verdict == "empty"
    assert judge(AnswerParts(f"{ORDERS}{end}", "stop")).verdict == "empty"
    assert judge(AnswerParts(f"{begin}hm{end}{ORDERS}", "stop")).verdict == "ok"


@pytest.mark.parametrize("words", NO_REFUSALS)
def test_a_player_that_cannot_help_another_one_does_not_decline(words: str) -> None:
    assert judge(AnswerParts(words, "stop")).verdict == "ok"


async def test_an_answer_among_the_reasoning_is_read_and_said_once(caplog: pytest.LogCaptureFixture) -> None:
    answer = completion("", reasoning_content=ORDERS)
    async with Canned(answer) as server:
        model = OpenAICompatible(PROFILES["vllm"], model="m", base_url=server.base_url, prices=Prices())
        first, second = await model.complete(Request(PROMPT)), await ask(model)
    assert (first.text, first.verdict) == (second.text, second.verdict) == (ORDERS, "ok")
    assert first.reason == "the whole answer was among the model's reasoning, and is read there"
    assert len(caplog.messages) == 1
    assert first.reason in caplog.messages[0]


FILTER_400 = {
    "error": {
        "message": "The prompt was filtered.",
        "code": "content_filter",
        "status": 400,
        "innererror": {"code": "ResponsibleAIPolicyViolation"},
    }
}


async def test_a_prompt_that_a_filter_refuses_is_filtered_and_may_have_cost_something() -> None:
    found = await asked(Given(FILTER_400, 400))
    assert (found.verdict, found.reason) == ("filtered", "a filter took the prompt: The prompt was filtered.")
    assert found.usage == Usage(requests=1, unknown_requests=1)


async def test_a_model_that_could_not_finish_for_lack_of_tokens_was_cut_and_may_have_cost_something() -> None:
    message = "Could not finish the message because max_tokens or model output limit was reached."
    found = await asked(Given({"error": {"message": message, "type": "invalid_request_error"}}, 400))
    assert (found.verdict, found.usage.unknown_requests) == ("cut", 1)
    assert found.reason.startswith("the model used all tokens on its reasoning: raise max_tokens in the model file")


BROKEN: list[tuple[Given, str]] = [
    (completion("Analysis: half of", "error"), "broke its answer off"),
    (
        Given({"choices": [{"finish_reason": "error", "error": {"code": 502, "message": "gone"}}]}),
        "broke its answer off: gone",
    ),
    (Given({"choices": [{"message": {"content": "half"}}], "error": {"message": "no memory"}}), "off: no memory"),
]  # fmt: skip


@pytest.mark.parametrize(("answer", "words"), BROKEN)
async def test_an_answer_that_the_endpoint_broke_off_is_a_failed_try_that_may_be_billed(
    answer: Given, words: str
) -> None:
    with pytest.raises(EndpointUnavailable, match=words) as caught:
        await asked(answer)
    assert caught.value.retryable
    assert caught.value.may_be_billed


@pytest.mark.parametrize(
    "choice", [{"index": 0}, {"message": None, "finish_reason": "stop"}, {"delta": {"content": "x"}}]
)
async def test_a_choice_without_a_message_is_malformed(choice: Any) -> None:
    with pytest.raises(MalformedCompletion, match="answered with a choice that has no message"):
        await asked(Given({"choices": [choice]}))


ODD_BUT_GOOD = [
    completion(ORDERS, finish=7),
    completion(ORDERS, usage="none"),
    completion(ORDERS, usage=[]),
    completion(ORDERS, refusal=False, reasoning_content={"a": 1}, tool_calls={}, function_call=[]),
    completion([{"type": "text", "text": None}, {"type": "reference"}, {"type": "output_text", "text": ORDERS}]),
    completion(["", ORDERS]),
    Given({"choices": [{"message": {"content": ORDERS}, "error": None}], "error": {"code": None, "message": ""}}),
    Given(b'{"choices": [{"logprobs": NaN, "message": {"content": ' + to_json(ORDERS) + b"}}]}"),
    Given({"choices": [{"message": {"content": "", "reasoning_content": "", "reasoning": ORDERS}}]}),
    Given(
        b"\xef\xbb\xbf" + b'{"choices": [{"message": {"content": "' + ORDERS.replace("\n", "\\n").encode() + b'"}}]}'
    ),
]


@pytest.mark.parametrize("answer", ODD_BUT_GOOD)
async def test_what_is_odd_beside_good_words_never_costs_them(answer: Given) -> None:
    found = await asked(answer)
    assert (found.text, found.verdict, found.usage.unknown_requests) == (ORDERS, "ok", 1)


async def test_tokens_are_counted_in_whatever_kind_of_number_they_come() -> None:
    usage = (await asked(completion(ORDERS, usage={"prompt_tokens": 900.0, "completion_tokens": "60"}))).usage
    assert (usage.prompt_tokens, usage.completion_tokens) == (900, 60)
    odd = (await asked(completion(ORDERS, usage={"prompt_tokens": True, "completion_tokens": 0.5}))).usage
    assert odd.unknown_requests == 1


# --- Anthropic ----------------------------------------------------------------------------------------


def message(*content: Any, stop: str = "end_turn", usage: Any = None) -> Given:
    return Given({"type": "message", "content": list(content), "stop_reason": stop, "usage": usage})


WORDS = {"type": "text", "text": ORDERS}
THOUGHT = {"type": "thinking", "thinking": "hm"}
OF_ANTHROPIC: list[tuple[Given, str, str]] = [
    (message(THOUGHT, WORDS), "ok", ""),
    (message(THOUGHT, stop="max_tokens"), "cut", "the model used all 77 tokens on its reasoning"),
    (message(stop="model_context_window_exceeded"), "cut", "the prompt left no room for an answer"),
    (message(THOUGHT), "empty", "the model thought, and then said nothing"),
    (message(), "empty", "the model said nothing (it ended with 'end_turn')"),
    (message(stop="refusal"), "refused", "the model declined: it gave no reason"),
    (message({"type": "text", "text": "I will not."}, stop="refusal"), "refused", "declined: I will not."),
    (message({"type": "text", "text": None}, "?", WORDS), "ok", ""),
]


@pytest.mark.parametrize(("answer", "verdict", "reason"), OF_ANTHROPIC)
async def test_an_answer_of_anthropic_says_what_became_of_it(answer: Given, verdict: str, reason: str) -> None:
    async with Canned(answer) as server:
        found = await ask(anthropic(server.base_url))
    assert found.verdict == verdict
    assert reason in found.reason


@pytest.mark.parametrize("usage", [{"input_tokens": None, "output_tokens": 60}, {"output_tokens": 60}, "?", None])
async def test_a_usage_that_says_nothing_costs_no_text(usage: Any) -> None:
    async with Canned(message(WORDS, usage=usage)) as server:
        found = await ask(anthropic(server.base_url))
    assert (found.text, found.usage) == (ORDERS, Usage(requests=1, unknown_requests=1))


# --- a context that is too small ----------------------------------------------------------------------

LONG = (ChatMessage(role="user", content="Zealot 0x100200 at [12, 30]. " * 1000),)  # about 7250 tokens


@pytest.mark.parametrize(
    ("counted", "cached", "warns"),
    [(2048, 0, True), (4096, 0, False), (7000, 0, False), (3000, 3000, False), (0, 0, False)],
)
async def test_an_endpoint_that_reads_half_of_a_prompt_is_noticed_once(
    counted: int, cached: int, *, warns: bool, caplog: pytest.LogCaptureFixture
) -> None:
    usage = {"prompt_tokens": counted, "completion_tokens": 5, "prompt_tokens_details": {"cached_tokens": cached}}
    async with Canned(completion(ORDERS, usage=usage)) as server:
        model = OpenAICompatible(PROFILES["ollama"], model="m", base_url=server.base_url, prices=Prices())
        await model.complete(Request(LONG))
        await ask(model, LONG)
    said = [text for text in caplog.messages if "OLLAMA_CONTEXT_LENGTH" in text and "num_ctx" in text]
    assert len(said) == int(warns)


async def test_a_short_prompt_says_nothing_of_the_context(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    await asked(completion(ORDERS, usage={"prompt_tokens": 1, "completion_tokens": 5}))
    assert caplog.messages == []
