"""The command `khala calibrate`; `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated

import typer

from khala_orchestrator.cli import Json
from khala_sc2.commands.run_options import Game

CALIBRATE_EPILOG = """
Examples:\n
    khala calibrate --list\n
    khala calibrate --game starcraft2 --out real.json\n
    khala calibrate --game starcraft2 --out real.json --resume\n
    khala calibrate --only "move.*" --only weapon.range --out moves.json\n
    khala calibrate --compare real.json simulator.json
"""


def calibrate(
    *,
    game: Game = "simulator",
    out: Annotated[Path, typer.Option(help="File for the measurements.", metavar="FILE.json")] = Path(
        "calibration.json"
    ),
    seed: Annotated[int, typer.Option(min=1, help="Random seed of the game.")] = 1,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Only these probes; may be given several times.", metavar="GLOB", show_default="all"),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the file: play the probes that are missing or failed.")
    ] = False,
    list_probes: Annotated[bool, typer.Option("--list", help="Show every probe and what it settles, and end.")] = False,
    compare: Annotated[
        tuple[Path, Path] | None,
        typer.Option(help="Play nothing: say where two files differ, as Markdown for an issue.", metavar="A B"),
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure a game with a fixed set of probes through its raw API, and write the numbers into one file.

    Compare two files to see where two games differ: the real one and the simulator, or two versions. An interrupted
    run keeps what it has measured. See docs/how-to/real-game.md for what to send.
    """
    from khala_sc2.calibrate import commands  # noqa: PLC0415  # PySC2 and the game, for which --help need not wait

    if list_probes:
        commands.show_probes(only or (), as_json=as_json)
    elif compare:
        commands.show_comparison(*compare, as_json=as_json)
    else:
        commands.measure(game, out, seed, only or (), resume=resume, as_json=as_json)
