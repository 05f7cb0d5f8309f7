"""Files that name code: a task, a recording, an order or an experiment, of one side and of two, at every door.

The code is a module in the current directory that leaves a file behind when it is imported, and a command that does so.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import sys
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import yaml

from bench.doors.rows import Row
from bench.paths import GOLDEN
from khala_configs import CONFIGS
from khala_protocol.codec import decode, encode
from khala_protocol.errors import KhalaError
from khala_protocol.messages import Run
from khala_protocol.recording import Recorder, Recording
from khala_protocol.service import Submit
from khala_sc2.service.orders import match_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    Json = dict[str, Any]

MODULE: Final = "open('it-ran', 'w').close()\n"
SECTIONS: Final = ["foreign_code:mine"]
PATIENCE_S: Final = 60.0
LISTENS: Final = b"http://"
"""A command that prints an address has opened its door, and imported what it would: it is ended."""
SIDES: Final = {"one side": "llm_smac/2s3z_pair.yaml", "two sides": "duels/duel_3m.yaml"}


def _forged_task(sides: str) -> Json:
    """Return a task whose agents all read a section of the module."""
    task: Json = yaml.safe_load((CONFIGS / "tasks" / SIDES[sides]).read_text(encoding="utf-8"))
    return _forge(task)


def _forge(task: Json) -> Json:
    for side in (task, *task.get("sides", ())):
        if side.get("agents"):
            side["agents"] = [agent | {"sections": SECTIONS} for agent in side["agents"]]
    return task


def _write_task(directory: Path, sides: str) -> str:
    path = directory / "task.yaml"
    path.write_text(yaml.safe_dump(_forged_task(sides)), encoding="utf-8")
    return path.name


def _write_recording(directory: Path, sides: str) -> str:
    """Write the recording of a match that was interrupted, with a forged run card."""
    path = directory / "runs" / "forged" / "recording.mcap"
    path.parent.mkdir(parents=True)
    with Recorder(path) as recorder:
        for sample in Recording.open(GOLDEN):
            message = decode(sample.payload) if sample.is_of(Run) else None
            if isinstance(message, Run):
                task = dict(_forged_task(sides)) if sides == "two sides" else _forge(dict(message.config))
                recorder.write(sample.key, encode(message.but(config=task)))
            elif not sample.key.endswith("/result"):
                recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
    return str(path.relative_to(directory))


def _write_experiment(directory: Path, sides: str) -> str:
    """Write an experiment whose task names the module, and whose player is code."""
    experiment = {
        "name": "forged",
        "fixed": {"task": _write_task(directory, sides)},
        "factors": {"model": ["foreign_code:decide"]},
    }
    (directory / "forged.yaml").write_text(yaml.safe_dump(experiment), encoding="utf-8")
    kept = directory / "experiments" / "forged"
    kept.mkdir(parents=True)
    shutil.copyfile(directory / "forged.yaml", kept / "experiment.yaml")
    return "forged.yaml"


def _write_agents(directory: Path, sides: str) -> str:
    side_agents = {"one side": ["Stalkers"], "two sides": ["Marines", "Stalkers"]}[sides]
    agents = {name: {"policy": "foreign_code:decide"} for name in side_agents}
    (directory / "agents.yaml").write_text(yaml.safe_dump({"agents": agents}), encoding="utf-8")
    return "agents.yaml"


DOORS: Final[tuple[tuple[str, str, Callable[[Path, str], str], tuple[str, ...]], ...]] = (
    ("khala run", "a task", _write_task, ("run", "FILE", "--max-steps", "1")),
    ("khala run", "a recording", _write_recording, ("run", "--resume", "FILE")),
    ("khala host", "a task", _write_task, ("host", "FILE", "--assemble", "0.5")),
    ("khala host", "a recording", _write_recording, ("host", "--resume", "FILE", "--assemble", "0.5")),
    ("khala agent", "an agents file", _write_agents, ("agent", "--agents", "FILE", "--run", "r")),
    ("khala submit", "a task", _write_task, ("submit", "FILE")),
    ("khala replay", "a recording", _write_recording, ("replay", "FILE")),
    ("khala fork", "a recording", _write_recording, ("fork", "FILE", "--at", "1")),
    ("khala mcp", "a task", _write_task, ("mcp", "FILE")),
    ("khala openenv", "a task", _write_task, ("openenv", "FILE", "--port", "0")),
    ("khala view", "a recording", _write_recording, ("view", "FILE", "--export", "page.html")),
    ("khala dataset export", "a recording", _write_recording, ("dataset", "export", "FILE", "--out", "data")),
    ("khala experiment run", "an experiment", _write_experiment, ("experiment", "run", "FILE")),
    ("khala experiment resume", "an experiment", _write_experiment, ("experiment", "resume", "forged")),
    ("khala experiment show", "an experiment", _write_experiment, ("experiment", "show", "FILE")),
    ("khala experiment status", "an experiment", _write_experiment, ("experiment", "status", "forged")),
    ("khala experiment index", "an experiment", _write_experiment, ("experiment", "index", "forged")),
    ("khala experiment report", "an experiment", _write_experiment, ("experiment", "report", "forged")),
    ("khala experiment export", "an experiment", _write_experiment, ("experiment", "export", "forged", "--csv", "x")),
    ("khala experiment compare", "an experiment", _write_experiment, ("experiment", "compare", "forged", "forged")),
)  # fmt: skip


async def _at_the_command(
    directory: Path, write: Callable[[Path, str], str], sides: str, arguments: tuple[str, ...]
) -> str:
    file = write(directory, sides)
    (directory / "foreign_code.py").write_text(MODULE, encoding="utf-8")
    words = [file if word == "FILE" else word for word in arguments]
    environ = {name: value for name, value in os.environ.items() if name != "KHALA_TRUST"}
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "khala_sc2", *words, cwd=directory, env=environ, start_new_session=True,
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    said = b""
    assert process.stdout is not None
    try:
        async with asyncio.timeout(PATIENCE_S):
            async for line in process.stdout:
                said += line
                if LISTENS in line:
                    break
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()
    if (directory / "it-ran").exists():
        return "the code ran"
    return f"it ended in a traceback: {said.decode()[-200:]}" if b"Traceback" in said else ""


async def _at_the_service(directory: Path, sides: str) -> str:
    """Order a match of a service that was started without --trust."""
    (directory / "foreign_code.py").write_text(MODULE, encoding="utf-8")
    sys.path.insert(0, str(directory))
    try:
        order = Submit(number="1", run="forged", match={"task": _forged_task(sides)}, minds={})
        match_of(order, directory, trusts=False)
    except KhalaError:
        pass
    else:
        return "the order was taken"
    finally:
        sys.path.remove(str(directory))
    return "the code ran" if "foreign_code" in sys.modules else ""


def _rows() -> Iterator[Row]:
    for door, what, write, arguments in DOORS:
        for sides in SIDES:
            play = partial(_at_the_command, write=write, sides=sides, arguments=arguments)
            yield Row(door, f"{what} of {sides} that names code", play)
    for sides in SIDES:
        yield Row("khala serve", f"an order of {sides} that names code", partial(_at_the_service, sides=sides))


ROWS: Final[tuple[Row, ...]] = tuple(_rows())
