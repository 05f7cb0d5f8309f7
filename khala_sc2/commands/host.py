"""The work of `khala host` and `khala doctor`, and the end of `khala run`, which `khala_sc2.commands.run` begins.

`khala_sc2.cli` above has the options. It imports this module only to run a command: tasks and messages take half a second
to import, and `--help` need not wait for that.
"""

from __future__ import annotations

import asyncio
import json
import signal
from collections import Counter
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table
from rich.text import Text

from khala_orchestrator.commands import access_rules
from khala_orchestrator.console import Progress, print_table, stderr_console
from khala_protocol.errors import ConfigError
from khala_protocol.joining import client_config, router_config
from khala_protocol.signals import cancelled_by_signal
from khala_protocol.visible import visible_line
from khala_sc2.commands.exit_codes import DONE, FAILED, NOT_VALID, SIGNALLED

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Coroutine, Iterator, Sequence
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.bus.config import BusConfig
    from khala_protocol.messages import Result, Wire


def bus_of(
    match: MatchConfig, connect: list[str] | None, listen: list[str] | None, tls: Path | None, *, insecure: bool
) -> BusConfig:
    """Return how the host of a match joins the bus, or is its router."""
    if connect and listen:
        raise ConfigError("a host has a router or is one: give --connect or --listen, not both")
    if listen:
        rules = access_rules([match.task], match.run) if tls else None
        return router_config(listen, tls=tls, insecure=insecure, rules=rules)
    return client_config(connect or (), tls=tls, names=("host",), insecure=insecure)


def until_interrupted(
    config: MatchConfig, as_json: bool, play: Callable[[Callable[[Wire], None]], Coroutine[Any, Any, list[Result]]]
) -> None:
    """Play with a live picture, print the results, and end in order on SIGINT and SIGTERM."""
    with Progress(stderr_console(), config.task.max_steps) as progress:
        results = asyncio.run(cancelled_by_signal(play(progress)))
    end(config, results, as_json=as_json)


def end(config: MatchConfig, results: list[Result] | signal.Signals, *, as_json: bool) -> None:
    """Print the results of a match, or that a signal ended it, and exit with the code for it."""
    screen = stderr_console()
    if isinstance(results, signal.Signals):
        screen.print(f"interrupted; what was played is in {config.record}", soft_wrap=True)
        raise typer.Exit(SIGNALLED + results)
    screen.print(f"recorded: `khala replay {config.record}` tells it", soft_wrap=True)
    if as_json:
        plain = [result.model_dump(mode="json") for result in results]
        typer.echo(json.dumps({"run": config.run, "recording": str(config.record), "results": plain}))
    for line in win_rates(results):
        screen.print(visible_line(line), soft_wrap=True)
    reasons = list(reasons_not_valid(results))
    idle = without_orders(results, talkers=_without_teams(config))
    said = f"no order of {', '.join(idle)} was carried out" if idle else ""
    if reasons:
        words = visible_line("; ".join([*reasons, *filter(None, [said])]))
        screen.print(Text.assemble(("not valid:", "bold red"), f" {words}"), soft_wrap=True)
        raise typer.Exit(NOT_VALID)
    if said:
        screen.print(Text(said, "yellow"), soft_wrap=True)


def win_rates(results: Sequence[Result]) -> Iterator[str]:
    """Yield for each side how many of several episodes it won; those that are not valid do not count."""
    sides = dict.fromkeys(result.side for result in results)
    for side in sides:
        of_side = [result for result in results if result.side == side]
        valid = [result for result in of_side if result.valid]
        if len(of_side) < 2:
            continue
        won = sum(result.outcome == "win" for result in valid)
        share = f" ({100 * won / len(valid):.0f} %)" if valid else ""
        others = f", {left} not valid" if (left := len(of_side) - len(valid)) else ""
        yield f"{f'{side}: ' if len(sides) > 1 else ''}won {won} of {len(valid)} episodes{share}{others}"


def _without_teams(config: MatchConfig) -> set[tuple[str, str]]:
    """Return the agents, by side and name, that command no units and only talk."""
    return {(task.side, agent.name) for task in config.task.per_side() for agent in task.agents if not agent.teams}


def without_orders(results: Sequence[Result], *, talkers: Collection[tuple[str, str]] = ()) -> list[str]:
    """Return the agents that were asked, and none of whose orders was carried out in any whole episode.

    Args:
        results: of all episodes and sides.
        talkers: agents, by side and name, that have nothing to order.
    """
    sides = {result.side for result in results}
    orders: Counter[str] = Counter()
    for result in results:
        for name in result.statuses if result.outcome != "aborted" else ():
            if (result.side, name) in talkers:
                continue
            orders[name if len(sides) == 1 else f"{result.side}/{name}"] += result.accepted_of.get(name, 0)
    return [name for name, count in orders.items() if not count]


def reasons_not_valid(results: Sequence[Result]) -> Iterator[str]:
    """Yield each reason once, after the name of the side if it is not every side's."""
    sides: dict[str, list[str]] = {}
    for result in results:
        if not result.valid and result.side not in sides.setdefault(result.invalid_because, []):
            sides[result.invalid_because].append(result.side)
    every = {result.side for result in results}
    for reason, those in sides.items():
        yield reason if every == set(those) else f"{', '.join(those)}: {reason}"


def doctor(tls: Path | None, game: str | None, *, as_json: bool) -> None:
    """Look at this machine, start a game if one is named, and print what was found."""
    from khala_sc2.commands.doctor import examine  # noqa: PLC0415  # PySC2 and the game, which a match needs later

    findings = list(examine(tls, game))
    wrong = any(finding.state == "wrong" for finding in findings)
    if as_json:
        typer.echo(json.dumps({"ok": not wrong, "findings": [finding.as_dict() for finding in findings]}))
    else:
        marks = {"ok": "green", "note": "yellow", "wrong": "red"}
        table = Table(box=None, pad_edge=False, show_header=False)
        for finding in findings:
            state, advice = Text(finding.state, marks[finding.state]), Text(finding.advice, "dim")
            table.add_row(state, finding.name, finding.found, advice)
        print_table(table)
    raise typer.Exit(FAILED if wrong else DONE)
