"""The interface of a game: reset it, play plans, close it.

`Game` is blocking, and one thread may use it. `GameThread` runs one in a thread of its own, so that a match can await
it, and ends it when it hangs. The implementation on PySC2 is `khala_bridge.game.pysc2_game`. No code above this module
knows whether it uses StarCraft II or Khala's simulator: they differ only in the directory in `GameConfig`.

Players are those that Khala plays, in the order of the configuration; a game returns a snapshot for each. `Sides` is
the game of a match: commands in, snapshots out.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import logging
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, Self, TypeVar

from pydantic import Field, model_validator

from khala_bridge.errors import GameHangs, GameMissing
from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.task.maps import MapSpec  # noqa: TC001  # pydantic evaluates it
from khala_bridge.task.opponent import Opponent
from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from concurrent.futures import Executor as Threads
    from types import TracebackType

    from khala_bridge.act import Command, Executor
    from khala_bridge.act.plan import Plan, PlanResult
    from khala_bridge.state import Snapshot

log = logging.getLogger(__name__)

T = TypeVar("T")

USUAL_PLACE = Path(
    {"win32": "C:/Program Files (x86)/StarCraft II", "darwin": "/Applications/StarCraft II"}.get(
        sys.platform, "~/StarCraftII"
    )
)
"""Where StarCraft II is on this platform, if SC2PATH is not set; PySC2 looks there as well."""


class GameConfig(Frozen):
    """Which game to start, and how."""

    sc2path: Path
    """Directory of the install, in the layout of StarCraft II; SC2PATH points to it while PySC2 looks for it."""
    map: MapSpec
    players: Literal[1, 2] = 1
    """That Khala plays: with 2, the second one plays the race of the opponent in place of the computer."""
    opponent: Opponent = Opponent()
    """Who plays against one player of Khala's."""
    realtime: bool = False
    """Whether the agents are ready for a game that goes on by itself, as one over LAN may."""
    seed: int | None = None
    """Of the first episode; the next ones count up from it. None: the game chooses."""
    screen_px: int = 128
    """Resolution of the feature layers of the screen, which shows 24 world units."""
    minimap_px: int = 64
    render_px: int | None = None
    """Resolution of the rendered pictures of the screen and the minimap, for a game that can draw; None for none."""
    limit_loops: int | None = None
    """Game loops after which an episode ends without a result; None: the map decides."""
    abilities: bool = True
    """Whether each observation says what every own unit can do now: a query of 1 ms for 30 units, 3 ms for 100."""
    start_timeout_s: int = 120
    """Time limit until the game listens."""
    environment: dict[str, str] | None = Field(default=None, repr=False)
    """Environment of the game's process; None: ours, with all that is in it."""

    @model_validator(mode="after")
    def _somebody_to_play(self) -> Self:
        if self.players == 2 and self.map.opponent is None:
            raise ValueError(f"the map {self.map.name} is played alone: it has no place for a second player")
        return self

    @property
    def camera_width(self) -> float:
        """World units that the screen shows."""
        return CAMERA_WIDTH


@dataclass(frozen=True, slots=True)
class GameIdentity:
    """Identity of the game, for the run card."""

    version: str
    """As the game says it, `4.10.0.75689`."""
    data_version: str
    map_file: str
    map_sha256: str
    opponent: str = ""
    """Who the opponent says it is, `guest bot Rush, zerg`; "" if the task knows it."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """The result of one player's plan."""

    snapshot: Snapshot
    played: PlanResult
    env_steps: int
    """Calls of `SC2Env.step` that the plan took; players share them."""


class Game(Protocol):
    """One game with its players. Every method blocks; errors are `khala_bridge.errors.GameError`."""

    @property
    def info(self) -> GameIdentity:
        """What plays."""

    def reset(self) -> tuple[Snapshot, ...]:
        """Begin an episode; return a snapshot for each player."""

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        """Play one plan of each player to its end, or to the end of the episode, which must not be over yet."""

    def whole(self) -> Snapshot | None:
        """Return the whole map as it is now, from the first player's place; None if the game does not show it.

        It is for those who watch. What the game tells a player only once must be in the snapshots before.
        """

    def kill(self) -> None:
        """End the game at once; the only method that another thread may call."""

    def close(self) -> None:
        """End the game in good order; may be called twice."""


