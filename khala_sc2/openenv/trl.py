"""Battles for TRL: `GRPOTrainer(environment_factory=environment_factory(...))` lets a model play with tools.

    trainer = GRPOTrainer(
        model, args=config, train_dataset=games, environment_factory=environment_factory("http://localhost:8000")
    )

TRL makes a battle for each rollout, resets it with the row of the data set, shows the model its public methods as
tools, and asks for the reward when the model calls no tool any more. The columns of the data set may be any fields of
`khala_sc2.openenv.models.ResetOptions`: rows of a group with the same seed play the same game. This module needs
neither TRL nor torch. Below: a session of a server, or of this process.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Protocol

from openenv.core.env_server.mcp_types import CallToolAction

from khala_protocol.errors import ConfigError
from khala_sc2.openenv.client import KhalaEnv
from khala_sc2.openenv.environment import KhalaEnvironment
from khala_sc2.openenv.models import KhalaObservation, ResetOptions
from khala_sc2.openenv.places import ServerPlaces
from khala_sc2.openenv.settings import ServerSettings
from khala_sc2.openenv.tools import ToolFault
from khala_sc2.playing.inside import InsideGames
from khala_sc2.playing.loop_thread import LoopThread

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

MESSAGE_S = 600.0
"""Longest wait for a server that many rollouts ask."""
MOST_HERE = 4096
"""Battles in this process: as many as its memory holds, at 5 MB for each of 2s3z."""
HOW = """\
# How to play
Call `act` with your orders, again and again: it plays on, and returns what you see then. `look_up` tells all about a
unit, an upgrade or an ability. Go on until you read that the episode is over."""


def environment_factory(server: str | None = None, **options: Any) -> Callable[[], ToolBattle]:
    """Return what makes battles for TRL; it can be pickled.

    Args:
        server: address of `khala openenv`; None plays in this process.
        options: of `reset`, for rows that have no such column: `task`, `agents`, `others`, `max_steps`, ...

    Raises:
        ConfigError: there is no such option.
    """
    if unknown := options.keys() - ResetOptions.model_fields.keys():
        raise ConfigError(
            f"reset has no option {min(unknown)!r}: it has {', '.join(ResetOptions.model_fields)}", source="options"
        )
    return functools.partial(ToolBattle, server, options)


class ToolBattle:
    """One agent of a battle, for a model that plays it with tools: the public methods but `reset` and `get_reward`."""

    def __init__(self, server: str | None, options: Mapping[str, Any]) -> None:
        self._session: _Session = _Here() if server is None else _There(server)
        self._options = options
        self._reward = 0.0
        self._over = False

    def reset(self, **row: Any) -> str:
        """Begin an episode, and return what the model reads first: its briefing, and what it sees.

        Args:
            row: of the data set; its columns that are options of a reset are used.

        Raises:
            ConfigError: the session would play several agents.
            KhalaError: an option is wrong, or the game cannot be played.
        """
        chosen = {name: row[name] for name in ResetOptions.model_fields if row.get(name) is not None}
        seen = self._session.reset({**self._options, **chosen})
        if len(seen.agents) > 1:
            raise ConfigError(
                f"a model plays one agent: name one of {', '.join(seen.agents)}, as in agents=[{min(seen.agents)!r}]",
                source="agents",
            )
        self._reward = 0.0
        self._over = seen.done
        return f"{seen.result}\n\n{HOW}"

    def act(self, orders: dict[str, list[str]], messages: dict[str, str] | None = None) -> str:
        """Give orders to your teams, write to other agents, and play until you are asked again.

        Args:
            orders: By team, its actions one after the other, in the form that the observation lists, such as
                {"Zealot-1": ["<Attack_Unit(0x100200000)>"]}. A team that is not named goes on as before.
            messages: By agent or channel that the observation names, what it is to read.

        Returns:
            What you see then, with the orders that were refused and why.
        """
        if self._over:
            raise ToolFault("the episode is over: call no tool any more")
        seen = self._session.call("act", {"orders": orders, "messages": messages or {}})
        self._reward += float(seen.reward or 0.0)
        self._over = seen.done
        return str(seen.result)

    def look_up(self, what: str) -> str:
        """Read all that is known of a unit type, an upgrade or an ability: numbers, costs, what it is good against.

        Args:
            what: Its name, such as Stalker, Blink or Effect_Blink.

        Returns:
            What is known.
        """
        return str(self._session.call("look_up", {"what": what}).result)

    def get_reward(self) -> float:
        """Return the sum of the rewards of the episode so far, by the rubric of the server."""
        return self._reward

    def _close(self) -> None:  # private, or TRL would show it to the model
        """End the session."""
        self._session.close()


class _Session(Protocol):
    def reset(self, options: Mapping[str, Any]) -> KhalaObservation:
        """Begin an episode."""

    def call(self, tool: str, arguments: Mapping[str, Any]) -> KhalaObservation:
        """Call a tool; raise if the call is wrong."""

    def close(self) -> None:
        """End it."""


class _There:
    """A session of a server."""

    def __init__(self, server: str) -> None:
        self._env = KhalaEnv(server, message_timeout_s=MESSAGE_S).sync()

    def reset(self, options: Mapping[str, Any]) -> KhalaObservation:
        seen: KhalaObservation = self._env.reset(**options).observation
        return seen

    def call(self, tool: str, arguments: Mapping[str, Any]) -> KhalaObservation:
        seen: KhalaObservation = self._env.step(CallToolAction(tool_name=tool, arguments=dict(arguments))).observation
        return seen

    def close(self) -> None:
        self._env.close()


class _Here:
    """A session of this process; all of them share a thread, and the threads of their games."""

    def __init__(self) -> None:
        self._thread, settings, games, places = _common()
        self._environment = KhalaEnvironment(settings, games, places)

    def reset(self, options: Mapping[str, Any]) -> KhalaObservation:
        return self._thread.run(self._environment.reset_async(**options))

    def call(self, tool: str, arguments: Mapping[str, Any]) -> KhalaObservation:
        action = CallToolAction(tool_name=tool, arguments=dict(arguments))
        seen = self._thread.run(self._environment.step_async(action))
        assert isinstance(seen, KhalaObservation)
        if seen.error is not None:
            raise ToolFault(seen.error.message)
        return seen

    def close(self) -> None:
        self._environment.close()


@functools.cache
def _common() -> tuple[LoopThread, ServerSettings, InsideGames, ServerPlaces]:
    """Return what sessions of this process share, made when the first battle is."""
    return LoopThread(), ServerSettings(), InsideGames(), ServerPlaces(MOST_HERE)
