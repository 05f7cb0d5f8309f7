"""Placing structures by hand with one worker: where there is room on the screen, and power if it is needed.

The same wants as in `builds` decide what is built. The place is guessed from the screen, and corrected by the
place that the host names when it refuses one. Where the host finds the place, a Pylon stands near a base and all else
near a Pylon, each time near another one.
"""

from __future__ import annotations

import re
from itertools import product
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import points
from khala_agents.scripted.skilled.builds import BUILDS
from khala_agents.scripted.skilled.economy import missing, needs_supply
from khala_agents.scripted.skilled.kinds import TOWN_HALLS, kind_of
from khala_agents.scripted.skilled.space import distance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_agents.scripted.reading import Point, TextTeam, TextUnit
    from khala_agents.scripted.skilled.builds import Build
    from khala_agents.scripted.skilled.plan import ReplyPlan

GAS = frozenset({"Assimilator", "Refinery", "Extractor"})
FIELD = 5.5
"""How far from a Pylon a structure is put."""
SMALL = frozenset({"Pylon", "SupplyDepot", "SupplyDepotLowered", "SpineCrawler"})
"""Structures of two by two cells."""
ROOM = {**dict.fromkeys(TOWN_HALLS, 4.6), **dict.fromkeys(SMALL, 2.6)}
"""Distance of two middles of structures of three cells, with a cell between them to walk on."""
PLAIN_ROOM = 3.6
FROM_MINERALS = 3.5
_HINT = re.compile(r"free place is (\[[^\]]*\])")


def leads(plan: ReplyPlan) -> bool:
    """Return whether a team is a builder: workers that may build, now or later."""
    names = {action.name for action in plan.team.actions} | plan.situation.impossible
    workers = all(kind_of(unit).role == "worker" for unit in plan.team.own)
    return workers and any(name.startswith("Build_") for name in names)


def build(plan: ReplyPlan) -> None:
    """Begin the first structure that is wanted and can be paid, if the worker is free."""
    team, situation = plan.team, plan.situation
    if any(unit.order.startswith("Build") for unit in team.own):
        return
    offered = {action.name for action in team.actions} | situation.impossible
    build = next((b for b in BUILDS if any(name.startswith(f"{_first(b)}_") for name in offered)), None)
    if build is None:
        return
    supply = [build.supply] if build.supply.action.startswith("Build_") and needs_supply(situation, build) else []
    wants = [want for want in build.wants if want.action.startswith("Build_") and missing(situation, want)]
    for want in [*supply, *wants]:
        if _begin(plan, want.action.removeprefix("Build_")):
            return
        if want.first or want in supply:
            return  # its money is saved


def _first(build: Build) -> str:
    """Return the first structure of a build order."""
    return next(want.action for want in build.wants if want.action.startswith("Build_"))


def _begin(plan: ReplyPlan, what: str) -> bool:
    """Order a structure; return whether that was possible."""
    team, situation = plan.team, plan.situation
    if what in TOWN_HALLS | GAS:
        wanted = "VespeneGeyser" if what in GAS else ""
        sites = [tag for kind, tag in situation.sites if (wanted in kind if wanted else "Mineral" in kind)]
        return bool(sites) and plan.give(f"Build_{what}_Near", sites[0])
    if team.can(f"Build_{what}_Near"):
        beside = [
            unit for unit in team.allies if (unit.type in TOWN_HALLS if what == "Pylon" else unit.type == "Pylon")
        ]
        return bool(beside) and plan.give(f"Build_{what}_Near", beside[len(team.allies) % len(beside)].tag)
    if not team.can(f"Build_{what}_Screen"):
        return False
    place = _hint(plan, what) or _place(team, what, situation.fields)
    return place is not None and plan.give(f"Build_{what}_Screen", place)


def _hint(plan: ReplyPlan, what: str) -> Point | None:
    """Return the place that the host named when it refused the last one."""
    for text in plan.situation.rejected:
        if f"Build_{what}_Screen" in text and (found := _HINT.search(text)):
            return points(found[1])[0]
    return None


def _place(team: TextTeam, what: str, fields: Sequence[Point]) -> Point | None:
    """Return a free place: by a Pylon if it needs power, else near the base; on whole cells or between."""
    half = 0.0 if what in SMALL else 0.5
    halls = [unit for unit in team.allies if unit.type in TOWN_HALLS]
    x0, x1, y0, y1 = (int(edge) for edge in team.bounds)
    cells = [(x + half, y + half) for x, y in product(range(x0 + 2, x1 - 2), range(y0 + 2, y1 - 2))]
    structures = [unit for unit in team.allies if kind_of(unit).structure]

    def fits(at: Point) -> bool:
        if any(
            distance(at, unit) < ROOM.get(unit.type, PLAIN_ROOM) + (0.5 if what in SMALL else 0.9)
            for unit in structures
        ):
            return False
        if any(distance(at, resource) < FROM_MINERALS for resource in team.resources):
            return False
        return not _between(at, halls, team.resources)

    if fields and what != "Pylon":
        near = [cell for cell in cells if any(distance(cell, field) <= FIELD for field in fields)]
        return min((cell for cell in near if fits(cell)), key=lambda cell: _nearest(cell, fields), default=None)
    near = [cell for cell in cells if halls and 6.0 <= min(distance(cell, hall) for hall in halls) <= 10.0]
    apart = [cell for cell in near if all(distance(cell, field) > FIELD for field in fields)]
    for choice in (apart, near, cells):  # a base that is full is built around
        if free := [cell for cell in choice if fits(cell)]:
            return min(free, key=lambda cell: (_nearest(cell, halls), cell))
    return None


def _between(at: Point, halls: Sequence[TextUnit], resources: Sequence[Point]) -> bool:
    """Return whether workers pass there on their way between minerals and base."""
    return any(
        distance(at, hall) + distance(at, resource) < distance(resource, hall) + 2.0
        for hall in halls
        for resource in resources
    )


def _nearest(at: Point, others: Sequence[TextUnit] | Sequence[Point]) -> tuple[float, Point]:
    return min((distance(at, other) for other in others), default=0.0), at
