"""Measure what a model makes of each form of answers: usable replies, refusals, tokens and seconds.

Each model file plays the first decisions of the tasks once with each form; the episodes are the same. A reply is usable
if at least one of its orders was carried out. Needs the server that the model files name, for example llama.cpp with a
small model:

    python -m bench forms llamacpp.yaml --tasks 2s3z_pair smac_3m --steps 8
"""

from __future__ import annotations

import asyncio
import json
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, get_args

import yaml

from bench.command_line import make_parser
from bench.tables import print_table
from khala_agents.answers.form import AnswerForm
from khala_agents.config import load_model
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import ModelCall, Observation, Reply, count_refusals
from khala_protocol.recording import Recording
from khala_sc2.playing.local import play
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import Sequence

TASKS: Final = ("2s3z_pair", "smac_3m", "pvz_task4_level1", "simple64_eceb")
STEPS: Final = 6
STEP_LOOPS: Final = 16
MAX_WAIT_S: Final = 1800


@dataclass(frozen=True)
class FormFigures:
    """What a model made of one form."""

    model: str
    form: str
    replies: int
    usable: int
    orders: int
    """That were carried out."""
    refused: dict[str, int]
    """Calls that were not carried out, by reason."""
    prompt_tokens: float
    """A reply, on average, as the endpoint counted them."""
    answer_tokens: float
    seconds: float


async def measure(model: str, form: str, tasks: Sequence[str], steps: int, keep: Path | None) -> FormFigures:
    """Return what a model makes of a form in the first steps of these tasks."""
    recordings = []
    with tempfile.TemporaryDirectory() as name:
        directory = keep or Path(name)
        file = directory / f"{Path(model).stem}_{form}.yaml"
        fields = load_model(model).model_dump(mode="json", exclude_unset=True)
        file.write_text(yaml.safe_dump({**fields, "answer": form}), encoding="utf-8")
        for task_name in tasks:
            task = change(load_task(task_name), step_loops=STEP_LOOPS, max_wait_s=MAX_WAIT_S, max_steps=steps + 1)
            path = directory / f"{file.stem}_{task_name}.mcap"
            path.unlink(missing_ok=True)
            config = MatchConfig(task=task, run=f"{form}_{task_name}", record=path)
            await play(config, {task.side: Minds(model=str(file))}, directory / task_name, game="simulator")
            recordings.append(Recording.open(path))
        return figures(Path(model).stem, form, recordings)


def figures(model: str, form: str, recordings: Sequence[Recording]) -> FormFigures:
    """Return the figures of matches with one form."""
    replies, usable, orders = 0, 0, 0
    refused: Counter[str] = Counter()
    calls = [made for recording in recordings for made in recording.of(ModelCall) if made.status == "ok"]
    for recording in recordings:
        asked = {(reply.agent, reply.step) for reply in recording.of(Reply)}
        for seen in recording.of(Observation):
            if (seen.agent, seen.step - 1) in asked:
                replies += 1
                usable += bool(seen.accepted)
                orders += len(seen.accepted)
                refused.update(count_refusals(seen.rejections))
    made = max(len(calls), 1)
    return FormFigures(
        model=model,
        form=form,
        replies=replies,
        usable=usable,
        orders=orders,
        refused=dict(refused),
        prompt_tokens=sum(call.usage.prompt_tokens for call in calls) / made,
        answer_tokens=sum(call.usage.completion_tokens for call in calls) / made,
        seconds=sum(call.latency_s for call in calls) / made,
    )


def show(found: Sequence[FormFigures]) -> None:
    """Print the figures."""
    columns = ("model", "form", "replies", "usable", "orders", "refused", "prompt", "answer", "s", "refusals")
    rows = [
        (
            each.model, each.form, each.replies, f"{each.usable / max(each.replies, 1):.0%}", each.orders,
            sum(each.refused.values()), f"{each.prompt_tokens:.0f}", f"{each.answer_tokens:.0f}",
            f"{each.seconds:.1f}", ", ".join(f"{reason} {number}" for reason, number in each.refused.items()),
        )
        for each in found
    ]  # fmt: skip
    print_table(columns, rows)


def main() -> None:
    """Play, and print a table or a list in JSON."""
    parser = make_parser(__doc__)
    parser.add_argument("models", nargs="+", help="model files, or names of shipped ones")
    parser.add_argument("--tasks", nargs="+", default=TASKS, help="tasks to play")
    parser.add_argument("--forms", nargs="+", choices=get_args(AnswerForm), help="forms; default: all that it takes")
    parser.add_argument("--steps", type=int, default=STEPS, help="decisions of each agent in each task")
    parser.add_argument("--keep", type=Path, help="directory to keep the recordings in")
    options = parser.parse_args()
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    found = [
        asyncio.run(measure(model, form, options.tasks, options.steps, options.keep))
        for model in options.models
        for form in options.forms or load_model(model).forms
    ]
    if options.json:
        print(json.dumps([asdict(each) for each in found]))
    else:
        show(found)
