"""Take pictures of six moments as a client sees them: `python -m docs.moments [NAME ...]`.

Each is a battle on the simulator with a fixed seed, led by a short script, up to a chosen loop. The picture shows
`render_data` of the observation there, the screen beside the minimap, and the strength of the sides. Written to
docs/images/moments, and docs/design/rendering.md shows them.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.painting import palette
from khala_simulator.api.painting.silhouettes import OUTLINES
from khala_simulator.api.painting.sprites import SpriteLook, wardrobe
from khala_simulator.api.sight import Alliance
from khala_simulator.process.client import Client, command, interface
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from s2clientprotocol import common_pb2

    Image = NDArray[np.uint8]
    Point = tuple[float, float]

OUT = Path(__file__).parent / "images" / "moments"
SCREEN, MINIMAP, GAP = 512, 256, 12
QUALITY = 88
SIDES = {"own": raw_pb2.Self, "enemy": raw_pb2.Enemy}
GROUND, TEXT, FAINT = (20, 18, 17), (240, 236, 232), (168, 160, 152)
COLOURS = {"own": (255, 150, 70), "enemy": (52, 96, 244)}  # blue, green, red, as OpenCV writes files
SANS = cv2.FontFace("sans")

GALLERY, GALLERY_COLUMNS, GALLERY_SCALE, CELL = "looks", 4, 20.0, (256, 60)
"""Name, columns, pixels per world unit and size of a cell of the picture of all looks."""
LOOPS_PER_SECOND = 22.4
REACH = 9.0
"""World units around own units within which a unit belongs to the fight."""
DECISION = 8
"""Loops from one decision to the next."""
ATTACK, MOVE, STORM, FORCE_FIELD, GUARDIAN_SHIELD = 3674, 3794, 1036, 1526, 76
"""Abilities, by the API's numbers."""


