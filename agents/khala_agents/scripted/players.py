"""Players that answer a prompt with a script, and the policies by which a worker plays them without a model.

`PLAYERS` lists them; `configs/models/scripted.yaml` says which plays by default. The same prompt gives the same reply.
They know the prompt and nothing else: no game, no state, no clock.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from typing import TYPE_CHECKING, Literal

from khala_agents.policy import Policy
from khala_agents.scripted.reading import ANY, Situation, TextAction, TextTeam, TextUnit, read
from khala_agents.scripted.skilled import skilled
from khala_agents.scripted.writing import call, inside, point, reply

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from khala_agents.policy import Context

PlayerName = Literal["silent", "random-legal", "focus-fire", "skilled"]

REACH = 4.0
"""World units: an enemy is in reach if it is at most this much farther than the team's nearest one."""
SCREEN_CENTRE = (12.0, 12.0)
MAP_CENTRE = (32.0, 32.0)
HOSTILE = ("Attack", "Storm", "Feedback", "Beam")
"""Words in the names of actions at enemies, for a text without descriptions."""
MESSAGE_SHARE = 0.25
"""Part of the replies in which a player with a contact writes a message."""


def silent(observation: str, rng: random.Random) -> str:
    """Analyse, and order nothing."""
    del rng
    teams = read(observation).teams
    enemies = {unit.tag for team in teams.values() for unit in team.enemies}
    return f"Analysis: {len(teams)} team(s) of mine, {len(enemies)} enemy unit(s) in sight. I watch.\n"


def random_legal(observation: str, rng: random.Random) -> str:
    """Order one valid action with valid arguments for each team."""
    situation = read(observation)
    orders = {}
    for team in situation.teams.values():
        possible = [action for action in team.actions if all(_pools(action, team, situation))]
        if possible:
            action = rng.choice(possible)
            orders[team.name] = [call(action.name, *_random_values(action, team, situation, rng))]
    return reply("Something will come of it.", orders, _hello(situation, rng))


def random_calls(situation: Situation, rng: random.Random) -> Iterator[str]:
    """Yield a reply for each valid action of each team, with arguments drawn from what the text calls valid."""
    for team in situation.teams.values():
        for action in team.actions:
            if all(_pools(action, team, situation)):
                yield reply(
                    "This one.", {team.name: [call(action.name, *_random_values(action, team, situation, rng))]}, []
                )


def focus_fire(observation: str, rng: random.Random) -> str:
    """Fire with all teams on the weakest enemy in reach, one target for all that reach it; the others advance."""
    situation = read(observation)
    teams = list(situation.teams.values())
    target = _common_target(teams)
    orders = {team.name: order for team in teams if (order := _fight(team, target))}
    if target is None:
        return reply("No enemy is in sight.", orders, [])
    said = []
    if situation.correspondents and rng.random() < MESSAGE_SHARE:
        said = [(situation.correspondents[0], f"We fire on {target.tag}.")]
    words = f"{target.tag} is the weakest enemy in reach, with {target.hit_points:g} left. All fire on it."
    return reply(words, orders, said)


PLAYERS: dict[PlayerName, Callable[[str, random.Random], str]] = {
    "silent": silent,
    "random-legal": random_legal,
    "focus-fire": focus_fire,
    "skilled": skilled,
}


# --- targets ----------------------------------------------------------------------------------------


def in_reach(team: TextTeam) -> list[TextUnit]:
    """Return the enemies that are about as near as the nearest one, of those that the team can attack."""
    enemies = [unit for unit in team.enemies if team.reaches(unit)]
    nearest = min((unit.distance for unit in enemies), default=math.inf)
    return [unit for unit in enemies if unit.distance <= nearest + REACH or math.isinf(nearest)]


def _common_target(teams: Iterable[TextTeam]) -> TextUnit | None:
    """Return the enemy that most teams reach; of several the weakest, then the nearest."""
    seen = [unit for team in teams for unit in in_reach(team)]
    reached_by = Counter(unit.tag for unit in seen)
    return min(seen, key=lambda unit: (-reached_by[unit.tag], *_weakness(unit)), default=None)


