"""Any task in words, as PettingZoo has it: agents read observations and write replies, as over the bus.

The match is played by the host of every other match (`khala_sc2.playing.seats`); a step lasts until somebody is asked
again. Above: `khala_sc2.env.parallel_env`. Below: `khala_sc2.playing.seats`, `khala_sc2.env.onlooker`.
"""

from __future__ import annotations

import secrets
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar, Final

from gymnasium import spaces
from pettingzoo import ParallelEnv

from khala_bridge.game.processes import IdleGames
from khala_bridge.task.code import code_of
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.trust import check_trusted, trust_named
from khala_sc2.env.onlooker import Onlooker
from khala_sc2.env.rewards import battle
from khala_sc2.playing.loop_thread import LoopThread
from khala_sc2.playing.minds import Minds, minds_of
from khala_sc2.playing.seats import Seat, SeatedMatch, SeatsTurn, seats_of, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Result
    from khala_sc2.env.rewards import SideReward

    Infos = dict[str, dict[str, Any]]

EPISODES: Final = 1_000_000
"""Of one match: the game goes on from episode to episode until it is seeded again."""
_MOST_SEED: Final = 2**30
_LONGEST_TEXT: Final = 200_000
_LONGEST_REPLY: Final = 4_000
"""Of samples of the space; the host reads 65 536 characters."""
_CHARACTERS: Final = "\n" + "".join(filter(str.isprintable, map(chr, range(0x3000))))
TRUNCATED: Final = frozenset({"time limit", "step limit", "agents gone"})
"""Why an episode ends that was not decided."""
_RUNNING: Final = frozenset({"_thread", "_games", "_match", "_onlooker", "_turn", "_texts"})
"""Attributes of an environment that belong to its match."""
_UNTIMED: Final = {"wall_s": 0.0, "latency_p50_s": None, "latency_p95_s": None, "lag_s": 0.0}
"""What a clock has measured: without it, the same seed and replies give the same."""


