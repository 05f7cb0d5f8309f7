"""A bot of python-sc2 that joins a ladder's game: `python ladder_bot.py KIND --LadderServer … --GamePort … …`."""

import argparse
import asyncio
import sys
from typing import Any

import aiohttp
from sc2.bot_ai import BotAI
from sc2.data import Race
from sc2.main import play_from_websocket
from sc2.player import Bot
from sc2.portconfig import Portconfig


class WorkerRush(BotAI):
    """Sends all workers to the enemy's base at once, and has them destroy everything there."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        self.client.game_step = 9
        near = self.enemy_units | self.enemy_structures
        for worker in self.workers:
            if not near:
                worker.move(self.enemy_start_locations[0])
            elif worker.order_target not in near.tags:
                worker.attack(near.closest_to(worker))


class Quitter(BotAI):
    """Gives up after some steps."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        self.client.game_step = 7
        if iteration == 10:
            await self.client.leave()


class Crash(BotAI):
    """Has a bug."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        if iteration == 5:
            sys.exit(3)


class Thinker(BotAI):
    """Thinks for ever."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        if iteration == 5:
            await asyncio.Event().wait()


KINDS: dict[str, type[BotAI]] = {"rush": WorkerRush, "quitter": Quitter, "crash": Crash, "thinker": Thinker}


async def play(bot: Bot, given: Any) -> None:
    """Play one game, and print the result."""
    ports = [given.StartPort + 2 + number for number in range(4)]
    async with aiohttp.ClientSession() as session:
        game = await session.ws_connect(f"ws://{given.LadderServer}:{given.GamePort}/sc2api", max_msg_size=0)
        meeting = Portconfig(server_ports=ports[:2], player_ports=[ports[2:]])
        result = await play_from_websocket(game, bot, realtime=False, portconfig=meeting)
    print("result", result)  # noqa: T201  # into the log of the run


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("kind")
    parser.add_argument("--LadderServer")
    parser.add_argument("--GamePort", type=int)
    parser.add_argument("--StartPort", type=int)
    parser.add_argument("--OpponentId")
    given = parser.parse_args()
    asyncio.run(play(Bot(Race.Zerg, KINDS[given.kind](), name=given.kind), given))
