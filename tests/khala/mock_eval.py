"""Evaluate inspect_ai's mock model: `mock_eval.py TASK ANSWERS USAGE TASK_ARGS`. The log goes into logs/."""

from __future__ import annotations

import json
import random
import sys

from inspect_ai import eval as evaluate
from inspect_ai.model import ModelOutput, ModelUsage, get_model

from khala_agents.scripted.players import PLAYERS


def skilled(messages: list[object], *_: object) -> ModelOutput:
    """Answer as the scripted player does, with a usage: without one, a tokenizer is loaded from the network."""
    text = getattr(messages[-1], "text", "")
    output = ModelOutput.from_content("mockllm/model", PLAYERS["skilled"](text, random.Random(0)))
    output.usage = ModelUsage.model_validate_json(sys.argv[3])
    return output


def fails(*_: object) -> ModelOutput:
    raise ValueError("the endpoint is away")


if __name__ == "__main__":
    model = get_model("mockllm/model", custom_outputs={"skilled": skilled, "fails": fails}[sys.argv[2]])
    evaluate(f"khala_sc2/{sys.argv[1]}", model=model, task_args=json.loads(sys.argv[4]), log_dir="logs", display="none")
