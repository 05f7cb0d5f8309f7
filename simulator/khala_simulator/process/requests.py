"""Which function answers which request.

Each takes the process and the request and returns the body of the response, at once or as an awaitable: a message, or
the parts of its bytes. Above: `session.py`. Below: `lobby.py`, `joining.py`, `play.py`, `viewing.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from khala_simulator.process import joining, lobby, play, viewing

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from google.protobuf.message import Message

    from khala_simulator.api.wire import Part
    from khala_simulator.process.process import Process

    Body = Message | list[Part]
    Handler = Callable[[Process, Any], Body | Awaitable[Body]]

HANDLERS: Final[dict[str, Handler]] = {
    "ping": lobby.ping,
    "available_maps": lobby.available_maps,
    "save_map": lobby.save_map,
    "create_game": lobby.create_game,
    "join_game": joining.join_game,
    "restart_game": joining.restart_game,
    "leave_game": lobby.leave_game,
    "quit": lobby.end,
    "start_replay": viewing.start_replay,
    "replay_info": viewing.replay_info,
    "game_info": play.game_info,
    "data": play.tables,
    "observation": play.observation,
    "step": play.step,
    "action": play.action,
    "obs_action": play.obs_action,
    "query": play.ask,
    "debug": play.debug,
    "map_command": play.map_command,
    "save_replay": play.save_replay,
    "quick_save": play.quick_save,
    "quick_load": play.quick_load,
}
