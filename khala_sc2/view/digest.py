"""A recording's messages → rows of the index: curves, losses and marks, from one message after the other.

What it must remember from one message to the next is in `Memory`, which the index keeps, so that an index goes on where
it was left. Scenes say most of it; of a recording without scenes, the agents' observations do. It reads plain JSON, for
a hundred thousand messages are too many to be checked field by field; what is not as it should be counts for nothing.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from khala_bridge.knowledge import WORKERS, is_structure, knowledge
from khala_protocol.messages import MOST, STEP_LIMIT, UnitFlag, refusals_by_reason

if TYPE_CHECKING:
    from collections.abc import Iterable

Json = dict[str, Any]
OPPONENT = "opponent"
"""The side of an opponent that Khala does not play."""


@dataclass(slots=True)
class Memory:
    """What is known of an episode up to a message.

    Attributes:
        places: where units were last seen, and whose they are, by tag: side, type, x, y.
        dead: tags of units whose death is noted.
        made: tags of structures, and names of upgrades, that are noted as finished.
        step: the last one that was reported.
    """

    episode: int = -1
    step: int = 0
    places: dict[str, tuple[str, str, float | None, float | None]] = field(default_factory=dict)
    dead: set[str] = field(default_factory=set)
    made: set[str] = field(default_factory=set)
    scenes: bool = False
    whole: bool = False
    """Whether the scenes show the map without fog."""
    sums: dict[str, float] = field(default_factory=dict)
    """Of the curves that add up, so far."""
    fallen: dict[str, float] = field(default_factory=dict)
    """What each side lost since the last report, for reports of older versions, which do not say."""

    def begin(self, episode: int) -> None:
        """Forget what belongs to another episode."""
        if episode != self.episode:
            self.episode = episode
            self.step = 0
            self.scenes = False
            self.places = {}
            self.dead = set()
            self.made = set()
            self.sums = {}
            self.fallen = {}

    def dump(self) -> Json:
        """Return it as JSON data."""
        plain = {name: getattr(self, name) for name in self.__slots__}
        return plain | {"dead": sorted(self.dead), "made": sorted(self.made)}

    @classmethod
    def load(cls, data: Json) -> Memory:
        """Return what `dump` returned."""
        places = {tag: (side, kind, x, y) for tag, (side, kind, x, y) in data["places"].items()}
        sets = {"dead": set(data["dead"]), "made": set(data["made"])}
        return cls(**data | sets | {"places": places})


@dataclass(slots=True)
class Digest:
    """Rows to be written: what the messages since the last time add."""

    memory: Memory
    sides: tuple[str, ...] = ()
    """That Khala plays."""
    steps: dict[tuple[int, int], Json] = field(default_factory=dict)
    losses: list[tuple[Any, ...]] = field(default_factory=list)
    marks: list[tuple[Any, ...]] = field(default_factory=list)
    decisions: list[tuple[Any, ...]] = field(default_factory=list)

    def note(self, said: Json, values: Json) -> None:
        """Note numbers of a step; what is no number counts as unknown."""
        row = self.steps.setdefault((said["episode"], said["step"]), {})
        row |= {name: number(value) for name, value in values.items()}

    def mark(self, said: Json, kind: str, text: str, *, side: str = "", agent: str = "") -> None:
        """Note that something happened."""
        self.marks.append((said["episode"], said["step"], kind, str(side), str(agent), str(text)[:200]))

    # --- reports ------------------------------------------------------------------------------------

    def report(self, said: Json) -> None:
        """Take in the report of a side's step."""
        side = said.get("side", "blue")
        agents = said["agents"]
        self.memory.begin(said["episode"])
        self.memory.step = said["step"]
        usages = [agent.get("usage", {}) for agent in agents]
        costs = [usage["cost_usd"] for usage in usages if usage.get("cost_usd") is not None]
        latencies = [agent["latency_s"] for agent in agents if agent.get("latency_s") is not None]
        known = {"after": said["game_loop"], f"score/{side}": said.get("score", 0.0)}
        sums = self._sums(side, {
            "killed_value": self._killed_value(said, side),
            "lost_value": self._lost(said, side),
            "tokens": sum(usage.get("prompt_tokens", 0) + usage.get("completion_tokens", 0) for usage in usages),
            "cost_usd": sum(costs) if costs else None,
            "refused": sum(_count_refused(agent) for agent in agents),
        })  # fmt: skip
        self.note(said, known | sums | {f"latency_s/{side}": max(latencies, default=None)})
        for agent in agents:
            self._agent(said, side, agent)
        for incident in said.get("incidents", ()):
            self.mark(said, "incident", incident, side=side)

    def _killed_value(self, said: Json, side: str) -> float | None:
        value: float | None = said.get("killed_value")
        return value if value is not None else self.memory.fallen.pop(self._other(side), None)

    def _lost(self, said: Json, side: str) -> float | None:
        value: float | None = said.get("lost_value")
        return value if value is not None else self.memory.fallen.pop(side, None)

    def _sums(self, side: str, more: Json) -> Json:
        """Add to the sums of a side; return them as far as any number was known."""
        for name, value in more.items():
            if value is not None:
                key = f"{name}/{side}"
                self.memory.sums[key] = round(self.memory.sums.get(key, 0) + value, 6)
        return {key: value for key, value in self.memory.sums.items() if key.endswith(f"/{side}")}

    def _agent(self, said: Json, side: str, agent: Json) -> None:
        name = agent["agent"]
        asked = agent.get("asked_step")
        asked = said["step"] if asked is None else asked
        self.decisions.append((said["episode"], side, name, asked, said["step"]))
        if (status := agent["status"]) != "ok":
            kind = "fallback" if status == "fallback" else "late"
            self.mark(said, kind, agent.get("detail") or agent["status"], side=side, agent=name)
        elif agent.get("fate") == "refused":
            why = next((refused["message"] for refused in agent["rejections"]), "")
            self.mark(said, "refused", why, side=side, agent=name)

    def message(self, said: Json) -> None:
        """Take in a message between agents, or an advice."""
        kind = "advice" if said.get("human") else "message"
        self.mark(said, kind, f"→ {said['recipient']}: {said['text']}", side=said["side"], agent=said["agent"])

    def result(self, said: Json) -> None:
        """Take in the result of an episode for a side."""
        self.mark(
            said | {"step": self.memory.step},
            "end",
            _ending_of(said),
            side=said.get("side", "blue"),
        )

    # --- observations -------------------------------------------------------------------------------

    def observation(self, said: Json) -> None:
        """Take in what an agent saw; of a match with scenes only what these do not say."""
        self.memory.begin(said["episode"])
        self.note(said, {"loop": said["game_loop"]})
        view, side = said["view"], said["side"]
        if not self.memory.scenes:
            self.note(said, _from_view(view, side, alone=len(self.sides) == 1))
            self._remember(view, side)
        events = [*view.get("events", ()), *(event for team in view["teams"] for event in team.get("events", ()))]
        for event in events:
            self._event(said, event)

    def _remember(self, view: Json, side: str) -> None:
        for team in view["teams"]:
            for group in ("units", "allies", "enemies"):
                whose = self._other(side) if group == "enemies" else side
                for unit in team.get(group, ()):
                    self.memory.places[unit["tag"]] = (whose, unit["type"], *unit["minimap"])

    def _event(self, said: Json, event: Json) -> None:
        what, tag, side = event["what"], event["tag"], said["side"]
        memory = self.memory
        if what == "died" and tag not in memory.dead and event["alliance"] != "neutral":
            memory.dead.add(tag)
            whose = self._other(side) if event["alliance"] == "enemy" else side
            _, _, x, y = memory.places.get(tag, ("", "", None, None))
            self.loss(said["episode"], said["step"], whose, event["type"], (x, y))
        elif what == "finished" and tag not in memory.made and is_structure(event["type"]):
            memory.made.add(tag)
            self.mark(said, "building", event["type"], side=side)
        elif what == "researched" and (name := f"{side}/{event['type']}") not in memory.made:
            memory.made.add(name)
            self.mark(said, "upgrade", event["type"], side=side)

    def loss(self, episode: int, step: int, side: str, kind: str, at: tuple[float | None, float | None]) -> None:
        """Note that a unit died."""
        value, (x, y) = value_of(kind), at
        self.losses.append((episode, step, side, str(kind), value, number(x), number(y)))
        self.memory.fallen[side] = self.memory.fallen.get(side, 0.0) + value

    def _other(self, side: str) -> str:
        return next((other for other in self.sides if other != side), OPPONENT)

    # --- scenes -------------------------------------------------------------------------------------

    def scene(self, said: Json) -> None:
        """Take in the whole map."""
        memory = self.memory
        memory.begin(said["episode"])
        names = {player["player"]: player.get("side") or OPPONENT for player in said["players"]}
        self.note(said, {"loop": said["game_loop"]})
        for player in said["players"]:
            self.note(said, _from_player(player, names[player["player"]]))
        self._structures(said, names, first=not memory.scenes)
        memory.scenes = True
        memory.whole = bool(said["whole"])
        for unit in said["units"]:
            memory.places[hex(unit[0])] = (names.get(unit[2], ""), unit[1], unit[3], unit[4])

    def _structures(self, said: Json, names: dict[int, str], *, first: bool) -> None:
        """Note structures that are finished now, but not those of the beginning."""
        for unit in said["units"]:
            tag = hex(unit[0])
            if unit[13] & UnitFlag.STRUCTURE and unit[12] >= 1.0 and unit[2] in names and tag not in self.memory.made:
                self.memory.made.add(tag)
                if not first:
                    self.mark(said, "building", unit[1], side=names[unit[2]])


