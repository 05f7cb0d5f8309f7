"""The command line: mount the packages' commands, add those that need all packages, print errors as one sentence."""

import asyncio
import itertools
import json
import logging
import os
import signal
import sys
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

import khala_agents.cli
import khala_orchestrator.cli
import khala_simulator.cli
import khala_simulator.process.install
from khala import __version__
from khala.actions import EPILOG as ACTIONS_EPILOG
from khala.actions import actions
from khala.keys import app as keys
from khala.knowledge.cli import app as knowledge
from khala_orchestrator.cli import Insecure, Json, Listen, Tls, access_rules
from khala_orchestrator.config import MatchConfig, change, load_task, new_run_name
from khala_orchestrator.console import Progress, stderr_console
from khala_protocol.bus.config import BusConfig
from khala_protocol.commandline import run_command
from khala_protocol.errors import ConfigError
from khala_protocol.joining import client_config, router_config
from khala_protocol.keys import check_name
from khala_protocol.messages import ClockRule, Result, Wire
from khala_protocol.signals import cancelled_by_signal
from khala_protocol.visible import VisibleFormatter

if TYPE_CHECKING:
    from khala_orchestrator.resume import Unfinished

SIGNALLED = 128
"""Added to a signal's number it is the exit code, as shells expect it: 130 after Ctrl-C, 143 after SIGTERM."""
NOT_VALID = 3
"""Exit code after a match with an episode that says nothing about its agents."""

