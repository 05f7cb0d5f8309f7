"""Play SMACv2's own environments, as its package makes them, on the simulator: every scenario, two agents.

    python -m bench smacv2 ~/smacv2                                15 scenarios, random and heuristic agents, 3 episodes
    python -m bench smacv2 ~/smacv2 --episodes 50 --maps zerg_10_vs_11 --agents random

The path is a checkout of https://github.com/oxwhirl/smacv2; options and checks are those of `python -m bench smac`. The
scenarios are those that its README lists, with the options of its own configuration files. When an episode begins,
both teams must have the types that the package has drawn, at the places that it has drawn. An episode may be worth more
than 20: the package divides by the worth of the teams of its first episode.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from bench.environments.smac import main_of, play_episodes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bench.environments.smac import Played

UNITS: Final = {
    "protoss": {"stalker": 0.45, "zealot": 0.45, "colossus": 0.1},
    "terran": {"marine": 0.45, "marauder": 0.45, "medivac": 0.1},
    "zerg": {"zergling": 0.45, "hydralisk": 0.45, "baneling": 0.1},
}
NOT_ALONE: Final = {"protoss": [], "terran": ["medivac"], "zerg": ["baneling"]}
"""Types that never make up a whole team."""
SIZES: Final = ((5, 5), (10, 10), (10, 11), (20, 20), (20, 23))
SIDE: Final = 32
"""Of the map."""
NEAR: Final = 4.0
"""How far from its place a unit may stand after the first loop: 20 of them share one, and push each other away."""


def play(scenario: str, agent: str, episodes: int, seed: int) -> Played:
    """Play one scenario in this process; `smacv2` must be importable."""
    from smacv2.env.starcraft2.wrapper import StarCraftCapabilityEnvWrapper  # noqa: PLC0415  # only this needs it

    race, allies, _, enemies = scenario.split("_")
    env = StarCraftCapabilityEnvWrapper(
        map_name=f"10gen_{race}", seed=seed, heuristic_ai=agent == "heuristic", obs_own_pos=True, use_unit_ranges=True,
        min_attack_range=2, capability_config=drawn(race, int(allies), int(enemies)),
    )  # fmt: skip
    return play_episodes(env, scenario, agent, episodes, seed, lambda: misplaced(env.env))


def drawn(race: str, allies: int, enemies: int) -> dict[str, Any]:
    """Return what the package draws anew for every episode."""
    team = {"dist_type": "weighted_teams", "unit_types": [*UNITS[race]], "weights": [*UNITS[race].values()],
            "exception_unit_types": NOT_ALONE[race], "observe": True}  # fmt: skip
    places = {"dist_type": "surrounded_and_reflect", "p": 0.5, "map_x": SIDE, "map_y": SIDE}
    return {"n_units": allies, "n_enemies": enemies, "team_gen": team, "start_positions": places}


def misplaced(env: Any) -> Iterator[str]:
    """Yield what is wrong with the teams of an episode that begins."""
    sides = (
        ("ally", env.agents, env.ally_unit_map, env.ally_start_positions),
        ("enemy", env.enemies, env.enemy_unit_map, env.enemy_start_positions),
    )
    for side, units, number_of, places in sides:
        ordered = [int(number_of[name]) for name in env.episode_config["team_gen"][f"{side}_team"]]
        if Counter(ordered) != Counter(unit.unit_type for unit in units.values()):
            yield f"another {side} team than ordered"
        for number, (x, y) in zip(ordered, places, strict=True):
            same = (unit for unit in units.values() if unit.unit_type == number)
            if not any(abs(unit.pos.x - x) <= NEAR and abs(unit.pos.y - y) <= NEAR for unit in same):
                yield f"no {side} where one was ordered"


def scenarios() -> list[str]:
    """Return the scenarios of SMACv2's README."""
    return [f"{race}_{allies}_vs_{enemies}" for allies, enemies in SIZES for race in UNITS]


def main() -> None:
    """Play what the command line asks for; exit with 1 if anything was wrong."""
    main_of("smacv2", __doc__ or "", play, scenarios)
