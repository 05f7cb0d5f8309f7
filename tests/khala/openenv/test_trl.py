"""Battles for TRL: their methods are tools by TRL's own introspection, and its trainer plays and learns with them."""

from __future__ import annotations

import importlib
import inspect
import json
import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2.openenv.tools import TOOLS, ToolFault
from khala_sc2.openenv.trl import ToolBattle, environment_factory

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager

    Serving = Callable[..., AbstractAsyncContextManager[str]]

EXAMPLE = Path(__file__).resolve().parents[3] / "envs" / "khala_env" / "grpo.py"
NONSENSE = {"Zealot-1": ["<Nonsense()>"]}


def methods_by_trl(battle: object) -> list[str]:
    """Return the members of an environment that TRL 1.16 takes for tools, found as its `GRPOTrainer` finds them."""
    members = [name for name, _ in inspect.getmembers(type(battle), predicate=inspect.isfunction)]
    assert {"reset", "get_reward"} <= set(members)
    return [name for name in members if name not in ("reset", "get_reward") and not name.startswith("_")]


def test_the_methods_of_a_battle_are_tools_of_the_server_with_types_and_words() -> None:
    battle = environment_factory()()
    assert methods_by_trl(battle) == ["act", "look_up"]
    for name in methods_by_trl(battle):
        method = getattr(battle, name)
        hints = inspect.get_annotations(method, eval_str=True)
        assert hints.pop("return") is str
        assert hints.keys() <= TOOLS[name].model_fields.keys()
        page = inspect.getdoc(method) or ""
        assert all(f"    {argument}: " in page for argument in hints), "each argument is described, or TRL refuses it"


def test_the_schemas_of_transformers_are_those_of_the_server() -> None:
    utils = pytest.importorskip("transformers.utils")
    battle = environment_factory()()
    for name in methods_by_trl(battle):
        schema = utils.get_json_schema(getattr(battle, name))["function"]["parameters"]["properties"]
        ours = TOOLS[name].model_json_schema()["properties"]
        assert {argument: field["type"] for argument, field in schema.items()} == {
            argument: ours[argument]["type"] for argument in schema
        }


@pytest.mark.game
def test_a_battle_in_this_process_is_played_with_tools() -> None:
    factory = pickle.loads(pickle.dumps(environment_factory(task="2s3z", max_steps=2)))  # our own
    battle, other = factory(), factory()
    first = battle.reset(seed=1, prompt=[{"role": "user", "content": ""}])
    assert first == other.reset(seed=1)
    assert "# Who you are" in first
    assert first.endswith("Go on until you read that the episode is over.")
    assert battle.look_up("Stalker").startswith("Stalker")
    with pytest.raises(ToolFault, match="act: orders"):
        battle.act("all")
    assert battle.get_reward() == 0.0
    assert "There is no action Nonsense" in battle.act(NONSENSE)
    other.act({})
    assert battle.get_reward() < other.get_reward(), "what is refused costs"
    assert battle.act({}).startswith("The episode is over: cut, step limit")
    with pytest.raises(ToolFault, match="the episode is over: call no tool any more"):
        battle.act({})
    assert battle.reset(seed=1) == first
    assert battle.get_reward() == 0.0
    for played in (battle, other):
        played._close()


@pytest.mark.game
def test_a_model_plays_one_agent() -> None:
    with pytest.raises(ConfigError, match="reset has no option 'sead': it has seed, episode_id, task"):
        environment_factory(sead=1)
    battle = environment_factory(task="2s3z_pair")()
    with pytest.raises(ConfigError, match=r"a model plays one agent: name one of Stalkers, Zealots, as in agents="):
        battle.reset(seed=1)
    assert "You are Zealots" in battle.reset(seed=1, agents=["Zealots"])
    battle._close()


@pytest.mark.game
@pytest.mark.slow
async def test_a_battle_on_a_server_is_the_same(serving: Serving) -> None:
    here = environment_factory(task="2s3z", max_steps=1)()

    def play(battle: ToolBattle) -> list[object]:
        said = [battle.reset(seed=1)]
        with pytest.raises((ToolFault, RuntimeError), match="act: orders"):
            battle.act("all")  # type: ignore[arg-type]  # as a model may
        said.append(battle.act(NONSENSE))
        reward = battle.get_reward()
        battle._close()
        return [*said, reward]

    import asyncio

    async with serving() as address:
        there = environment_factory(address, task="2s3z", max_steps=1)()
        assert await asyncio.to_thread(play, there) == await asyncio.to_thread(play, here)


