"""The command `khala mcp`; `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated

import typer

from khala_agents.cli import Trust
from khala_sc2.commands.run_options import (
    BudgetUsd,
    Episodes,
    Game,
    Images,
    MaxSteps,
    Opponent,
    Out,
    Rule,
    RunName,
    Seed,
    Speed,
    StepLoops,
    Task,
)

MCP_EPILOG = """
Examples:\n
    khala mcp 2s3z_pair --seat Stalkers\n
    khala mcp pvz_task6_level1 --images paper --episodes 10 --out ~/khala\n
    khala mcp 2s3z_pair --port 8765\n
    khala mcp duel_3m --seat red/Captain --others openai --budget-usd 1 --port 8765\n
    khala mcp 2s3z_pair --seat Stalkers --max-wait 60 --clock realtime\n
"""


def mcp(
    task: Task = None,
    *,
    seat: Annotated[
        list[str] | None,
        typer.Option(
            help="Agent that the client plays: Stalkers, red/Captain. With --port several may be given.",
            show_default="the first one; with --port all",
            metavar="[SIDE/]AGENT",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Serve streamable HTTP on this port of this machine; 0 takes a free one.",
            show_default="stdio",
        ),
    ] = None,
    others: Annotated[
        str,
        typer.Option(
            help="Model or policy of the agents that no client plays: scripted/skilled, openai, module:name.",
            metavar="MODEL",
        ),
    ] = "scripted",
    budget_usd: BudgetUsd = None,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    opponent: Opponent = None,
    seed: Seed = None,
    episodes: Episodes = None,
    clock: Rule = None,
    max_wait: Annotated[
        float | None,
        typer.Option(min=0.01, help="Longest wait for an answer, in seconds.", show_default="no limit"),
    ] = None,
    step_loops: StepLoops = None,
    speed: Speed = None,
    max_steps: MaxSteps = None,
    images: Images = None,
    run: RunName = None,
    out: Out = Path("runs"),
) -> None:
    """Let MCP clients, such as Claude Code or an IDE, play agents of a match.

    A client starts this command and talks to it over stdio. With --port, the command prints an address for each seat,
    and clients connect to these. The tools are observe, act, message and look_up. The match begins when a client
    first observes. It is recorded like any other, and khala view shows it.
    """
    from khala_sc2.mcp.commands import WantedSeats, run_mcp  # noqa: PLC0415  # the match and the SDK, which --help can do without

    match = {
        "seed": seed, "episodes": episodes, "rule": clock, "max_wait_s": max_wait, "step_loops": step_loops,
        "speed": speed, "max_steps": max_steps, "images": images, "opponent": opponent,
        "assemble_s": None,
    }  # fmt: skip
    run_mcp(WantedSeats(task, tuple(seat or ()), port, others, budget_usd, game, run, out, match))
