"""The tasks of the catalogue, as inspect_ai finds them: `khala_sc2/2s3z` and every other name of `khala tasks`.

The entry point `inspect_ai` of this distribution names this module. A sample is an episode, with a seed of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from inspect_ai import Task, task
from inspect_ai.dataset import Sample

from khala_orchestrator.config import all_tasks
from khala_sc2.inspect.scores import legality, value, win
from khala_sc2.inspect.team import MATCH, team

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.task.config import TaskConfig


def task_of(config: TaskConfig) -> Callable[..., Task]:
    """Return a task of the catalogue as one of inspect_ai."""

    @task(name=config.name)
    def play(
        seeds: int = 5,
        images: str = "paper",
        max_steps: int | None = None,
        clock: str | None = None,
        executor: str | None = None,
    ) -> Task:
        """Return the task.

        Args:
            seeds: number of episodes, with the seeds 1, 2, ….
            images: pictures that the agents see, as `--images` of `khala run`: none for a model that does not see.
            max_steps: end an episode after this many steps.
            clock: time that thinking costs: frozen, budget, token; as the task says.
            executor: raw or screen; as the task says.
        """
        options = {"images": images, "max_steps": max_steps, "rule": clock, "executor": executor}
        match = {"task": config.name, **options}
        samples = [
            Sample(id=f"seed {seed}", input=config.description, target="win", metadata={MATCH: match | {"seed": seed}})
            for seed in range(1, seeds + 1)
        ]
        return Task(dataset=samples, solver=team(), scorer=[win(), value(), legality()])

    return play


TASKS = {config.name: task_of(config) for config in all_tasks()}
"""All of them, by name."""