# --- TRL itself, where torch is installed ---------------------------------------------------------------


def tokenizer_and_model() -> tuple[Any, Any]:
    """Return a tokenizer of bytes with Qwen's template, and a model with one layer and random weights."""
    tokenizers, transformers = pytest.importorskip("tokenizers"), pytest.importorskip("transformers")
    templates = pytest.importorskip("trl.chat_template_utils")
    special = ["<|endoftext|>", "<|im_end|>", "<|im_start|>", "<tool_call>", "</tool_call>", "<think>", "</think>"]
    alphabet = sorted(tokenizers.pre_tokenizers.ByteLevel.alphabet())
    vocabulary = {token: number for number, token in enumerate([*special, *alphabet])}
    made = tokenizers.Tokenizer(tokenizers.models.BPE(vocab=vocabulary, merges=[]))
    made.pre_tokenizer = tokenizers.pre_tokenizers.ByteLevel(add_prefix_space=False)
    made.decoder = tokenizers.decoders.ByteLevel()
    made.add_special_tokens(special[:3])
    made.add_tokens(special[3:])
    tokenizer = transformers.PreTrainedTokenizerFast(
        tokenizer_object=made,
        pad_token="<|endoftext|>",
        eos_token="<|im_end|>",
        chat_template=templates.qwen3_chat_template,
    )
    config = transformers.Qwen2Config(
        vocab_size=len(vocabulary), hidden_size=16, intermediate_size=32, num_hidden_layers=1, num_attention_heads=2,
        num_key_value_heads=2, max_position_embeddings=65536, eos_token_id=1, pad_token_id=0, bos_token_id=None,
    )  # fmt: skip
    return tokenizer, transformers.Qwen2ForCausalLM(config)


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.filterwarnings("default")  # of torch, transformers and trl
def test_grpo_of_trl_plays_with_tools_and_changes_a_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A model made here is too weak to call a tool: its words are given, and all else is TRL's."""
    torch, trl = pytest.importorskip("torch"), pytest.importorskip("trl")
    monkeypatch.syspath_prepend(EXAMPLE.parent)
    example = importlib.import_module(EXAMPLE.stem)
    torch.manual_seed(1)
    tokenizer, model = tokenizer_and_model()
    before = {name: weight.detach().clone() for name, weight in model.named_parameters()}

    def words(orders: object) -> str:
        call = json.dumps({"name": "act", "arguments": {"orders": orders}})
        return f"<tool_call>\n{call}\n</tool_call><|im_end|>"

    class Scripted(trl.GRPOTrainer):  # type: ignore[misc, name-defined]
        turns = 0

        def _generate_single_turn(self, prompt_ids: list[list[int]], *_: Any, **__: Any) -> Any:
            self.turns += 1
            first = [words(NONSENSE if sample % 2 else {}) for sample in range(len(prompt_ids))]
            said = first if self.turns % 2 else ["Done.<|im_end|>"] * len(prompt_ids)
            return [tokenizer(text)["input_ids"] for text in said], None

    config = trl.GRPOConfig(
        output_dir=str(tmp_path), max_steps=1, per_device_train_batch_size=2, num_generations=2, learning_rate=1e-2,
        max_completion_length=40_000, max_tool_calling_iterations=2, use_cpu=True, bf16=False, report_to=[],
        logging_steps=1, save_strategy="no", disable_tqdm=True,
    )  # fmt: skip
    trainer = Scripted(
        model=model,
        args=config,
        processing_class=tokenizer,
        train_dataset=example.games(4),
        environment_factory=environment_factory(task="2s3z"),
    )
    assert [tool.__name__ for tool in trainer.tools] == ["act", "look_up"]
    trainer.train()
    (logged,) = [entry for entry in trainer.state.log_history if "reward" in entry]
    assert logged["tools/call_frequency"] == 1.0
    assert logged["tools/failure_frequency"] == 0.0
    assert logged["reward_std"] > 0, "a call that was refused costs"
    assert any(not torch.equal(before[name], weight) for name, weight in model.named_parameters())
