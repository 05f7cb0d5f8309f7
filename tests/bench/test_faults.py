"""When the bench of faults takes a match to go on again."""

from __future__ import annotations

from typing import get_args

import pytest

from bench.survival.faults import AGENTS, SIDE, is_answered
from khala_protocol.messages import AgentReport, AgentStatus, Report

UNANSWERED = {"late", "gone"}


@pytest.mark.parametrize("status", get_args(AgentStatus))
def test_every_answer_counts_also_that_nothing_was_decided(status: AgentStatus) -> None:
    agents = tuple(AgentReport(agent=name, side=SIDE, status=status) for name in AGENTS)
    assert is_answered(_report(agents)) == (status not in UNANSWERED)


def test_one_agent_without_an_answer_is_enough() -> None:
    first, second = AGENTS
    answered = AgentReport(agent=first, side=SIDE, status="ok")
    silent = AgentReport(agent=second, side=SIDE, status="gone")
    assert not is_answered(_report((answered, silent)))


def _report(agents: tuple[AgentReport, ...]) -> Report:
    return Report(run="faults", episode=0, step=1, game_loop=8, agents=agents)
