"""The policy that asks a model in batches: it refuses a match that does not wait long enough for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.llm.client import RequestRefused
from khala_agents.llm_policy import LLMPolicy

if TYPE_CHECKING:
    from khala_agents.policy import Context, Said
    from khala_protocol.messages import Clock

SHORTEST_WAIT_S = 3600.0
LONGEST_BATCH_S = 24 * 3600.0
"""An endpoint answers a batch within a day, or not at all."""


class BatchPolicy(LLMPolicy):
    """An `LLMPolicy` whose requests wait for batches."""

    async def decide(self, context: Context) -> Said:
        """Return the model's words; see `LLMPolicy.decide`.

        Raises:
            RequestRefused: the clock of the match does not wait for a batch.
        """
        why = reason_against_batches(context.briefing.clock)
        if why:
            error = RequestRefused(why, status="batch")
            error.hopeless = True
            raise error
        return await super().decide(context)


def reason_against_batches(clock: Clock) -> str:
    """Return why a match with this clock does not wait for batches; "" if it does."""
    if clock.rule == "realtime":
        why = "in real time the game goes on while a batch is answered; play with --clock frozen"
    elif clock.max_wait_s is not None and clock.max_wait_s < SHORTEST_WAIT_S:
        why = f"a step waits {clock.max_wait_s:g} s, and a batch takes up to a day; play with --max-wait 86400"
    else:
        return ""
    return f"a model file with `batch: true` is for matches that wait: {why}"
