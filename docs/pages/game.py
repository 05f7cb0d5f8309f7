"""The pages of tasks, units and maps, from the data of the bridge and the simulator."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from docs.pages.markdown import code, codes, head, join, table
from khala_bridge.task.differences import differences_of, papers_notes
from khala_bridge.task.maps import known_maps
from khala_orchestrator.config import all_tasks, task_files
from khala_protocol.messages import LOOPS_PER_S
from khala_simulator.maps.game_map import MapError, load_map
from khala_simulator.tick import new_game

if TYPE_CHECKING:
    from khala_bridge.task.config import AgentConfig, TaskConfig
    from khala_bridge.task.differences import PapersDifference
    from khala_bridge.task.maps import MapSpec
    from khala_simulator.world.world import World

AGENTS, OPPONENT = 1, 2
"""Player numbers on the shipped maps."""
PLAYED = {
    "files": "files",
    "paper": "paper",
    "variant": "files, or paper with `variant: paper`",
}
VARIANTS = """## The paper and its files

The paper of LLM-PySC2 and its published maps and files differ in places. A task plays what the maps and files do.
`khala run TASK --variant paper`, or `variant: paper` in a task file or an experiment, plays what the paper says, where
the last column says so. Its maps are the simulator's own, and the real game does not have them; its orders are possible
in both games. Killed workers are counted by those that are left. The run card, each result and each report name the
variant, and no cell of a report mixes two. Agents read a number behind the name of each team of a single unit, so that
`Observer` is `Observer-1` to them.
"""


def tasks() -> str:
    """Return every shipped task with its agents."""
    found = list(all_tasks())
    written = {path.stem for path in task_files()}
    overview = [
        (_link(task) if task.name in written else code(task.name), _agents(task), task.description) for task in found
    ]
    return join(
        head("Tasks", "`configs/tasks`, and the maps for which none is there"),
        "What `khala run` and `khala host` take by name. To make one: [write a task](../how-to/write-a-task.md). A map "
        "without a task file is played by one commander of all units, with every action that they have.",
        table(("task", "agents", "about"), overview),
        VARIANTS,
        _notes(),
        *(_task(task) for task in found if task.name in written),
    )


def maps() -> str:
    """Return every known map, and its units in the simulator."""
    rows = [_map_row(spec) for spec in known_maps().values()]
    return join(
        head("Maps", "`bridge/khala_bridge/data/maps.yaml` and `simulator/khala_simulator/data/maps`"),
        "Files are below the directory `Maps` of the install. What stands on a map, and when it ends, is the map's own "
        "affair; the last columns are what the simulator's maps hold.",
        table(("map", "file", "race", "against", "limit", "cells", "agents' units", "enemy units"), rows),
    )


def _notes() -> str:
    """Return where the paper and its files differ, over all tasks."""
    rows = [
        (title if row is notes.differs[0] else "", *_difference(row, with_levels=True))
        for title, notes in papers_notes().items()
        for row in notes.differs
    ]
    return table(("task", "what", "the paper says", "its maps and files do", "played"), rows)


def _difference(row: PapersDifference, *, with_levels: bool) -> tuple[str, ...]:
    levels = f", level {', '.join(map(str, row.levels))}" if with_levels and row.levels else ""
    return (f"{row.what}{levels}", row.paper or "nothing", row.files, PLAYED[row.played])


def _link(task: TaskConfig) -> str:
    return f"[`{task.name}`](#{task.name.lower()})"


def _agents(task: TaskConfig) -> str:
    return ", ".join(dict.fromkeys(card.name for card in task.cards()))


def _task(task: TaskConfig) -> str:
    wait = "as long as it takes" if task.clock.max_wait_s is None else f"at most {task.clock.max_wait_s:g} s"
    clock = f"clock {code(task.clock.rule)}: {task.clock.step_loops} game loops a step, waits {wait}"
    facts = [
        f"* Map [{code(task.map_spec.name)}](maps.md), executor {code(task.executor)}, {clock}.",
        f"* At most {task.max_actions} actions per team and reply.",
    ]
    if len(task.agents) > 1 and task.communication:
        channels = f", and on {codes(task.channels)}" if task.channels else ""
        facts.append(f"* The agents can write to each other{channels}.")
    if task.sides:
        facts.append(f"* Two sides play against each other: {codes(side.side for side in task.sides)}.")
    rows = list(dict.fromkeys(row for side in task.per_side() for agent in side.agents for row in _teams(agent)))
    return join(
        f"## {task.name}",
        task.description,
        task.task,
        "\n".join(facts),
        table(("agent", "team", "units", "actions"), rows),
        _of_paper(task),
    )


def _of_paper(task: TaskConfig) -> str:
    """Return where the paper and its files differ in a task; "" if they do not."""
    rows = [_difference(row, with_levels=False) for row in differences_of(task.name)]
    if not rows:
        return ""
    called = next((n.called for n in papers_notes().values() if n.called and n.of(task.name)), "")
    head = f"In the paper: `{called}`." if called else ""
    return join(head, table(("what", "the paper says", "its maps and files do", "played"), rows))


def _teams(agent: AgentConfig) -> list[tuple[str, str, str, str]]:
    return [
        (
            agent.name,
            code(team.name),
            ", ".join(team.unit_types),
            codes(dict.fromkeys(name for unit in team.unit_types for name in agent.actions[unit])),
        )
        for team in agent.teams
    ]


def _map_row(spec: MapSpec) -> tuple[object, ...]:
    limit = f"{spec.limit_loops} loops, {spec.limit_loops / LOOPS_PER_S:.0f} s" if spec.limit_loops else ""
    against = f"{spec.opponent}, {spec.difficulty}" if spec.opponent else "nobody"
    against += ", or a second side" if spec.two_sides else ""
    row = (code(spec.name), code(spec.file), spec.race, against, limit)
    try:
        shipped = load_map(spec.file.removesuffix(".SC2Map"))
    except MapError:
        return (*row, "not in the simulator", "", "")
    x0, y0, x1, y1 = shipped.terrain.playable
    begun = new_game(shipped)
    return (*row, f"{x1 - x0} x {y1 - y0}", *(_army(begun, player) for player in (AGENTS, OPPONENT)))


def _army(world: World, player: int) -> str:
    """Return a player's units when the game begins."""
    names = [world.unit_type(slot).name for slot in world.units_of(player).tolist()]
    return ", ".join(f"{count} {name.removesuffix('_RL')}" for name, count in Counter(names).items())
