"""The work of `khala agent` and `khala llm`: put things together and run until the run or a signal ends them.

`khala_agents.cli` above has the options. It imports this module only to run a command: HTTP clients and
servers take half a second to import, and `--help` need not wait for that.
"""

from __future__ import annotations

import asyncio
import json
import os
from contextlib import AsyncExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import typer
from pydantic import ValidationError

from khala_agents.build import Workshop
from khala_agents.config import AgentsFile, WorkerSpec, load_agents
from khala_agents.llm.money import MoneyLedger, SharedBudget
from khala_agents.scripted.endpoint import Behaviour, Endpoint
from khala_agents.scripted.faults import InjectedFaults, parse_faults
from khala_agents.scripted.players import PLAYERS
from khala_agents.worker import run_workers
from khala_protocol.bus import Delivery
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.commandline import say
from khala_protocol.common_names import agent_name
from khala_protocol.configfile import words_of
from khala_protocol.errors import BusError, ConfigError
from khala_protocol.garbage import tidy_memory
from khala_protocol.joining import client_config
from khala_protocol.keys import Topic, agent_key, check_name
from khala_protocol.signals import stop_on_signal
from khala_protocol.trust import trust_named

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
    from pathlib import Path

    from khala_agents.policy import Policy
    from khala_agents.worker import WorkerTally
    from khala_protocol.bus import Bus
    from khala_protocol.bus.config import BusConfig
    from khala_protocol.messages import Usage

T = TypeVar("T")

PATIENCE_S = 10.0
"""So long agents wait for a host before they say so."""


class Link(NamedTuple):
    """One session on the bus, and the agents that share it."""

    config: BusConfig
    names: Sequence[str]


@dataclass(frozen=True, slots=True)
class BusPlace:
    """Where the bus is, and with which certificates agents join it."""

    connect: Sequence[str] = ()
    tls: Path | None = None
    insecure: bool = False

    def links(self, side: str, names: Iterable[str]) -> list[Link]:
        """Return the sessions for these agents: with TLS one each, as each has a certificate of its own.

        Raises:
            ConfigError: an agent has no certificate.
            BusError: an endpoint or a certificate is wrong.
        """
        if self.tls is None:
            return [Link(client_config(self.connect, tls=None, insecure=self.insecure), list(names))]

        def link(name: str) -> Link:
            mine = (agent_name(side, name),)
            return Link(client_config(self.connect, tls=self.tls, names=mine, insecure=self.insecure), [name])

        return [link(name) for name in names]


def play(
    file: AgentsFile,
    run: str,
    side: str,
    place: BusPlace,
    *,
    budget_usd: float | None,
    ledger: Path | None,
    overrides: Mapping[str, str | float | None],
    as_json: bool,
) -> None:
    """Play the agents of a file until the run is over or a signal arrives, and print what they did."""
    check_name(run, "run")
    check_name(side, "side")
    limit_usd = budget_usd if budget_usd is not None else file.budget_usd
    budget = SharedBudget(limit_usd, ledger=MoneyLedger(ledger), account=side, source=f"the budget of side {side}")
    workshop = Workshop(budget=budget, overrides=overrides)
    policies = {name: workshop.policy(spec) for name, spec in file.agents.items()}
    links = place.links(side, policies)
    tallies = _until_signal(lambda stop: _play(links, run, side, policies, stop))
    if as_json:
        typer.echo(json.dumps({"run": run, "agents": {name: _plain(tally) for name, tally in tallies.items()}}))
    else:
        for name, tally in tallies.items():
            _say(_sentence(name, tally))


def serve(
    *,
    host: str,
    port: int,
    latency_s: float,
    faults: Sequence[str],
    retry_after_s: float,
    seed: int,
    ready_file: Path | None,
    as_json: bool,
) -> None:
    """Serve the scripted model until a signal arrives."""
    dice = InjectedFaults(parse_faults(faults), seed=seed)
    behaviour = Behaviour(latency_s=latency_s, faults=dice, retry_after_s=retry_after_s, seed=seed)
    _until_signal(lambda stop: _serve(Endpoint(behaviour, host=host, port=port), stop, ready_file, as_json=as_json))


# --- agent ------------------------------------------------------------------------------------------


def specs(
    names: Sequence[str],
    *,
    model: str | None,
    policy: str | None,
    memory: str | None,
    path: Path | None,
    fallback: str | None = None,
    rethink: int = 0,
) -> AgentsFile:
    """Return the agents that the command line describes, by a file or one by one.

    Raises:
        ConfigError: the command line says both, or nothing, or the file is wrong.
    """
    if path is not None:
        if names or model or policy or fallback or rethink:
            fault = "a file of agents says all: leave out NAMES, --model, --policy, --fallback and --rethink"
            raise ConfigError(fault, source="--agents")
        return load_agents(path)
    if not names:
        raise ConfigError("say which agents to play, or give a file with --agents: khala agent NAME… --run RUN")
    if model and policy:
        raise ConfigError("an agent decides with a model or with a policy: give --model or --policy, not both")
    if policy and (fallback or rethink):
        option = "--fallback" if fallback else "--rethink"
        raise ConfigError(f"{option} is for agents with a model: leave it out, or --policy")
    trust_named(policy, fallback)
    default = _with_model(model or "scripted", memory, fallback, rethink)
    spec = WorkerSpec(policy=policy) if policy else default
    return AgentsFile(agents={check_name(name, "agent"): spec for name in names})


