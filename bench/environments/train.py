"""Train a team on a SMAC map through `khala_sc2.env.numeric`, and draw how many test battles it wins.

    python -m bench train                                          3m by MAPPO, one seed, a minute of one core
    python -m bench train 3m --seeds 3 4 5
    python -m bench train 3s5z --algorithm qmix --steps 2000000 --tests 40
    python -m bench train --seeds --lines curves.jsonl --out curves.svg     no training: draw earlier lines

`mappo` (`ppo.py`) is NumPy; `qmix` (`qmix.py`) needs torch, which `uv sync --inexact --group learning` installs. Both
have one set of settings for all maps. All battles are played in this process, in one thread.

A test is a number of new battles, the same for each test, in which each agent takes the action that it thinks best.
Each test is a line of JSON in the file of `--lines`: seconds are those of the processor, of the whole process but
without the tests, so that a busy machine changes nothing. Ctrl-C ends the training, and draws the curves so far.
"""

from __future__ import annotations

import json
import os
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads: these matrices are too small to share

from bench.command_line import make_parser
from bench.environments import ppo
from bench.environments.battles import Battles, count_wins

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bench.environments.battles import Learner, Sizes

ALGORITHMS: Final = ("mappo", "qmix")
PYMARL2: Final = "PyMARL2, 10 million steps"
DI_ENGINE: Final = "DI-engine, 2 million steps"
PUBLISHED: Final = {
    "3s5z": (("qmix", PYMARL2, 1.0), ("qmix", DI_ENGINE, 1.0), ("mappo", DI_ENGINE, 1.0)),
    "5m_vs_6m": (("qmix", PYMARL2, 0.9), ("qmix", DI_ENGINE, 0.6), ("mappo", DI_ENGINE, 0.75)),
    "3s_vs_5z": (("qmix", PYMARL2, 1.0),),
}
"""Of each map: algorithm, source, and the share of battles won on StarCraft II at the end of training.

PyMARL2's are the column Finetuned-QMIX in the README of hijkzzz/pymarl2 (8ccac7c), the code of arXiv:2102.03479;
DI-engine's stand in dizoo/smac/README.md of opendilab/DI-engine.
"""


@dataclass(frozen=True, slots=True)
class Test:
    """What a team won at a moment of its training."""

    map: str
    algorithm: str
    seed: int
    steps: int
    """Of all its battles together."""
    cpu_s: float
    """Of this process so far, without its tests."""
    won: int
    battles: int


def make_learner(algorithm: str, sizes: Sizes, seed: int) -> Learner:
    """Return an algorithm with new networks."""
    if algorithm == "mappo":
        return ppo.Learner(sizes, seed)
    from bench.environments import qmix  # noqa: PLC0415  # torch is not installed for `mappo` alone

    return qmix.Learner(sizes, seed)


def train(map_name: str, algorithm: str, seed: int, envs: int, steps: int, tests: int, battles: int) -> Iterator[Test]:
    """Train one team, and yield its tests, which are as many steps apart."""
    begun_s = time.process_time()
    team = Battles(map_name, envs, seed)
    learner = make_learner(algorithm, team.sizes, seed)
    for number in range(1, tests + 1):
        while team.steps < steps * number // tests:
            learner.play(team)
        spent_s = time.process_time() - begun_s
        won = count_wins(map_name, learner.most_likely(), battles)
        yield Test(map_name, algorithm, seed, team.steps, round(spent_s, 1), won, battles)
        begun_s = time.process_time() - spent_s


def draw(tests: list[Test], path: Path) -> None:
    """Draw a panel for each map, with a line for each team, and what others published for the real game."""
    import matplotlib as mpl  # noqa: PLC0415  # loads fonts, which only a picture needs
    from matplotlib.figure import Figure  # noqa: PLC0415  # see above

    mpl.rcParams["svg.hashsalt"] = "khala"
    maps = list(dict.fromkeys(test.map for test in tests))
    figure = Figure(figsize=(3.4 * len(maps), 3.6), layout="constrained")
    colours = dict(zip(ALGORITHMS, ("C0", "C1"), strict=True))
    legend: dict[str, Any] = {}  # lines by their labels, each once for all panels
    for axes, name in zip(figure.subplots(1, len(maps), squeeze=False)[0], maps, strict=True):
        here = [test for test in tests if test.map == name]
        for algorithm, seed in dict.fromkeys((test.algorithm, test.seed) for test in here):
            run = [test for test in here if (test.algorithm, test.seed) == (algorithm, seed)]
            x = [test.steps / 1e6 for test in run]
            y = [test.won / test.battles for test in run]
            axes.plot(x, y, colours[algorithm], label=algorithm, linewidth=1)
        for algorithm, source, share in PUBLISHED.get(name, ()):
            style = ":" if source == DI_ENGINE else "--"
            axes.axhline(share, color=colours[algorithm], linestyle=style, label=f"{algorithm}, {source}", linewidth=1)
        axes.set(xlabel="million steps", ylim=(-0.02, 1.02), title=name)
        axes.locator_params(axis="x", nbins=5)
        axes.grid(alpha=0.3)
        lines, labels = axes.get_legend_handles_labels()
        legend |= dict(zip(labels, lines, strict=True))
    figure.axes[0].set_ylabel("test battles won")
    figure.legend(list(legend.values()), list(legend), loc="outside lower center", ncols=len(legend), frameon=False)
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Train as the command line asks."""
    parser = make_parser(__doc__)
    parser.add_argument("map", nargs="?", default="3m")
    parser.add_argument("--algorithm", choices=ALGORITHMS, default="mappo")
    parser.add_argument("--seeds", type=int, nargs="*", default=[1], help="train a team with each")
    parser.add_argument("--steps", type=int, default=200_000, help="of all battles of a team together")
    parser.add_argument("--envs", type=int, default=32, help="battles at once")
    parser.add_argument("--tests", type=int, default=10)
    parser.add_argument("--battles", type=int, default=100, help="of a test")
    parser.add_argument("--lines", type=Path, help="file to which each test is added")
    parser.add_argument("--out", type=Path, help="where to draw the lines: .svg or .png")
    options = parser.parse_args()
    tests = _read(options.lines) if options.lines and options.lines.exists() else []
    with suppress(KeyboardInterrupt):
        for seed in options.seeds:
            for test in train(
                options.map, options.algorithm, seed, options.envs, options.steps, options.tests, options.battles
            ):
                tests.append(test)
                line = json.dumps(asdict(test))
                if options.lines:
                    with options.lines.open("a", encoding="utf-8") as file:
                        file.write(f"{line}\n")
                print(line if options.json else _say(test), flush=True)
    if options.out:
        draw(tests, options.out)


def _read(lines: Path) -> list[Test]:
    return [Test(**json.loads(line)) for line in lines.read_text(encoding="utf-8").splitlines()]


def _say(test: Test) -> str:
    return (
        f"{test.map} {test.algorithm} seed {test.seed}  {test.cpu_s:7.1f} s  {test.steps:8d} steps  "
        f"won {test.won} of {test.battles}"
    )
