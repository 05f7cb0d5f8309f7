"""What prompts have of the steps before: steps in short, and a summary that the model writes beside its decisions."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_agents.build import replay_policies
from khala_agents.config import WorkerSpec
from khala_agents.llm.client import Completion, LLMError
from khala_agents.llm_policy import LLMPolicy
from khala_agents.memory import NoMemory, ShortSteps, WholeSteps, first_sentence, memory_of
from khala_agents.policy import Context, Said
from khala_agents.prompt import system_text
from khala_protocol.codec import decode_as, encode
from khala_protocol.messages import MemoryRule, ModelCall, Received, Rejection, Usage, View
from khala_protocol.reasoning import CHANNELS, MARKS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_agents.llm.client import Request
    from khala_protocol.messages import Briefing, Observation

CLOCK = "jumps"

SAID = (
    "Analysis: They come from the left. I hold.\nActions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>\n<MessageTo(B, 'hold')>"
)
RULES: list[tuple[object, type]] = [
    (0, NoMemory),
    (2, ShortSteps),
    ("2", ShortSteps),
    ("steps=2, whole=true", WholeSteps),
    ({"steps": 2, "whole": True}, WholeSteps),
]


@pytest.mark.parametrize(("rule", "kind"), RULES)
def test_a_rule_is_read_in_every_form(rule: object, kind: type) -> None:
    assert type(memory_of(MemoryRule.model_validate(rule))) is kind


def test_an_agent_cannot_ask_for_what_the_host_keeps() -> None:
    with pytest.raises(ValueError, match="the host keeps messages_s and notes"):
        WorkerSpec.model_validate({"model": "openai", "memory": "steps=2,notes=3,messages_s=4"})


def test_a_step_in_short_is_its_thought_its_messages_and_what_became_of_its_orders(
    observation: Callable[..., Observation],
) -> None:
    memory = ShortSteps(2)
    refusal = Rejection(reason="dead_target", message="0xc is dead.", text="<Attack_Unit(0xc)>", start=0, team="A")
    heard = Received(sender="B", recipient="Stalkers", text="come\nhere", age_s=2)
    for step in range(3):
        seen = observation(
            step, view=View(time_s=60.5 * step), messages=(heard.but(again=step > 1),) if step else (),
            accepted=("A <Stop()>",) if step == 2 else (), rejections=(refusal,) if step == 2 else (),
        )  # fmt: skip
        memory.recall(seen)
        memory.remember(seen, SAID)
    assert memory.recall(observation(3, accepted=("A <Go()>",))).text == (
        "Your last steps\n"
        "    1:00 They come from the left.\n"
        "        read from B: come here\n"
        "        wrote to B: hold\n"
        "        done: A <Stop()>\n"
        "        refused: A <Attack_Unit(0xc)> (0xc is dead.)\n"
        "    2:01 They come from the left.\n"
        "        wrote to B: hold\n"
    )


@pytest.mark.parametrize(
    ("reply", "sentence"),
    [
        (SAID, "They come from the left."),
        ("<think>Hm. Perhaps.</think>**Analysis:** Go at 4.5 now! Then stop.", "Go at 4.5 now!"),
        ("分析：进攻。\n动作：", "进攻。"),
        ("I attack\nActions:\n<Stop()>", "I attack"),
        ("Actions:\n<Stop()>", ""),
        ("<Stop()>", ""),
        ("", ""),
    ],
)
def test_the_first_sentence_of_an_analysis_is_found(reply: str, sentence: str) -> None:
    assert first_sentence(reply) == sentence


@pytest.mark.parametrize(("begin", "end"), [*MARKS, CHANNELS])
def test_reasoning_between_any_marks_is_no_analysis(begin: str, end: str) -> None:
    assert first_sentence(f"{begin}Hm. Perhaps.{end}Go now. Then stop.") == "Go now."


def test_a_prompt_tells_of_notes_and_standing_orders_only_where_there_are_any(
    briefing: Callable[..., Briefing],
) -> None:
    words = ("<Note('''text''')>", "<Forget(2)>", "<Standing(", "<Revoke(1)>", "until you write to its sender")
    assert not any(word in system_text(briefing()) for word in words)
    words_of = system_text(briefing(memory=MemoryRule(notes=4, messages_s=60), standing_orders=5))
    assert all(word in words_of for word in words)


# --- the summary --------------------------------------------------------------------------------------------------


class Model:
    """An `LLMClient` that decides at once, and takes a time for a summary."""

    model, endpoint = "listed", "http://listed/v1"
    params: Mapping[str, str | int | float | bool | None] = {}
    answer_tokens: int | None = None

    def __init__(self, summary_s: float = 0.0, fails: LLMError | None = None) -> None:
        self._summary_s, self._fails = summary_s, fails

    async def complete(self, request: Request) -> Completion:
        assert request.origin is not None
        if request.origin.purpose == "decision":
            return Completion(f"Analysis: step {request.origin.step}.", Usage(requests=1))
        await asyncio.sleep(self._summary_s)
        if self._fails:
            raise self._fails
        return Completion(f"We hold\nat step {request.origin.step}.", Usage(requests=1))

    async def check(self) -> None: ...

    async def refresh(self) -> None: ...

    async def close(self) -> None: ...


class Played:
    """A policy that is asked as a worker asks it, with all of its exchanges."""

    def __init__(self, policy: LLMPolicy, briefing: Briefing) -> None:
        self.policy, self.briefing = policy, briefing
        self.exchanges: list[ModelCall] = []

    async def play(self, observations: list[Observation]) -> list[Said]:
        """Return the replies to these observations, one a second; the policy thinks on meanwhile."""
        said, thinking = [], []
        for seen in observations:
            context = Context(self.briefing, seen, trace=self.exchanges.append)
            said.append(await self.policy.decide(context))
            thinking.append(asyncio.create_task(self.policy.reflect(context)))
            await asyncio.sleep(1)
        await asyncio.gather(*thinking, return_exceptions=True)
        return said

    @property
    def prompts(self) -> list[str]:
        """The last messages of the prompts of decisions."""
        return [call.prompt[-1].content for call in self.exchanges if call.purpose == "decision"]

    @property
    def summaries(self) -> list[ModelCall]:
        return [call for call in self.exchanges if call.purpose == "summary"]


@pytest.fixture
def game(observation: Callable[..., Observation]) -> list[Observation]:
    """Six observations of half a minute each."""
    return [observation(step, view=View(time_s=30.0 * step), within_s=None) for step in range(6)]


async def test_a_summary_is_asked_for_beside_decisions_and_read_from_the_third_one_on(
    briefing: Callable[..., Briefing], game: list[Observation]
) -> None:
    played = Played(LLMPolicy(Model(1.5)), briefing(memory=MemoryRule(steps=1, summary=2)))
    assert await played.play(game) == [f"Analysis: step {step}." for step in range(6)]
    above = "Your summary of the game until 0:30\n    We hold\n    at step 1.\n"
    assert [above in prompt for prompt in played.prompts] == [False, False, False, False, True, True]
    assert played.prompts[4] == above + "\nYour last steps\n    1:30 step 3.\n\nstep 4"
    first, second = played.summaries
    assert [(call.step, call.attempt) for call in (first, second)] == [(1, 1), (5, 1)]
    assert first.prompt[:3] == played.exchanges[0].prompt[:3]
    assert "Your steps\n    0:00 step 0.\n    0:30 step 1.\n" in first.prompt[-1].content
    before = "Your summary until now\n    We hold\n    at step 1.\n\nYour steps\n    1:00 step 2.\n    1:30 step 3.\n"
    assert before in second.prompt[-1].content


@pytest.mark.parametrize("rule", [MemoryRule(steps=2), MemoryRule(steps=3, whole=True), MemoryRule(steps=2, summary=9)])
async def test_who_goes_on_with_a_match_remembers_the_steps_before_as_its_own(
    briefing: Callable[..., Briefing], game: list[Observation], rule: MemoryRule
) -> None:
    whole = Played(LLMPolicy(Model()), briefing(memory=rule))
    said = await whole.play(game)
    late = Played(LLMPolicy(Model()), briefing(memory=rule))
    late.policy.remember(list(zip(game[:4], map(str, said), strict=False)))
    await late.policy.prepare(late.briefing)
    await late.play(game[4:])
    prompts, recorded = ([call.prompt for call in played.exchanges] for played in (late, whole))
    assert prompts == recorded[4:]
    assert any("step 3." in message.content for message in prompts[0])


@pytest.mark.parametrize(("summary_s", "status", "shown"), [(1.5, "ok", 2), (60.0, "cancelled", 0)])
async def test_a_late_summary_is_dropped_and_a_replay_has_the_same_prompts(
    summary_s: float, status: str, shown: int, briefing: Callable[..., Briefing], game: list[Observation]
) -> None:
    rule = briefing(memory=MemoryRule(steps=1, summary=2))
    played = Played(LLMPolicy(Model(summary_s)), rule)
    said = await played.play(game)
    assert played.summaries[0].status == status
    assert sum("Your summary" in prompt for prompt in played.prompts) == shown
    recorded = [decode_as(ModelCall, encode(call)) for call in played.exchanges]
    again = Played(replay_policies(recorded)["Stalkers"], rule)
    assert await again.play(game) == said
    assert again.prompts == played.prompts


async def test_a_summary_that_fails_costs_nothing_but_itself(
    briefing: Callable[..., Briefing], game: list[Observation]
) -> None:
    model = Model(fails=LLMError("no", status="http 400"))
    played = Played(LLMPolicy(model), briefing(memory=MemoryRule(summary=4)))
    assert len(await played.play(game)) == 6
    assert [call.status for call in played.summaries] == ["http 400"]
    assert played.prompts == [f"step {step}" for step in range(6)]
