"""Train a model by playing, with TRL's GRPO, against a server of `khala openenv`.

    khala openenv 2s3z --sessions 8
    python grpo.py Qwen/Qwen3-0.6B --task 2s3z --steps 200

A sample of GRPO is an episode: the model reads the briefing and the first observation, answers, reads the next one, and
so on for some turns. Only its own words are trained; what the game says between them is masked. All samples of a group
play the same game, with the same seed, so that their rewards can be compared. The rewards are the server's.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import torch
from datasets import Dataset
from transformers import AutoModelForCausalLM, AutoTokenizer
from trl import GRPOConfig, GRPOTrainer

from khala_sc2.openenv.client import KhalaAction, KhalaEnv

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from openenv.core.sync_client import SyncEnvClient
    from transformers import PreTrainedModel, PreTrainedTokenizerBase

    from khala_sc2.openenv.client import KhalaObservation

    Session = SyncEnvClient[Any, Any, Any]


@dataclass(frozen=True, slots=True)
class Limits:
    """How much of an episode is one sample."""

    turns: int = 4
    reply_tokens: int = 256
    prompt_tokens: int = 8192
    """Of the first prompt and of each observation; what is longer loses its beginning."""


@dataclass(slots=True)
class Episode:
    """One sample: what was read, and what was said."""

    chat: list[dict[str, str]]
    prompt: list[int]
    completion: list[int] = field(default_factory=list)
    trained: list[int] = field(default_factory=list)
    """1 for each token of the model's own."""
    reward: float = 0.0
    done: bool = False

    def say(self, ids: list[int]) -> None:
        """Add words of the model."""
        self.completion += ids
        self.trained += [1] * len(ids)

    def hear(self, ids: list[int]) -> None:
        """Add words of the game."""
        self.completion += ids
        self.trained += [0] * len(ids)


class Rollouts:
    """Plays the episodes of a batch, all at a time; `GRPOTrainer` calls it."""

    def __init__(self, server: str, limits: Limits) -> None:
        self._server, self._limits = server, limits
        self._sessions: list[Session] = []

    def __call__(self, prompts: Sequence[str], trainer: GRPOTrainer) -> dict[str, Any]:
        """Return the samples, one for each prompt, which says what is played in JSON."""
        while len(self._sessions) < len(prompts):
            self._sessions.append(KhalaEnv(self._server, message_timeout_s=300).sync())
        sessions = self._sessions[: len(prompts)]
        tokenizer = trainer.processing_class
        with ThreadPoolExecutor(len(prompts)) as threads:
            began = list(
                threads.map(lambda one: one[0].reset(**json.loads(one[1])), zip(sessions, prompts, strict=True))
            )
            episodes = [self._begun(one.observation, tokenizer) for one in began]
            for turn in range(self._limits.turns):
                live = [index for index, one in enumerate(episodes) if not one.done]
                replies = self._generated(trainer, [episodes[index] for index in live])
                actions = [KhalaAction(reply=tokenizer.decode(ids, skip_special_tokens=True)) for ids in replies]
                results = threads.map(lambda one: sessions[one[0]].step(one[1]), zip(live, actions, strict=True))
                last = turn == self._limits.turns - 1
                for index, ids, action, result in zip(live, replies, actions, list(results), strict=True):
                    episode = episodes[index]
                    episode.say(ids)
                    episode.reward += result.reward or 0.0
                    episode.done = result.done
                    if not (last or result.done):
                        episode.hear(self._heard(episode, action.reply or "", result.observation, tokenizer))
        return {
            "prompt_ids": [one.prompt for one in episodes],
            "completion_ids": [one.completion for one in episodes],
            "logprobs": None,
            "env_mask": [one.trained for one in episodes],
            "episode_reward": [one.reward for one in episodes],
        }

    def close(self) -> None:
        """End all sessions."""
        for session in self._sessions:
            session.close()

    def _begun(self, seen: KhalaObservation, tokenizer: PreTrainedTokenizerBase) -> Episode:
        (view,) = seen.agents.values()
        chat = [one.model_dump() for one in view.briefing] + [{"role": "user", "content": view.text}]
        text = tokenizer.apply_chat_template(chat, tokenize=False, add_generation_prompt=True)
        return Episode(chat, self._cut(tokenizer, text))

    def _heard(
        self, episode: Episode, reply: str, seen: KhalaObservation, tokenizer: PreTrainedTokenizerBase
    ) -> list[int]:
        """Return what stands between two replies: the end of the first, the observation, the head of the next.

        The template must not change what it wrote before, as some do that hide earlier thoughts.
        """
        before = tokenizer.apply_chat_template(episode.chat, tokenize=False, add_generation_prompt=True) + reply
        episode.chat += [{"role": "assistant", "content": reply}, {"role": "user", "content": seen.text}]
        after = tokenizer.apply_chat_template(episode.chat, tokenize=False, add_generation_prompt=True)
        if not after.startswith(before):
            raise ValueError("the chat template changes earlier messages: take trl.get_training_chat_template's")
        return self._cut(tokenizer, after.removeprefix(before))

    def _cut(self, tokenizer: PreTrainedTokenizerBase, text: str) -> list[int]:
        ids: list[int] = tokenizer(text, add_special_tokens=False)["input_ids"]
        return ids[-self._limits.prompt_tokens :]

    def _generated(self, trainer: GRPOTrainer, episodes: Sequence[Episode]) -> list[list[int]]:
        """Return the next replies, without the tokens that end them."""
        if not episodes:
            return []
        tokenizer, model = trainer.processing_class, trainer.accelerator.unwrap_model(trainer.model)
        heads = [one.prompt + one.completion for one in episodes]
        longest = max(map(len, heads))
        ids = torch.tensor([[tokenizer.pad_token_id] * (longest - len(one)) + one for one in heads])
        mask = torch.tensor([[0] * (longest - len(one)) + [1] * len(one) for one in heads])
        with torch.no_grad():
            made = model.generate(
                input_ids=ids.to(model.device),
                attention_mask=mask.to(model.device),
                max_new_tokens=self._limits.reply_tokens,
                do_sample=True,
                pad_token_id=tokenizer.pad_token_id,
                eos_token_id=tokenizer.eos_token_id,
            )
        ends = {tokenizer.eos_token_id, tokenizer.pad_token_id}
        return [_until(row[longest:].tolist(), ends) for row in made]


