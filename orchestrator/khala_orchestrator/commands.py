"""The work of `khala router`, `khala tasks` and `khala replay`.

`khala_orchestrator.cli` above has the options. It imports this module only to run a command: tasks, recordings and the
bus take half a second to import, and `--help` need not wait for that.
"""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.padding import Padding
from rich.text import Text

from khala_orchestrator.config import all_tasks, load_task
from khala_orchestrator.console import stderr_console, stdout_console
from khala_orchestrator.past.places import recording_of
from khala_orchestrator.past.transcript import StepSelection, save_pictures, summary, transcript
from khala_protocol.bus.zenoh import open_bus, probe
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.joining import client_config, router_config
from khala_protocol.messages import ModelCall
from khala_protocol.recording import Recording, recover
from khala_protocol.signals import stop_on_signal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.task.config import TaskConfig
    from khala_protocol.bus.config import BusConfig

CHECK_S = 2.0
RUNS = Path("runs")
"""Where `khala run` records."""


def check_router(connect: str | None, *, tls: Path | None, insecure: bool, as_json: bool) -> None:
    """Ask whether a router answers."""
    config = client_config([connect] if connect else [], tls=tls, insecure=insecure, timeout_s=CHECK_S)
    routers = asyncio.run(_probe(config))
    (endpoint,) = config.connect_to
    _out({"endpoint": endpoint, "routers": routers}, f"a router answers at {endpoint}", as_json=as_json)


def route(
    listen: Sequence[str],
    *,
    tls: Path | None,
    names_of_tasks: Sequence[str],
    run: str | None,
    insecure: bool,
    as_json: bool,
) -> None:
    """Be a router until a signal arrives."""
    if tls and not names_of_tasks:
        raise ConfigError("with --tls only agents of a task may join: give --task TASK")
    rules = access_rules([load_task(name) for name in names_of_tasks], run) if tls else None
    config = router_config(listen, tls=tls, insecure=insecure, rules=rules)
    asyncio.run(_route(config, as_json=as_json))


def access_rules(tasks: Sequence[TaskConfig], run: str | None) -> dict[str, Any]:
    """Return the settings of a router that the agents and advisers of these tasks may join."""
    from khala_protocol.access import router_settings  # noqa: PLC0415  # 60 ms, which links without TLS do without

    sides = [side for task in tasks for side in task.per_side()]
    agents = {(side.side, agent.name) for side in sides for agent in side.agents}
    advisers = {(side.side, adviser.name) for side in sides for adviser in side.advisers}
    return router_settings(agents, run, advisers=advisers)


def list_tasks(*, as_json: bool) -> None:
    """List what can be played."""
    found = list(all_tasks())
    if as_json:
        rows = [
            {
                "name": t.name,
                "map": t.map_spec.name,
                "agents": [card.name for card in t.cards()],
                "opponent": t.against,
                "description": t.description,
            }
            for t in found
        ]
        typer.echo(json.dumps({"tasks": rows}))
        return
    console = stdout_console()
    for task in found:
        names = dict.fromkeys(card.name for card in task.cards())  # those of two sides may have the same
        console.print(Text.assemble((task.name, "bold"), "  ", (people(list(names)), "dim")))
        console.print(Padding(task.description, (0, 0, 0, 4), expand=False))


def people(names: Sequence[str]) -> str:
    """Return the names of agents, grouping those that only differ by a number: `Commander, CombatGroup1 2 5`."""
    groups: dict[str, list[str]] = {}
    for name in names:
        stem = name.rstrip("0123456789")
        groups.setdefault(stem, []).append(name.removeprefix(stem))
    return ", ".join(f"{stem}{' '.join(numbers)}" for stem, numbers in groups.items())


def replay(
    given: Sequence[Path],
    *,
    agent: str | None,
    steps: str | None,
    text: bool,
    images: Path | None,
    new: Path | None,
    pace: bool,
    as_json: bool,
) -> None:
    """Show what was said and done in recorded runs."""
    selection = StepSelection.of(agent, steps)
    if len(given) > 1 and (images is not None or new is not None):
        raise ConfigError(f"the files of {len(given)} recordings would be mixed: name one")
    for name in given or (RUNS,):
        file = recording_of(name, RUNS)
        if file != name or len(given) > 1:
            stderr_console().print(Text(str(file)), style="bold", soft_wrap=True)
        _replay(file, selection, text=text, images=images, new=new, pace=pace, as_json=as_json)


def _replay(
    file: Path,
    selection: StepSelection,
    *,
    text: bool,
    images: Path | None,
    new: Path | None,
    pace: bool,
    as_json: bool,
) -> None:
    recording = Recording.open(file)
    if not recording.complete:
        stderr_console().print(Text(_damage(recording)), style="yellow", soft_wrap=True)
    for key, words in recording.left_out.items():
        stderr_console().print(Text(f"left out of {key}: {words}"), style="yellow", soft_wrap=True)
    if new is not None:
        whole = recover(file, new)
        data = {"recording": str(new), "samples": whole.samples, "complete": recording.complete}
        _out(data, f"{new} holds the {whole.samples} samples of {file} that can be read", as_json=as_json)
        return
    if images is not None:
        saved = save_pictures(file, selection, images)
        data = {"pictures": [str(path) for path in saved]}
        _out(data, f"{len(saved)} pictures are in {images}", as_json=as_json)
        return
    if pace:
        _paces(recording, as_json=as_json)
        return
    if as_json:
        typer.echo(
            json.dumps(summary(file, selection) | {"complete": recording.complete, "left_out": recording.left_out})
        )
        return
    console = stdout_console()
    for part in transcript(file, selection, whole=text):
        console.print(part, soft_wrap=isinstance(part, Text))


def _paces(recording: Recording, *, as_json: bool) -> None:
    from khala_orchestrator.past.measured_pace import measured_paces, yaml  # noqa: PLC0415  # numpy, for this alone

    found = list(measured_paces(recording.of(ModelCall)))
    if not found:
        raise RecordingError(f"{recording.path} has no answer of a model, and the pace is measured from answers")
    if as_json:
        typer.echo(json.dumps({"paces": [row._asdict() | {"pace": row.pace.model_dump()} for row in found]}))
        return
    say("\n".join(map(yaml, found)).removesuffix("\n"))


async def _probe(config: BusConfig) -> list[str]:
    return list(await probe(config))


async def _route(config: BusConfig, *, as_json: bool) -> None:
    stop = stop_on_signal()
    bus = await open_bus(config)
    try:
        _out({"endpoints": bus.endpoints}, f"router at {', '.join(bus.endpoints)}; Ctrl-C ends it", as_json=as_json)
        await stop.wait()
    finally:
        await bus.close()


def _damage(recording: Recording) -> str:
    where = f"after its sample {recording.samples}" if recording.samples else "before its first sample"
    return f"{recording.path} is torn or damaged {where}; --recover NEW writes what can be read as a whole recording"


def _out(data: dict[str, Any], sentence: str, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(data))
    else:
        stderr_console().print(sentence, soft_wrap=True)
