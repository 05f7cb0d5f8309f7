"""The golden recording, a whole battle of two agents, against the host and against the agents of today.

A change of rules, texts or prompts shows up here first. If it was meant: `make golden`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_protocol.codec import encode
from khala_protocol.messages import Briefing, Observation, Reply, Run
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_protocol.messages import Wire
    from khala_protocol.recording.difference import Difference

    Replay = Callable[..., Awaitable[list[Difference]]]

pytestmark = pytest.mark.game

GOLDEN = Path(__file__).with_name("golden.mcap")


def changed(path: Path, change: Callable[[Wire], Wire]) -> Path:
    """Return a copy of the golden recording with some of its messages changed."""
    with Recorder(path) as recorder:
        for sample in Recording.open(GOLDEN):
            assert sample.message is not None
            recorder.write(sample.key, encode(change(sample.message)), log_time_ns=sample.log_time_ns)
    return path


def test_the_golden_recording_is_whole() -> None:
    golden = Recording.open(GOLDEN)
    assert golden.complete
    assert golden.run is not None
    assert [card.name for card in golden.run.agents] == ["Stalkers", "Zealots"]
    assert [result.outcome for result in golden.results] == ["win"]


@pytest.mark.slow
async def test_the_host_shows_its_agents_what_it_showed_them_then(replay_host: Replay) -> None:
    assert await replay_host(GOLDEN) == []


async def test_the_agents_say_what_they_said_then(replay_agents: Replay) -> None:
    assert await replay_agents(GOLDEN) == []


@pytest.mark.slow
async def test_another_reply_leads_to_another_observation(replay_host: Replay, tmp_path: Path) -> None:
    def change(message: Wire) -> Wire:
        if isinstance(message, Reply) and message.step == 3:
            return message.model_copy(update={"text": "Actions:\nTeam Stalker-1:\n<Move_Screen([6, 12])>"})
        return message

    (first, *_) = await replay_host(changed(tmp_path / "changed.mcap", change))
    assert (first.step, first.what) == (4, "observation")
    assert "in episode 0, step 4: recorded …" in str(first)


@pytest.mark.slow
async def test_another_seed_is_noticed_by_its_first_difference(replay_host: Replay, tmp_path: Path) -> None:
    def change(message: Wire) -> Wire:
        return message.model_copy(update={"seed": 2}) if isinstance(message, Run) else message

    assert await replay_host(changed(tmp_path / "changed.mcap", change)) != []


async def test_another_role_leads_to_another_prompt(replay_agents: Replay, tmp_path: Path) -> None:
    def change(message: Wire) -> Wire:
        return message.model_copy(update={"role": "You watch."}) if isinstance(message, Briefing) else message

    first = (await replay_agents(changed(tmp_path / "changed.mcap", change)))[0]
    assert (first.step, first.what) == (0, "reply")


async def test_a_policy_of_ones_own_is_compared_as_well(replay_agents: Replay) -> None:
    class Copy:
        def __init__(self) -> None:
            self.replies = {(r.agent, r.step): r.text for r in Recording.open(GOLDEN).of(Reply)}

        async def decide(self, _: Briefing, observation: Observation) -> str:
            return self.replies[observation.agent, observation.step] if observation.step != 5 else "no"

    differences = await replay_agents(GOLDEN, {"Stalkers": Copy(), "Zealots": Copy()})
    assert {(d.agent, d.step) for d in differences if d.what == "reply" and "no" in d.sent} >= {("Stalkers", 5)}