class TextParallelEnv(ParallelEnv[str, str, str]):  # type: ignore[misc]  # PettingZoo has no types
    """One episode of a task after the other; `infos` have what observations carry beside their text.

    An agent that is not asked in a step, because its units are dead or its orders play out, keeps its text; what it
    answers is not read, and its `info["asked"]` is False. All agents stay until the episode is over.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": ["rgb_array"],
        "name": "khala_text_v0",
        "is_parallelizable": True,
        "render_fps": 2,
    }

    def __init__(
        self,
        task: str | TaskConfig,
        *,
        agents: Sequence[str] | None = None,
        others: str | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
        reward: SideReward = battle,
        game: str = "simulator",
    ) -> None:
        """Take a task; see `khala_sc2.env.parallel_env`."""
        task = load_task(task) if isinstance(task, str) else task
        check_trusted(code_of(task), source=task.name)
        scenes = None if render_mode else "none"
        self._task = without_time_limit(change(task, max_steps=max_cycles, scenes=scenes))
        self._seats = _seats_by_name(self._task, agents)
        sides = [side.side for side in self._task.per_side()]
        trust_named(others)
        self._minds = {} if others is None else minds_of(sides, Minds().with_name(others), {})
        self._reward, self._game = reward, game
        self.render_mode = render_mode
        self.possible_agents = list(self._seats)
        text = spaces.Text(_LONGEST_TEXT, min_length=0, charset=_CHARACTERS)
        self.observation_spaces = dict.fromkeys(self.possible_agents, text)
        self.action_spaces = {agent: spaces.Text(_LONGEST_REPLY, min_length=0) for agent in self.possible_agents}
        self._forget()

    def _forget(self) -> None:
        """Be as before the first episode."""
        self.agents: list[str] = []
        self._thread: LoopThread | None = None
        self._games = IdleGames()
        self._match: SeatedMatch | None = None
        self._onlooker: Onlooker | None = None
        self._turn = SeatsTurn()
        self._texts: dict[str, str] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Return what `pickle` and `copy` keep: how the environment was made.

        Raises:
            TypeError: an episode has begun; the game is a process, which cannot be copied.
        """
        if self._thread is not None:
            raise TypeError("an environment in words cannot be pickled or copied between reset() and close()")
        return {name: value for name, value in vars(self).items() if name not in _RUNNING}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Make the environment again."""
        self.__dict__.update(state)
        self._forget()

    def observation_space(self, agent: str) -> spaces.Space[str]:
        """Return the space of the texts that an agent reads."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[str]:
        """Return the space of an agent's replies."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[dict[str, str], Infos]:
        """Begin an episode: in a new match with a seed, or if the one before is not over; else in that which goes on.

        A new match is played in the game's process of the one before.

        Raises:
            KhalaError: the game cannot be played; the text says what to do.
        """
        del options
        if self._match is None or seed is not None or self.agents or self._turn.over:
            self._leave()
            self._enter(secrets.randbelow(_MOST_SEED) if seed is None else seed)
        self.agents = list(self.possible_agents)
        self._texts = dict.fromkeys(self.possible_agents, "")
        self._turn = SeatsTurn()
        self._turn = self._next({})
        return self._seen(), self._infos({})

    def step(
        self, actions: Mapping[str, str]
    ) -> tuple[dict[str, str], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Send the replies of those that were asked, and play until somebody is asked again.

        Raises:
            KhalaError: the match failed.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        self._turn = self._next(actions)
        agents = self.agents
        results = {result.side: result for result in self._turn.results}
        cut = any(result.cause in TRUNCATED for result in results.values())
        if results:
            self.agents = []
        return (
            self._seen(),
            self._rewards(agents, results),
            dict.fromkeys(agents, bool(results) and not cut),
            dict.fromkeys(agents, cut),
            self._infos(results),
        )

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the whole map, [height, width, 3] RGB; None without a render mode.

        Raises:
            RuntimeError: no episode has begun.
        """
        if self.render_mode is None:
            return None
        if self._onlooker is None or self._thread is None:
            raise RuntimeError("no episode has begun: call reset() first")
        steps = [seen.observation.step for seen in self._turn.asked.values()]
        return self._thread.run(self._onlooker.picture(max(steps, default=0)))

    def close(self) -> None:
        """End the match and its game."""
        self._leave()
        self._games.close()
        if self._thread is not None:
            self._thread.close()
            self._thread = None

    def __del__(self) -> None:
        """Close an environment that was dropped: its match waits for nobody else."""
        thread = getattr(self, "_thread", None)
        if thread is None or sys.is_finalizing():
            return
        if thread.is_current:  # it cannot wait for what it has to do itself
            threading.Thread(target=self.close).start()
        else:
            self.close()

    # the match ----------------------------------------------------------------------------------------------------

    def _enter(self, seed: int) -> None:
        if self._thread is None:
            self._thread = LoopThread()
            self._games = IdleGames()
        config = MatchConfig(task=self._task, run=self._task.name, seed=seed, episodes=EPISODES)
        self._match = SeatedMatch(config, self._seats.values(), self._minds, game=self._game, processes=self._games)
        if self.render_mode is not None:
            self._onlooker = Onlooker()
            self._thread.run(self._onlooker.look(self._match.broker, config.run))
        self._thread.run(self._match.__aenter__())

    def _leave(self) -> None:
        if self._match is not None and self._thread is not None:
            with suppress(KhalaError):  # it was raised where the match was waited for
                self._thread.run(self._match.__aexit__(None, None, None))
            if self._onlooker is not None:
                self._thread.run(self._onlooker.close())
        self._match = None

    def _next(self, actions: Mapping[str, str]) -> SeatsTurn:
        assert self._match is not None and self._thread is not None
        return self._thread.run(self._answer(self._match, actions))

    async def _answer(self, match: SeatedMatch, actions: Mapping[str, str]) -> SeatsTurn:
        for agent, seat in self._seats.items():
            if seat in self._turn.asked:
                match.act(seat, actions.get(agent, ""))
        return await match.turn()

    # what agents get ----------------------------------------------------------------------------------------------

    def _seen(self) -> dict[str, str]:
        for agent, seat in self._seats.items():
            if seat in self._turn.asked:
                self._texts[agent] = self._turn.asked[seat].observation.text
        return dict(self._texts)

    def _rewards(self, agents: Sequence[str], results: Mapping[str, Result]) -> dict[str, float]:
        by_side = {
            side: self._reward([report for report in self._turn.reports if report.side == side], results.get(side))
            for side in {seat.side for seat in self._seats.values()}
        }
        return {agent: by_side[self._seats[agent].side] for agent in agents}

    def _infos(self, results: Mapping[str, Result]) -> Infos:
        return {agent: self._info(seat, results.get(seat.side)) for agent, seat in self._seats.items()}

    def _info(self, seat: Seat, result: Result | None) -> dict[str, Any]:
        heard = (
            agent for report in self._turn.reports for agent in report.agents if Seat(agent.side, agent.agent) == seat
        )
        reports = [report.but(latency_s=None) for report in heard]
        info: dict[str, Any] = {"asked": seat in self._turn.asked, "reports": reports}
        if seat in self._turn.asked:
            seen = self._turn.asked[seat]
            info |= {"observation": seen.observation, "briefing": seen.briefing, "pictures": list(seen.pictures)}
        return info if result is None else info | {"result": result.but(**_UNTIMED)}


def _seats_by_name(task: TaskConfig, wanted: Sequence[str] | None) -> dict[str, Seat]:
    """Return the seats that are played, by the agents' names, with their sides where there are two.

    Raises:
        ConfigError: there is no such agent.
    """
    seats = seats_of(task)
    named = {str(seat) if len(task.per_side()) > 1 else seat.agent: seat for seat in seats}
    if unknown := [name for name in wanted or () if name not in named]:
        raise ConfigError(f"the task {task.name} has no agent {unknown[0]!r}: it has {', '.join(named)}")
    return named if wanted is None else {name: named[name] for name in wanted}