class Stage:
    """A game that is led by a script."""

    def __init__(self, map_name: str, seed: int) -> None:
        self._client = Client()
        self._catalog = load_catalog()
        options = interface(screen=0)
        options.raw_affects_selection = False
        options.render.resolution.x = options.render.resolution.y = SCREEN
        options.render.minimap_resolution.x = options.render.minimap_resolution.y = MINIMAP
        self.seen = self._client.play(map_name, options, seed=seed)
        self._targets: dict[int, int] = {}

    def step(self, loops: int) -> None:
        """Play on."""
        self.seen = self._client.step(loops)

    def units(self, side: str, *names: str) -> list[raw_pb2.Unit]:
        """Return units of a side, of these types or of all."""
        rows = [unit for unit in self.seen.observation.raw_data.units if unit.alliance == SIDES[side]]
        return [unit for unit in rows if not names or self.name(unit) in names]

    def name(self, unit: raw_pb2.Unit) -> str:
        """Return its type's name."""
        row = self._catalog.row_of_id.get(unit.unit_type)
        return "" if row is None else self._catalog.units[row].name

    def order(self, ability: int, units: list[raw_pb2.Unit], point: Point | None = None) -> None:
        """Give own units an order."""
        self._client.act(command(ability, [unit.tag for unit in units], point=point))

    def look(self, point: Point) -> None:
        """Point the camera."""
        action = sc.Action()
        centre = action.action_raw.camera_move.center_world_space
        centre.x, centre.y = point
        self._client.act(action)

    def watch(self) -> None:
        """Point the camera at the fight."""
        army = [unit for side in SIDES for unit in self.units(side) if self._fights(unit)]
        own = [unit for unit in army if unit.alliance == SIDES["own"]]
        near = [u for u in army if own and min(np.hypot(u.pos.x - o.pos.x, u.pos.y - o.pos.y) for o in own) < REACH]
        self.look(self.middle(near or army))
        self.step(1)

    @staticmethod
    def middle(units: list[raw_pb2.Unit]) -> Point:
        """Return the mean of the places of units."""
        x, y = np.mean([(unit.pos.x, unit.pos.y) for unit in units], axis=0).tolist()
        return x, y

    @staticmethod
    def distance(some: list[raw_pb2.Unit], others: list[raw_pb2.Unit]) -> float:
        """Return the distance between the nearest two of two groups."""
        return min(float(np.hypot(a.pos.x - b.pos.x, a.pos.y - b.pos.y)) for a in some for b in others)

    def attack(self, loops: int) -> None:
        """Have every own fighter attack its nearest enemy until that one is dead, for this many loops."""
        for _ in range(0, loops, DECISION):
            enemies = {unit.tag: unit for unit in self.units("enemy")}
            for unit in self.units("own"):
                if not self._armed(unit) or self._targets.get(unit.tag) in enemies or not enemies:
                    continue
                nearest = min(enemies.values(), key=lambda enemy: self.distance([enemy], [unit]))
                self._targets[unit.tag] = nearest.tag
                self._client.act(command(ATTACK, [unit.tag], target=nearest.tag))
            self.step(DECISION)

    def picture(self, title: str) -> Image:
        """Draw the screen, the minimap beside it, and the strength of the sides."""
        sent = self.seen.observation.render_data
        image = np.full((SCREEN, SCREEN + GAP + MINIMAP, 3), GROUND, np.uint8)
        image[:, :SCREEN] = _pixels(sent.map)
        image[:MINIMAP, SCREEN + GAP :] = _pixels(sent.minimap)
        time_s = self.seen.observation.game_loop / LOOPS_PER_SECOND
        left, line = SCREEN + GAP, MINIMAP + 40
        _write(image, title, (left, line), TEXT, 22)
        _write(image, f"{int(time_s) // 60}:{int(time_s) % 60:02d}", (SCREEN + GAP + MINIMAP - 48, line), FAINT, 20)
        for side in SIDES:
            line = self._strength(image, side, (left, line + 34))
        return image

    def _strength(self, image: Image, side: str, at: Point) -> int:
        """Draw a side's fighters by type, and what is left of them; return the last line."""
        units = [unit for unit in self.units(side) if self._fights(unit)]
        counts = Counter(self.name(unit).removesuffix("_RL").removesuffix("Burrowed") for unit in units)
        vigour = round(sum(unit.health + unit.shield for unit in units))
        x, y = int(at[0]), int(at[1])
        cv2.rectangle(image, (x, y - 12), (x + 8, y + 2), COLOURS[side], -1)
        _write(image, f"{side}: {len(units)} units, {vigour} hp", (x + 18, y), TEXT, 15)
        for name, count in counts.most_common(5):
            y += 19
            _write(image, f"{count} {name}", (x + 18, y), FAINT, 14)
        return y

    def _fights(self, unit: raw_pb2.Unit) -> bool:
        row = self._catalog.row_of_id.get(unit.unit_type)
        return row is not None and self._catalog.units[row].army

    def _armed(self, unit: raw_pb2.Unit) -> bool:
        return self._fights(unit) and bool(self._catalog.units[self._catalog.row_of_id[unit.unit_type]].weapons)


def _pixels(image: common_pb2.ImageData) -> Image:
    """Return a picture as OpenCV writes files: blue, green, red."""
    return np.frombuffer(image.data, np.uint8).reshape(image.size.y, image.size.x, 3)[..., ::-1]


def _write(image: Image, text: str, at: tuple[int, int], colour: tuple[int, int, int], size: int) -> None:
    cv2.putText(image, text, at, colour, SANS, size, 500)


# scripts --------------------------------------------------------------------------------------------------------------


def clash(stage: Stage) -> None:
    """Send both sides into each other."""
    stage.attack(96)


def cliff(stage: Stage) -> None:
    """Walk Colossi down the cliff; the swarm has to run round by the ramps."""
    stage.attack(72)
    stage.order(MOVE, stage.units("own"), (16, 9.5))
    stage.step(40)
    stage.attack(16)


