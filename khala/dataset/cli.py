"""The commands `khala dataset …`; `khala.cli` mounts them."""

import json
from pathlib import Path
from typing import Annotated

import typer

from khala.dataset.choose import Only, RowChoice, Split, SplitBy
from khala.dataset.files import RowForm
from khala_protocol.commandline import say

app = typer.Typer(no_args_is_help=True, help="Make data sets of recordings.")

EXPORT_EPILOG = """
Examples:\n
    khala dataset export runs --out my_data\n
    khala dataset export runs --out my_data --format parquet --format openai --split 0.8,0.1,0.1\n
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
            help="Format of the rows; may be given several times.",
            show_default="parquet, openai and sharegpt",
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
    split: Annotated[
        str, typer.Option(help="Shares of train and test, or of train, validation and test.", metavar="SHARES")
    ] = "1",
    split_by: Annotated[SplitBy, typer.Option(help="Unit that is never divided between splits.")] = "seed",
    images: Annotated[bool, typer.Option(help="Export the pictures that were sent with prompts.")] = True,
    gamma: Annotated[float, typer.Option(min=0.0, max=1.0, help="Discount of the reward-to-go for each decision.")] = (
        0.99
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print what was exported as one JSON object.")] = False,
) -> None:
    """Export recorded decisions: each row has a prompt, a reply, its actions, their fate and their reward.

    The directory holds a folder for each format, with a file for each split and a README for the Hugging Face hub. Each
    folder is a data set that `datasets.load_dataset` reads.
    """
    from khala.dataset.card import Recipe  # noqa: PLC0415
    from khala.dataset.export import export as write  # noqa: PLC0415

    forms: tuple[RowForm, ...] = tuple(dict.fromkeys(formats or RowForm))
    choice = RowChoice(tuple(only or ()), tuple(agent or ()))
    contents = write(sources, out, Recipe(forms, choice, Split.of(split, split_by), gamma, images))
    rows = dict(contents.rows)
    left_out = {reason: count for reason, count in contents.left_out.items() if count}
    if as_json:
        found = {"out": str(out), "recordings": contents.recordings, "rows": rows, "left_out": left_out}
        typer.echo(json.dumps(found))
        return
    parts = ", ".join(f"{name} {count}" for name, count in rows.items())
    say(f"{contents.rows.total()} decisions are in {out}: {parts}")
    if left_out:
        say("left out: " + ", ".join(f"{reason} {count}" for reason, count in left_out.items()))