@dataclass(frozen=True, slots=True)
class GamePatience:
    """How long a game may take to answer before it is taken to hang; what it has shown so far decides."""

    unknown_s: float = 120.0
    """To load a map and to play for the first time; the longest limit at all."""
    least_s: float = 10.0
    times_slowest: float = 20.0
    """Times the slowest step so far; steps grow with the armies, 3.5-fold in the first 177 on Simple64."""
    remark_s: float = 2.0
    """When a log line says that a step takes long, unless steps of half that time are usual here."""
    hangs: str = "the game"
    """What it is that does not answer then."""

    def against(self, opponent: Opponent) -> GamePatience:
        """Return it for a game whose opponent may take its time, too."""
        if not opponent.joins:
            return self
        wait_s = opponent.wait_s
        hangs = f"the game, or the {opponent.words}"
        return replace(self, unknown_s=self.unknown_s + wait_s, least_s=self.least_s + wait_s, hangs=hangs)

    def limit_s(self, slowest_s: float | None) -> float:
        """Return the limit for a step of a game whose slowest one took so long; None if there was none."""
        if slowest_s is None:
            return self.unknown_s
        return min(self.unknown_s, max(self.least_s, self.times_slowest * slowest_s))

    def remark_after_s(self, slowest_s: float | None) -> float:
        """Return after which time to remark on a step."""
        return max(self.remark_s, 2 * (slowest_s or 0.0))