def _with_model(model: str, memory: str | None, fallback: str | None, rethink: int) -> WorkerSpec:
    fields = {"model": model, "fallback": fallback, "rethink": rethink} | ({} if memory is None else {"memory": memory})
    try:
        return WorkerSpec.model_validate(fields)
    except ValidationError as error:
        raise ConfigError(words_of(error.errors(include_url=False)[0]), source="--memory") from None


async def _play(
    links: Sequence[Link], run: str, side: str, policies: dict[str, Policy], stop: asyncio.Event
) -> dict[str, WorkerTally]:
    await _check(policies.values())
    where = ", ".join(links[0].config.connect_to)
    async with AsyncExitStack() as stack:
        buses = [await _open(link, stack) for link in links]
        of = {name: bus for bus, link in zip(buses, links, strict=True) for name in link.names}
        _say(f"{', '.join(policies)} on side {side} of run {run}: waiting for the host at {where}")
        tidy_memory()
        async with asyncio.TaskGroup() as group:
            playing = [
                group.create_task(run_workers(bus, run, side, {n: policies[n] for n in link.names}, stop=stop))
                for bus, link in zip(buses, links, strict=True)
            ]
            waiting = group.create_task(_say_if_nobody_comes(of, run, side, where))
            await asyncio.wait(playing)
            waiting.cancel()
    return {name: tally for task in playing for name, tally in task.result().items()}


async def _open(link: Link, stack: AsyncExitStack) -> Bus:
    bus = await open_bus(link.config)
    stack.push_async_callback(bus.close)
    return bus


async def _say_if_nobody_comes(buses: Mapping[str, Bus], run: str, side: str, where: str) -> None:
    """Say who waits in vain, and for what: a misspelt name is not an error that anybody else could see.

    Args:
        buses: by name of the agent.
        run: name of the run.
        side: side of the agents.
        where: endpoints of the bus.
    """
    vain: list[str] = []

    async def wait(name: str, bus: Bus) -> None:
        briefings = await bus.subscribe(agent_key(run, side, name, Topic.BRIEFING), Delivery.STATE, depth=1)
        try:
            async with asyncio.timeout(PATIENCE_S):
                await anext(briefings)
        except TimeoutError:
            vain.append(name)
        except (BusError, StopAsyncIteration):
            pass  # the workers say so
        finally:
            await briefings.close()

    await asyncio.gather(*(wait(name, bus) for name, bus in buses.items()))
    if vain:
        _say(
            f"{', '.join(vain)} on side {side}: no host that knows them in run {run} has come to {where} within "
            f"{PATIENCE_S:g} s, and they wait on; are the names right? `khala tasks` lists those of agents"
        )


async def _check(policies: Iterable[Policy]) -> None:
    """Have each policy check itself before a host counts on it."""
    async with asyncio.TaskGroup() as group:
        for policy in policies:
            group.create_task(policy.check())


def _sentence(name: str, tally: WorkerTally) -> str:
    causes = ", ".join(f"{count} {why}" for why, count in tally.undecided.most_common())
    text = f"{name}: {tally.replies['ok']} decisions"
    text += f", {tally.undecided.total()} not its own ({causes})" if causes else ""
    if tally.usage.requests:
        text += f", {tally.usage.prompt_tokens} + {tally.usage.completion_tokens} tokens, {_price(tally.usage)}"
    return f"{text}; ended: {tally.ended}"


def _price(usage: Usage) -> str:
    return "price unknown" if usage.cost_usd is None else f"{usage.cost_usd:.4f} USD"


def _plain(tally: WorkerTally) -> dict[str, Any]:
    return {
        "replies": dict(tally.replies),
        "undecided": dict(tally.undecided),
        "superseded": tally.superseded,
        "usage": tally.usage.model_dump(),
        "ended": tally.ended,
    }


# --- llm --------------------------------------------------------------------------------------------


async def _serve(endpoint: Endpoint, stop: asyncio.Event, ready_file: Path | None, *, as_json: bool) -> None:
    async with endpoint:
        tidy_memory()
        ready = json.dumps({"base_url": endpoint.base_url, "pid": os.getpid(), "models": list(PLAYERS)})
        _say(f"scripted models {', '.join(PLAYERS)} at {endpoint.base_url}")
        if ready_file is not None:
            _write_whole(ready_file, ready)
        if as_json:
            say(ready)
        await stop.wait()
        _say(f"{endpoint.requests} requests were answered")


def _write_whole(path: Path, text: str) -> None:
    """Write a file so that no reader sees half of it."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", source=str(path)) from None


# --- both -------------------------------------------------------------------------------------------


def _until_signal(work: Callable[[asyncio.Event], Coroutine[Any, Any, T]]) -> T:
    """Run `work` with an event that SIGINT and SIGTERM set; a second signal ends the process at once."""

    async def main() -> T:
        return await work(stop_on_signal())

    return asyncio.run(main())


def _say(text: str) -> None:
    say(text, err=True)
