"""One snapshot while views are made of it: the units on each team's screen.

A team sees what its camera shows: a square of 24 world units around the one of its units that is nearest to the middle
of most. The camera is virtual: it needs no move in the game and does not stop at the border of the map. The team's own
units are listed wherever they are, with a position outside of the frame if the camera does not reach them; everything
else only within it. Neutral units (resources, rocks) and larvae are left out; builders get resources apart. A team
without units of its own, which orders units of the whole side, has no camera and sees nothing.

A dozen teams look at a hundred units in each step, so the work has this order:

1. Each unit in sight but the neutral ones becomes a `Body`, once. Its place in ascending order of tags is its *row*.
2. With the first team that looks, arrays of all bodies and of all cameras give the rows that each team sees: its own
   units, friends, enemies (`khala_bridge.observe.looks`). Only here are bodies compared with cameras in bulk.
3. For each team that looks, its rows become unit views: a copy of the body's view with what depends on the team, its
   side, its place on the screen and its distance. Offers, skills and resources are added.
4. Events come last: they need the tags that the team witnesses now, and those of its last observation.

Keep in step by hand:

* `bodies`, `views`, `_order`, `_tags`, `_aim` and the arrays of `_arrays` have the same order, that of the rows.
* `on_screen`, `khala_bridge.frames.sees` and `_shows` in `khala_bridge.act.targets` cut the same square. An agent that
  is shown a unit may aim at it.
* `_units` writes fields of `UnitView` by name, unchecked, for speed: a field that is renamed there is renamed here.
* `screen_of` and `_on_screen` in `khala_bridge.observe.looks` round to the same tenth, within the frame.

`khala_bridge.observe.side` makes views of the whole side, `khala_bridge.observe.text` the words;
`khala_bridge.observe.observer` is above.
"""

from __future__ import annotations

import functools
import math
from collections import Counter
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from khala_bridge.auto.aims import aim_of
from khala_bridge.auto.warp import fields
from khala_bridge.frames import CAMERA_WIDTH, Camera, central
from khala_bridge.names import effect_name
from khala_bridge.observe.arguments import Around
from khala_bridge.observe.body import body, to_tenth
from khala_bridge.observe.events import Witnessed
from khala_bridge.observe.looks import BodyArrays, looks
from khala_bridge.observe.observation import TeamObservation
from khala_bridge.observe.offers import Possible
from khala_bridge.observe.timers import BARRIERS
from khala_bridge.state import Alliance
from khala_bridge.state.ground import land_of
from khala_protocol.messages import LOOPS_PER_S, EffectView, Resources, TeamView, UnitDetails, View

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping, Sequence

    from khala_bridge.auto.aims import Aim
    from khala_bridge.auto.warp import PowerField
    from khala_bridge.frames import WorldPoint
    from khala_bridge.observe.body import Body
    from khala_bridge.observe.events import Events
    from khala_bridge.observe.looks import Look, Shown
    from khala_bridge.observe.offers import Choice, SkillState
    from khala_bridge.observe.timers import Timers
    from khala_bridge.state import Snapshot
    from khala_bridge.state.teams import Team
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import Alliance as Whose
    from khala_protocol.messages import Frames, Point, UnitView

    _Effect: TypeAlias = tuple[str, Alliance, float, tuple[WorldPoint, ...], float | None]
    """Name, owner, radius, places and seconds that are left."""

_WHOSE: dict[Alliance, Whose] = {
    Alliance.OWN: "own",
    Alliance.ALLY: "ally",
    Alliance.NEUTRAL: "neutral",
    Alliance.ENEMY: "enemy",
}
UNSEEN_TYPES = frozenset({"Larva", "Cocoon"})
_HALF = CAMERA_WIDTH / 2
SLACK = 1e-6
"""Tenths of a cell that rounding of floats may take."""
_NO_DETAILS = UnitDetails()


