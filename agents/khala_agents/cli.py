"""The commands `khala agent` and `khala llm`, as plain functions that `khala_sc2.cli` mounts.

Where only this package is installed they are `khala-agent` and `khala-llm`.

They read options, put things together and run until they are stopped. A mistake of the user is raised
as a `khala_protocol.errors.KhalaError` of one sentence; `khala_sc2.cli` or `run_command` prints it.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from khala_protocol.commandline import run_command
from khala_protocol.rethinks import MAX_RETHINKS
from khala_protocol.trust import trust_files

DEFAULT_LLM_PORT = 8765
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        callback=trust_files,
        help="Let files name code that runs here: policies, sections of observations, commands of guests.",
    ),
]

AGENT_EPILOG = """
Examples:\n
    khala agent CombatGroupSmac --run demo\n
    khala agent CombatGroup1 CombatGroup2 --run demo --model openai --budget-usd 0.50\n
    khala agent CombatGroup1 --run demo --policy my_agent:decide --connect tls/10.0.0.5:7447 --tls keys\n
    khala agent --agents configs/agents/mixed.yaml --run demo
"""
LLM_EPILOG = """
Examples:\n
    khala llm\n
    khala llm --latency 1 --fault 429=0.1 --fault stall=0.01 --seed 7\n
    khala llm --port 0 --ready-file llm.json\n
    curl http://127.0.0.1:8765/v1/models
"""


def agent(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            envvar="KHALA_AGENTS", help="Agents to play, as the task file names them. Several share this process."
        ),
    ] = None,
    *,
    run: Annotated[str, typer.Option(envvar="KHALA_RUN", help="Name of the run; the host prints it.", metavar="NAME")],
    side: Annotated[str, typer.Option(help="Side of the agents, as the task file names it.")] = "blue",
    connect: Annotated[
        list[str] | None,
        typer.Option(
            help="Endpoint of the router, may be given several times.",
            show_default="tcp/127.0.0.1:7447, with --tls tls/127.0.0.1:7447",
        ),
    ] = None,
    tls: Annotated[
        Path | None,
        typer.Option(
            envvar="KHALA_TLS",
            help="Encrypt, with the agents' certificates in this directory, see `khala keys`.",
            metavar="DIR",
        ),
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Allow a link to another machine without TLS: in your own network only.")
    ] = False,
    model: Annotated[
        str | None,
        typer.Option(
            help="Model to ask: a shipped file (scripted, openai, …), openai/gpt-5, or a YAML file.", metavar="MODEL"
        ),
    ] = None,
    policy: Annotated[
        str | None,
        typer.Option(help="Decide without a model: module:function, or silent.", metavar="MODULE:NAME"),
    ] = None,
    agents: Annotated[
        Path | None, typer.Option(help="YAML file that says how each agent decides, instead of NAMES.")
    ] = None,
    base_url: Annotated[str | None, typer.Option(help="Use the model at this address instead of its file's.")] = None,
    model_name: Annotated[str | None, typer.Option(help="Use this model instead of its file's.")] = None,
    memory: Annotated[
        str | None,
        typer.Option(
            help="Past steps in the prompt: a number, or a rule such as steps=4,summary=20 or steps=2,whole=true.",
            show_default="as the task says",
            metavar="RULE",
        ),
    ] = None,
    budget_usd: Annotated[
        float | None,
        typer.Option(min=0.0, help="Limit for these agents, in US dollars; no request is sent that could exceed it."),
    ] = None,
    ledger: Annotated[
        Path | None,
        typer.Option(
            envvar="KHALA_LEDGER",
            help="File with the money spent, for processes that share a budget or start again.",
            show_default="in memory",
            metavar="FILE",
        ),
    ] = None,
    fallback: Annotated[
        str | None,
        typer.Option(
            help="Policy for when the model has no reply: silent, skilled, focus-fire, random-legal, or module:name.",
            metavar="NAME",
        ),
    ] = None,
    rethink: Annotated[
        int,
        typer.Option(
            min=0,
            max=MAX_RETHINKS,
            help="How often a model is asked again in a step if nothing of its answer is possible.",
            metavar="N",
        ),
    ] = 0,
    answer: Annotated[
        str | None,
        typer.Option(
            help="Form that the endpoint holds answers to, instead of the model file's.",
            metavar="text|json|tools|grammar",
        ),
    ] = None,
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    as_json: Annotated[bool, typer.Option("--json", help="Print the results as one JSON object.")] = False,
) -> None:
    """Play one or more agents of a run.

    An agent gets observations from the host, asks its model or policy, and answers before the deadline. It may
    start before or after the host, and be started again in the middle of a run.

    API keys come from the environment only; the model file names the variable.
    """
    from khala_agents import commands  # noqa: PLC0415  # see there

    commands.play(
        commands.specs(
            names or [],
            model=model,
            policy=policy,
            memory=memory,
            path=agents,
            fallback=fallback,
            rethink=rethink,
        ),
        run,
        side,
        commands.BusPlace(connect or [], tls, insecure=insecure),
        budget_usd=budget_usd,
        ledger=ledger,
        overrides={"base_url": base_url, "model": model_name, "answer": answer},
        as_json=as_json,
    )


def llm(
    *,
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0 for all.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 for a free one.")] = (
        DEFAULT_LLM_PORT
    ),
    latency: Annotated[float, typer.Option(min=0.0, help="Seconds until a request is answered.")] = 0.0,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help="Share of the requests that fail like this: an HTTP status, or quota, garbage, nonsense, half, reset, "
            "drip, stall. May be given several times.",
            metavar="KIND=RATE",
        ),
    ] = None,
    retry_after: Annotated[float, typer.Option(min=0.0, help="Seconds in Retry-After of 429 and 503.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Seed of faults and of random players.")] = 0,
    ready_file: Annotated[
        Path | None, typer.Option(help="File that gets the base URL, as JSON, once the server listens.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the base URL as a JSON object on stdout.")] = False,
) -> None:
    """Serve the scripted model over HTTP, in the form of OpenAI's chat completions.

    It plays from the text of the prompt alone. The model's name selects the player: skilled uses skills, keeps its
    distance, raids and builds; focus-fire fires with all teams on the weakest enemy, random-legal does anything that
    is allowed, silent orders nothing.
    """
    from khala_agents import commands  # noqa: PLC0415  # see there

    commands.serve(
        host=host,
        port=port,
        latency_s=latency,
        faults=fault or [],
        retry_after_s=retry_after,
        seed=seed,
        ready_file=ready_file,
        as_json=as_json,
    )


def agent_command() -> None:
    """Run `khala-agent`: `khala agent`, on a machine that has only this package."""
    _run_alone("khala-agent", agent, AGENT_EPILOG)


def llm_command() -> None:
    """Run `khala-llm`: `khala llm`, on a machine that has only this package."""
    _run_alone("khala-llm", llm, LLM_EPILOG)


def _run_alone(name: str, command: Callable[..., None], epilog: str) -> None:
    app = typer.Typer(add_completion=False, rich_markup_mode="rich", pretty_exceptions_enable=False)
    app.command(epilog=epilog.replace("khala agent", name).replace("khala llm", name))(command)
    run_command(name, lambda: app(prog_name=name))
