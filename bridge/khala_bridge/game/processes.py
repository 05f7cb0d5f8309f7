"""Processes of the game: started before the match is known, or left over from the match before.

A process has no map until a game is created in it, and takes any. Above: `khala_bridge.game.env`, whose environment
plays in one.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from typing import TYPE_CHECKING, Any, Protocol

from absl import flags

from khala_bridge.compat import remote_controller, run_configs
from khala_bridge.errors import GameError
from khala_bridge.game.game import check_install
from khala_bridge.game.ports import pick_port

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor
    from pathlib import Path

_environment = threading.RLock()
_THIS_MACHINE = "127.0.0.0/8,::1,localhost"
_LISTENS_AFTER_S = 0.2
"""The simulator listens 0.05 s after its start, 0.15 s on a busy machine. Who comes later waits for a second more."""


class Processes(Protocol):
    """Where a match gets the process of its game, and may leave it afterwards."""

    @property
    def threads(self) -> Executor | None:
        """The threads that games share; None if each game has a thread of its own."""

    def take(self, sc2path: Path) -> Any:
        """Return a process of this install that waits for a game, connected; None if there is none.

        Its taker ends it, unless `keep` takes it back.
        """

    def keep(self, process: Any, sc2path: Path) -> bool:
        """Have a process leave its game, and return True; return False if its taker is to end it."""

    def began(self) -> None:
        """Note that the match has its game, in a process from here or in another one."""


class Launched:
    """A process of the game that is there before its match is known, for one match.

    PySC2 tries to connect as soon as it has started a process, is refused, and sleeps for a second. Here it connects
    when the process is taken, which most often listens by then.
    """

    threads = None

    def __init__(self, sc2path: Path, environment: dict[str, str] | None = None) -> None:
        """Start the process; arguments and errors as in `GameConfig` and `PySC2Game`."""
        check_install(sc2path)
        settle_flags()
        with pointed_to(sc2path), explain_errors("the game could not be started"):
            run_config = run_configs.get()
            run_config.env = environment_of(run_config, environment)
            self._process: Any = run_config.start(want_rgb=False, connect=False, port=pick_port())
        self._sc2path = sc2path
        self._started_s = time.monotonic()

    def take(self, sc2path: Path) -> Any:
        """See `Processes`; the process is given once."""
        if sc2path != self._sc2path:
            return None
        process, self._process = self._process, None
        if process is None or not process.running:
            return None
        time.sleep(max(0.0, self._started_s + _LISTENS_AFTER_S - time.monotonic()))
        try:  # as `StarcraftProcess` does
            with no_proxy():
                process._controller = remote_controller.RemoteController(process.host, process.port, process)  # noqa: SLF001
        except BaseException:
            process.close()
            raise
        return process

    def keep(self, process: Any, sc2path: Path) -> bool:  # noqa: ARG002  # see `Processes`
        """Return False: it was for one match."""
        return False

    def began(self) -> None:
        """End the process, if nobody took it."""
        self.close()

    def close(self) -> None:
        """End the process, if nobody took it."""
        process, self._process = self._process, None
        if process is not None:
            process.close()


class IdleGames:
    """Keeps processes of the game from one match to the next.

    A new match of 2s3z sees its first observation after 0.06 s in a process that is there, and after 0.6 s in a new
    one; the game is the same (`tests/khala/test_one_process.py`). Threads may share it.
    """

    threads = None

    def __init__(self, most: int = 1) -> None:
        """Keep so many at most; each has the memory of a game, 70 MB with the simulator."""
        self._most = most
        self._idle: list[tuple[Path, Any]] = []
        self._lock = threading.Lock()
        self._closed = False

    def take(self, sc2path: Path) -> Any:
        """See `Processes`; the one that has waited least."""
        while True:
            with self._lock:
                found = next((idle for idle in reversed(self._idle) if idle[0] == sc2path), None)
                if found is None:
                    return None
                self._idle.remove(found)
            if found[1].running:
                return found[1]
            found[1].close()

    def keep(self, process: Any, sc2path: Path) -> bool:
        """See `Processes`; a game that cannot be left was not worth keeping."""
        if not (self._has_room and process.running):
            return False
        try:
            process.controller.leave()
        except Exception:  # noqa: BLE001  # those of PySC2 have no common base class
            return False
        with self._lock:  # again: the game took its time
            if has_room := self._has_room:
                self._idle.append((sc2path, process))
            return has_room

    def began(self) -> None:
        """Do nothing: what was not taken waits for another match."""

    def close(self) -> None:
        """End those that wait, and keep none from now on."""
        with self._lock:
            idle, self._idle, self._closed = self._idle, [], True
        for _, process in idle:
            process.close()

    @property
    def _has_room(self) -> bool:
        return not self._closed and len(self._idle) < self._most


def new_process(sc2path: Path, environment: dict[str, str] | None = None) -> Any:
    """Return a process of an install that was started just now, connected; its taker ends it.

    Raises:
        GameMissing: there is no game.
        GameError: it could not be started.
    """
    process = Launched(sc2path, environment).take(sc2path)
    if process is None:
        raise GameError("the game could not be started: it ended before it listened")
    return process


def environment_of(run_config: Any, environment: dict[str, str] | None) -> dict[str, str] | None:
    """Return the environment of a process of the game, in which it finds its libraries."""
    ours: dict[str, str] | None = run_config.env  # on Linux, with the libraries of the game
    if environment is None:
        return ours
    return environment | {name: (ours or {})[name] for name in ("LD_LIBRARY_PATH",) if name in (ours or {})}


def settle_flags() -> None:
    """Let PySC2 read its flags, whoever started this Python."""
    if not flags.FLAGS.is_parsed():  # PySC2 reads absl flags; it needs their defaults, not our command line
        flags.FLAGS.mark_as_parsed()


@contextlib.contextmanager
def pointed_to(directory: Path) -> Iterator[None]:
    """Point SC2PATH to this install; PySC2 reads it once, while it starts. It connects to its game directly."""
    with no_proxy(), _variable("SC2PATH", str(directory)):
        yield


@contextlib.contextmanager
def no_proxy() -> Iterator[None]:
    """Have PySC2 connect to a game on this machine directly.

    Its websocket-client takes a proxy of the environment even for 127.0.0.1, and then waits for an answer that no proxy
    can give. Names are added to `no_proxy`, so that whoever else reads it in the meantime finds what the user wrote.
    """
    with _environment:
        given = os.environ.get("no_proxy") or os.environ.get("NO_PROXY")
        with _variable("no_proxy", ",".join(filter(None, [given, _THIS_MACHINE]))):
            yield


@contextlib.contextmanager
def _variable(name: str, value: str) -> Iterator[None]:
    with _environment:
        before = os.environ.get(name)
        os.environ[name] = value
        try:
            yield
        finally:
            if before is None:
                del os.environ[name]
            else:
                os.environ[name] = before


@contextlib.contextmanager
def explain_errors(what: str) -> Iterator[None]:
    """Turn any exception of PySC2 into an error for the user; they have no common base class."""
    try:
        yield
    except GameError:
        raise
    except Exception as error:
        detail = " ".join(str(error).split()) or type(error).__name__
        raise GameError(f"{what}: {detail}") from error