class SideScene:
    """A snapshot, and the common part of all teams' views."""

    def __init__(self, snapshot: Snapshot, frames: Frames, teams: Iterable[Team], timers: Timers) -> None:
        """Take a snapshot that the timers have noted, the frames of its views, and the teams of all agents.

        The units of the teams are in the snapshot.
        """
        self.snapshot = snapshot
        self._timers = timers
        self.world = snapshot.info.frame(frames)
        self._screen_size = frames.screen
        units = [unit for unit in snapshot.units.values() if not unit.is_neutral]
        self.bodies: dict[int, Body] = {unit.tag: body(unit, self.world) for unit in units}
        """Every unit in sight but the neutral ones, in ascending order of tags."""
        self.views = {b.view.tag: b.view for b in self.bodies.values()}
        """Their views, by tag."""
        self.totals = {tag: view.health + view.shield for tag, view in self.views.items()}
        """Health and shield by tag."""
        self.possible = Possible(snapshot, self.world)
        self._order = tuple(self.bodies.values())
        self._tags = tuple(self.views)
        self._teams = {(team.agent, team.name): team.tags for team in teams if team.tags}

    @functools.cached_property
    def _looks(self) -> dict[tuple[str, str], Look]:
        """What each team with units looks at, by agent and team."""
        index = {tag: row for row, tag in enumerate(self.bodies)}
        members = [[index[tag] for tag in tags] for tags in self._teams.values()]
        middles = [self._order[_central(self._order, rows)] for rows in members]
        cameras = [Camera(middle.x, middle.y, self._screen_size) for middle in middles]
        return dict(zip(self._teams, looks(_arrays(self._order), cameras, members), strict=True))

    @functools.cached_property
    def resources(self) -> tuple[Body, ...]:
        """Minerals and geysers as they are now or were last seen, in ascending order of tags."""
        neutral = (unit for unit in self.snapshot.known.values() if unit.is_neutral)
        return tuple(body(unit, self.world) for unit in neutral if unit.facts is not None and unit.facts.resource)

    @functools.cached_property
    def power(self) -> tuple[PowerField, ...]:
        """The power fields of the player, in ascending order of tags."""
        return fields(self.snapshot)

    @functools.cached_property
    def planned(self) -> dict[str, int]:
        """Structures that workers are on their way to build, by type."""
        if not any(order.name.startswith("Build_") for b in self._order if b.is_own for order in b.view.orders):
            return {}
        return dict(sorted(Counter(structure for structure, _ in land_of(self.snapshot).plans).items()))

    @functools.cached_property
    def view(self) -> View:
        """The common part of all agents' views."""
        player = self.snapshot.player
        return View(
            time_s=round(self.snapshot.game_loop / LOOPS_PER_S, 3),
            resources=Resources(
                minerals=player.minerals,
                vespene=player.vespene,
                supply_used=player.food_used,
                supply_cap=player.food_cap,
                promised=self.possible.promised,
            ),
            upgrades=self.snapshot.upgrades,
            cell=self.world.cell,
            bounds=_edges(self.world.bounds),
        )

    def team(
        self, agent: AgentConfig, team: Team, before: TeamObservation | None, events: Events, *, resources: bool = False
    ) -> TeamObservation:
        """Return the observation of one team.

        Args:
            agent: whose team it is.
            team: its units; they are in the snapshot.
            before: the team's last observation; None if there is none.
            events: of all units since then.
            resources: whether it gets minerals and geysers.
        """
        if not team.tags:
            names = team.config.actions
            return TeamObservation(team, None, _team_view(team.name, None, self.possible.for_side(names)))
        camera, members, friends, foes = self._looks[team.agent, team.name]
        bodies = [self._order[row] for row in members.rows]
        around = Around(self.world, camera, self._aims(foes.rows), self._aims([*friends.rows, *members.rows]))
        place = to_tenth(self.world.minimap(camera.x, camera.y), self.world.minimap_size)
        view = _team_view(team.name, place, self.possible.for_team(agent, bodies, around)).but(
            units=self._add_skills(agent, bodies, self._units(members, "own")),
            allies=self._units(friends, "ally"),
            enemies=self._units(foes, "enemy"),
            resources=self._resources_on(camera) if resources else (),
            effects=self._effects_on(camera),
            bounds=_edges(camera.bounds(self.world)),
        )
        witnessed = Witnessed(*(tuple([self._tags[row] for row in shown.rows]) for shown in (members, friends, foes)))
        news = events.of_team(before.view, before.witnessed, witnessed) if before else ()
        return TeamObservation(team, camera, view.but(events=news), witnessed)

    @functools.cached_property
    def _aim(self) -> list[Aim]:
        """What matters of each body as a target."""
        return [aim_of(self.snapshot.units[tag]) for tag in self.bodies]

    def _aims(self, rows: Iterable[int]) -> dict[Aim, list[int]]:
        """Return the tags of bodies, those that are equally good targets together."""
        found: dict[Aim, list[int]] = {}
        for row in rows:
            found.setdefault(self._aim[row], []).append(self._order[row].tag)
        return found

    def _units(self, shown: Shown, alliance: Whose) -> tuple[UnitView, ...]:
        units = []
        for row, x, y, distance in zip(*shown, strict=True):
            view = self._order[row].view
            values = view.__dict__.copy()
            values["alliance"] = alliance
            values["screen"] = (x, y)
            values["distance"] = distance if alliance == "enemy" else None
            units.append(view.having(values))
        return tuple(units)

    def _add_skills(self, agent: AgentConfig, bodies: list[Body], views: tuple[UnitView, ...]) -> tuple[UnitView, ...]:
        """Return the units of a team, each with the skills that are ready and those that are not.

        A skill is not ready if only others of the team can use it now, or if it will be ready again at a known time.
        """
        skills = [self.possible.skills(agent, body) for body in bodies]
        of_team = {name for known in skills for name, skill in known.items() if skill.ready}
        units = zip(bodies, views, skills, strict=True)
        return tuple([self._with_skills(body, view, known, of_team) if known else view for body, view, known in units])

    def _with_skills(
        self, body: Body, view: UnitView, skills: Mapping[str, SkillState], of_team: Container[str]
    ) -> UnitView:
        unit = self.snapshot.units[body.tag]
        ready = tuple([name for name, skill in skills.items() if skill.ready])
        missing = {name: skill.ability for name, skill in skills.items() if not skill.ready}
        waits = {name: self._timers.ready_in_s(self.snapshot.facts, unit, ability) for name, ability in missing.items()}
        unready = {name: wait_s for name, wait_s in waits.items() if wait_s is not None or name in of_team}
        if not ready and not unready:
            return view
        return view.but(details=(view.details or _NO_DETAILS).but(ready=ready, unready=unready))

    def _resources_on(self, camera: Camera) -> tuple[UnitView, ...]:
        """Return the resources on a camera's screen, by type and tag."""
        seen = [b for b in self.resources if on_screen(camera, b)]
        return tuple(b.view.but(screen=screen_of(camera, b)) for b in sorted(seen, key=lambda b: (b.name, b.tag)))

    @functools.cached_property
    def _effects(self) -> list[_Effect]:
        """The effects on the ground and the barriers that belong to nobody, by name."""
        left_s = functools.partial(self._timers.effect_left_s, self.snapshot.facts)
        found: list[_Effect] = []
        for effect in self.snapshot.effects:
            name = effect_name(effect.effect_id)
            left = left_s((effect.effect_id, effect.places), name)
            found.append((name, effect.alliance, effect.radius, effect.places, left))
        barriers = [unit for unit in self.snapshot.units.values() if unit.is_neutral and unit.name in BARRIERS]
        found += [
            (unit.name, unit.alliance, unit.radius, (unit.pos,), left_s(unit.tag, unit.name)) for unit in barriers
        ]
        return sorted(found, key=lambda effect: effect[:4])

    def _effects_on(self, camera: Camera) -> tuple[EffectView, ...]:
        """Return the effects on the ground that a camera shows, and barriers that belong to nobody, by name."""
        made = []
        for name, alliance, radius, places, left in self._effects:
            shown = [place for place in places if _shows(camera, *place)]
            if shown:
                points = tuple(to_tenth(camera.screen(*place), camera.size) for place in shown)
                wide = round(radius, 1)
                made.append(EffectView(name=name, alliance=_WHOSE[alliance], radius=wide, screen=points, left_s=left))
        return tuple(made)


