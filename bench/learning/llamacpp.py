"""Whether the dequantized weights say what llama.cpp says with the file itself.

llama.cpp multiplies the quantized weights with activations that it rounds to eight bits, so the chances of tokens are
close and not the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import httpx
import torch
import xllamacpp

from bench.learning.model import Row, gguf_file

if TYPE_CHECKING:
    from bench.learning.model import SmallModel


class Likeness(NamedTuple):
    """How alike two models answer one prompt."""

    tokens: int
    """Of the answer of llama.cpp, the likeliest ones."""
    same: int
    """Of these, the number from the first on that the model here answers as well."""
    difference: float
    """Mean difference between the logarithms of their chances."""
    text: str


def compare(model: SmallModel, prompt: list[int], most: int) -> Likeness:
    """Compare the model, whose adapter does nothing yet, with llama.cpp.

    Args:
        model: that was just made.
        prompt: tokens.
        most: tokens of the answer.
    """
    said = _answer(prompt, most)
    tokens = [place["id"] for place in said["completion_probabilities"]]
    theirs = torch.tensor([place["logprob"] for place in said["completion_probabilities"]])
    with torch.no_grad():
        (ours,) = model.token_log_chances([Row(prompt, tokens)])
    (here,) = model.complete([prompt], most=len(tokens), temperature=0)
    same = next((at for at, pair in enumerate(zip(here, tokens, strict=False)) if len(set(pair)) > 1), len(here))
    return Likeness(len(tokens), same, float((ours - theirs).abs().mean()), said["content"])


def _answer(prompt: list[int], most: int) -> dict[str, Any]:
    wanted = xllamacpp.CommonParams()
    wanted.model.path = str(gguf_file())
    wanted.port = 0
    wanted.n_ctx = len(prompt) + most + 8
    wanted.n_parallel = 1
    wanted.warmup = False
    server = xllamacpp.Server(wanted)
    body = {"prompt": prompt, "n_predict": most, "temperature": 0, "n_probs": 1}
    answer = httpx.post(f"{server.listening_address}/completion", json=body, timeout=600)
    answer.raise_for_status()
    return dict(answer.json())
