"""Small stages on the simulator for one action of one unit: the units around it, and what happened before.

A stage is a game of its own in this process, without socket or PySC2's processes, saved at the moment of the order;
tests play it on from there any number of times, with an order and without.
"""

from __future__ import annotations

import io
import pickle
from typing import TYPE_CHECKING, Any

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import features, point
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.state import read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_simulator.combat import lifecycle
from khala_simulator.combat.traits import refresh
from khala_simulator.process import bookmark
from khala_simulator.process.client import Client, interface

from .effect import Seen

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.act.plan import Plan, PlanResult
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

    Point = tuple[float, float]
    Preparation = Callable[[World, int], None]

MAP, SIDE = "Melee/Flat64", 64
CENTRE = (32.0, 32.0)
RACES = {"protoss": common_pb2.Protoss, "terran": common_pb2.Terran, "zerg": common_pb2.Zerg}
OWN = (
    ("Nexus", 41.5, 24.5), ("CommandCenter", 41.5, 40.5), ("Hatchery", 23.5, 23.5), ("Pylon", 29, 34),
    ("Pylon", 38, 28), ("SupplyDepot", 27, 42), ("Barracks", 22.5, 40.5), ("CyberneticsCore", 34.5, 24.5),
    ("ShieldBattery", 36, 38),
    ("Marine", 34, 35), ("Stalker", 35.5, 35.5), ("SiegeTank", 34, 29), ("VikingFighter", 31, 36),
    ("Zergling", 31.5, 28), ("HighTemplar", 34, 37), ("Roach", 28, 36.5), ("Medivac", 29, 28), ("Queen", 27, 27),
    ("Overlord", 26, 33),
)  # fmt: skip
"""Structures of the player around the acting unit."""
FOES = (
    ("Marine", 38.5, 33), ("Roach", 39, 31), ("SiegeTank", 40, 34), ("Zealot", 36, 33), ("VikingFighter", 39, 30),
    ("HighTemplar", 40, 32), ("SupplyDepot", 42, 31), ("SpawningPool", 42.5, 35.5), ("Stalker", 38.5, 34.5),
)  # fmt: skip
NEUTRAL = (("MineralField", 24, 34.5), ("VespeneGeyser", 24.5, 30.5), ("VespeneGeyser", 33.5, 41.5))
CREEP = (20, 20, 30, 32)
CHEATS = ("tech_tree", "cooldown", "food")
PURSE = 5000