def _until(ids: list[int], ends: set[int]) -> list[int]:
    return ids[: next((index for index, one in enumerate(ids) if one in ends), len(ids))]


def episode_reward(completions: Sequence[Any], episode_reward: Sequence[float], **_: Any) -> Sequence[float]:
    """Return the sum of the rewards of each episode."""
    del completions
    return episode_reward


def trained(
    model: PreTrainedModel,
    tokenizer: PreTrainedTokenizerBase,
    rollouts: Rollouts,
    config: GRPOConfig,
    options: Callable[[int], dict[str, Any]],
) -> GRPOTrainer:
    """Train a model, and return its trainer.

    Args:
        model: it changes.
        tokenizer: with a chat template, and tokens for padding and the end.
        rollouts: where it plays.
        config: of TRL; `max_steps` says how long.
        options: of `reset`, by the number of a game: its seed, its task, the one agent that is played.
    """
    games = Dataset.from_dict({"prompt": [json.dumps(options(number)) for number in range(1, 1001)]})
    trainer = GRPOTrainer(
        model=model,
        reward_funcs=episode_reward,
        args=config,
        train_dataset=games,
        processing_class=tokenizer,
        rollout_func=rollouts,
    )
    try:
        trainer.train()
    finally:
        rollouts.close()
    return trainer


def main() -> None:
    """Read the command line, and train."""
    parser = argparse.ArgumentParser(description="Train a model on a task of Khala with GRPO.")
    parser.add_argument("model")
    parser.add_argument("--server", default="http://127.0.0.1:8000")
    parser.add_argument("--task", default="2s3z", help="of one agent")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--group", type=int, default=8, help="samples that play the same game; the server's --sessions")
    parser.add_argument("--turns", type=int, default=4, help="replies in a sample")
    parser.add_argument("--out", default="grpo")
    given = parser.parse_args()
    config = GRPOConfig(
        output_dir=given.out,
        max_steps=given.steps,
        per_device_train_batch_size=given.group,
        num_generations=given.group,
        logging_steps=1,
    )
    trained(
        AutoModelForCausalLM.from_pretrained(given.model),
        AutoTokenizer.from_pretrained(given.model),
        Rollouts(given.server, Limits(turns=given.turns)),
        config,
        lambda number: {"task": given.task, "seed": number},
    ).save_model()


if __name__ == "__main__":
    main()
