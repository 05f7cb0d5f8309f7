"""What a player reads: its briefing, its observations with their deadline, what became of its answers, the results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.prompt import Prompt
from khala_protocol.messages import count_refusals

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import AgentReport, Briefing, Report, Result
    from khala_sc2.mcp.table import TableLook
    from khala_sc2.playing.seats import Seat

HOW = """\
# How to play with these tools
- observe waits until you are asked, and returns what you see, or how an episode ended.
- act answers it: give it the parts "Analysis:" and "Actions:" as above. It returns your next observation.
- message adds a message to another agent to your next answer; look_up tells all about a unit, upgrade or ability.
- Go on until you read that the match is over."""


def instructions(config: MatchConfig, seat: Seat) -> str:
    """Return what a client is told when it connects."""
    return (
        f"You play the agent {seat.agent} of side {seat.side} in the StarCraft II task {config.task.name}. "
        "Call observe; it begins the match, waits until you are asked, and says who you are and what you see. "
        "Answer with act, again and again, until you read that the match is over."
    )


def briefing_page(briefing: Briefing) -> str:
    """Return who an agent is, what it may do, an example, and how the tools are used."""
    prompt = Prompt(briefing)
    system, *example = prompt.messages("")[: prompt.stable]
    shown = "\n\n".join(message.content for message in example)
    return f"{system.content}\n\n# Example\n{shown}\n\n{HOW}\n"


def page(look: TableLook, config: MatchConfig) -> str:
    """Return what a player reads when it looks."""
    return "\n".join(_lines(look, config))


def _lines(look: TableLook, config: MatchConfig) -> Iterator[str]:
    yield from map(_fate, look.fates)
    if look.seen is None:  # else the observation has them
        yield from (f"    refused: {no.text}: {no.message}" for fate in look.fates for no in fate.rejections)
    yield from (_result(result, config.episodes) for result in look.results)
    if look.over:
        yield f"The match is over. Its recording is {config.record}: the user can look at it with `khala view`."
    elif look.seen is not None:
        observation = look.seen.observation
        yield (
            f"Observation of step {observation.step}, episode {observation.episode + 1} of {config.episodes}. "
            f"{_deadline(look.left_s, waits=config.task.clock.waits)}"
        )
        yield f"\n{observation.text}"
    elif look.others:
        yield f"You are not asked now: the match waits for {', '.join(map(str, look.others))}. Call observe again."
    else:
        yield "You are not asked now: the match goes on. Call observe again."


def _deadline(left_s: float | None, *, waits: bool) -> str:
    if left_s is not None:
        return f"You have {left_s:.1f} s to answer; then the match goes on without your answer."
    return "The game waits for your answer." if waits else "The game goes on while you think."


def _fate(report: AgentReport) -> str:
    what = report.fate or report.detail or report.status
    refused = count_refusals(report.rejections).total()
    return f"Your last answer: {what}; {len(report.accepted)} carried out, {refused} refused."


def _result(result: Result, episodes: int) -> str:
    ratio = "" if result.kd is None else f", ratio {result.kd:.2f}"
    return (
        f"Episode {result.episode + 1} of {episodes} is over: {result.ending}, after "
        f"{result.game_s:.0f} s of game time. "
        f"Value killed {result.killed.value:.0f}, lost {result.lost.value:.0f}{ratio}."
    )


def step_line(report: Report) -> str:
    """Return what a client may show while the game moves."""
    return f"episode {report.episode + 1}, step {report.step}, game loop {report.game_loop}"