class GameThread:
    """A game in a thread of its own; an async context manager.

    Entering it starts the game, leaving it closes the game. The calls are not reentrant: one at a time.
    """

    def __init__(
        self,
        start: Callable[[], Game],
        *,
        patience: GamePatience | None = None,
        give_up: Callable[[], None] = lambda: None,
        threads: Threads | None = None,
    ) -> None:
        """Prepare a game without starting it.

        Args:
            start: makes the game; runs in the thread.
            patience: longest time that one call may take before the game is ended and `GameHangs` is raised.
            give_up: ends the wait for a player, if the game is no longer wanted while it starts.
            threads: those that games in this process share, in place of a thread of its own.
        """
        self._start = start
        self._give_up = give_up
        self._patience = patience or GamePatience()
        self._slowest_s: float | None = None
        self._slowest_reset_s: float | None = None
        self._shares = threads is not None
        self._threads = threads or ThreadPoolExecutor(max_workers=1, thread_name_prefix="game")
        self._game: Game | None = None

    async def __aenter__(self) -> Self:
        """Start the game."""
        try:
            self._game = await asyncio.get_running_loop().run_in_executor(self._threads, self._start)
        except BaseException:
            self._give_up()
            self._leave_threads()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the game, or kill it if it does not close."""
        try:
            with contextlib.suppress(GameHangs):  # it is gone, as wanted
                await self._run(self._playing.close, self._patience.limit_s(self._slowest_s))
        finally:
            self._leave_threads()

    def _leave_threads(self) -> None:
        if not self._shares:
            self._threads.shutdown(wait=False)

    @property
    def info(self) -> GameIdentity:
        """What plays."""
        return self._playing.info

    async def reset(self) -> tuple[Snapshot, ...]:
        """Begin an episode; return a snapshot for each player."""
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        snapshots = await self._run(self._playing.reset, self._patience.limit_s(self._slowest_reset_s))
        self._slowest_reset_s = max(self._slowest_reset_s or 0.0, loop.time() - began_s)
        return snapshots

    async def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        """Play one plan of each player to its end, or to the end of the episode."""
        play = functools.partial(self._playing.act, plans)
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        remark_s = self._patience.remark_after_s(self._slowest_s)
        remark = loop.call_later(remark_s, log.warning, "%s has not answered for %g s", self._patience.hangs, remark_s)
        try:
            played = await self._run(play, self._patience.limit_s(self._slowest_s))
        finally:
            remark.cancel()
        self._slowest_s = max(self._slowest_s or 0.0, loop.time() - began_s)
        return played

    async def whole(self) -> Snapshot | None:
        """Return the whole map as it is now; None if the game does not show it."""
        return await self._run(self._playing.whole, self._patience.limit_s(self._slowest_s))

    @property
    def _playing(self) -> Game:
        assert self._game is not None, "the game is entered before it is used"
        return self._game

    async def _run(self, call: Callable[[], T], limit_s: float) -> T:
        work = asyncio.get_running_loop().run_in_executor(self._threads, call)
        work.add_done_callback(lambda done: done.exception())  # Ctrl-C ends the game too, when nobody waits for it
        try:
            async with asyncio.timeout(limit_s):
                return await asyncio.shield(work)
        except TimeoutError:
            self._give_up()
            self._playing.kill()
            await asyncio.wait([work])  # it fails soon: its process is gone
            work.exception()
            raise GameHangs(
                f"{self._patience.hangs} did not answer within {limit_s:g} s and was ended; "
                "try again, or another game or map"
            ) from None


class Sides:
    """A game in which Khala plays one side or more; an async context manager around its thread.

    Commands go in and snapshots come out by side, in the order of the executors.
    """

    def __init__(self, thread: GameThread, executors: Sequence[Executor]) -> None:
        """Take a game that is not entered yet, and an executor for each side."""
        self._thread = thread
        self._executors = tuple(executors)
        self._now: tuple[Snapshot, ...] = ()

    async def __aenter__(self) -> Self:
        """Start the game."""
        await self._thread.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the game."""
        await self._thread.__aexit__(kind, error, trace)

    @property
    def info(self) -> GameIdentity:
        """What plays."""
        return self._thread.info

    async def reset(self) -> tuple[Snapshot, ...]:
        """Begin an episode; return its first snapshots."""
        for executor in self._executors:
            executor.begin()
        self._now = await self._thread.reset()
        return self._now

    async def whole(self) -> Snapshot | None:
        """Return the whole map as it is now, for those who watch; None if the game does not show it."""
        return await self._thread.whole()

    async def act(self, commands: Sequence[Sequence[Command]], loops: int) -> tuple[StepResult, ...]:
        """Play the commands of each side for a number of game loops."""
        assert self._now, "the game is reset before it is played"
        sides = zip(self._executors, commands, self._now, strict=True)
        results = await self._thread.act([executor.plan(given, now, loops) for executor, given, now in sides])
        self._now = tuple(result.snapshot for result in results)
        return results


def find_sc2(source: str, *, simulator: Path | None = None, environ: Mapping[str, str] = os.environ) -> Path:
    """Return the directory of the configured game.

    Args:
        source: `simulator`, `starcraft2` (by SC2PATH, else at `USUAL_PLACE`), or a directory.
        simulator: where the simulator is installed; callers that may know it pass it.
        environ: the environment with SC2PATH.

    Raises:
        GameMissing: there is no game; the text says what to do.
    """
    if source == "simulator":
        if simulator is None:
            raise GameMissing("the simulator is not installed: `khala sc2 install DIR` installs it")
        return check_install(simulator)
    if source == "starcraft2":
        if "SC2PATH" in environ:
            return check_install(Path(environ["SC2PATH"]).expanduser(), told_by="SC2PATH")
        return check_install(USUAL_PLACE.expanduser(), told_by="SC2PATH is not set, the usual place")
    return check_install(Path(source).expanduser())


def check_install(directory: Path, *, told_by: str = "") -> Path:
    """Return `directory` if a game is installed in it.

    Raises:
        GameMissing: there is no game in it.
    """
    where = f"{directory} ({told_by})" if told_by else str(directory)
    if not directory.is_dir():
        raise GameMissing(f"there is no StarCraft II in {where}: no such directory; set SC2PATH to where it is")
    versions = directory / "Versions"
    if not versions.is_dir() or not any(entry.name.startswith("Base") for entry in versions.iterdir()):
        raise GameMissing(f"there is no StarCraft II in {where}: it has no directory Versions with a Base in it")
    return directory
