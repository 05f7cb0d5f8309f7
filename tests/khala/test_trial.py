"""`khala try`: what it finds of endpoints, and what it says to do."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.scripted.canned import Canned, completion, refusal
from khala_sc2.cli import main
from khala_sc2.commands.trial import FormTrial, ModelTrial, WantedTrial, print_trial, try_model

if TYPE_CHECKING:
    from pathlib import Path

    from khala_agents.scripted.canned import CannedRequest, Given

pytestmark = pytest.mark.game
TEXT = "Analysis: go.\nActions:\n    Team Stalker-1:\n        <Move_Screen([12, 6])>\n        <Attack_Unit(0x1)>"
USAGE = {"prompt_tokens": 2000, "completion_tokens": 30}


async def found_at(base_url: str, directory: Path, *, model: str = "mine", answer: str | None = None) -> ModelTrial:
    file = directory / "model.yaml"
    file.write_text(
        f"profile: vllm\nmodel: {model}\nbase_url: {base_url}\nretry: {{tries: 1}}\n"
        "prices: {prompt: 1, completion: 2}\n",
        encoding="utf-8",
    )
    return await try_model(WantedTrial(str(file), "2s3z_pair", None, answer, 60.0, "simulator"))


async def test_each_form_is_asked_for_once_and_the_host_reads_the_replies(tmp_path: Path) -> None:
    def answer(request: CannedRequest) -> Given:
        body: Any = request.body
        if body is None:
            return completion("") if request.path != "/v1/models" else models("mine", max_model_len=8192)
        if "response_format" in body:
            return refusal(400, "response_format is not supported")
        if "tools" in body:
            call = {"function": {"name": "Move_Screen", "arguments": '{"team": "Stalker-1", "screen": [12, 6]}'}}
            return completion(None, usage=USAGE, tool_calls=[call])
        return completion(TEXT, usage=USAGE)

    async with Canned(answer) as endpoint:
        trial = await found_at(endpoint.base_url, tmp_path)
        posts = [asked.body for asked in endpoint.asked if asked.body]
    assert [form.form for form in trial.forms] == ["text", "json", "tools", "grammar"]
    assert [form.state for form in trial.forms] == ["held", "refused", "held", "held"]
    assert len(posts) == 5  # json was asked for again without the field
    assert trial.context == 8192
    first = trial.forms[0]
    assert first.carried_out == ("Stalker-1 <Move_Screen([12, 6])>",)
    assert [refused.partition(":")[0] for refused in first.refused] == ["Stalker-1 <Attack_Unit(0x1)>"]
    assert trial.forms[2].carried_out == first.carried_out
    assert (first.prompt_tokens, first.answer_tokens) == (2000, 30)
    assert first.usd == pytest.approx(0.00206)
    assert 1000 < first.estimated_tokens < 2000


async def test_a_model_that_the_endpoint_does_not_have_is_told_with_those_that_it_has(tmp_path: Path) -> None:
    def answer(request: CannedRequest) -> Given:
        return models("qwen3", "llama4") if request.body is None else refusal(404, "there is no model 'mine'")

    async with Canned(answer) as endpoint:
        trial = await found_at(endpoint.base_url, tmp_path)
    (form,) = trial.forms  # the others would fail as well
    assert form.state == "failed"
    assert form.why.endswith("there is no model 'mine'; it has qwen3, llama4: name one of them, such as qwen3")


async def test_a_form_that_is_ignored_and_an_answer_without_words_are_named(tmp_path: Path) -> None:
    async with Canned(completion("I would attack.", usage=USAGE)) as endpoint:
        trial = await found_at(endpoint.base_url, tmp_path, answer="json")
    assert [(form.form, form.state, form.usable) for form in trial.forms] == [("json", "ignored", False)]
    async with Canned(completion("", "length", usage=USAGE)) as endpoint:
        trial = await found_at(endpoint.base_url, tmp_path, answer="text")
    assert trial.forms[0].state == "no words"
    assert "set max_tokens in the model file" in trial.forms[0].why


def models(*names: str, **more: Any) -> Given:
    from khala_agents.scripted.canned import Given

    return Given({"data": [{"id": name, **more} for name in names]})


@pytest.mark.parametrize(
    ("form", "words"),
    [
        (FormTrial("text", "held", reply="x", carried_out=("<Stop()>",)), "It can play: khala run 3m --model vllm/m"),
        (FormTrial("text", "held", reply="x", cut=True), "Its answer was cut: raise max_tokens in its file."),
        (FormTrial("text", "failed", why="nothing listens there"), "It has not answered."),
        (FormTrial("text", "held", reply="x"), "Try a larger model, or --answer grammar with llama.cpp or vLLM."),
    ],
)
def test_the_last_line_says_what_to_do(form: FormTrial, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    print_trial(ModelTrial("vllm/m", "m", "http://x/v1", "3m", "A", None, [form]))
    said = capsys.readouterr().out
    assert words in said
    assert form.why in said


def test_the_command_ends_with_1_where_nothing_was_carried_out_and_prints_json(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["try", "scripted/silent", "--answer", "text", "--json"])
    assert ended.value.code == 1
    said = json.loads(capsys.readouterr().out)
    assert (said["model"], said["forms"][0]["carried_out"]) == ("silent", [])
    with pytest.raises(SystemExit) as ended:
        main(["try", "scripted/skilled", "--answer", "text"])
    assert ended.value.code == 0
    assert "carried out  Stalker-1 " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [("opnai/gpt-5", "did you mean openai/gpt-5?"), ("scripted --answer yaml", "there is no form 'yaml'"),
     ("scripted --task nosuch", "there is no task 'nosuch'"), ("openai/", "'openai/' names no model")],
)  # fmt: skip
def test_a_mistake_is_one_sentence(arguments: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["try", *arguments.split()])
    assert ended.value.code == 1
    assert words in capsys.readouterr().err
