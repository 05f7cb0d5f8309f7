"""Every benchmark: its module, the claim that it backs, and when it runs.

`python -m bench`, its `--help` and `--list`, and `python -m bench limits` read this table. None of them imports a
benchmark before it runs. The first line of a module's docstring says what it measures.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import ModuleType

BENCH: Final = Path(__file__).parent

Part: TypeAlias = Literal["figures", "table", "alone"]
"""The part that a benchmark has in `python -m bench`, which runs all of them.

figures: its figures are kept. Its module has `--json`, and `measures`, which makes figures of what `--json` prints.
table: it prints its table.
alone: it is left out, and runs when it is named. It takes hours, needs a checkout of another project, or looks after
    the repository. All words after its name are its own.
"""


@dataclass(frozen=True, slots=True)
class Benchmark:
    """A module with a `main`."""

    module: str
    """Below `bench`."""
    claim: str
    """The heading in `docs/measurements.md` that it backs; or another file that rests on it, a page or a test."""
    part: Part = "alone"
    limited: tuple[str, ...] | None = None
    """Options of a short run that has the ratios which `python -m bench limits` holds to their limits."""

    @property
    def name(self) -> str:
        """What the command line and the results call it."""
        return self.module.rpartition(".")[2]

    @property
    def measures(self) -> str:
        """What it measures, in a sentence."""
        with (BENCH / f"{self.module.replace('.', '/')}.py").open(encoding="utf-8") as source:
            return source.readline().strip().strip('"')

    def load(self) -> ModuleType:
        """Import it."""
        return importlib.import_module(f"bench.{self.module}")


BENCHMARKS: Final[Mapping[str, Benchmark]] = {
    benchmark.name: benchmark
    for benchmark in (
        Benchmark("yardstick", "Measurements", "figures"),
        Benchmark("turns.turn", "Overhead of a step", "figures"),
        Benchmark("turns.bus", "The bus", "figures", limited=("--agents", "8", "32", "--scale", "1")),
        Benchmark("simulator.simulator_engine", "The simulator", "figures"),
        Benchmark("simulator.engines", "The simulator", "figures", limited=()),
        Benchmark("simulator.simulator_env", "The simulator", "figures"),
        Benchmark("simulator.floors", "The simulator", "figures", limited=()),
        Benchmark("matches.start", "Survival", "figures"),
        Benchmark("turns.observe", "Observations and actions", "figures"),
        Benchmark("turns.act", "Observations and actions", "figures"),
        Benchmark("simulator.abilities", "Observations and actions", "figures"),
        Benchmark("matches.games_per_hour", "Games per hour", "figures"),
        Benchmark("environments.env", "Environments for training", "figures"),
        Benchmark("environments.sessions", "docs/how-to/openenv.md", "figures"),
        Benchmark("simulator.simulator_memory", "The simulator", "table"),
        Benchmark("language.recognition", "Accuracy of the parser", "table"),
        Benchmark("language.forms", "Forms of answers"),
        Benchmark("language.prompts", "Lengths of prompts"),
        Benchmark("turns.image", "Observations and actions", "table"),
        Benchmark("turns.http_client", "agents/khala_agents/llm/transport.py", "table"),
        Benchmark("survival.orphans", "Survival", "table"),
        Benchmark("survival.strangers", "Strangers", "table"),
        Benchmark("matches.clocks", "Clocks", "table"),
        Benchmark("matches.pace", "Clocks", "table"),
        Benchmark("matches.serve", "Survival", "table"),
        Benchmark("turns.scenes", "The map for observers", "table"),
        Benchmark("recordings.view", "The match viewer", "table"),
        Benchmark("survival.faults", "Survival", "table"),
        Benchmark("survival.resume", "Survival", "table"),
        Benchmark("survival.soak", "Survival", "table"),
        Benchmark("simulator.mining", "docs/design/fidelity.md", "table"),
        Benchmark("simulator.crowds", "Crowds", "table"),
        Benchmark("doors.doors", "Measurements", "table"),
        Benchmark("survival.money", "Money", "table"),
        Benchmark("simulator.rendering", "The simulator"),
        Benchmark("simulator.compilers", "docs/design/engine.md"),
        Benchmark("environments.smac", "SMAC's own package"),
        Benchmark("environments.smacv2", "SMACv2's own package"),
        Benchmark("environments.scripts", "Scripts that were played on StarCraft II"),
        Benchmark("environments.smac_speed", "The simulator"),
        Benchmark("environments.env_parity", "Environments for training"),
        Benchmark("environments.train", "Teams that learn"),
        Benchmark("learning.learns", "A small model that learns"),
        Benchmark("language.offers", "Honest offers"),
        Benchmark("language.messages", "True messages"),
        Benchmark("language.numbers", "tests/bridge/test_knowledge_numbers.py"),
        Benchmark("matches.scenarios", "Every scenario, played by scripted players"),
        Benchmark("matches.ladder", "The ladder of the scripted player"),
        Benchmark("matches.duels", "Duels, with sides swapped"),
        Benchmark("matches.opponents", "Computer opponents"),
        Benchmark("matches.bots", "Computer opponents"),
        Benchmark("matches.intervals", "Intervals and tests"),
        Benchmark("survival.experiments", "tests/khala/experiment/test_engine.py"),
        Benchmark("survival.hostile", "docs/design/turn.md"),
        Benchmark("survival.hostile_files", "SECURITY.md"),
        Benchmark("limits", "Measurements"),
        Benchmark("compare", "docs/measurements-over-time.md"),
        Benchmark("history", "docs/measurements-over-time.md"),
        Benchmark("repository.house", "Makefile"),
    )
}
"""By name; those of the whole stand in the order in which it runs them."""


def having(part: Part) -> tuple[str, ...]:
    """Return the names of the benchmarks that have such a part in the whole."""
    return tuple(name for name, benchmark in BENCHMARKS.items() if benchmark.part == part)
