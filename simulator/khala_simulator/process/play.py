"""Requests while a game is played or a replay is watched.

Each function takes the process and a request and returns the body of the response: a message, or for the large ones the
parts of its bytes. Above: `requests.py`. Below: `game.py`, `observation.py` and their neighbours.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from s2clientprotocol import error_pb2, query_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import data, query
from khala_simulator.api.observation import observe
from khala_simulator.api.viewer import Viewer
from khala_simulator.process import bookmark, replay
from khala_simulator.process.lan import CHUNK_LOOPS
from khala_simulator.process.status import UsageError

if TYPE_CHECKING:
    from khala_simulator.api.game import HostedGame
    from khala_simulator.api.wire import Part
    from khala_simulator.process.process import Playing, Process


def game_info(process: Process, _: sc.RequestGameInfo) -> list[Part]:
    """Return players, options and the map."""
    return process.table.info.encode()


def tables(process: Process, request: sc.RequestData) -> sc.ResponseData:
    """Return abilities, unit types, upgrades, buffs and effects."""
    return data.answer(process.table.game.catalog, request)


async def observation(process: Process, request: sc.RequestObservation) -> list[Part]:
    """Return what the player knows now; with a game loop in real time, not before that loop."""
    table = process.table
    if table.clock is not None:
        await table.clock.wait_for(request.game_loop)
    return observe(table.game, table.seat, disable_fog=request.disable_fog)


async def step(process: Process, request: sc.RequestStep) -> sc.ResponseStep:
    """Advance the game, by one loop unless the request says how many; together with the other processes, if any."""
    table = process.table
    count = request.count or 1
    if table.clock is not None:
        raise UsageError("step is not possible in a game in real time")
    if table.peers is not None:
        await table.peers.step(count)
    else:
        await _advance(table.game, count)
    return sc.ResponseStep(simulation_loop=table.game.world.loop)


async def _advance(game: HostedGame, count: int) -> None:
    target = game.world.loop + count
    while True:
        game.step(min(target - game.world.loop, CHUNK_LOOPS))
        if game.world.loop >= target or game.over:
            return
        await asyncio.sleep(0)


def action(process: Process, request: sc.RequestAction) -> sc.ResponseAction:
    """Note actions of the player, and return how each would go at present."""
    table = process.table
    if isinstance(table.seat, Viewer):
        return sc.ResponseAction(result=[error_pb2.NotSupported] * len(request.actions))
    results = [table.game.act(table.seat.player, action) for action in request.actions]
    return sc.ResponseAction(result=results)


def obs_action(process: Process, request: sc.RequestObserverAction) -> sc.ResponseObserverAction:
    """Turn the view of an observer, or of the viewer of a replay; a player has no such view, and nothing happens."""
    seat = process.table.seat
    if isinstance(seat, Viewer):
        for action in request.actions:
            seat.obey(action)
    return sc.ResponseObserverAction()


def ask(process: Process, request: query_pb2.RequestQuery) -> query_pb2.ResponseQuery:
    """Return ways, places to build, abilities of units."""
    return query.answer(process.table.seat, request)


def debug(process: Process, request: sc.RequestDebug) -> sc.ResponseDebug:
    """Note debug commands; they take effect with the next loop. An observer's do nothing."""
    table = process.table
    if isinstance(table.seat, Viewer):
        return sc.ResponseDebug()
    for command in request.debug:
        table.game.debug(table.seat.player, command)
    return sc.ResponseDebug()


def map_command(_: Process, __: sc.RequestMapCommand) -> sc.ResponseMapCommand:
    """Accept the command and do nothing; no map has commands."""
    return sc.ResponseMapCommand()


def save_replay(process: Process, _: sc.RequestSaveReplay) -> sc.ResponseSaveReplay:
    """Return the game up to now, as the bytes of a replay."""
    table = process.table
    if table.replay:
        raise UsageError("A replay of a replay cannot be saved")
    return sc.ResponseSaveReplay(data=replay.record(table.game).file(process.about))


def quick_save(process: Process, _: sc.RequestQuickSave) -> sc.ResponseQuickSave:
    """Keep the present state of the game, in memory."""
    bookmark.keep(_alone(process, "quick_save"))
    return sc.ResponseQuickSave()


def quick_load(process: Process, _: sc.RequestQuickLoad) -> sc.ResponseQuickLoad:
    """Go back to the last quick save of this game."""
    kept = bookmark.reopen(_alone(process, "quick_load"))
    if kept is None:
        raise UsageError("quick_load needs a quick_save of the same game")
    process.play(kept)
    return sc.ResponseQuickLoad()


def _alone(process: Process, kind: str) -> Playing:
    if process.table.peers is not None:
        raise UsageError(f"{kind} is not possible in a game of several processes")
    return process.table
