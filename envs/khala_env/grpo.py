"""Train a model by playing, with TRL's GRPO: the model plays an agent with tools.

    python grpo.py Qwen/Qwen3-0.6B --task 2s3z --steps 200
    python grpo.py Qwen/Qwen3-0.6B --task 2s3z --steps 200 --server http://localhost:8000    # of `khala openenv`

A sample of GRPO is an episode: the model reads the briefing and the first observation, calls tools, reads what they
return, and so on. TRL trains the model's own words alone. All samples of a group play the same game, with the same
seed, so that their rewards can be compared.
"""

from __future__ import annotations

import argparse

from datasets import Dataset
from trl import GRPOConfig, GRPOTrainer

from khala_sc2.openenv.trl import environment_factory

SYSTEM = "You command units of StarCraft II, together with other agents. You play with tools."


def games(count: int) -> Dataset:
    """Return the data set: a prompt and a seed for each game."""
    rows = [
        {"prompt": [{"role": "system", "content": SYSTEM}, {"role": "user", "content": ""}], "seed": seed}
        for seed in range(1, count + 1)
    ]
    return Dataset.from_list(rows)


def main() -> None:
    """Train."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", help="name or directory of a model whose chat template knows tools")
    parser.add_argument("--server", help="address of khala openenv; without it, games are played in this process")
    parser.add_argument("--task", default="2s3z")
    parser.add_argument("--agent", help="the agent that the model plays, if the task has several")
    parser.add_argument("--turns", type=int, default=4, help="most calls of tools in an episode")
    parser.add_argument("--steps", type=int, default=100, help="of training")
    parser.add_argument("--group", type=int, default=4, help="samples of the same game")
    given = parser.parse_args()
    config = GRPOConfig(
        output_dir=f"{given.model.rpartition('/')[2]}-{given.task}",
        max_steps=given.steps,
        per_device_train_batch_size=given.group,
        num_generations=given.group,
        max_completion_length=8192,
        max_tool_calling_iterations=given.turns,
        logging_steps=1,
    )
    agents = {"agents": [given.agent]} if given.agent else {}
    trainer = GRPOTrainer(
        model=given.model,
        args=config,
        train_dataset=games(1000),
        environment_factory=environment_factory(given.server, task=given.task, **agents),
    )
    trainer.train()
    trainer.save_model()


if __name__ == "__main__":
    main()