class Stage:
    """A game with one unit of a type in the middle, ready for an order."""

    def __init__(
        self,
        caster: str,
        prepare: Preparation | None = None,
        race: str = "protoss",
        place: Point | None = None,
        *,
        layers: bool = False,
    ) -> None:
        """Set the stage.

        Args:
            caster: type of the acting unit, as PySC2 names it.
            prepare: prepares it, as a function of the simulator's world and the unit's slot.
            race: whose base the player has in a corner of the map.
            place: where it stands, if not in the middle.
            layers: whether the game has a screen, as PySC2 asks for it.
        """
        self.client = Client()
        self.client.create(MAP)
        options = interface() if layers else sc.InterfaceOptions(raw=True, score=True)
        self.client.ask(join_game=sc.RequestJoinGame(race=RACES[race], options=options))
        self._populate()
        self.caster = self._put(caster, place)
        self.client.step(2)
        if prepare is not None:
            prepare(self.world, self.world.slot_of(self.caster))
        self.client.step(1)
        self._kept = self._keep()
        self.info = read_info(self.client.ask(game_info=sc.RequestGameInfo()).game_info, facts_of("multi"))
        self._eyes = _eyes() if layers else None
        self._idle: dict[int, Seen] = {}
        self._first = self.look()

    def _populate(self) -> None:
        world = self.world
        world.fog = False
        world.visibility[:] = 2
        player = world.players[1]
        player.minerals = player.vespene = PURSE
        player.cheats += CHEATS
        world.growth.paint(*CREEP)
        for owner, group in ((1, OWN), (2, FOES), (0, NEUTRAL)):
            for name, x, y in group:
                slot = lifecycle.spawn(world, world.catalog.unit(name), owner, (x, y))
                world.energy[slot] = world.energy_max[slot]
                world.looks_around[slot] = False
                world.autocast.pop(slot, None)
                if owner and not world.unit_type(slot).structure:
                    world.life[slot] *= 0.6
                    world.shields[slot] *= 0.5

    def _put(self, caster: str, place: Point | None) -> int:
        """Put the unit in the middle, calm and full of energy; return its tag."""
        world = self.world
        unit = world.catalog.unit(knowledge()[caster].id)
        if place is None:
            place = _usual_place(unit)
        if not unit.structure:  # a structure may have to research them
            _grant_all(world)
        slot = lifecycle.spawn(world, unit, 1, place)
        world.energy[slot] = world.energy_max[slot]
        world.looks_around[slot] = False
        world.autocast.pop(slot, None)
        return world.tag_of(slot)

    @property
    def world(self) -> World:
        """The simulator's present world."""
        playing = self.client.session._process.playing
        assert playing is not None
        return playing.game.world

    def _keep(self) -> tuple[bytes, dict[int, object]]:
        """Return the present game, with constant parts shared. Like a quick save, but faster to restore."""
        playing = self.client.session._process.playing
        assert playing is not None
        shared = {id(part): part for part in bookmark._unchanging(playing)}
        kept = io.BytesIO()
        _Keeper(kept, shared).dump(playing)
        return kept.getvalue(), shared

    def _reopen(self) -> None:
        data, shared = self._kept
        self.client.session._process.playing = _Opener(io.BytesIO(data), shared).load()

    def again(self) -> Seen:
        """Go back to the moment of the order."""
        self._reopen()
        return self._first

    def look(self, response: sc.ResponseObservation | None = None) -> Seen:
        """Return what the player sees now, and what its units can do and do by themselves."""
        response, world = response or self.client.observe(), self.world
        answer = self.client.ask(query=question(read_snapshot(response, self.info))).query
        functions = self._eyes.available_actions(response.observation) if self._eyes else ()
        snapshot = read_snapshot(
            response, self.info, abilities=available(answer), functions=frozenset(map(int, functions))
        )
        return Seen(
            snapshot, response, {world.tag_of(slot): frozenset(known) for slot, known in world.autocast.items()}
        )

    def idle(self, loops: int) -> Seen:
        """Return the same game some loops later, without any order."""
        if loops not in self._idle:
            process = self.client.session._process
            current = process.playing
            self._reopen()
            self._idle[loops] = self.look(self.client.step(loops))
            process.playing = current
        return self._idle[loops]

    def play(self, plan: Plan) -> tuple[PlanResult, int]:
        """Play a plan from now on; return what was played, and its number of loops."""
        step, loops = next(plan), 0
        while True:
            self._enter(step.actions)
            loops += step.loops
            seen = self.look(self.client.step(step.loops))
            try:
                step = plan.send(seen.snapshot)
            except StopIteration as done:
                return done.value, loops

    def _enter(self, actions: Sequence[Any]) -> None:
        """Play actions in the game; PySC2 translates calls of functions, and refuses what it should."""
        seen = self.client.observe().observation if self._eyes else None
        for action in actions:
            if isinstance(action, sc.Action):
                self.client.act(action)
            else:
                assert self._eyes is not None, "there is no screen on this stage"
                self.client.act(self._eyes.transform_action(seen, action))


class _Keeper(pickle.Pickler):
    """Pickles everything except the shared parts."""

    def __init__(self, file: io.BytesIO, shared: dict[int, object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_id(self, part: object) -> int | None:
        return id(part) if id(part) in self._shared else None


class _Opener(pickle.Unpickler):
    """Unpickles, with the shared parts in their places."""

    def __init__(self, file: io.BytesIO, shared: dict[int, object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, number: int) -> object:
        return self._shared[number]


def _grant_all(world: World) -> None:
    """Give the player every upgrade at once, which is much faster than one after the other."""
    names = (ability.upgrade for ability in world.catalog.abilities if ability.effect == "research")
    world.players[1].upgrades = sorted({world.catalog.upgrade(name).id for name in names})
    world.stats.apply(1, world.players[1].upgrades)
    for slot in world.units_of(1).tolist():
        refresh(world, slot)


def _usual_place(unit: UnitType) -> Point:
    """Return the place in the middle, or on creep for units that need it."""
    if unit.name.endswith("CrawlerUprooted"):
        return 26.5, 30.0
    if unit.structure and unit.needs_creep:
        return 28.5, 30.5
    return (32.5, 32.5) if unit.structure and unit.radius > 1.2 else CENTRE


def _eyes() -> Any:
    """Return PySC2's reader of observations and functions, with the settings of the bridge's game."""
    interface_format = features.AgentInterfaceFormat(
        feature_dimensions=features.Dimensions(screen=128, minimap=64),
        camera_width_world_units=24,
        use_feature_units=True,
        hide_specific_actions=False,
    )
    return features.Features(interface_format, map_size=point.Point(SIDE, SIDE))
