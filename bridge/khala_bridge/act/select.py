"""The hand that selects units on the screen: by the shortest way that fits, checked against the game's selection.

Above it is the tour of `khala_bridge.act.screen_executor`, which provides the camera and the functions; below it is
`khala_bridge.act.aim`, which says where to click. The hand selects own units only, and gives no orders.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Protocol, TypeAlias

from khala_bridge.act.aim import RealScreen
from khala_bridge.knowledge import WORKERS

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from khala_bridge.act.plan import PlanStep
    from khala_bridge.act.translate import Command
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Snapshot

    Way: TypeAlias = Generator[PlanStep, Snapshot, None]

TRIES = 2
"""Clicks on one unit before the hand gives up."""
LARGE = 6
"""Number of units from which `select_army` is worth a try."""
HATCHERIES = frozenset({"Hatchery", "Lair", "Hive"})


class Missed(Exception):
    """A command that the hand could not carry out; the message is the end of a sentence."""


class Tour(Protocol):
    """What the hand needs: the present snapshot, the camera and the functions of PySC2."""

    now: Snapshot

    def look_at(self, place: WorldPoint) -> Way:
        """Move the camera."""

    def function(self, name: str, *arguments: object) -> Way:
        """Call a function."""


class Hand:
    """Selects the units of commands, in one episode."""

    def __init__(self, tour: Tour, groups: dict[int, frozenset[int]]) -> None:
        """Take the units of each control group; the hand notes there what it sets."""
        self._tour = tour
        self._groups = groups

    def select(self, command: Command) -> Way:
        """Select the living units of a command, and no others.

        Raises:
            Missed: they are gone, or cannot be selected, or not without others.
        """
        if not self._alive(command):
            raise Missed("its units are gone")
        if self._is_right(command):
            return
        for way in self._short_ways(command):
            yield from way
            if self._is_right(command):
                return
        yield from self._click_all(command)
        wanted = self._alive(command)
        selected = self._selection
        if not wanted & selected:
            raise Missed("its units could not be selected, something stands over them")
        if selected - wanted:
            raise Missed("its units could not be selected alone, others stand over them")
        group = self._group(command)
        if group is not None and selected == wanted:
            yield from self._tour.function("select_control_group", "set", group)
            self._groups[group] = selected

    # --- the state --------------------------------------------------------------------------------------------

    @property
    def _selection(self) -> frozenset[int]:
        return frozenset(unit.tag for unit in self._tour.now.own if unit.is_selected)

    def _alive(self, command: Command) -> frozenset[int]:
        return frozenset(tag for tag in command.units if tag in self._tour.now.units)

    def _group(self, command: Command) -> int | None:
        """Return the control group of the team, if the command is for the whole team."""
        if command.said is None:
            return None
        team = command.said.team
        whole = self._alive(command) == frozenset(tag for tag in team.tags if tag in self._tour.now.units)
        return team.team.control_group if whole else None

    def _types(self, command: Command) -> set[str]:
        return {self._tour.now.units[tag].name for tag in self._alive(command)}

    def _is_right(self, command: Command) -> bool:
        wanted = self._alive(command)
        selected = self._selection
        if self._one_will_do(command):
            same = {self._tour.now.units[tag].name for tag in selected}
            return wanted <= selected and same == self._types(command)
        return wanted == selected

    def _one_will_do(self, command: Command) -> bool:
        """Return True if one selected unit is enough, so that others of its type may be selected too."""
        if command.function.stem.startswith("TrainWarp_"):
            return self._types(command) == {"WarpGate"}
        return command.function.stem.startswith("Train_") and self._types(command) == {"Larva"}

    # --- short ways -------------------------------------------------------------------------------------------

    def _short_ways(self, command: Command) -> Iterator[Way]:
        """Yield the ways of one or two functions that may lead to the right selection."""
        tour = self._tour
        wanted = self._alive(command)
        player = tour.now.player
        group = self._group(command)
        if group is not None and wanted <= self._groups.get(group, frozenset()):
            yield tour.function("select_control_group", "recall", group)
        if self._one_will_do(command):
            yield (
                self._larvae(command)
                if "Larva" in self._types(command)
                else tour.function("select_warp_gates", "select")
            )
        if len(wanted) == player.idle_worker_count == 1 and self._types(command) <= WORKERS:
            yield tour.function("select_idle_worker", "select")
        if len(wanted) == player.army_count >= LARGE:
            yield tour.function("select_army", "select")

    def _larvae(self, command: Command) -> Way:
        """Select the hatchery of a Larva, and then its Larvae."""
        larva = self._tour.now.units[min(self._alive(command))]
        homes = [u for u in self._tour.now.own if u.name in HATCHERIES]
        if not homes:
            return
        nearest = min(homes, key=lambda u: ((u.pos.x - larva.pos.x) ** 2 + (u.pos.y - larva.pos.y) ** 2, u.tag))
        yield from self._click(nearest.tag, "select")
        yield from self._tour.function("select_larva")

    # --- clicks -----------------------------------------------------------------------------------------------

    def _click_all(self, command: Command) -> Way:
        """Click the units that the selection lacks, and those that must leave it; those on the screen first."""
        tries: Counter[int] = Counter()
        fresh = bool(self._selection - self._alive(command))
        while True:
            wanted = self._alive(command)
            selected = self._selection
            missing = [t for t in command.units if t in wanted and (fresh or t not in selected) and tries[t] < TRIES]
            strange = [] if fresh else [t for t in sorted(selected - wanted) if tries[t] < TRIES]
            if not missing and not strange:
                return
            screen = RealScreen(self._tour.now)
            tag = min(missing or strange, key=lambda t: screen.pixel(self._tour.now.units[t].pos) is None)
            anew = fresh or not selected
            same = self._of_a_kind(tag, screen)
            at_once = tag in missing and same <= wanted and len(same & set(missing)) > 1 and not tries[tag]
            how = {(True, True): "select_all_type", (True, False): "add_all_type", (False, True): "select"}
            for other in same if at_once else (tag,):
                tries[other] += 1
            yield from self._click(tag, how.get((at_once, anew), "toggle"))
            fresh = False

    def _of_a_kind(self, tag: int, screen: RealScreen) -> frozenset[int]:
        """Return the own units of the same type that are on the screen."""
        kind = self._tour.now.units[tag].unit_type
        return frozenset(u.tag for u in self._tour.now.own if u.unit_type == kind and screen.pixel(u.pos))

    def _click(self, tag: int, how: str) -> Way:
        """Click a unit, and move the camera to it first if it is not on the screen; do nothing if it is covered."""
        unit = self._tour.now.units.get(tag)
        if unit is not None and RealScreen(self._tour.now).pixel(unit.pos) is None:
            yield from self._tour.look_at(unit.pos)
            unit = self._tour.now.units.get(tag)
        pixel = None if unit is None else RealScreen(self._tour.now).hit(unit)
        if pixel is not None:
            yield from self._tour.function("select_point", how, pixel)