def _weakness(unit: TextUnit) -> tuple[float, float, str]:
    return unit.hit_points, unit.distance, unit.tag


def _fight(team: TextTeam, target: TextUnit | None) -> list[str]:
    actions = {action.name: action for action in team.actions}
    reached = in_reach(team)
    if reached and "Attack_Unit" in actions:
        common = next((unit for unit in reached if target and unit.tag == target.tag), None)
        return [f"<Attack_Unit({(common or min(reached, key=_weakness)).tag})>"]
    if not reached and team.allies and "Move_Screen" in actions:
        return [f"<Move_Screen({point(_middle(team))})>"]
    if not reached and "Move_Minimap" in actions:
        return [f"<Move_Minimap({point(MAP_CENTRE)})>"]
    return []


def _middle(team: TextTeam) -> tuple[float, float]:
    """Return the middle of a team's allies on its screen."""
    x = sum(unit.x for unit in team.allies) / len(team.allies)
    y = sum(unit.y for unit in team.allies) / len(team.allies)
    return inside((x, y), team)


# --- arguments --------------------------------------------------------------------------------------


def _pools(action: TextAction, team: TextTeam, situation: Situation) -> list[list[str]]:
    """Return, for each tag that an action takes, those that the text calls valid."""
    count = action.args.count("tag")
    will = team.will.get(action.name, ANY)
    own = [unit.tag for unit in team.own]
    targets = list(will.tags)
    if not targets:
        hostile = action.name in situation.hostile or any(word in action.name for word in HOSTILE)
        around = team.enemies if hostile else [*team.allies, *team.own]
        targets = [unit.tag for unit in around if unit.tag]
    if not action.name.startswith("Select_"):
        return [targets] * count
    named = 2 if action.name.startswith("Select_Two_") else 1  # the first arguments name the units that act
    return [list(will.units) or own] * named + [targets] * (count - named)


def _random_values(action: TextAction, team: TextTeam, situation: Situation, rng: random.Random) -> list[str]:
    pools = iter(_pools(action, team, situation))
    places = team.will.get(action.name, ANY).points
    values: list[str] = []
    for kind in action.args:
        if kind == "tag":
            pool = next(pools)
            values.append(rng.choice([tag for tag in pool if tag not in values] or pool))
        elif kind == "minimap":
            x0, y0, x1, y1 = situation.playable
            values.append(point((rng.uniform(x0, x1), rng.uniform(y0, y1))))
        elif places:
            values.append(point(rng.choice(places)))
        else:
            x, y = (middle + rng.uniform(-8, 8) for middle in SCREEN_CENTRE)
            values.append(point(inside((x, y), team)))
    return values


def _hello(situation: Situation, rng: random.Random) -> list[tuple[str, str]]:
    if situation.correspondents and rng.random() < MESSAGE_SHARE:
        return [(rng.choice(situation.correspondents), f"{len(situation.teams)} team(s) of mine are left.")]
    return []


# --- policies ---------------------------------------------------------------------------------------


class Fixed(Policy):
    """A policy that gives the same reply to every observation."""

    def __init__(self, text: str) -> None:
        self._text = text

    async def decide(self, context: Context) -> str:
        """Return the text."""
        del context
        return self._text


class ScriptedPlayer(Policy):
    """A scripted player within a worker: it plays from the text of the observation alone.

    Args:
        name: of the player.
        seed: for what it leaves to chance; the same seed and text give the same reply.
    """

    def __init__(self, name: PlayerName, *, seed: int = 0) -> None:
        self._play = PLAYERS[name]
        self._seed = seed

    async def decide(self, context: Context) -> str:
        """Return the player's reply."""
        text = context.observation.text
        return self._play(text, random.Random(f"{self._seed} {text}"))


class Silent(Fixed):
    """A policy that answers, and orders nothing."""

    def __init__(self) -> None:
        super().__init__("Analysis: I watch.\nActions:\n")
