"""Bots for python-sc2, and the games that they play: run by `test_python_sc2.py` in a process of its own.

python-sc2 writes its log to the standard output and changes signal handlers; so it gets an interpreter for itself, and
what the bots saw goes to a file as JSON.
"""

import contextlib
import json
import os
import sys
from pathlib import Path
from typing import Any

from sc2 import maps
from sc2.bot_ai import BotAI
from sc2.data import Difficulty, Race, Result
from sc2.ids.ability_id import AbilityId
from sc2.ids.unit_typeid import UnitTypeId
from sc2.main import run_game, run_replay
from sc2.observer_ai import ObserverAI
from sc2.player import Bot, Computer

SEEN: dict[str, Any] = {}
MAPS = Path(os.environ["SC2PATH"]) / "Maps"


class Settler(BotAI):
    """Looks around at the start of a melee game, says something, sends a Probe away, and gives up."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        if iteration == 0:
            scout, goal = self.workers.first, self.enemy_start_locations[0]
            SEEN["start"] = [self.workers.amount, self.townhalls.amount, self.minerals, self.supply_used]
            SEEN["goal"] = list(goal)
            SEEN["expansions"] = len(self.expansion_locations_list)
            SEEN["path"] = await self.client.query_pathing(scout, goal.towards(self.game_info.map_center, 8))
            SEEN["abilities"] = [a.name for a in (await self.get_available_abilities([scout]))[0]]
            SEEN["build"] = self.base_build
            SEEN["overcharge"] = 4107 in self.game_data.abilities
            SEEN["scout"], SEEN["from"] = scout.tag, list(scout.position)
            scout.move(goal)
            await self.chat_send("gl hf")
        SEEN["chat"] = SEEN.get("chat", []) + [chat.message for chat in self.state.chat]
        walker = self.workers.find_by_tag(SEEN["scout"])
        if walker is not None:
            SEEN["to"] = list(walker.position)
            SEEN["moves"] = walker.is_moving
        SEEN["errors"] = SEEN.get("errors", 0) + len(self.state.action_errors)
        if iteration == 60:
            await self.client.leave()


class Expander(BotAI):
    """Looks at its ramp, founds a second base, and gives up if it shall."""

    def __init__(self, *, leaves: bool = False) -> None:
        self.leaves = leaves

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        if iteration == 0:
            ramp = self.main_base_ramp
            away = self.start_location.distance_to(ramp.top_center)
            SEEN.setdefault("ramps", []).append([away, len(ramp.upper), len(ramp.corner_depots)])
            SEEN.setdefault("expansions", []).append(len(self.expansion_locations_list))
            await self.client.debug_all_resources()
        elif self.structures(UnitTypeId.NEXUS).amount > 1:
            SEEN.setdefault("expanded", set()).add(self.player_id)
            if self.leaves and len(SEEN["expanded"]) > 1:
                await self.client.leave()
        elif self.can_afford(UnitTypeId.NEXUS) and not self.already_pending(UnitTypeId.NEXUS):
            await self.expand_now()


class Fighter(BotAI):
    """Attacks the nearest enemy."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        for unit in self.units:
            if self.enemy_units and not unit.is_attacking:
                unit.attack(self.enemy_units.closest_to(unit))
        SEEN.setdefault("first enemies", self.enemy_units.amount)
        SEEN["loop"] = self.state.game_loop
        SEEN["killed"] = self.state.score.killed_value_units

    async def on_unit_destroyed(self, unit_tag: int) -> None:
        """Called by python-sc2."""
        SEEN["destroyed"] = SEEN.get("destroyed", 0) + 1


class Quitter(BotAI):
    """Walks off and gives up soon. When the first of two bots is done, python-sc2 kills the game processes of both."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        for unit in self.units:
            unit(AbilityId.MOVE_MOVE, self.game_info.map_center)
        if iteration == 20:
            SEEN["quit at"] = self.state.game_loop
            await self.client.leave()


class Waiter(BotAI):
    """Does nothing."""

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        SEEN["types"] = sorted({unit.type_id.name for unit in self.units if unit.type_id in UnitTypeId})


class Watcher(ObserverAI, BotAI):
    """Watches a replay; python-sc2's own observer lacks some of the methods that it calls, which bots have."""

    async def on_start(self) -> None:
        """Called by python-sc2."""
        SEEN["map"] = self.game_info.map_name

    async def on_step(self, iteration: int) -> None:
        """Called by python-sc2."""
        SEEN["loop"] = self.state.game_loop
        SEEN["units"] = max(SEEN.get("units", 0), len(self.state.observation_raw.units))


def _play(
    path: str, *players: Bot | Computer, realtime: bool = False, fog: bool = True, replay: str | None = None
) -> Any:
    return run_game(
        maps.Map(MAPS / path),
        list(players),
        realtime=realtime,
        random_seed=1,
        save_replay_as=replay,
        disable_fog=not fog,
        game_time_limit=90,
    )


def _bot(ai: BotAI, name: str) -> Bot:
    return Bot(Race.Protoss, ai, name=name)


def main(game: str, out: Path) -> None:
    """Play a game, and write what was seen of it."""
    computer = Computer(Race.Protoss, Difficulty.VeryEasy)
    match game:
        case "melee":
            result = _play("Melee/Simple64.SC2Map", _bot(Settler(), "settler"), computer)
        case "two bases":
            result = _play("Melee/Simple64.SC2Map", _bot(Expander(), "1"), _bot(Expander(leaves=True), "2"), fog=False)
            SEEN["expanded"] = sorted(SEEN["expanded"])
        case "combat":
            replay = str(out.with_suffix(".SC2Replay"))
            result = _play("llm_smac/2s3z.SC2Map", _bot(Fighter(), "fighter"), computer, replay=replay)
        case "two bots":
            result = _play("llm_smac/2s3z.SC2Map", _bot(Fighter(), "fighter"), _bot(Waiter(), "waiter"))
        case "a quitter":
            result = _play("Melee/Simple64.SC2Map", _bot(Waiter(), "waiter"), _bot(Quitter(), "quitter"))
        case "real time":
            result = _play("llm_smac/2s3z.SC2Map", _bot(Fighter(), "f"), _bot(Quitter(), "q"), realtime=True)
        case "replay":
            with contextlib.suppress(KeyError):  # at the end it looks for the result of a player 0
                run_replay(Watcher(), str(out.with_suffix(".SC2Replay")), observed_id=1)
            result = []
        case _:
            raise ValueError(game)
    SEEN["result"] = [r.name for r in ([result] if isinstance(result, Result) else result)]
    out.write_text(json.dumps(SEEN))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
