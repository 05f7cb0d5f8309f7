"""The commands `khala dataset …`; `khala_sc2.cli` mounts them."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from khala_agents.detail import Detail
from khala_protocol.commandline import say
from khala_sc2.dataset.choose import ExampleRule, Only, RowChoice, Split, SplitBy
from khala_sc2.dataset.files import RowForm

if TYPE_CHECKING:
    from khala_sc2.dataset.card import Contents, Recipe

app = typer.Typer(no_args_is_help=True, help="Make data sets of recordings.")

EXPORT_EPILOG = """
Examples:\n
    khala dataset export runs --out my_data\n
    khala dataset export runs --out my_data --format parquet --format openai --split 0.8,0.1,0.1\n
    khala dataset export runs --out my_data --format trl --dedupe --tokenizer Qwen/Qwen3-0.6B\n
    khala dataset export runs --out my_data --dynamics --horizon 5\n
    khala dataset export runs/first/recording.mcap --out my_data --only wins --only accepted --agent Stalkers
"""


@app.callback()
def group() -> None:
    """Make data sets of recordings."""


@app.command(epilog=EXPORT_EPILOG)
def export(
    sources: Annotated[
        list[Path], typer.Argument(help="Recordings, or directories to search for recordings.", metavar="SOURCE")
    ],
    *,
    out: Annotated[Path, typer.Option(help="Directory of the data set, new or empty.", metavar="DIR")],
    formats: Annotated[
        list[RowForm] | None,
        typer.Option(
            "--format",
            help="Format of the rows; may be given several times. parquet has all that is known, openai and sharegpt "
            "are chats, trl has prompts and completions.",
            show_default="all",
        ),
    ] = None,
    only: Annotated[
        list[Only] | None,
        typer.Option(
            help="Only decisions of won episodes, of valid ones, with all actions accepted, or made by the "
            "agent itself; a decision must pass all given filters."
        ),
    ] = None,
    agent: Annotated[
        list[str] | None,
        typer.Option(help="Only this agent, such as Stalkers or red/Captain; may be given several times."),
    ] = None,
    dynamics: Annotated[
        bool,
        typer.Option(
            "--dynamics",
            help="Export rows for a world model instead of decisions: what an agent saw, the joint orders of its side "
            "after it, and what the agent saw next.",
        ),
    ] = False,
    horizon: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=600.0,
            help="With --dynamics: seconds of the game to the next observation, at least; 0 for the very next one.",
            metavar="SECONDS",
        ),
    ] = 5.0,
    split: Annotated[
        str | None,
        typer.Option(
            help="Shares of train and test, or of train, validation and test.",
            metavar="SHARES",
            show_default="1; with --dynamics 0.8,0.1,0.1",
        ),
    ] = None,
    split_by: Annotated[
        SplitBy,
        typer.Option(
            help="Unit that stays in one split, except for its prompts that stand word for word in another split's "
            "units: these go to the first of the splits."
        ),
    ] = "seed",
    example: Annotated[
        ExampleRule,
        typer.Option(
            help="The worked example, which every prompt has: keep it, with weight 0 for its reply in chats, or leave "
            "it out. Agents play with it, so a model should be trained with it."
        ),
    ] = "weighted",
    detail: Annotated[
        Detail | None,
        typer.Option(
            help="Make all prompts with so much detail, as `detail` in a model file does: short ones have about 2 000 "
            "tokens at most, tiny ones 1 000.",
            show_default="as they were sent",
        ),
    ] = None,
    dedupe: Annotated[
        bool, typer.Option("--dedupe", help="Leave out rows whose prompt and reply came before, word for word.")
    ] = False,
    tokenizer: Annotated[
        str | None,
        typer.Option(
            help="Count the lengths in the README by this tokenizer: a file tokenizer.json, a name on the Hugging Face "
            "hub such as Qwen/Qwen3-0.6B, or tiktoken:o200k_base.",
            show_default="an estimate of four bytes a token",
        ),
    ] = None,
    images: Annotated[bool, typer.Option(help="Export the pictures that were sent with prompts.")] = True,
    gamma: Annotated[float, typer.Option(min=0.0, max=1.0, help="Discount of the reward-to-go for each decision.")] = (
        0.99
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print what was exported as one JSON object.")] = False,
) -> None:
    """Export recorded decisions: each row has a prompt, a reply, its actions, their fate and their reward.

    With --dynamics a row has an observation, the orders after it, and the next observation.

    The directory holds a folder for each format, with a file for each split and a README for the Hugging Face hub. Each
    folder is a data set that `datasets.load_dataset` reads. The README says what is in it, how long the rows are, what
    repeats, and which setting of a trainer trains on the reply alone.
    """
    from khala_sc2.dataset.card import Recipe  # noqa: PLC0415
    from khala_sc2.dataset.export import export as write  # noqa: PLC0415

    forms: tuple[RowForm, ...] = tuple(dict.fromkeys(formats or RowForm))
    choice = RowChoice(tuple(only or ()), tuple(agent or ()))
    recipe = Recipe(
        forms,
        choice,
        Split.of(split or ("0.8,0.1,0.1" if dynamics else "1"), split_by),
        gamma=gamma,
        images=images,
        example=example,
        detail=detail,
        dedupe=dedupe,
        tokenizer=tokenizer,
        horizon_s=horizon if dynamics else None,
    )
    contents = write(sources, out, recipe)
    if as_json:
        typer.echo(json.dumps({"out": str(out), **_summary(contents)}))
    else:
        _print(contents, out, recipe)


def _summary(contents: "Contents") -> dict[str, object]:
    return {
        "recordings": contents.recordings,
        "rows": dict(contents.rows),
        "left_out": {reason: count for reason, count in contents.left_out.items() if count},
        "prompts": contents.repeats.prompts,
        "duplicates": contents.repeats.duplicates,
        "ambiguous_prompts": contents.repeats.ambiguous,
        "shared_prompts": contents.shared,
        "moved_rows": contents.moved,
        "tokens": {name: lengths._asdict() for name, lengths in contents.lengths.fields().items()},
    }


def _print(contents: "Contents", out: Path, recipe: "Recipe") -> None:
    parts = ", ".join(f"{name} {count}" for name, count in contents.rows.items())
    what = "decisions" if recipe.horizon_s is None else "observations with the next one"
    say(f"{contents.rows.total()} {what} are in {out}: {parts}")
    left_out = [f"{reason} {count}" for reason, count in contents.left_out.items() if count]
    if left_out:
        say("left out: " + ", ".join(left_out))
    if contents.repeats.duplicates and not recipe.dedupe:
        say(f"{contents.repeats.duplicates} rows repeat the prompt and the reply of another: --dedupe leaves them out")
    if contents.shared:
        say(f"prompts that stood in several splits, now in the first: {contents.shared}; rows moved: {contents.moved}")
    row = contents.lengths.fields()["row"]
    reply = contents.lengths.fields()["reply"]
    say(
        f"tokens of a row, {contents.lengths.counter.name}: median {row.median}, longest {row.longest}; "
        f"{reply.share:.1%} are of {'replies' if recipe.horizon_s is None else 'next observations'}"
    )
