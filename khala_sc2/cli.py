"""The command line: mount the packages' commands, add those that need all packages, print errors as one sentence.

A command imports what it needs when it runs: this module, and every module with options that it imports, knows no
pydantic, no game and no bus. `tests/khala/test_imports.py` holds them to it.
"""

import logging
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import khala_agents.cli
import khala_orchestrator.cli
import khala_simulator.cli
import khala_simulator.process.install
from khala_agents.cli import Trust
from khala_orchestrator.cli import Insecure, Json, Listen, Tls
from khala_protocol.commandline import run_command, say
from khala_protocol.keys import check_name
from khala_protocol.visible import VisibleFormatter
from khala_sc2 import __version__
from khala_sc2.arena.cli import app as arena
from khala_sc2.calibrate.cli import CALIBRATE_EPILOG, calibrate
from khala_sc2.commands.actions import EPILOG as ACTIONS_EPILOG
from khala_sc2.commands.actions import actions
from khala_sc2.commands.help import Commands
from khala_sc2.commands.keys import app as keys
from khala_sc2.commands.run_options import (
    Game,
    MatchOptions,
    MindOptions,
    Out,
    Resume,
    RunName,
    Task,
    with_options,
)
from khala_sc2.dataset.cli import app as dataset
from khala_sc2.experiment.cli import app as experiment
from khala_sc2.fork.cli import FORK_EPILOG, fork
from khala_sc2.knowledge.cli import app as knowledge
from khala_sc2.mcp.cli import MCP_EPILOG, mcp
from khala_sc2.openenv.cli import OPENENV_EPILOG, openenv
from khala_sc2.service.cli import SERVE_EPILOG, SUBMIT_EPILOG, matches, serve, stop, submit, watch
from khala_sc2.view.cli import VIEW_EPILOG, view

app = typer.Typer(
    name="khala",
    cls=Commands,
    help="Teams of LLM agents play StarCraft II together over a message bus.",
    epilog="Begin with: khala run 2s3z_pair",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)

RUN_EPILOG = """
Examples:\n
    khala run 2s3z\n
    khala run 2s3z_pair --model deepseek --episodes 5\n
    khala run pvz_task6_level1 --model anthropic --images paper\n
    khala run 3s5z --base-url http://localhost:8000/v1 --model vllm --model-name my-model\n
    khala run my_task.yaml --policy my_agent:decide --json\n
    khala run 2s3z_pair --clock realtime --speed 2\n
    khala run simple64_eceb --level 5 --agents my_agents.yaml\n
    khala run simple64_duel --blue openai --red anthropic\n
    khala run simple64_eceb_terran --opponent "guest:python my_bot/run.py"\n
    khala run --resume runs/2s3z-20260101-120000-ab12
"""
TRY_EPILOG = """
Examples:\n
    khala try openai/gpt-5\n
    khala try ollama/qwen3:8b --task smac_3m\n
    khala try my_model.yaml --answer json\n
    khala try llamacpp --base-url http://127.0.0.1:8081/v1 --json
"""
ADVISE_EPILOG = """
Examples:\n
    khala advise first\n
    khala advise first --agent Stalkers --name Coach --connect tls/10.0.0.5:7447 --tls keys
"""
HOST_EPILOG = """
Examples:\n
    khala host 2s3z_pair --run first --connect tls/10.0.0.5:7447 --tls keys\n
    khala host 2s3z_pair --run first --listen tls/0.0.0.0:7447 --tls keys\n
    khala host --resume runs/first --listen tls/0.0.0.0:7447 --tls keys
"""


@with_options
def run(
    task: Task = None,
    *,
    resume: Resume = None,
    minds: MindOptions,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    match: MatchOptions,
    run: RunName = None,
    out: Out = Path("runs"),
    as_json: Json = False,
) -> None:
    """Play a task on this machine: game, host, agents and, if need be, the scripted model.

    Agents run in their own processes and talk to the host over the bus, as they would from other machines. All
    messages go into a recording, see `khala replay`.
    """
    from khala_sc2.commands.run import WantedRun  # noqa: PLC0415  # see there
    from khala_sc2.commands.run import run as play  # noqa: PLC0415

    play(WantedRun(task, resume, run, out, game, asdict(match), minds), as_json=as_json)


@with_options
def host(
    task: Task = None,
    *,
    resume: Resume = None,
    run: RunName = None,
    connect: Annotated[
        list[str] | None,
        typer.Option(help="Endpoint of the router.", show_default="tcp/127.0.0.1:7447, with --tls tls/127.0.0.1:7447"),
    ] = None,
    listen: Listen = None,
    tls: Tls = None,
    insecure: Insecure = False,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    match: MatchOptions,
    out: Out = Path("runs"),
    as_json: Json = False,
) -> None:
    """Play a task with agents that join over the bus, from this machine or from others.

    With --listen the host is its own router; with --connect it uses one, see `khala router`.
    """
    from khala_sc2.commands.host import bus_of, until_interrupted  # noqa: PLC0415  # see there
    from khala_sc2.playing.local import play_hosted  # noqa: PLC0415
    from khala_sc2.playing.matches import new_or_resumed  # noqa: PLC0415

    config, past = new_or_resumed(task, resume, run, out, **asdict(match))
    bus = bus_of(config, connect, listen, tls, insecure=insecure)
    until_interrupted(
        config, as_json, lambda watch: play_hosted(config, bus, out / config.run, game=game, watch=watch, past=past)
    )


