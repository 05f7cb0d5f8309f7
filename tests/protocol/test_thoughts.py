"""What an agent thinks: its reply up to the first orders or messages."""

from __future__ import annotations

import pytest

from khala_protocol.speech import thought_of

ROWS = {
    "Analysis: hold the ramp.\nActions:\n    Team A:\n        <Stop()>": "hold the ramp.",
    "We are weak.\nWe wait.\nActions:\n<Stop()>": "We are weak.\nWe wait.",
    "**Analysis:**\nhold\n\n## Actions\n<Stop()>": "hold",
    "<think>Actions: none?</think>\nAnalysis: go\nActions:\n<Stop()>": "<think>Actions: none?</think>\nAnalysis: go",
    "Communications:\n<MessageTo(A, 'go')>": "",
    "Team A:\n    <Stop()>": "",
    "no heading at all": "no heading at all",
    "": "",
}


@pytest.mark.parametrize("reply", ROWS)
def test_a_thought_ends_where_orders_begin(reply: str) -> None:
    assert thought_of(reply) == ROWS[reply]
