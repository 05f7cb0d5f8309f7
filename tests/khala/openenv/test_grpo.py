"""The example of TRL: a tiny model made here takes two steps of GRPO against a server, without a download."""

from __future__ import annotations

import importlib
import re
import socket
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import uvicorn
from openenv.core.rubrics import Rubric

from khala_sc2.openenv.server import app_of
from khala_sc2.openenv.settings import ServerSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

EXAMPLE = Path(__file__).resolve().parents[3] / "envs" / "khala_env" / "grpo.py"
TEMPLATE = (
    "{% for m in messages %}<|{{ m.role }}|>{{ m.content }}<|end|>{% endfor %}"
    "{% if add_generation_prompt %}<|assistant|>{% endif %}"
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.game,
    pytest.mark.filterwarnings("default"),  # of torch, transformers and trl
]


class Letters(Rubric):
    """The share of letters in a reply: an untrained model differs in it from sample to sample, and never wins."""

    def forward(self, action: Any, observation: Any) -> float:
        reply = action.reply or ""
        return len(re.findall("[a-z]", reply)) / max(len(reply), 1)


@pytest.fixture
def address() -> Iterator[str]:
    """Serve 2s3z in a thread."""
    app = app_of(ServerSettings(task="2s3z", rubric=Letters), sessions=4)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = uvicorn.Server(uvicorn.Config(app, log_config=None, ws="websockets-sansio"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        server.should_exit = True
        thread.join()


def tokenizer_and_model() -> tuple[Any, Any]:
    """Return a tokenizer of bytes, and a model with one layer and random weights."""
    tokenizers = pytest.importorskip("tokenizers")
    transformers = pytest.importorskip("transformers")
    special = ["<|pad|>", "<|end|>", "<|system|>", "<|user|>", "<|assistant|>"]
    alphabet = sorted(tokenizers.pre_tokenizers.ByteLevel.alphabet())
    vocabulary = {token: number for number, token in enumerate([*special, *alphabet])}
    made = tokenizers.Tokenizer(tokenizers.models.BPE(vocab=vocabulary, merges=[]))
    made.pre_tokenizer = tokenizers.pre_tokenizers.ByteLevel(add_prefix_space=False)
    made.decoder = tokenizers.decoders.ByteLevel()
    made.add_special_tokens(special)
    tokenizer = transformers.PreTrainedTokenizerFast(
        tokenizer_object=made, pad_token="<|pad|>", eos_token="<|end|>", chat_template=TEMPLATE
    )
    config = transformers.Qwen2Config(
        vocab_size=len(vocabulary), hidden_size=16, intermediate_size=32, num_hidden_layers=1, num_attention_heads=2,
        num_key_value_heads=2, max_position_embeddings=4096, eos_token_id=1, pad_token_id=0, bos_token_id=None,
    )  # fmt: skip
    return tokenizer, transformers.Qwen2ForCausalLM(config)


def test_two_steps_of_grpo_change_a_model_that_plays(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch, trl = pytest.importorskip("torch"), pytest.importorskip("trl")
    monkeypatch.syspath_prepend(EXAMPLE.parent)
    example = importlib.import_module(EXAMPLE.stem)
    torch.manual_seed(1)
    tokenizer, model = tokenizer_and_model()
    before = {name: one.detach().clone() for name, one in model.named_parameters()}
    config = trl.GRPOConfig(
        output_dir=str(tmp_path), max_steps=2, per_device_train_batch_size=4, num_generations=4, learning_rate=1e-2,
        use_cpu=True, bf16=False, report_to=[], logging_steps=1, save_strategy="no", disable_tqdm=True,
    )  # fmt: skip
    rollouts = example.Rollouts(address, example.Limits(turns=2, reply_tokens=12, prompt_tokens=128))
    trainer = example.trained(model, tokenizer, rollouts, config, lambda number: {"seed": number})
    assert trainer.state.global_step == 2
    logged = [one["reward"] for one in trainer.state.log_history if "reward" in one]
    assert len(logged) == 2
    assert all(0 < reward < 2 for reward in logged)
    assert any(not torch.equal(before[name], one) for name, one in model.named_parameters())