def number(value: object) -> float | None:
    """Return a value if it is a number."""
    return value if isinstance(value, int | float) and abs(value) <= MOST else None


def tag_number(tag: str) -> int:
    """Return a tag as a number; 0 for a text that is none."""
    try:
        return int(tag, 16)
    except ValueError:
        return 0


def value_of(kind: str) -> float:
    """Return the minerals and vespene that a type of unit costs; 0 for an unknown one."""
    facts = knowledge().get(kind)
    return facts.value if facts else 0.0


def _from_player(player: Json, side: str) -> Json:
    income = player.get("income") or (None, None)
    return {
        f"army_value/{side}": player.get("army_value"),
        f"workers/{side}": player.get("workers"),
        f"minerals/{side}": player.get("minerals"),
        f"vespene/{side}": player.get("vespene"),
        f"supply_used/{side}": player.get("supply_used"),
        f"supply_cap/{side}": player.get("supply_cap"),
        f"income_minerals/{side}": income[0],
        f"income_vespene/{side}": income[1],
    }


def _from_view(view: Json, side: str, *, alone: bool) -> Json:
    found = {f"{name}/{side}": value for name, value in view["resources"].items() if name != "promised"}
    if counts := view.get("counts"):
        found[f"workers/{side}"] = sum(count["ready"] for count in counts["units"] if count["type"] in WORKERS)
    if army := view.get("army"):
        found[f"army_value/{side}"] = army["value"]
        if alone:
            found[f"army_value/{OPPONENT}"] = sum(part["value"] for part in army["enemies"])
    if economy := view.get("economy"):
        found[f"income_minerals/{side}"], found[f"income_vespene/{side}"] = economy["income"]
    return found


def count_kinds(kinds: Iterable[str]) -> str:
    """Return what there is of several: `2 Stalkers, 1 Probe`."""
    return ", ".join(
        f"{number} {kind if number == 1 else _several(kind)}" for kind, number in Counter(kinds).most_common()
    )


def _several(kind: str) -> str:
    return f"{kind}es" if kind.endswith(("ch", "sh", "s", "x")) else f"{kind}s"


def _count_refused(agent: dict[str, Any]) -> int:
    """Return how many calls of an agent's report were refused."""
    return sum(
        sum(refusals_by_reason(said.get("reason", ""), said.get("others", {})).values())
        for said in agent.get("rejections", ())
    )


def _ending_of(said: Json) -> str:
    """Return how and why an episode ended, also in a recording of a version that called a cut one a draw."""
    return f"cut at {said['steps']} steps" if said["cause"] == STEP_LIMIT else f"{said['outcome']}: {said['cause']}"