def _central(order: Sequence[Body], rows: Sequence[int]) -> int:
    """Return the row of the unit by which a team's camera stands."""
    return rows[central([(order[row].x, order[row].y) for row in rows])]


def _arrays(order: Sequence[Body]) -> BodyArrays:
    """Return bodies as arrays."""
    ranks = {name: rank for rank, name in enumerate(sorted({b.name for b in order}))}
    foe = [b.alliance is Alliance.ENEMY and b.name not in UNSEEN_TYPES for b in order]
    return BodyArrays(
        np.array([(b.x, b.y) for b in order]),
        np.array([ranks[b.name] for b in order]),
        np.array([b.alliance is not Alliance.ENEMY for b in order]),
        np.array(foe),
    )


def _team_view(name: str, minimap: Point | None, choice: Choice) -> TeamView:
    actions, offers, arguments, barred = choice
    return TeamView(name=name, minimap=minimap, actions=actions, offers=offers, arguments=arguments, barred=barred)


def on_screen(camera: Camera, seen: Body) -> bool:
    """Return True if a camera shows a body."""
    return _shows(camera, seen.x, seen.y)


def _shows(camera: Camera, x: float, y: float) -> bool:
    right, down = x - camera.x, camera.y - y
    return -_HALF <= right < _HALF and -_HALF <= down < _HALF


def screen_of(camera: Camera, seen: Body) -> Point:
    """Return the screen position of a body, to a tenth of a cell."""
    return to_tenth(camera.screen(seen.x, seen.y), camera.size)


def _edges(bounds: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Return bounds to a tenth of a cell, so that nothing within them is outside of the map."""
    x0, y0 = (math.ceil(10 * value - SLACK) / 10 for value in bounds[:2])
    x1, y1 = (math.floor(10 * value + SLACK) / 10 for value in bounds[2:])
    return x0, y0, x1, y1
