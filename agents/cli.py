"""The commands `khala agent` and `khala llm`, as plain functions that `khala.cli` mounts.

They read options, put things together and run until they are told to end. What goes wrong on the user's side is
raised as a `protocol.errors.KhalaError` of one sentence; printing it is the front door's part.
"""

import asyncio
import gc
import json
import os
import signal
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from agents.build import Workshop
from agents.config import AgentsFile, WorkerSpec, load_agents
from agents.policy import Policy
from agents.scripted.endpoint import Behaviour, Endpoint
from agents.scripted.faults import Faults, parse_faults
from agents.scripted.players import PLAYERS
from agents.worker import Tally, run_workers
from protocol.bus.config import BusConfig
from protocol.errors import ConfigError
from protocol.keys import check_name
from protocol.messages import Usage

T = TypeVar("T")
DEFAULT_LLM_PORT = 8765

AGENT_EPILOG = """
Examples:\n
    khala agent CombatGroupSmac --run demo\n
    khala agent CombatGroup1 CombatGroup2 --run demo --model openai --budget-usd 0.50\n
    khala agent CombatGroup1 --run demo --policy my_agent:decide --connect tcp/10.0.0.5:7447\n
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
        typer.Option(help="Endpoint of the router, may be given several times.", show_default="tcp/127.0.0.1:7447"),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(help="Model to ask: a shipped one (scripted, openai, ollama, …) or a YAML file.", metavar="NAME"),
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
    memory: Annotated[int, typer.Option(min=0, help="Past steps that stand in the prompt, word for word.")] = 0,
    budget_usd: Annotated[
        float | None, typer.Option(min=0.0, help="What this process may spend; then its agents hold still.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was done as one JSON object.")] = False,
) -> None:
    """Play one or more agents of a run.

    An agent gets observations from the host, asks its model or policy, and answers before the deadline. It may
    start before or after the host, and be started again in the middle of a run.

    Keys of models are taken from the environment only; the model file says which variable.
    """
    file = _specs(names or [], model=model, policy=policy, memory=memory, path=agents)
    workshop = Workshop(
        budget_usd=budget_usd if budget_usd is not None else file.budget_usd,
        overrides={"base_url": base_url, "model": model_name},
    )
    check_name(run, "run")
    check_name(side, "side")
    policies = {name: workshop.policy(spec) for name, spec in file.agents.items()}
    config = BusConfig(connect=tuple(connect or ()))
    tallies = _until_told(lambda stop: _play(config, run, side, policies, file.default_reply, stop))
    if as_json:
        typer.echo(json.dumps({"run": run, "agents": {name: _plain(tally) for name, tally in tallies.items()}}))
    else:
        for name, tally in tallies.items():
            _say(_sentence(name, tally))


def llm(
    *,
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0 for all.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")] = (
        DEFAULT_LLM_PORT
    ),
    latency: Annotated[float, typer.Option(min=0.0, help="Seconds until a request is answered.")] = 0.0,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help="Part of the requests that goes wrong: an HTTP status, or quota, garbage, nonsense, half, reset, "
            "drip, stall. May be given several times.",
            metavar="KIND=RATE",
        ),
    ] = None,
    retry_after: Annotated[float, typer.Option(min=0.0, help="Seconds in Retry-After of 429 and 503.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Of faults and of players that roll dice.")] = 0,
    ready_file: Annotated[
        Path | None, typer.Option(help="File to write the base URL to, as JSON, once it listens.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the base URL as a JSON object on stdout.")] = False,
) -> None:
    """Serve the scripted model over HTTP, in the form of OpenAI's chat completions.

    It plays from the text of the prompt alone. The model's name selects the player: focus-fire fires with all teams
    on the weakest enemy, random-legal does anything that is allowed, silent orders nothing.
    """
    behaviour = Behaviour(
        latency_s=latency, faults=Faults(parse_faults(fault or ()), seed=seed), retry_after_s=retry_after, seed=seed
    )
    _until_told(lambda stop: _serve(Endpoint(behaviour, host=host, port=port), stop, ready_file, as_json=as_json))


# --- agent ------------------------------------------------------------------------------------------


def _specs(names: list[str], *, model: str | None, policy: str | None, memory: int, path: Path | None) -> AgentsFile:
    if path is not None:
        if names or model or policy:
            raise ConfigError("a file of agents says all: leave out NAMES, --model and --policy", source="--agents")
        return load_agents(path)
    if not names:
        raise ConfigError("say which agents to play, or give a file with --agents: khala agent NAME… --run RUN")
    if model and policy:
        raise ConfigError("an agent decides with a model or with a policy: give --model or --policy, not both")
    spec = WorkerSpec(policy=policy) if policy else WorkerSpec(model=model or "scripted", memory=memory)
    return AgentsFile(agents={check_name(name, "agent"): spec for name in names})


def _settle_memory() -> None:
    """Takes what was imported out of garbage collection: going through it stops every agent for 40 ms."""
    gc.collect()
    gc.freeze()


async def _play(
    config: BusConfig, run: str, side: str, policies: dict[str, Policy], default_reply: str, stop: asyncio.Event
) -> dict[str, Tally]:
    from protocol.bus.zenoh import open_bus  # noqa: PLC0415 - loads the native library, which --help need not wait for

    bus = await open_bus(config)
    try:
        _say(
            f"{', '.join(policies)} on side {side} of run {run}: waiting for the host at {', '.join(config.connect_to)}"
        )
        _settle_memory()
        return await run_workers(bus, run, side, policies, default_reply=default_reply, stop=stop)
    finally:
        await bus.close()


def _sentence(name: str, tally: Tally) -> str:
    fallbacks = ", ".join(f"{count} {why}" for why, count in tally.fallbacks.most_common())
    text = f"{name}: {tally.replies['ok']} replies, {tally.replies['fallback']} fallbacks"
    text += f" ({fallbacks})" if fallbacks else ""
    if tally.usage.requests:
        text += f", {tally.usage.prompt_tokens} + {tally.usage.completion_tokens} tokens, {_price(tally.usage)}"
    return f"{text}; ended: {tally.ended}"


def _price(usage: Usage) -> str:
    return "price unknown" if usage.cost_usd is None else f"{usage.cost_usd:.4f} USD"


def _plain(tally: Tally) -> dict[str, Any]:
    return {
        "replies": dict(tally.replies),
        "fallbacks": dict(tally.fallbacks),
        "superseded": tally.superseded,
        "usage": tally.usage.model_dump(),
        "ended": tally.ended,
    }


# --- llm --------------------------------------------------------------------------------------------


async def _serve(endpoint: Endpoint, stop: asyncio.Event, ready_file: Path | None, *, as_json: bool) -> None:
    async with endpoint:
        _settle_memory()
        ready = json.dumps({"base_url": endpoint.base_url, "pid": os.getpid(), "models": list(PLAYERS)})
        _say(f"scripted models {', '.join(PLAYERS)} at {endpoint.base_url}")
        if ready_file is not None:
            _write_whole(ready_file, ready)
        if as_json:
            typer.echo(ready)
        await stop.wait()
        _say(f"{endpoint.requests} requests were answered")


def _write_whole(path: Path, text: str) -> None:
    """Writes a file that nobody can see half of."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", source=str(path)) from None


# --- both -------------------------------------------------------------------------------------------


def _until_told(work: Callable[[asyncio.Event], Coroutine[Any, Any, T]]) -> T:
    """Runs `work` with an event that SIGINT and SIGTERM set; a second signal ends the process at once."""

    async def main() -> T:
        stop = asyncio.Event()
        loop = asyncio.get_running_loop()
        signals = (signal.SIGINT, signal.SIGTERM)

        def tell() -> None:
            stop.set()
            for number in signals:
                loop.remove_signal_handler(number)

        for number in signals:
            loop.add_signal_handler(number, tell)
        return await work(stop)

    return asyncio.run(main())


def _say(text: str) -> None:
    typer.echo(text, err=True)