def marauders(stage: Stage) -> None:
    """Fly Medivacs behind the infantry."""
    stage.attack(128)


def roaches(stage: Stage) -> None:
    """Have Marines open fire as soon as they can."""
    stage.attack(96)
    stage.watch()


def base(stage: Stage) -> None:
    """Bring the enemy to the gates."""
    stage.step(200)
    stage.attack(160)
    stage.watch()


def storm(stage: Stage) -> None:
    """Cut the swarm in two with force fields, and storm the half in front of them."""
    stage.step(160)
    while stage.distance(stage.units("own", "Stalker"), stage.units("enemy", "Zergling")) > 2:
        stage.step(4)
    x, y = stage.middle(stage.units("enemy", "Zergling"))
    stage.order(GUARDIAN_SHIELD, stage.units("own", "Sentry")[:1])
    for sentry, shift in zip(stage.units("own", "Sentry")[1:], (-3.2, 0.0, 3.2), strict=False):
        stage.order(FORCE_FIELD, [sentry], (x + 0.5, y + shift))
    stage.step(12)
    for templar, shift in zip(stage.units("own", "HighTemplar"), (-4.5, -1.5, 1.5, 4.5), strict=False):
        stage.order(STORM, [templar], (x - 1.8, y + shift))
    stage.step(36)
    stage.watch()


@dataclass(frozen=True)
class Moment:
    """One picture: its map, its script, and its seed."""

    map_name: str
    script: Callable[[Stage], None]
    seed: int = 1


MOMENTS = {
    "clash": Moment("llm_smac/2s3z", clash),
    "cliff": Moment("llm_smac/2c_vs_64zg", cliff),
    "infantry": Moment("SMAC_Maps/MMM2", marauders),
    "roaches": Moment("mini_games/DefeatRoaches", roaches),
    "base": Moment("llm_pysc2/pvz_task5_level1", base),
    "storm": Moment("llm_pysc2/pvz_task6_level1", storm),
}


def gallery() -> Image:
    """Draw every type with its own outline, on both sides."""
    catalog = load_catalog()
    sprites = wardrobe(catalog, GALLERY_SCALE)
    names = [name for name in OUTLINES if not name.endswith(("Phased", "Burrowed"))]
    rows = -(-len(names) // GALLERY_COLUMNS)
    image = np.full((rows * CELL[1], GALLERY_COLUMNS * CELL[0], 3), palette.LOW, np.uint8)
    for k, name in enumerate(names):
        row = catalog.unit(name).row
        left, top = k // rows * CELL[0], k % rows * CELL[1]
        for side, turn, column in ((Alliance.SELF, 0, 34), (Alliance.ENEMY, 8, 102)):
            look = SpriteLook(row, side, turn, veiled=False, unfinished=False)
            sprites.sprite(look).stamp(image, left + column, top + CELL[1] // 2)
        _write(image, name, (left + 138, top + CELL[1] // 2 + 5), TEXT, 14)
    return np.ascontiguousarray(image[..., ::-1])


def take(moment: Moment) -> Image:
    """Play up to a moment and take its picture."""
    stage = Stage(moment.map_name, moment.seed)
    moment.script(stage)
    return stage.picture(moment.map_name.partition("/")[2])


def main() -> None:
    """Take the pictures that are named, or all."""
    OUT.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or (*MOMENTS, GALLERY):
        path = OUT / f"{name}.webp"
        image = gallery() if name == GALLERY else take(MOMENTS[name])
        if not cv2.imwrite(str(path), image, [cv2.IMWRITE_WEBP_QUALITY, QUALITY]):
            raise SystemExit(f"{path} cannot be written")
        sys.stdout.write(f"{path}: {path.stat().st_size / 1e3:.0f} kB\n")


if __name__ == "__main__":
    main()
