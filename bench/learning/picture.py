"""The picture of a course: what it won in the tests, and what it lost and won while it learned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from khala_sc2.experiment.statistics import wilson

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

SAMPLED: Final = ", sampled"
"""End of the model's name in tests that it plays with sampled answers."""


def draw(
    results: Sequence[dict[str, Any]],
    steps: Sequence[dict[str, Any]],
    practice: Sequence[dict[str, Any]],
    references: Sequence[str],
    path: Path,
) -> None:
    """Draw the tests beside the steps.

    Args:
        results: of the tests, as `summary` in `bench.learning.learns` gives them.
        steps: of both stages.
        practice: rewards of the battles of each step of the second stage.
        references: players that are lines and no points.
        path: of the picture.
    """
    import matplotlib as mpl  # noqa: PLC0415  # loads fonts, which only a picture needs
    from matplotlib.figure import Figure  # noqa: PLC0415  # see above

    mpl.rcParams["svg.hashsalt"] = "khala"
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    tests, learning = figure.subplots(1, 2)
    _draw_tests(tests, results, references)
    _draw_steps(learning, steps, practice)
    figure.savefig(path, metadata={"Date": None})


def _draw_tests(axes: Any, results: Sequence[dict[str, Any]], references: Sequence[str]) -> None:
    points = [result for result in results if result["player"] not in references]
    for label, sampled in (("its likeliest answers", False), ("sampled answers", True)):
        line = [point for point in points if point["player"].endswith(SAMPLED) == sampled]
        below = [point["won"] - point["low"] for point in line]
        above = [point["high"] - point["won"] for point in line]
        names = [point["player"].removesuffix(SAMPLED) for point in line]
        axes.errorbar(names, [point["won"] for point in line], yerr=[below, above], marker="o", capsize=4, label=label)
    for result, style in zip([r for r in results if r["player"] in references], (":", "-.", "--"), strict=False):
        axes.axhline(result["won"], linestyle=style, color="gray", label=result["player"])
    battles = max((result["battles"] for result in points), default=0)
    axes.set(ylabel=f"won of {battles} test battles", ylim=(-0.03, 1.03))
    axes.tick_params(axis="x", labelrotation=30)
    axes.grid(alpha=0.3)
    axes.legend()


def _draw_steps(axes: Any, steps: Sequence[dict[str, Any]], practice: Sequence[dict[str, Any]]) -> None:
    taught = [step for step in steps if step["stage"] == "taught"]
    axes.plot([step["step"] + 1 for step in taught], [step["loss"] for step in taught], label="taught: loss")
    won, below, above = [], [], []
    for step in practice:
        rewards = [reward for group in step["rewards"] for reward in group]
        share = wilson(sum(reward > 0 for reward in rewards), len(rewards))
        won.append(share.value or 0.0)
        below.append(won[-1] - (share.low or 0.0))
        above.append((share.high or 0.0) - won[-1])
    places = [len(taught) + step["step"] + 1 for step in practice]
    axes.errorbar(places, won, yerr=[below, above], marker=".", capsize=4, label="practised: won, sampled")
    axes.set(xlabel="step")
    axes.grid(alpha=0.3)
    axes.legend()
