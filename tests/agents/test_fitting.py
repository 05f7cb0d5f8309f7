"""What is left out of a prompt that is longer than its model's context."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.build import replay_policies
from khala_agents.detail import DETAILS
from khala_agents.fitting import CUTS, Cut, DraftPrompt, PromptTooLong
from khala_agents.llm.client import Completion, RequestRefused
from khala_agents.llm.limits import RequestLimits
from khala_agents.llm.retry import RetryRule
from khala_agents.llm.vision import OPENAI, Vision
from khala_agents.llm.window import ContextWindow
from khala_agents.llm_policy import LLMPolicy
from khala_agents.memory import WholeSteps
from khala_agents.policy import Context
from khala_agents.prompt import Prompt
from khala_protocol.messages import ChatMessage, ImageRef, ModelCall, Usage

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import Briefing, Observation

GOLDEN = Path(__file__).parents[1] / "bridge" / "golden"
OBSERVATION = (GOLDEN / "2s3z_pair.txt").read_text(encoding="utf-8")
SYSTEM = "# Who you are\nYou are A.\n\n# Rules\n- Obey.\n\n# Actions\n<Stop()>"


def message(role: Any, content: str) -> ChatMessage:
    return ChatMessage(role=role, content=content)


def cut_of(name: str) -> Cut:
    return next(cut for cut in CUTS if cut.name == name)


def full() -> DraftPrompt:
    return DraftPrompt(
        system=SYSTEM,
        example=(message("user", "see " * 200), message("assistant", "do " * 100)),
        recalled=tuple(message(role, f"{role} {n} " * 20) for n in range(3) for role in ("user", "assistant")),
        summary="Your summary of the game\n" + "We won. " * 20,
        steps="Your last steps\n" + "0:01 went. " * 20,
        observation=OBSERVATION,
    )


def test_a_prompt_that_fits_is_whole() -> None:
    draft = full()
    assert draft.fit(None) is draft
    assert draft.fit(draft.tokens()) is draft


def test_parts_are_left_out_in_the_order_of_the_table_until_the_prompt_fits() -> None:
    draft = full()
    seen: list[tuple[str, ...]] = []
    for room in range(draft.tokens(), 0, -20):
        try:
            fitted = draft.fit(room)
        except PromptTooLong:
            break
        assert fitted.tokens() <= room
        if fitted.left_out and fitted.left_out not in seen:
            seen.append(fitted.left_out)
    order = [cut.name for cut in CUTS]
    for left_out in seen:
        assert [order.index(name) for name in left_out] == sorted(order.index(name) for name in left_out)
    assert {"earlier steps", "worked example", "Unit knowledge", "Allied units"} <= set(seen[-1])


def test_of_earlier_steps_the_oldest_go_first_and_no_answer_stays_without_its_question() -> None:
    draft = full()
    fitted = draft.fit(draft.tokens() - 10)
    assert [each.content.split()[:2] for each in fitted.recalled] == [
        ["user", "1"], ["assistant", "1"], ["user", "2"], ["assistant", "2"],
    ]  # fmt: skip


def test_pictures_go_before_what_stands_in_the_text() -> None:
    image = ImageRef(
        name="screen", title="Screen", media_type="image/png", sha256="0" * 64, bytes=9, width=512, height=512
    )
    vision = Vision().counted_by(OPENAI)
    draft = DraftPrompt(SYSTEM, observation=OBSERVATION, images=(image,))
    fitted = draft.fit(draft.tokens(vision) - 1, vision)
    assert (fitted.images, fitted.left_out, fitted.observation) == ((), ("pictures",), OBSERVATION)


def test_what_an_agent_would_believe_to_be_empty_is_named() -> None:
    draft = DraftPrompt(SYSTEM, observation=OBSERVATION)
    fitted = draft.fit(draft.tokens() - 250)
    assert "Allied units:" not in fitted.messages[-1].content or "Unit knowledge" in fitted.left_out
    assert f"Left out here, to keep this short: {', '.join(fitted.left_out)}." in fitted.messages[-1].content
    assert "Zealot | tag 0x100180001" in fitted.messages[-1].content, "enemies stay"


def test_allies_go_and_own_units_and_enemies_stay() -> None:
    shorter = cut_of("Allied units").shorten(DraftPrompt("", observation=OBSERVATION)).observation
    assert "Allied units" not in shorter
    assert "    Enemy units:\n        Stalker | tag 0x100200001" in shorter
    assert "0x100040001" in shorter


def test_the_farthest_units_go_first_and_two_of_each_list_stay() -> None:
    draft = DraftPrompt("", observation=OBSERVATION)
    shorter = cut_of("the farthest units").shorten(draft)
    gone = set(OBSERVATION.splitlines()) - set(shorter.observation.splitlines())
    assert [line.split(" | ")[1] for line in gone] == ["tag 0x100200001"]
    while (after := cut_of("the farthest units").shorten(shorter)) != shorter:
        shorter = after
    assert shorter.observation.count("| tag 0x") == 4


def test_actions_keep_their_names_and_arguments() -> None:
    draft = DraftPrompt("# Actions\n- <Stop()>: Stands still.\n- <Move_Screen(screen)>: Walks.\n\n# Arguments\n- x: y")
    assert cut_of("descriptions of actions").shorten(draft).system == (
        "# Actions\n- <Stop()>\n- <Move_Screen(screen)>\n\n# Arguments\n- x: y"
    )


@pytest.mark.parametrize("page", ["2s3z", "2s3z_pair", "builder", "combatgroup1", "commander", "developer"])
def test_each_detail_has_its_tokens(page: str, briefing: Callable[..., Briefing]) -> None:
    text = (GOLDEN / f"{page}.txt").read_text(encoding="utf-8")
    drafts = {detail: Prompt(briefing(), detail=detail).draft(text) for detail in DETAILS}
    assert drafts["full"].left_out == ()
    for detail, room in DETAILS.items():
        assert room is None or drafts[detail].tokens() <= room
    assert drafts["tiny"].tokens() <= drafts["short"].tokens() <= drafts["full"].tokens()


def test_a_prompt_that_cannot_fit_is_not_sent_and_says_what_to_do() -> None:
    with pytest.raises(PromptTooLong, match="give the model a larger context at its server, or lower max_tokens"):
        full().fit(50)


def test_every_heading_of_the_table_is_one_of_an_observation() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in GOLDEN.glob("*.txt"))
    headings = {line.strip().rstrip(":") for line in re.findall(r"^(?:\S| +Allied| +What they).*$", text, re.MULTILINE)}
    own = {"earlier steps", "steps in short", "summary of the game", "worked example", "pictures"}
    own |= {"descriptions of actions", "the farthest units"}
    assert {cut.name for cut in CUTS if not cut.name.endswith("(instructions)")} - own <= headings


# --- in a policy --------------------------------------------------------------------------------------


class DigitModel:
    """An endpoint whose tokens are single digits and words, and whose context is small; it refuses what is longer."""

    model, endpoint = "digits", "http://digits/v1"

    def __init__(self, context: int, answer_tokens: int = 50) -> None:
        self.params: dict[str, Any] = {}
        self.context = context
        self.answer_tokens: int | None = answer_tokens
        self.refused = 0
        self.counts: list[int] = []

    async def complete(self, request: Any) -> Completion:
        tokens = sum(len(re.findall(r"\d|[A-Za-z]{1,4}|[^\w\s]|_", each.content)) for each in request.messages)
        if tokens + (self.answer_tokens or 0) > self.context:
            self.refused += 1
            words = f"request ({tokens} tokens) exceeds the available context size ({self.context} tokens)"
            raise RequestRefused(words, status="http 400")
        self.counts.append(tokens)
        return Completion("go", Usage(requests=1, prompt_tokens=tokens, completion_tokens=1))

    async def check(self) -> None: ...
    async def refresh(self) -> None: ...
    async def close(self) -> None: ...


def policy_of(model: Any, **options: Any) -> LLMPolicy:
    return LLMPolicy(model, rng=random.Random(0), retry=RetryRule(tries=1), **options)


async def test_after_one_refusal_every_prompt_fits_a_context_that_nobody_named(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = DigitModel(2000)
    policy = policy_of(model, memory=WholeSteps(5))
    calls: list[ModelCall] = []
    for step in range(8):
        seen = observation(step, text=OBSERVATION)
        assert await policy.decide(Context(briefing(), seen, trace=calls.append)) == "go"
    assert model.refused <= 2
    assert len(model.counts) == 8
    assert all(2000 * 0.6 < count <= 1950 for count in model.counts[2:])
    answered = [call for call in calls if call.status == "ok"]
    assert answered[-1].left_out[0] == "earlier steps"
    total = sum((call.usage for call in answered), Usage())
    assert total.shortened_requests == sum(bool(call.left_out) for call in answered) > 0
    assert total.left_out["earlier steps"] == total.shortened_requests


async def test_a_context_of_the_file_is_never_exceeded(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = DigitModel(2000)
    limits = RequestLimits()
    policy = policy_of(model, limits=limits, window=ContextWindow(2000, limits.scale), memory=WholeSteps(5))
    for step in range(8):
        await policy.decide(Context(briefing(), observation(step, text=OBSERVATION)))
    assert model.refused <= 1  # before it has counted a prompt, that it has a token for each digit cannot be known
    assert limits.scale.factor > 1.2


async def test_a_replay_makes_the_same_shortened_prompts(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    calls: list[ModelCall] = []
    policy = policy_of(DigitModel(1500), memory=WholeSteps(3))
    for step in range(5):
        await policy.decide(Context(briefing(), observation(step, text=OBSERVATION), trace=calls.append))
    (again,) = replay_policies(calls).values()
    again = LLMPolicy(again.client, memory=WholeSteps(3), retry=RetryRule(tries=9, base_s=0), window=again.window)
    for step in range(5):
        assert await again.decide(Context(briefing(), observation(step, text=OBSERVATION))) == "go"
