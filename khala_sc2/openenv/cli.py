"""The command `khala openenv`; `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated

import typer

from khala_agents.cli import Trust
from khala_sc2.commands.run_options import Game

OPENENV_EPILOG = """
Examples:\n
    khala openenv\n
    khala openenv pvz_task6_level1 --sessions 16 --port 8000\n
    khala openenv duel_3m --others focus-fire --allow openai\n
    KHALA_OPENENV_TOKEN=... khala openenv 2s3z --host 0.0.0.0\n
    khala openenv 2s3z --rubric my_rewards:Mine --out runs\n
"""


def openenv(
    task: Annotated[
        str,
        typer.Argument(
            help="Task to play if a client names none, see `khala tasks`, or a path to a .yaml file.", metavar="TASK"
        ),
    ] = "2s3z_pair",
    *,
    host: Annotated[
        str, typer.Option(help="Address to serve on; 0.0.0.0 means all addresses of this machine.", metavar="ADDRESS")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to serve on; 0 takes a free one.")] = 8000,
    is_open: Annotated[
        bool,
        typer.Option(
            "--open", envvar="KHALA_OPENENV_OPEN", help="Let everybody who reaches the port play, without a token."
        ),
    ] = False,
    sessions: Annotated[int, typer.Option(min=1, help="Most sessions at a time; each has its own game.")] = 8,
    idle: Annotated[float, typer.Option(min=1, help="End a session that does nothing for this many seconds.")] = 3600.0,
    others: Annotated[
        str,
        typer.Option(
            help="Model or policy of the agents that no client plays: skilled, openai, module:name.", metavar="MODEL"
        ),
    ] = "skilled",
    allow: Annotated[
        list[str] | None,
        typer.Option(
            help="Another model or policy that clients may choose for those agents; may be given several times.",
            metavar="MODEL",
            show_default="the scripted players",
        ),
    ] = None,
    rubric: Annotated[
        str | None,
        typer.Option(
            help="Your rubric, or a function that makes one.", metavar="MODULE:NAME", show_default="win, value, ..."
        ),
    ] = None,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    out: Annotated[
        Path | None,
        typer.Option(help="Directory for recordings of all sessions.", metavar="DIR", show_default="none is made"),
    ] = None,
) -> None:
    """Serve OpenEnv: clients such as TRL play agents of matches, with rewards.

    Each session is a match of its own; with reset, a client chooses task, agents, seed and pictures. The client plays
    one agent or all agents of a side, over a websocket or HTTP. On an address that other machines reach, clients need
    a token: the one in KHALA_OPENENV_TOKEN, or a new one that the printed address contains.
    """
    from khala_sc2.openenv.commands import WantedServer, run_openenv  # noqa: PLC0415  # the server, which --help can do without

    run_openenv(WantedServer(task, host, port, sessions, idle, others, tuple(allow or ()), rubric, game, out, is_open))
