"""Draw a recorded battle as a moving picture: `python -m docs.picture [RECORDING]`, which plays one if none is given.

Everything in it comes from the recording: places and health of units from the views, the agents' words
from their replies, the results from the reports. The battlefield is on the left, the agents' words on the right.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_protocol.messages import Message, Observation, Reply, Report, Result, Run, UnitView
from khala_protocol.recording import read
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterator

Image = np.ndarray
Colour = tuple[int, int, int]

FIELD, PANEL, HEIGHT, MARGIN = 460, 380, 460, 26
TASK = "2s3z_pair"
OUT = Path(__file__).parent / "images" / "2s3z.webp"
BETWEEN = 3  # pictures from one step to the next
FRAME_MS, LAST_MS = 50, 3000

BACKGROUND: Colour = (38, 27, 20)
GROUND: Colour = (52, 38, 29)
GRID: Colour = (64, 48, 38)
TEXT: Colour = (240, 234, 228)
FAINT: Colour = (160, 146, 134)
OWN: Colour = (245, 190, 80)
ENEMY: Colour = (92, 102, 245)
HEALTH: Colour = (120, 214, 120)
SHIELD: Colour = (250, 200, 140)
SAID: tuple[Colour, ...] = ((245, 190, 80), (120, 200, 250), (160, 230, 160))

SANS = cv2.FontFace("sans")
RADIUS = {"Colossus": 15, "SpineCrawler": 15, "Stalker": 11, "Zealot": 9, "Zergling": 6}
CORNERS = {"Stalker": 6, "Zealot": 4, "Colossus": 8, "Zergling": 3, "SpineCrawler": 5}


@dataclass
class Moment:
    """One step of an episode, as drawn."""

    step: int
    time_s: float = 0.0
    units: dict[str, UnitView] = field(default_factory=dict)
    said: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    targets: list[tuple[str, str]] = field(default_factory=list)
    latency_s: dict[str, float] = field(default_factory=dict)


@dataclass
class Battle:
    """The first episode of a recording."""

    run: Run
    moments: list[Moment]
    result: Result | None


def load(path: Path) -> Battle:
    """Read the needed parts of a recording."""
    run: Run | None = None
    result: Result | None = None
    moments: dict[int, Moment] = {}
    for recorded in read(path):
        message = recorded.message
        if isinstance(message, Run):
            run = message
        elif isinstance(message, Result):
            result = result or message
        elif isinstance(message, Observation | Reply | Message | Report) and message.episode == 0:
            moment = moments.setdefault(message.step, Moment(message.step))
            _note(moment, message)
    if run is None or not moments:
        raise SystemExit(f"{path} holds no run with observations")
    return Battle(run, [moments[step] for step in sorted(moments)], result)


def _note(moment: Moment, message: Observation | Reply | Message | Report) -> None:
    match message:
        case Observation():
            moment.time_s = message.view.time_s
            for team in message.view.teams:
                moment.units |= {unit.tag: unit for unit in (*team.units, *team.allies, *team.enemies)}
        case Reply():
            _note_reply(moment, message)
        case Message():
            moment.said[message.agent].append(f"to {message.recipient}: {message.text}")
        case Report():
            moment.latency_s = {a.agent: a.latency_s for a in message.agents if a.latency_s is not None}


def _note_reply(moment: Moment, reply: Reply) -> None:
    words = reply.text.partition("Actions:")[0].removeprefix("Analysis:").strip()
    moment.said[reply.agent].insert(0, " ".join(words.split()))
    for call in parse(reply.text).calls:
        tags = [arg for arg in call.args if isinstance(arg, str) and arg.startswith("0x")]
        moment.said[reply.agent].append(f"{call.team or ''}  {reply.text[call.start : call.end]}".strip())
        if tags and call.team:
            moment.targets.append((call.team, tags[-1]))


class Painter:
    """The painter that turns moments into pictures."""

    def __init__(self, battle: Battle) -> None:
        self._battle = battle
        points = np.array([u.minimap for m in battle.moments for u in m.units.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        self._span = float(max(*(high - low), 12.0))
        self._corner = (low + high - self._span) / 2
        self._agents = [card.name for card in battle.run.agents]

    def pictures(self) -> Iterator[Image]:
        """Yield every picture of the battle, in order."""
        moments = self._battle.moments
        for now, after in zip(moments, [*moments[1:], moments[-1]], strict=True):
            for part in range(BETWEEN):
                yield self._picture(now, after, part / BETWEEN)
        if self._battle.result:
            yield self._ending(self._picture(moments[-1], moments[-1], 0.0), self._battle.result)

    def _picture(self, now: Moment, after: Moment, part: float) -> Image:
        image = np.full((HEIGHT, FIELD + PANEL, 3), BACKGROUND, np.uint8)
        self._ground(image)
        at = {tag: self._place(unit, after.units.get(tag, unit), part) for tag, unit in now.units.items()}
        for tag, place in at.items():
            if tag not in after.units:
                cv2.circle(image, place, int(8 + 14 * part), FAINT, 1, cv2.LINE_AA)
        for team, target in now.targets:
            self._shots(image, now, at, team, target)
        for tag, unit in sorted(now.units.items()):
            if tag in after.units or part == 0:
                _unit(image, at[tag], unit)
        self._panel(image, now)
        return image

    def _ground(self, image: Image) -> None:
        cv2.rectangle(image, (12, 12), (FIELD - 12, HEIGHT - 12), GROUND, -1, cv2.LINE_AA)
        for i in range(1, 8):
            at = 12 + (FIELD - 24) * i // 8
            cv2.line(image, (at, 12), (at, HEIGHT - 12), GRID, 1)
            cv2.line(image, (12, at), (FIELD - 12, at), GRID, 1)

    def _place(self, unit: UnitView, after: UnitView, part: float) -> tuple[int, int]:
        here = (1 - part) * np.array(unit.minimap) + part * np.array(after.minimap)
        x, y = MARGIN + 12 + (here - self._corner) / self._span * (FIELD - 24 - 2 * MARGIN)
        return int(x), int(y)

    def _shots(self, image: Image, now: Moment, at: dict[str, tuple[int, int]], team: str, target: str) -> None:
        if target not in at:
            return
        kind = team.partition("-")[0]
        for tag, unit in now.units.items():
            if unit.alliance != "enemy" and unit.type == kind:
                cv2.line(image, at[tag], at[target], (130, 110, 70), 1, cv2.LINE_AA)

    def _panel(self, image: Image, now: Moment) -> None:
        run, left = self._battle.run, FIELD + 12
        _write(image, run.map_name, (left, 38), TEXT, 22, 600)
        _write(image, f"{int(now.time_s) // 60}:{int(now.time_s) % 60:02d}", (FIELD + PANEL - 60, 38), FAINT, 18, 400)
        _write(image, f"{len(self._agents)} agents on the bus, clock {run.clock.rule}", (left, 60), FAINT, 13, 400)
        top, room = 88, (HEIGHT - 100) // max(1, len(self._agents))
        for index, agent in enumerate(self._agents):
            self._speech(image, now, agent, SAID[index % len(SAID)], (left, top + index * room), room)

    def _speech(
        self, image: Image, now: Moment, agent: str, colour: Colour, corner: tuple[int, int], room: int
    ) -> None:
        x, y = corner
        cv2.line(image, (x, y - 10), (x, y + room - 34), colour, 2, cv2.LINE_AA)
        _write(image, agent, (x + 10, y + 4), colour, 15, 600)
        if agent in now.latency_s:
            _write(image, f"{now.latency_s[agent] * 1000:.0f} ms", (FIELD + PANEL - 62, y + 4), FAINT, 12, 400)
        line = y + 24
        for text in now.said.get(agent, []):
            for row in _wrap(text, 48):
                if line > y + room - 30:
                    return
                _write(image, row, (x + 10, line), TEXT if "<" in row else FAINT, 12, 400)
                line += 17

    def _ending(self, image: Image, result: Result) -> Image:
        image[12 : HEIGHT - 12, 12 : FIELD - 12] = (image[12 : HEIGHT - 12, 12 : FIELD - 12] * 0.35).astype(np.uint8)
        _write(image, result.outcome.upper(), (FIELD // 2 - 44, HEIGHT // 2 - 8), TEXT, 36, 700)
        kd = "none lost" if result.kd is None else f"K/D {result.kd:.2f}"
        _write(image, f"{result.cause}, {kd}", (FIELD // 2 - 80, HEIGHT // 2 + 24), FAINT, 16, 400)
        return image


def _unit(image: Image, at: tuple[int, int], unit: UnitView) -> None:
    radius, corners = RADIUS.get(unit.type, 10), CORNERS.get(unit.type, 12)
    turns = np.arange(corners) * 2 * np.pi / corners - np.pi / 2
    shape = np.stack([at[0] + radius * np.cos(turns), at[1] + radius * np.sin(turns)], axis=1).astype(np.int32)
    cv2.fillPoly(image, [shape], ENEMY if unit.alliance == "enemy" else OWN, cv2.LINE_AA)
    for share, colour, width in (
        (unit.shield / unit.shield_max if unit.shield_max else 0.0, SHIELD, radius + 6),
        (unit.health / unit.health_max, HEALTH, radius + 3),
    ):
        if share > 0:
            cv2.ellipse(image, at, (width, width), -90, 0, 360 * share, colour, 2, cv2.LINE_AA)


def _write(image: Image, text: str, at: tuple[int, int], colour: Colour, size: int, weight: int) -> None:
    cv2.putText(image, text, at, colour, SANS, size, weight)


def _wrap(text: str, width: int) -> Iterator[str]:
    row = ""
    for word in text.split():
        if len(row) + len(word) + 1 > width and row:
            yield row
            row = ""
        row = f"{row} {word}".strip()
    if row:
        yield row[:width]


def save(pictures: list[Image], path: Path) -> None:
    """Write the pictures as an endless WebP; a GIF of them is forty times as large."""
    animation = cv2.Animation(0, (0, 0, 0, 0))
    animation.frames = pictures
    animation.durations = [FRAME_MS] * (len(pictures) - 1) + [LAST_MS]
    if not cv2.imwriteanimation(str(path), animation, [cv2.IMWRITE_WEBP_QUALITY, 85]):
        raise SystemExit(f"{path} cannot be written")


def play(task: str) -> Path:
    """Play a task and return its recording."""
    command = [sys.executable, "-m", "khala_sc2", "run", task, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)  # noqa: S603  # our own command line
    return Path(json.loads(done.stdout)["recording"])


def main() -> None:
    """Draw the recording that is named, or one of a match that is played for it."""
    recording = Path(sys.argv[1]) if len(sys.argv) > 1 else play(TASK)
    pictures = list(Painter(load(recording)).pictures())
    OUT.parent.mkdir(parents=True, exist_ok=True)
    save(pictures, OUT)
    sys.stdout.write(f"{OUT}: {len(pictures)} pictures, {OUT.stat().st_size / 1e6:.1f} MB\n")


if __name__ == "__main__":
    main()
