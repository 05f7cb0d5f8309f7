"""Things on the map whose tags an action takes: power fields, free places for a base, free geysers, own structures.

Functions of a scene. `khala_bridge.state.ground` knows the places for a base; here each gets the tag by which an agent
can name it, the one of the resource nearest to its middle.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from khala_bridge.auto.places import is_held
from khala_bridge.knowledge import is_structure
from khala_bridge.observe.body import to_tenth
from khala_bridge.observe.chronicle import PASSING
from khala_bridge.observe.scene import on_screen, screen_of
from khala_bridge.state.ground import land_of
from khala_protocol.messages import Landmark

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Literal, TypeAlias

    from khala_bridge.frames import Camera, WorldPoint
    from khala_bridge.observe.body import Body
    from khala_bridge.observe.scene import SideScene
    from khala_bridge.state.ground import Land
    from khala_protocol.messages import OrderView

    What: TypeAlias = Literal["base place", "geyser", "power field", "structure"]

MAX_PLACES = 5
"""Number of free places for a base that a page shows, the nearest ones."""
POWERS = frozenset({"Pylon", "PylonOvercharged", "WarpPrismPhasing"})
"""Sources of power at which units can be warped in; a Nexus or a Gateway only makes it faster."""
GAS_OF_BASE = 10.0
"""World units from a town hall within which a geyser is its own, as for the count of workers."""
ON_TOP = 1.0
"""World units between the middles of a geyser and of the structure on it."""


def power_fields(scene: SideScene, camera: Camera | None) -> Iterator[Landmark]:
    """Yield the power fields, in the order of tags, with their positions on a camera's screen."""
    sources = scene.snapshot.power_sources
    radius = {source.tag: source.radius for source in sources}
    for field in scene.power:
        body = scene.bodies.get(field.tag)
        if body is not None and body.name in POWERS:
            states = (("warps in fast", field.fast), ("no room for a unit", not field.room))
            states_now = [words for words, is_so in states if is_so]
            yield _landmark("power field", body, camera, ", ".join([f"radius {radius[field.tag]:g}", *states_now]))


def free_places(scene: SideScene, camera: Camera | None) -> Iterator[Landmark]:
    """Yield free places for a base, the nearest to the own bases first, then the free geysers of own bases."""
    land = land_of(scene.snapshot)
    own = [unit.pos for unit in land.own_halls]
    free = [base.place for base in land.bases if not is_held(land, base.place)]
    fields = [body for body in scene.resources if "Mineral" in body.name]
    for place in sorted(free, key=lambda place: (_nearest(place, own), place))[:MAX_PLACES]:
        yield from _base(scene, place, fields, own)
    yield from _geysers(scene, camera, land)


def _base(
    scene: SideScene, place: WorldPoint, fields: Sequence[Body], own: Sequence[tuple[float, float]]
) -> Iterator[Landmark]:
    nearest = min(fields, key=lambda body: (math.dist((body.x, body.y), place), body.tag), default=None)
    if nearest is not None:
        far = _nearest(place, own)
        about = f"{far:.0f} from your nearest base" if math.isfinite(far) else ""
        middle = to_tenth(scene.world.minimap(*place), scene.world.minimap_size)
        yield _landmark("base place", nearest, None, about).but(minimap=middle)


def _geysers(scene: SideScene, camera: Camera | None, land: Land) -> Iterator[Landmark]:
    built = [(b.x, b.y) for b in scene.bodies.values() if b.name.removesuffix("Rich") in GAS_STRUCTURES]
    for body in scene.resources:
        if "Geyser" not in body.name or _nearest((body.x, body.y), built) < ON_TOP:
            continue
        for hall in land.own_halls:
            if math.dist((body.x, body.y), hall.pos) <= GAS_OF_BASE:
                yield _landmark("geyser", body, camera, f"by your {scene.bodies[hall.tag].name} {hex(hall.tag)}")
                break


GAS_STRUCTURES = frozenset({"Assimilator", "Extractor", "Refinery"})


def structures(scene: SideScene) -> Iterator[Landmark]:
    """Yield the own structures with their orders, by type and tag."""
    own = [b for b in scene.bodies.values() if b.is_own and is_structure(b.name) and b.name not in PASSING]
    for body in sorted(own, key=lambda body: (body.name, body.tag)):
        yield _landmark("structure", body, None, _busy(body))


def at_work(orders: Sequence[OrderView]) -> tuple[list[OrderView], list[OrderView]]:
    """Return the orders that a unit carries out, the first one and those that have begun beside it, and the others."""
    later = orders[1:]
    working = [*orders[:1], *(order for order in later if order.progress)]
    return working, [order for order in later if not order.progress]


def _queue(orders: Sequence[OrderView]) -> str:
    """Return the orders at work of a structure, two with a Reactor, and the queued orders by name."""
    working, waiting = at_work(orders)
    begun = " and ".join(f"{o.name} {100 * o.progress:.0f}%" if o.progress else o.name for o in working)
    return " then ".join([begun, *(f"{count} {name}" for name, count in Counter(o.name for o in waiting).items())])


def _busy(body: Body) -> str:
    view = body.view
    if view.build_progress < 1:
        return f"{100 * view.build_progress:.0f}% built"
    parts = [_queue(view.orders)] if view.orders else []
    if details := view.details:
        parts += ["no power"] if details.unpowered else []
        parts += [f"{details.harvesters[0]} of {details.harvesters[1]} workers"] if details.harvesters else []
    parts += [f"{int(view.energy)} energy"] if view.energy_max else []
    return ", ".join(parts)


def _landmark(what: What, body: Body, camera: Camera | None, about: str) -> Landmark:
    screen = screen_of(camera, body) if camera is not None and on_screen(camera, body) else None
    return Landmark(what=what, tag=body.view.tag, type=body.name, minimap=body.view.minimap, screen=screen, about=about)


def _nearest(place: tuple[float, float], others: Sequence[tuple[float, float]]) -> float:
    return min((math.dist(place, other) for other in others), default=math.inf)