def advise(
    run: Annotated[str, typer.Argument(help="Name of the run; the host prints it.")],
    *,
    agent: Annotated[
        str | None, typer.Option(help="Write to this agent.", show_default="to all of the side", metavar="NAME")
    ] = None,
    name: Annotated[str, typer.Option(help="Adviser who writes, as the task names it.")] = "Adviser",
    side: Annotated[str, typer.Option(help="Side whose agents are advised.")] = "blue",
    connect: Annotated[
        list[str] | None,
        typer.Option(
            help="Endpoint of the router.",
            show_default="where this machine plays it, or tcp/127.0.0.1:7447; with --tls tls/127.0.0.1:7447",
        ),
    ] = None,
    tls: Tls = None,
    insecure: Insecure = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print messages of the host as JSON, one a line.")] = False,
) -> None:
    """Read the reports of a running match, and write to its agents.

    Each line of stdin is a message that agents read in their next observation; `@Stalkers fall back` is for one
    agent. The recording marks each message as human, and the result counts it.
    """
    from khala_orchestrator.words.mailbox import EVERYONE  # noqa: PLC0415
    from khala_sc2.commands.advise import Adviser, run_advise  # noqa: PLC0415  # loads the native library of the bus

    names = {what: check_name(value, what) for what, value in (("run", run), ("side", side), ("name", name))}
    adviser = Adviser(**names, recipient=agent or EVERYONE)
    run_advise(adviser, connect=connect or (), tls=tls, insecure=insecure, as_json=as_json)


def try_model(
    model: Annotated[
        str, typer.Argument(help="A model file by name or path, or a provider and its model: openai/gpt-5.")
    ] = "scripted",
    *,
    task: Annotated[str, typer.Option(help="Task whose first observations are sent.", metavar="TASK")] = "2s3z_pair",
    base_url: Annotated[str | None, typer.Option(help="Another endpoint of the same kind.")] = None,
    answer: Annotated[
        str | None,
        typer.Option(
            help="Ask in this form only.", show_default="once in each form", metavar="text|json|tools|grammar"
        ),
    ] = None,
    timeout: Annotated[float, typer.Option(min=1, help="Seconds to wait for an answer.")] = 600.0,
    game: Game = "simulator",
    as_json: Json = False,
) -> None:
    """Ask a model once, and show what it said, what the host read of it, and what it took.

    It gets the prompt of an agent at the beginning of a task, once for each form of answers. Prints the tokens by its
    own count, the seconds, the price, its context and which forms it takes. Ends with 1 if none of its orders in the
    form of its file was carried out.
    """
    from khala_sc2.commands.trial import WantedTrial, run_trial  # noqa: PLC0415  # see there

    run_trial(WantedTrial(model, task, base_url, answer, timeout, game), as_json=as_json)


def doctor(
    *,
    tls: Tls = None,
    game: Annotated[
        str | None,
        typer.Option(
            help="Start this game as well, and try its maps: simulator, starcraft2, or a directory.",
            show_default="none is started",
            metavar="GAME",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Check whether this machine can play matches, and say what to fix."""
    from khala_sc2.commands import host as commands  # noqa: PLC0415  # see there

    commands.doctor(tls, game, as_json=as_json)


def version(value: bool) -> None:  # typer calls it with the flag
    """Print the version and end."""
    if value:
        say(f"khala {__version__}")
        raise typer.Exit


@app.callback()
def front_door(
    *,
    version: Annotated[  # noqa: ARG001  # handled by its callback
        bool, typer.Option("--version", callback=version, is_eager=True, help="Print the version and end.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log what happens, on stderr.")] = False,
) -> None:
    """Set up logging before any command."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(VisibleFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, handlers=[handler])
    logging.getLogger("httpx").setLevel(logging.WARNING)  # it logs every request
    logging.getLogger("absl").setLevel(logging.ERROR)  # PySC2 warns at each step of abilities that it has no name for


for command, epilog in (
    (run, RUN_EPILOG),
    (host, HOST_EPILOG),
    (advise, ADVISE_EPILOG),
    (khala_agents.cli.agent, khala_agents.cli.AGENT_EPILOG),
    (khala_agents.cli.llm, khala_agents.cli.LLM_EPILOG),
    (khala_orchestrator.cli.router, khala_orchestrator.cli.ROUTER_EPILOG),
    (khala_orchestrator.cli.replay, khala_orchestrator.cli.REPLAY_EPILOG),
    (khala_orchestrator.cli.tasks, None),
    (fork, FORK_EPILOG),
    (actions, ACTIONS_EPILOG),
    (serve, SERVE_EPILOG),
    (submit, SUBMIT_EPILOG),
    (matches, None),
    (watch, None),
    (stop, None),
    (view, VIEW_EPILOG),
    (mcp, MCP_EPILOG),
    (openenv, OPENENV_EPILOG),
    (calibrate, CALIBRATE_EPILOG),
    (doctor, None),
):
    app.command(epilog=epilog)(command)
app.command("try", epilog=TRY_EPILOG)(try_model)
app.add_typer(arena, name="arena")
app.add_typer(dataset, name="dataset")
app.add_typer(experiment, name="experiment")
app.add_typer(keys, name="keys")
app.add_typer(khala_simulator.cli.app, name="sc2")
app.add_typer(knowledge, name="knowledge")


_OLD_STUBS = "Descriptors cannot be created directly"
"""What protobuf says of stubs that were made for it before 2022. pip does not know that two packages share a name."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; an error that the user can fix is one sentence on stderr and an exit code other than 0."""
    try:
        run_command("khala", lambda: app(arguments, prog_name="khala"), khala_simulator.process.install.InstallError)
    except TypeError as error:
        if _OLD_STUBS not in str(error):
            raise
        sys.exit(
            "khala: s2clientprotocol, which PySC2 asks for, has overwritten pys2clientprotocol, which knows the "
            "protobuf of today: pip install --force-reinstall --no-deps pys2clientprotocol"
        )
