"""The work of `khala openenv`: the server that its options describe."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from khala_agents.build import load_attribute
from khala_orchestrator.config import load_task
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError
from khala_protocol.listening import bind
from khala_protocol.trust import trust_named
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from openenv.core.rubrics import Rubric

    from khala_sc2.openenv.settings import ServerSettings


@dataclass(frozen=True, slots=True)
class WantedServer:
    """What the command line says; names are those of its options."""

    task: str
    host: str
    port: int
    sessions: int
    idle_s: float
    others: str
    allow: Sequence[str]
    rubric: str | None
    game: str
    out: Path | None
    is_open: bool = False


def run_openenv(wanted: WantedServer) -> None:
    """Serve until a signal comes.

    Raises:
        ConfigError: an option is wrong, or OpenEnv is not installed.
    """
    try:
        import uvicorn  # noqa: PLC0415  # of the extra `openenv`, as all below it

        from khala_sc2.openenv.server import app_of, openenv_door, server_config  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"there is no module {error.name}: pip install 'khala-sc2[openenv]'", source="khala openenv"
        ) from None
    door = openenv_door(wanted.host, is_open=wanted.is_open)
    app = app_of(settings_of(wanted), sessions=wanted.sessions, idle_s=wanted.idle_s, door=door)
    with bind(wanted.host, wanted.port) as listening:
        login = f"khala:{door.token}@" if door.token else ""
        say(f"http://{login}{wanted.host}:{listening.getsockname()[1]}", err=True)
        uvicorn.Server(server_config(app, sessions=wanted.sessions, timeout_graceful_shutdown=5)).run(
            sockets=[listening]
        )


def settings_of(wanted: WantedServer) -> ServerSettings:
    """Return what the server decides.

    Raises:
        ConfigError: there is no such task, model, policy or rubric.
    """
    from khala_sc2.openenv.rubrics import Battle  # noqa: PLC0415  # of the extra `openenv`
    from khala_sc2.openenv.settings import ServerSettings  # noqa: PLC0415

    load_task(wanted.task)
    trust_named(wanted.others, *wanted.allow)
    for name in {wanted.others, *wanted.allow}:
        Minds().with_name(name).check()
    rubric = Battle if wanted.rubric is None else rubric_of(wanted.rubric)
    return ServerSettings(wanted.task, wanted.others, wanted.allow, rubric, wanted.game, wanted.out)


def rubric_of(name: str) -> Callable[[], Rubric]:
    """Return what makes the rubric at `module:name` for each session.

    Raises:
        ConfigError: there is none, or it makes something else.
    """
    from openenv.core.rubrics import Rubric  # noqa: PLC0415  # of the extra `openenv`

    source = f"rubric {name}"
    module, _, attribute = name.partition(":")
    if not module or not attribute:
        raise ConfigError("write module:name, such as my_rewards:Mine", source=source)
    trust_named(name)
    made = load_attribute(module, attribute, source=source)
    if not callable(made) or isinstance(made, Rubric):
        raise ConfigError("give a class or a function that makes a rubric: each session has its own", source=source)
    if not isinstance(made(), Rubric):
        raise ConfigError("it makes no openenv.core.rubrics.Rubric", source=source)
    return partial(made)
