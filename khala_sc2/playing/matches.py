"""The match that options describe: a new one, or what is left of one whose host was lost; and where it is recorded.

Above: `khala run`, `khala host` and `khala submit`, which take the same options, and the workers of `khala serve`.
"""

from __future__ import annotations

import itertools
import os
import re
import shlex
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from khala_bridge.observe import Observer
from khala_bridge.task.code import code_of
from khala_orchestrator.config import MatchConfig, change, load_task, new_run_name
from khala_orchestrator.past.resume import read_unfinished
from khala_protocol.configfile import words_of
from khala_protocol.errors import ConfigError
from khala_protocol.keys import check_name
from khala_protocol.recording import Recording
from khala_protocol.trust import check_trusted, trust

if TYPE_CHECKING:
    from pathlib import Path

    from khala_orchestrator.past.resume import Unfinished


_TRY = re.compile(r"recording(?:-([0-9]{1,9}))?\.mcap")


def new_or_resumed(
    task: str | None, resume: Path | None, run: str | None, out: Path, **given: Any
) -> tuple[MatchConfig, Unfinished | None]:
    """Return the match that the options describe, and what was played of it.

    Raises:
        ConfigError: an option or a file is wrong, or says something else than the recording.
        RecordingError: there is nothing to go on with.
    """
    if resume is None:
        if task is None:
            raise ConfigError("give a task, such as 2s3z_pair (`khala tasks` lists them), or a recording with --resume")
        return new(task, run, out, **given), None
    config, past = resume_match(resume, out, assemble_s=given["assemble_s"])
    refuse_others(config, task=task, run=run, **given)
    return config, past


def refuse_others(config: MatchConfig | None, **given: Any) -> None:
    """Refuse options that contradict the resumed match.

    Args:
        config: the match; None if it is not known here, and no option can be seen to say the same.
        given: by the names that `new` takes; None for an option that was left out. How long a match waits for its
            agents at the start may change.

    Raises:
        ConfigError: there are some; the text names them all.
    """
    others = [
        f"{_option(name)} {value}"
        for name, value in given.items()
        if name != "assemble_s" and value is not None and (config is None or not _says(config, name, value))
    ]
    if others:
        raise ConfigError(f"a resumed match keeps its options: leave out {', '.join(others)}, or begin a new one")


def _option(name: str) -> str:
    """Return what a user calls an option: the units of its value are no part of that."""
    named = {"task": "the task", "rule": "--clock"}
    return named.get(name, f"--{name.removesuffix('_s').replace('_', '-')}")


def _says(config: MatchConfig, name: str, value: object) -> bool:
    if name == "task":
        return value == config.task.name
    if name in MatchConfig.model_fields:
        return bool(getattr(config, name) == value)
    try:
        return change(config.task, **{name: value}) == config.task
    except ConfigError:  # the option does not go with the others of the match
        return False


def new(task: str, run: str | None, out: Path, **given: Any) -> MatchConfig:
    """Return the match that the options describe; its recording is in its own directory below `out`."""
    match = {name: value for name in ("seed", "episodes", "assemble_s") if (value := given.pop(name)) is not None}
    loaded = change(load_task(task), **given)
    if given.get("opponent"):
        trust(shlex.join(loaded.opponent.command))  # the user has named it
    check_trusted(code_of(loaded), source=task)
    Observer(loaded)  # report an unknown section before a game is started
    name = check_name(run or new_run_name(loaded.name), "run")
    try:
        return MatchConfig(task=loaded, run=name, record=free_recording(out / name), **match)
    except ValidationError as error:
        raise ConfigError(words_of(error.errors(include_url=False)[0]), source="command line") from None


def resume_match(path: Path, out: Path, *, assemble_s: float) -> tuple[MatchConfig, Unfinished]:
    """Return the match of a recording, or of the newest one in the directory of a run, and what was played of it."""
    past = read_unfinished(newest_recording(_run_at(path, out)))
    changes = {"record": free_recording(out / past.config.run), "assemble_s": assemble_s}
    return past.config.model_copy(update=changes), past


def _run_at(path: Path, out: Path) -> Path:
    """Return the path of a recording or of a run, which may also be named as it is below `out`."""
    if path.exists():
        return path
    if (out / path).is_dir():
        return out / path
    raise ConfigError(f"there is no {path}, and no {out / path}: give a run, its directory, or a .mcap file")


def newest_recording(path: Path) -> Recording:
    """Return the recording at a path, or the newest one with a run card in the directory of a run."""
    if not path.is_dir():
        return Recording.open(path)
    found = tries_in(path)
    if not found:
        raise ConfigError(f"there is no recording in {path}: give the directory of a run, or a .mcap file")
    for file in reversed(found):
        if (recording := Recording.open(file)).run is not None:
            return recording
    return Recording.open(found[-1])


def tries_in(directory: Path) -> list[Path]:
    """Return the recordings of a match, as `free_recording` numbers them; when a file was copied says nothing."""
    found = ((_TRY.fullmatch(path.name), path) for path in directory.glob("recording*.mcap"))
    numbered = sorted((int(match[1] or 1), path) for match, path in found if match)
    return [path for _, path in numbered]


def free_recording(directory: Path) -> Path:
    """Return an unused file for the recording: containers, for example, start a run again under its name."""
    names = itertools.chain(["recording"], (f"recording-{number}" for number in itertools.count(2)))
    paths = (directory / f"{name}.mcap" for name in names)
    return next(path for path in paths if not os.path.exists(path))  # noqa: PTH110  # Path.exists raises where it may not look
