"""Nothing unseen leaks: two games that differ only under the fog look the same to every kind of agent.

In both of them enemy structures, creep and units stand where the player never looked: at a free base place, and on the
screen of a worker that does not see that far, or else far away. Texts, pictures, offers, and what becomes of calls must
be equal.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import pytest

from khala_bridge.act import Actor
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Observer
from khala_bridge.state.fog import known_creep
from khala_bridge.state.grid import NO_GRID, Grid
from khala_bridge.state.ground import land_of
from khala_bridge.task.config import TaskConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_bridge.observe import SideObservation

WORKERS: Final = {"protoss": "Probe", "terran": "SCV", "zerg": "Drone"}
HALLS: Final = {"protoss": "Nexus", "terran": "CommandCenter", "zerg": "Hatchery"}
SUPPLY: Final = {"protoss": "Pylon", "terran": "SupplyDepot", "zerg": "Hatchery"}
PICTURES: Final = ("screen", "minimap", "features", "layer:creep", "layer:buildable", "layer:pathable")
LOOPS: Final = 160
SIGHT_AND_CREEP: Final = 22.0
"""World units from a worker to a Hatchery: it sees 8, the creep grows 12."""
ON_SCREEN: Final = 10.5
"""Distance at which a structure is on a worker's screen and out of its sight."""
SCREEN: Final = range(2, 24, 4)


def everybody(race: str) -> TaskConfig:
    """Return an agent of each kind, with all that it may have, and pictures."""
    worker = WORKERS[race]
    side = ("easy-control", "train", "easy-build", "research")
    groups = [f"group:{group}/{race}" for group in side]
    own = [{"name": "Worker", "unit_types": [worker]}]
    actions = {worker: ["group:basic", f"group:build/{race}", f"group:easy-build/{race}"]}
    agents: list[dict[str, Any]] = [
        {"name": "Commander", "kind": "commander", "teams": [{"name": "Army", "kind": "side", "actions": groups}]},
        {"name": "Developer", "kind": "developer", "teams": [{"name": "All", "kind": "side", "actions": groups}]},
        {"name": "Builder", "kind": "builder", "admits": "any", "teams": own, "actions": actions},
        {"name": "Fighter", "kind": "combat_group", "admits": "any", "teams": own, "actions": actions},
    ]
    images = [{"what": what, "size_px": 160, "format": "png"} for what in PICTURES]
    task = {"name": race, "own_map": {"file": "Simple64", "race": race, "opponent": "zerg"}, "task": "Win."}
    return TaskConfig.model_validate(
        {**task, "max_actions": 999, "agents": [{"role": "You play.", "images": images, **agent} for agent in agents]}
    )


def at_the_edge(game: Any) -> WorldPoint:
    """Return a free base place that nobody has seen, the one nearest to home."""
    land = land_of(game.snapshot)
    home = land.own_halls[0].pos
    unseen = [base.place for base in land.bases if not land.sight[int(base.place.x), int(base.place.y)]]
    return min(unseen, key=lambda at: (math.dist(at, home), at))


def play(make_game: Callable[..., Any], race: str, *, hidden: bool) -> tuple[SideObservation, list[str], list[str]]:
    """Return the observation of a game, what its calls lead to, and the game's answers to placements."""
    game = make_game(race=race, enemy="zerg")
    game.cheat()
    where = at_the_edge(game)
    home = land_of(game.snapshot).own_halls[0].pos

    def before(distance: float) -> tuple[float, float]:
        share = 1 - distance / math.dist(where, home)
        return home.x + share * (where.x - home.x), home.y + share * (where.y - home.y)

    game.put(WORKERS[race], *before(SIGHT_AND_CREEP))
    game.play(LOOPS)
    far = game.snapshot.info.size[0] - 8.0 if home.x < game.snapshot.info.size[0] / 2 else 8.0
    at_far = (far, game.snapshot.info.size[1] / 2)
    game.put("Hatchery", *(where if hidden else at_far), owner=2)
    game.put("EvolutionChamber", *(before(SIGHT_AND_CREEP - ON_SCREEN) if hidden else at_far), owner=2)
    game.play(LOOPS)  # its creep grows
    game.put("Roach", *(where if hidden else at_far), owner=2, count=4)
    task = everybody(race)
    seen = Observer(task).observe(game.snapshot)
    fates = list(outcomes(task, seen))
    return seen, fates, [game.may_stand(f"Build_{SUPPLY[race]}_screen", point) for point in around(where)]


