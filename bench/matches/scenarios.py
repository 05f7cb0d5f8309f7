"""Play every scenario of the paper with scripted players, through `khala run`, and tabulate the results.

    python -m bench scenarios                              all 33 maps, skilled and focus-fire, one episode each
    python -m bench scenarios --tasks 'pvz_task1*' --episodes 5 --players skilled

Host, agents and the scripted model are processes that talk over the bus, as in any other run. The table goes to
`<out>/scenarios.md` as well, with a recording of every run next to it. The exit code is 1 if a run failed, or if a
player's reply had no valid action (class `malformed` or `unknown_action`): a scripted player reads its actions.
"""

from __future__ import annotations

import fnmatch
import json
import subprocess
import sys
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.command_line import make_parser
from khala_orchestrator.config import all_tasks

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

PLAYERS = ("skilled", "focus-fire")
FAMILIES = ("llm_smac/", "llm_pysc2/pvz_")
"""The directory of the paper's 33 maps."""
SHAME = ("malformed", "unknown_action")
COLUMNS = (
    "task",
    "player",
    "won",
    "drawn",
    "cut",
    "lost",
    "KD",
    "steps",
    "accepted",
    "rejections",
    "wall s",
    "recording",
)


@dataclass(frozen=True, slots=True)
class Row:
    """The results of a player in some episodes of a task."""

    task: str
    player: str
    outcomes: Counter[str] = field(default_factory=Counter)
    killed: float = 0.0
    """Minerals and vespene, of all episodes."""
    lost: float = 0.0
    steps: int = 0
    accepted: int = 0
    rejections: Counter[str] = field(default_factory=Counter)
    wall_s: float = 0.0
    recording: str = ""
    fault: str = ""
    """The error of the run, if it failed."""

    @property
    def cells(self) -> tuple[str, ...]:
        """The printed cells of the row."""
        if self.fault:
            return (self.task, self.player, *["-"] * 8, f"{self.wall_s:.0f}", self.fault)
        count = sum(self.outcomes.values())
        kd = "-" if not self.killed and not self.lost else f"{self.killed / self.lost:.2f}" if self.lost else "no loss"
        said = ", ".join(f"{number} {reason}" for reason, number in sorted(self.rejections.items())) or "none"
        outcomes = (f"{self.outcomes[name]}/{count}" for name in ("win", "draw", "cut", "loss"))
        work = (str(self.steps), str(self.accepted), said, f"{self.wall_s:.0f}", self.recording)
        return (self.task, self.player, *outcomes, kd, *work)


def scenarios(pattern: str = "*") -> list[str]:
    """Return the names of the tasks of the paper's maps that fit a pattern, maps in the order of their names."""
    found = (task for task in all_tasks() if task.map == task.name and task.map_spec.file.startswith(FAMILIES))
    return sorted(task.name for task in found if fnmatch.fnmatch(task.name, pattern))


def play(task: str, player: str, *, episodes: int, seed: int, out: Path) -> Row:
    """Run a task with a scripted player and return its row; the row of a run that fails says so."""
    command = [sys.executable, "-m", "khala_sc2", "run", task, "--model-name", player, "--latency", "0", "--json"]
    command += ["--episodes", str(episodes), "--seed", str(seed), "--out", str(out), "--max-wait", "60"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"code {done.returncode}"]
        return Row(task, player, fault=lines[-1])
    said = json.loads(done.stdout)
    results: list[dict[str, Any]] = said["results"]
    return Row(
        task=task,
        player=player,
        outcomes=Counter(result["outcome"] for result in results),
        killed=sum(result["killed"]["value"] for result in results),
        lost=sum(result["lost"]["value"] for result in results),
        steps=sum(result["steps"] for result in results),
        accepted=sum(result["accepted"] for result in results),
        rejections=sum((Counter(result["rejections"]) for result in results), Counter()),
        wall_s=sum(result["wall_s"] for result in results),
        recording=said["recording"],
    )


def table(rows: Iterable[Row]) -> Iterator[str]:
    """Yield the rows as lines of a Markdown table."""
    yield f"| {' | '.join(COLUMNS)} |"
    yield f"|{'---|' * len(COLUMNS)}"
    yield from (f"| {' | '.join(row.cells)} |" for row in rows)


def main() -> int:
    """Play the tasks that the options name; print and write the table."""
    options = make_parser(__doc__)
    options.add_argument("--tasks", default="*", metavar="PATTERN", help="only tasks whose names fit, such as 'pvz_*'")
    options.add_argument("--players", default=",".join(PLAYERS), help="scripted players, with commas between them")
    options.add_argument("--episodes", type=int, default=1, help="episodes of each task, with consecutive seeds")
    options.add_argument("--seed", type=int, default=1, help="seed of the first episode")
    options.add_argument("--out", type=Path, default=Path("runs/scenarios"), help="directory for table and recordings")
    given = options.parse_args()
    names = scenarios(given.tasks)
    if not names:
        options.error(f"no scenario fits {given.tasks}")
    rows: list[Row] = []
    for name in names:
        for player in given.players.split(","):
            rows.append(play(name, player, episodes=given.episodes, seed=given.seed, out=given.out))
            if not given.json:
                print(" | ".join(rows[-1].cells), flush=True)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "scenarios.md").write_text("\n".join(table(rows)) + "\n", encoding="utf-8")
    if given.json:
        print(json.dumps({"scenarios": [asdict(row) for row in rows]}))
    else:
        print(f"\n{given.out / 'scenarios.md'} has the table")
    return 1 if any(row.fault or set(SHAME) & row.rejections.keys() for row in rows) else 0
