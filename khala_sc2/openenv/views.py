"""What a client reads of the messages of a match."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING

from khala_agents.prompt import Prompt
from khala_sc2.openenv.models import AgentView, ChatTurn, Outcome, Picture

if TYPE_CHECKING:
    from khala_protocol.messages import Briefing, Result
    from khala_sc2.playing.seats import Seen


def view_of(seen: Seen, *, briefed: bool) -> AgentView:
    """Return what an agent sees, behind its briefing if it has not been briefed."""
    observation = seen.observation
    return AgentView(
        text=observation.text,
        briefing=[] if briefed else _briefing(seen.briefing),
        accepted=list(observation.accepted),
        rejections=[f"{rejection.text}: {rejection.message}" for rejection in observation.rejections],
        pictures=[
            Picture(title=ref.title or ref.name, media_type=ref.media_type, data=b64encode(picture).decode())
            for ref, picture in seen.arrived_pictures()
        ],
    )


def _briefing(briefing: Briefing) -> list[ChatTurn]:
    prompt = Prompt(briefing)
    stable = prompt.messages("")[: prompt.stable]
    return [ChatTurn(role=message.role, content=message.content) for message in stable]


def outcome_of(result: Result) -> Outcome:
    """Return how an episode ended."""
    return Outcome(
        outcome=result.outcome,
        cause=result.cause,
        valid=result.valid,
        killed_value=result.killed.value,
        lost_value=result.lost.value,
        steps=result.steps,
        game_s=result.game_s,
    )
