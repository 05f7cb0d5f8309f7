"""A recording with scenes, made up message by message: three Stalkers, an enemy that loses one every ten steps."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key, image_key, run_key
from khala_protocol.messages import (
    AgentCard,
    AgentReport,
    Briefing,
    Casualties,
    Clock,
    Event,
    GridView,
    ImageRef,
    Message,
    ModelCall,
    Observation,
    PlayerMark,
    Rejection,
    Reply,
    Report,
    Result,
    Run,
    Scene,
    TeamView,
    Terrain,
    UnitFlag,
    UnitMark,
    UnitView,
    Usage,
    View,
)
from khala_protocol.recording import Recorder
from khala_sc2.view.runs import Opened
from khala_sc2.view.scan import whole

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_protocol.messages import Wire

RUN, SIDE, AGENT = "made", "blue", "Stalkers"
PICTURE = b"\x89PNG\r\n\x1a\n" + bytes(64)
HOSTILE = '<img src=x onerror="alert(1)"></script><script>alert(2)</script>'
STEPS = 40
LOOPS = 23


def card(**changes: object) -> Run:
    values: dict[str, object] = {
        "run": RUN, "task": "2s3z_pair", "map_name": "2s3z", "map_sha256": "0" * 64, "seed": 1, "episodes": 1,
        "game": "Khala simulator", "opponent": "computer (protoss, easy)", "executor": "raw", "clock": Clock(),
        "agents": (AgentCard(name=AGENT, side=SIDE, teams=("Stalker-1",)),), "advisers": ("Coach",),
        "catalogue_sha256": "0" * 64, "versions": {"khala": "0.1.0"},
    }  # fmt: skip
    return Run(**values | changes)


def key_of(message: Wire) -> str:
    topic = Topic(message.kind)  # type: ignore[attr-defined]
    if topic in {Topic.RUN, Topic.REPORT, Topic.RESULT, Topic.TERRAIN, Topic.SCENE}:
        return run_key(message.run, topic)
    return agent_key(message.run, message.side, message.agent, topic)  # type: ignore[attr-defined]


def unit(
    tag: int, x: float, y: float, *, player: int = 1, flags: int = UnitFlag.ARMY, progress: float = 1.0
) -> UnitMark:
    kind = "Gateway" if flags & UnitFlag.STRUCTURE else "Stalker"
    return UnitMark(
        tag,
        kind,
        player,
        x,
        y,
        0.5,
        0.0,
        80.0 - tag % 7,
        80.0,
        80.0,
        80.0,
        0.0,
        progress,
        int(flags),
        1,
        "",
        0,
        -1.0,
        -1.0,
    )


def scene(step: int) -> Scene:
    """Return a scene: a fight in which the enemy loses a unit every ten steps, while a Gateway is built."""
    own = [unit(100 + i, 10.0 + step / 10, 20.0 + i) for i in range(3)]
    enemies = [unit(200 + i, 30.0, 20.0 + i, player=2) for i in range(4 - step // 10)]
    gateway = unit(300, 5.0, 5.0, flags=UnitFlag.STRUCTURE, progress=min(1.0, step / 20))
    return Scene(
        run=RUN, episode=0, step=step, game_loop=step * LOOPS, sides=(SIDE,), whole=True,
        players=(
            PlayerMark(player=1, side=SIDE, race="protoss", units=4, army_value=525, minerals=50 + step, vespene=0),
            PlayerMark(player=2, race="protoss", units=len(enemies), army_value=175 * len(enemies)),
        ),
        units=(*own, *enemies, gateway),
    )  # fmt: skip


def observation(step: int) -> Observation:
    """Return what the agent sees: its units on a screen in the middle of which they stand."""
    units = tuple(
        UnitView(
            tag=hex(100 + i), type="Stalker", alliance="own", screen=(12.0, 12.0 + 2 * i),
            minimap=(10.0 + step / 10, 20.0 + i), health=80.0, health_max=80.0,
        )
        for i in range(3)
    )  # fmt: skip
    dead = Event(what="died", tag=hex(203 - (step // 10 - 1)), type="Stalker", alliance="enemy")
    team = TeamView(name="Stalker-1", minimap=(10.0 + step / 10, 20.0), units=units)
    return Observation(
        run=RUN, side=SIDE, agent=AGENT, episode=0, step=step, game_loop=step * LOOPS, answer_within_s=15.0,
        text=f"Step {step}: {HOSTILE}",
        view=View(time_s=step * LOOPS / 22.4, teams=(team,), events=(dead,) if step and step % 10 == 0 else ()),
        images=(picture(),) if step == 3 else (),
    )  # fmt: skip


def picture() -> ImageRef:
    digest = hashlib.sha256(PICTURE).hexdigest()
    return ImageRef(name="screen", media_type="image/png", sha256=digest, width=8, height=8, bytes=len(PICTURE))


def reply(step: int) -> Reply:
    calls = "<Move_Screen([18, 12])>\n        <Stop(1)>"
    text = f"Analysis: I hold. {HOSTILE}\nActions:\n    Team Stalker-1:\n        {calls}\n"
    usage = Usage(requests=1, prompt_tokens=100, completion_tokens=10, cost_usd=0.001)
    return Reply(
        run=RUN, side=SIDE, agent=AGENT, episode=0, step=step, text=text, latency_s=0.5, attempts=1, usage=usage
    )


def report(step: int) -> Report:
    said = reply(step)
    refused = Rejection(
        reason="wrong_arguments", message="Stop takes no arguments.", text="<Stop(1)>", start=said.text.index("<Stop"),
        team="Stalker-1",
    )  # fmt: skip
    agent = AgentReport(
        agent=AGENT, side=SIDE, status="ok", latency_s=0.5, accepted=("Stalker-1 <Move_Screen([18, 12])>",),
        rejections=(refused,), usage=said.usage, fate="fresh",
    )  # fmt: skip
    killed = 175.0 if (step + 1) % 10 == 0 else 0.0
    return Report(
        run=RUN, side=SIDE, episode=0, step=step, game_loop=(step + 1) * LOOPS, agents=(agent,), score=float(step),
        killed_value=killed, lost_value=0.0, functions=("Move_screen(now, …)",),
    )  # fmt: skip


def step_of(step: int) -> Iterator[Wire]:
    """Yield the messages of a step, in the order of a host."""
    yield observation(step)
    yield scene(step)
    yield reply(step)
    if step == 5:
        yield ModelCall(
            run=RUN, side=SIDE, agent=AGENT, episode=0, step=5, attempt=1, model="qwen", answered_by="qwen-2.5",
            endpoint="http://localhost", prompt=(), completion="…", status="ok", started_s=0.0, latency_s=0.5,
        )  # fmt: skip
        yield Message(run=RUN, side=SIDE, agent=AGENT, episode=0, step=5, recipient="Zealots", text="Help.")
    yield report(step)


def begin() -> Iterator[Wire]:
    """Yield what comes before the first step."""
    yield card()
    yield Briefing(run=RUN, side=SIDE, agent=AGENT, episode=0, role="You hold.", agent_kind="combat_group")
    grid = GridView(width=0, height=0, data="")
    yield Terrain(run=RUN, episode=0, size=(128, 96), bounds=(0.0, 0.0, 64.0, 48.0), height=grid, walkable=grid)


def end() -> Result:
    return Result(
        run=RUN, side=SIDE, episode=0, outcome="win", cause="enemy defeated", steps=STEPS, game_loop=STEPS * LOOPS,
        game_s=STEPS * LOOPS / 22.4, wall_s=20.0, killed=Casualties(units=4, value=700.0), lost=Casualties(), kd=None,
    )  # fmt: skip


def put(recorder: Recorder, *messages: Wire) -> None:
    """Record messages, and end their chunk as a host does after each step."""
    for message in messages:
        if isinstance(message, Observation) and message.images:
            recorder.write(image_key(RUN, SIDE, AGENT, 0), PICTURE)
        recorder.write(key_of(message), encode(message))
    recorder.flush()


def make(path: Path, *, steps: int = STEPS, ends: bool = True) -> Path:
    """Write the made-up recording."""
    with Recorder(path) as recorder:
        put(recorder, *begin())
        for step in range(steps):
            put(recorder, *step_of(step))
        if ends:
            put(recorder, end())
    return path


def opened(path: Path) -> Opened:
    """Return a recording, indexed to its end."""
    found = Opened("id", path)
    whole(found.index)
    return found