def around(middle: WorldPoint) -> list[WorldPoint]:
    return [WorldPoint(middle.x + dx, middle.y + dy) for dx in range(-8, 9, 4) for dy in range(-8, 9, 4)]


def outcomes(task: TaskConfig, seen: SideObservation) -> Iterator[str]:
    """Yield what becomes of calls at every part of the builders' screens and every resource, one by one."""
    actor = Actor(task)
    for agent in ("Developer", "Commander", "Builder", "Fighter"):
        for team in seen.agents[agent].teams:
            for call in calls(seen, [spec.name for spec in team.view.actions], team.camera is not None):
                said = parse(f"Actions:\n    Team {team.name}:\n        {call}")
                joint = actor.joint(seen, {agent: said})
                orders = [(c.function.name, c.units, c.target) for c in joint.commands]
                yield f"{agent} {call} {orders} {[one.message for one in joint.rejections[agent]]}"


def calls(seen: SideObservation, names: list[str], on_screen: bool) -> Iterator[str]:
    resources = [tag for tag, unit in seen.snapshot.known.items() if unit.is_neutral]
    for name in names:
        if name.endswith("_Screen") and on_screen and name.startswith("Build"):
            yield from (f"<{name}([{x}, {y}])>" for x in SCREEN for y in SCREEN)
        elif name.endswith("_Near"):
            yield from (f"<{name}({hex(tag)})>" for tag in resources)
        elif "Screen" not in name and "Minimap" not in name and "Unit" not in name:
            yield f"<{name}()>"


@pytest.mark.parametrize(
    "race", ["protoss", pytest.param("terran", marks=pytest.mark.slow), pytest.param("zerg", marks=pytest.mark.slow)]
)
def test_what_is_under_the_fog_changes_nothing(race: str, make_game: Callable[..., Any]) -> None:
    bare, of_bare, game_of_bare = play(make_game, race, hidden=False)
    full, of_full, game_of_full = play(make_game, race, hidden=True)
    assert bare.snapshot.game_loop == full.snapshot.game_loop
    for name, agent in bare.agents.items():
        other = full.agents[name]
        assert other.text == agent.text
        assert other.view == agent.view
        assert {p.ref.name: p.data for p in other.pictures} == {p.ref.name: p.data for p in agent.pictures}
    assert of_full == of_bare
    assert game_of_full == game_of_bare
    assert len(of_bare) > 100, "there is something to compare"


def test_the_unseen_start_of_an_enemy_is_no_free_base_place(make_game: Callable[..., Any]) -> None:
    game = make_game()
    land = land_of(game.snapshot)
    (start,) = land.ground.starts
    seen = Observer(everybody("protoss")).observe(game.snapshot).agents["Builder"].view
    places = [mark.minimap for mark in seen.landmarks if mark.what == "base place"]
    frame = game.info.frame(everybody("protoss").frames)
    assert places
    assert all(math.dist(at, frame.minimap(*start)) > 3 for at in places)


# --- creep ------------------------------------------------------------------------------------------------------------

ROW: Final = Grid(8, 1, 1, b"\xff")
"""Creep on all eight cells."""
SIGHT: Final = Grid(8, 1, 8, bytes((2, 2, 1, 1, 0, 0, 0, 0)))


@pytest.mark.parametrize(
    ("creep", "before", "known"),
    [
        (b"\xff", NO_GRID, 0b11000000),
        (b"\xff", Grid(8, 1, 1, b"\x20"), 0b11100000),
        (b"\x00", Grid(8, 1, 1, b"\xf0"), 0b00110000),
        (b"\xff", None, 0b11110000),
    ],
    ids=["only what is in sight", "what was seen before, as it was", "it went, unseen", "nobody remembers"],
)
def test_creep_is_known_as_it_was_seen_last(creep: bytes, before: Grid | None, known: int) -> None:
    assert known_creep(ROW._replace(data=creep), SIGHT, before).data == bytes((known,))


def test_creep_counts_as_sent_without_a_map_of_what_is_seen() -> None:
    assert known_creep(ROW, NO_GRID, NO_GRID) == ROW