app = typer.Typer(
    name="khala",
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
    khala run --resume runs/2s3z-20260101-120000-ab12
"""
HOST_EPILOG = """
Examples:\n
    khala host 2s3z_pair --run first --connect tls/10.0.0.5:7447 --tls keys\n
    khala host 2s3z_pair --run first --listen tls/0.0.0.0:7447 --tls keys\n
    khala host --resume runs/first --listen tls/0.0.0.0:7447 --tls keys
"""

Task = Annotated[
    str | None, typer.Argument(help="A task, see `khala tasks`, or a path to a .yaml file.", metavar="TASK")
]
Resume = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a task: go on with a match whose host was lost; its recording, or the directory of its run.",
        metavar="RUN",
    ),
]
Game = Annotated[
    str,
    typer.Option(help="Game to use: simulator, starcraft2 (at SC2PATH), or a directory of either.", metavar="GAME"),
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the first episode; each further one adds 1.")]
Episodes = Annotated[int, typer.Option(min=1, help="Number of episodes.")]
RunName = Annotated[
    str | None,
    typer.Option(envvar="KHALA_RUN", help="Name of the run.", show_default="task, time, digits", metavar="NAME"),
]
MaxWait = Annotated[float | None, typer.Option(min=0.01, help="Longest wait for the agents of a step, in seconds.")]
StepLoops = Annotated[int | None, typer.Option(min=1, help="Game loops between two observations.")]
Rule = Annotated[
    ClockRule | None,
    typer.Option(
        "--clock",
        help="Time that thinking costs: frozen (none), budget (always the same), token (by tokens), realtime.",
        show_default="as the task says",
    ),
]
ThinkingLoops = Annotated[
    int | None, typer.Option(min=0, help="Clock budget: game loops that each decision costs; 22.4 are a second.")
]
Speed = Annotated[float | None, typer.Option(min=0.01, help="Clock realtime: speed of the game; 1 is that of ladders.")]
Grace = Annotated[
    float | None, typer.Option(min=0, help="How long a required agent may be away before the match ends, in seconds.")
]
MaxSteps = Annotated[int | None, typer.Option(min=1, help="End an episode after this many steps.")]
ExecutorName = Annotated[
    str | None, typer.Option(help="raw (one env step a turn) or screen (as in the paper).", metavar="EXECUTOR")
]
Images = Annotated[
    str | None,
    typer.Option(
        help="Pictures for all agents: paper (those of their kind), none, or a list such as screen,minimap.",
        show_default="as the task says",
        metavar="LIST",
    ),
]
Assemble = Annotated[float, typer.Option(min=0.1, help="How long to wait for the agents at the start, in seconds.")]
Out = Annotated[Path, typer.Option(help="Directory in which the run gets its own directory.", metavar="DIR")]


def run(
    task: Task = None,
    *,
    resume: Resume = None,
    model: Annotated[
        str, typer.Option(help="Model to ask: scripted, openai, deepseek, …, or a YAML file.", metavar="NAME")
    ] = "scripted",
    model_name: Annotated[
        str | None,
        typer.Option(help="Another model of the endpoint; scripted has skilled, focus-fire, random-legal, silent."),
    ] = None,
    base_url: Annotated[str | None, typer.Option(help="Another endpoint of the same kind.")] = None,
    policy: Annotated[
        str | None, typer.Option(help="Decide without a model, with your own code.", metavar="MODULE:NAME")
    ] = None,
    fallback: Annotated[
        str | None,
        typer.Option(
            help="Policy where the model has no reply: silent, skilled, focus-fire, random-legal, or module:name.",
            metavar="NAME",
        ),
    ] = None,
    budget_usd: Annotated[float | None, typer.Option(min=0, help="Limit of all agents together in US dollars.")] = None,
    latency: Annotated[float, typer.Option(min=0, help="Seconds that the scripted model takes to answer.")] = 0.2,
    game: Game = "simulator",
    seed: Seed = 1,
    episodes: Episodes = 1,
    executor: ExecutorName = None,
    clock: Rule = None,
    max_wait: MaxWait = None,
    step_loops: StepLoops = None,
    thinking_loops: ThinkingLoops = None,
    speed: Speed = None,
    grace: Grace = None,
    max_steps: MaxSteps = None,
    images: Images = None,
    run: RunName = None,
    assemble: Assemble = 60.0,
    out: Out = Path("runs"),
    as_json: Json = False,
) -> None:
    """Play a task on this machine: game, host, agents and, if need be, the scripted model.

    Agents run in their own processes and talk to the host over the bus, as they would from other machines. All
    messages go into a recording, see `khala replay`.
    """
    from khala.local import Minds, play  # noqa: PLC0415  # PySC2 takes a second that --help need not wait for

    config, past = _match(
        task, resume, run, out, seed=seed, episodes=episodes, assemble_s=assemble,
        executor=executor, rule=clock, max_wait_s=max_wait, step_loops=step_loops, thinking_loops=thinking_loops,
        speed=speed, grace_s=grace, max_steps=max_steps, images=images,
    )  # fmt: skip
    minds = Minds(model, model_name, base_url, policy, budget_usd, latency, fallback)
    _until_interrupted(
        config, as_json, lambda watch: play(config, minds, out / config.run, game=game, watch=watch, past=past)
    )


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
    seed: Seed = 1,
    episodes: Episodes = 1,
    executor: ExecutorName = None,
    clock: Rule = None,
    max_wait: MaxWait = None,
    step_loops: StepLoops = None,
    thinking_loops: ThinkingLoops = None,
    speed: Speed = None,
    grace: Grace = None,
    max_steps: MaxSteps = None,
    images: Images = None,
    assemble: Assemble = 60.0,
    out: Out = Path("runs"),
    as_json: Json = False,
) -> None:
    """Play a task with agents that join over the bus, from this machine or from others.

    With --listen the host is its own router; with --connect it uses one, see `khala router`.
    """
    from khala.local import play_hosted  # noqa: PLC0415

    config, past = _match(
        task, resume, run, out, seed=seed, episodes=episodes, assemble_s=assemble,
        executor=executor, rule=clock, max_wait_s=max_wait, step_loops=step_loops, thinking_loops=thinking_loops,
        speed=speed, grace_s=grace, max_steps=max_steps, images=images,
    )  # fmt: skip
    bus = _bus(config, connect, listen, tls, insecure=insecure)
    _until_interrupted(
        config, as_json, lambda watch: play_hosted(config, bus, out / config.run, game=game, watch=watch, past=past)
    )


def doctor(*, tls: Tls = None, as_json: Json = False) -> None:
    """Look at this machine as a match would, and say what to do."""
    from khala.doctor import examine  # noqa: PLC0415

    findings = list(examine(tls))
    wrong = any(finding.state == "wrong" for finding in findings)
    if as_json:
        typer.echo(json.dumps({"ok": not wrong, "findings": [finding.as_dict() for finding in findings]}))
    else:
        marks = {"ok": "[green]ok[/]", "note": "[yellow]note[/]", "wrong": "[red]wrong[/]"}
        table = Table(box=None, pad_edge=False, show_header=False)
        for finding in findings:
            table.add_row(marks[finding.state], finding.name, finding.found, f"[dim]{escape(finding.advice)}[/]")
        Console().print(table)
    raise typer.Exit(1 if wrong else 0)


def version(value: bool) -> None:  # typer calls it with the flag
    """Print the version and end."""
    if value:
        typer.echo(f"khala {__version__}")
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


for command, epilog in (
    (run, RUN_EPILOG),
    (host, HOST_EPILOG),
    (khala_agents.cli.agent, khala_agents.cli.AGENT_EPILOG),
    (khala_agents.cli.llm, khala_agents.cli.LLM_EPILOG),
    (khala_orchestrator.cli.router, khala_orchestrator.cli.ROUTER_EPILOG),
    (khala_orchestrator.cli.replay, khala_orchestrator.cli.REPLAY_EPILOG),
    (khala_orchestrator.cli.tasks, None),
    (actions, ACTIONS_EPILOG),
    (doctor, None),
):
    app.command(epilog=epilog)(command)
app.add_typer(keys, name="keys")
app.add_typer(khala_simulator.cli.app, name="sc2")
app.add_typer(knowledge, name="knowledge")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; an error that the user can fix is one sentence on stderr and an exit code other than 0."""
    run_command("khala", lambda: app(arguments, prog_name="khala"), khala_simulator.process.install.InstallError)


def _match(
    task: str | None, resume: Path | None, run: str | None, out: Path, **given: Any
) -> "tuple[MatchConfig, Unfinished | None]":
    """Return the match that the options describe, and what was played of it."""
    if (task is None) == (resume is None):
        raise ConfigError("give a task, or a recording with --resume: one of them")
    if resume is None:
        assert task is not None
        return _config(task, run, out, **given), None
    from khala_orchestrator.resume import unfinished  # noqa: PLC0415  # as below
    from khala_protocol.recording import Recording  # noqa: PLC0415

    past = unfinished(Recording.open(_newest_recording(resume)))
    changes = {"record": _free_recording(out / past.config.run), "assemble_s": given["assemble_s"]}
    return past.config.model_copy(update=changes), past


def _newest_recording(path: Path) -> Path:
    """Return the recording at a path, or the newest one with a run card in the directory of a run."""
    if not path.is_dir():
        return path
    found = sorted(path.glob("recording*.mcap"), key=lambda file: file.stat().st_mtime)
    if not found:
        raise ConfigError(f"there is no recording in {path}: give the directory of a run, or a .mcap file")
    from khala_protocol.recording import Recording  # noqa: PLC0415  # zstd is not for --help

    begun = (path for path in reversed(found) if Recording.open(path).run is not None)
    return next(begun, found[-1])


def _config(task: str, run: str | None, out: Path, **given: Any) -> MatchConfig:
    """Return the match that the options describe; its recording is in its own directory below `out`."""
    from khala_bridge.observe import Observer  # noqa: PLC0415  # half a second that other commands do without

    match = {name: given.pop(name) for name in ("seed", "episodes", "assemble_s")}
    loaded = change(load_task(task), **given)
    Observer(loaded)  # report an unknown section before a game is started
    name = check_name(run or new_run_name(loaded.name), "run")
    return MatchConfig(task=loaded, run=name, record=_free_recording(out / name), **match)


def _free_recording(directory: Path) -> Path:
    """Return an unused file for the recording: containers, for example, start a run again under its name."""
    names = itertools.chain(["recording"], (f"recording-{number}" for number in itertools.count(2)))
    paths = (directory / f"{name}.mcap" for name in names)
    return next(path for path in paths if not os.path.exists(path))  # noqa: PTH110  # Path.exists raises where it may not look


def _bus(
    match: MatchConfig, connect: list[str] | None, listen: list[str] | None, tls: Path | None, *, insecure: bool
) -> BusConfig:
    if connect and listen:
        raise ConfigError("a host has a router or is one: give --connect or --listen, not both")
    if listen:
        rules = access_rules([match.task], match.run) if tls else None
        return router_config(listen, tls=tls, insecure=insecure, rules=rules)
    return client_config(connect or (), tls=tls, names=("host",), insecure=insecure)


def _until_interrupted(
    config: MatchConfig, as_json: bool, play: Callable[[Callable[[Wire], None]], Coroutine[Any, Any, list[Result]]]
) -> None:
    """Play with a live picture, print the results, and end in order on SIGINT and SIGTERM."""
    screen = stderr_console()
    with Progress(screen, config.task.max_steps) as progress:
        results = asyncio.run(cancelled_by_signal(play(progress)))
    if isinstance(results, signal.Signals):
        screen.print(f"interrupted; what was played is in {config.record}", soft_wrap=True)
        raise typer.Exit(SIGNALLED + results)
    screen.print(f"recorded: `khala replay {config.record}` tells it", soft_wrap=True)
    if as_json:
        plain = [result.model_dump(mode="json") for result in results]
        typer.echo(json.dumps({"run": config.run, "recording": str(config.record), "results": plain}))
    if reasons := dict.fromkeys(result.invalid_because for result in results if not result.valid):
        screen.print(f"[bold red]not valid:[/] {escape('; '.join(reasons))}", soft_wrap=True)
        raise typer.Exit(NOT_VALID)
